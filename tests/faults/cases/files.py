"""Files of images that the camera node and the RGB-D player play are damaged."""
import shutil
import tempfile
from pathlib import Path
from typing import Any, Callable

from faults.fault import Scenario

FRAMES = 4


def played(rig: Any, name: str, program: str, topic: str, damage: Callable[[Path], None], number: int, *words: str,
           **parameters: Any) -> None:
    """Play the first frames of the shipped sequence with damage: so many images come, then it ends with 1 and words."""
    import rospy
    from sensor_msgs.msg import Image, PointCloud2

    from faults.rig import PATIENCE, ROOT, Program, start_node
    from session import await_true
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        shipped = ROOT / 'skeleton_extract_3d/demo/cross'
        shutil.copy(str(shipped / 'camera.yaml'), temporary)
        for stream in ('rgb', 'depth'):
            (folder / stream).mkdir()
            for path in sorted((shipped / stream).iterdir())[:FRAMES]:
                shutil.copy(str(path), str(folder / stream))
        damage(folder)
        images: list = []
        subscribers = [rospy.Subscriber(f'/{name}/{topic}', Image, images.append),
                       rospy.Subscriber(f'/{name}/points', PointCloud2)]
        player = start_node(rig.session, f'{name}/player', Program(program, {
            key: str(value).format(folder=folder) for key, value in {'rate': 5.0, **parameters}.items()}))
        status = player.wait(PATIENCE)
        said = rig.session.log(player)
        assert status == 1 and all(word in said for word in words) and 'Traceback' not in said, (status, said)
        await_true(lambda: len(images) >= number, lambda: f'{number} images, not {len(images)}; {said}')
        assert len(images) == number
        for subscriber in subscribers:
            subscriber.unregister()


def cut(path: Path) -> None:
    """Leave the first half of a file."""
    path.write_bytes(path.read_bytes()[:path.stat().st_size // 2])


def one_image_of_a_folder(rig: Any) -> None:
    played(rig, 'folder', 'openpose_ros_pkg/scripts/camera_node', 'image_raw',
           lambda folder: cut(folder / 'rgb/001.jpg'), FRAMES - 1, 'frame skipped', 'rgb/001.jpg',
           source='{folder}/rgb', start_delay=60.0)


def one_depth_image(rig: Any) -> None:
    played(rig, 'sequence', 'skeleton_extract_3d/scripts/rgbd_player_node', 'image_color',
           lambda folder: cut(folder / 'depth/001.png'), FRAMES - 1, 'frame skipped', 'depth/001.png',
           folder='{folder}', playback='once', wait_for_subscribers=60.0)


def all_depth_images(rig: Any) -> None:
    def damage(folder: Path) -> None:
        for path in (folder / 'depth').iterdir():
            cut(path)
    played(rig, 'damaged', 'skeleton_extract_3d/scripts/rgbd_player_node', 'image_color', damage, 0,
           'no frame of the sequence can be read', folder='{folder}', playback='loop', wait_for_subscribers=60.0)


FAULTS = [
    Scenario('an image of a folder is cut off', one_image_of_a_folder, 'camera_node',
             'names and skips it; the others are sent; ends with 1'),
    Scenario('a depth image of a sequence is cut off', one_depth_image, 'rgbd_player_node',
             'names and skips the frame; the others are sent; ends with 1'),
    Scenario('all depth images of a sequence are cut off', all_depth_images, 'rgbd_player_node', 'ends with 1'),
]
