"""Images to bags and back: nothing changes on the way, whatever the types; errors."""
from pathlib import Path

import cv2
import genpy
import numpy as np
import pytest
import rosbag
import yaml
from sensor_msgs.msg import CameraInfo, CompressedImage
from std_msgs.msg import Header

from openpose_ros_pkg.command_line import DONE, REFUSED, SOME_FAILED
from openpose_ros_pkg.ros.convert import pixels_to_image
from openpose_ros_tools.images.image_files import depth_to_metres
from openpose_ros_tools.ros import bag_to_images, images_to_bag
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence
from skeleton_extract_3d.ros.convert import (
    cloud_to_message,
    rotation_and_translation,
)

NS = '/kinect2/qhd'
SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
W, H, FRAMES = 12, 8, 3
LENS = {'image_width': W, 'image_height': H, 'distortion_model': 'plumb_bob',
        'camera_matrix': {'data': [10.1, 0.0, 5.3, 0.0, 1 / 3 * 30, 3.7, 0.0, 0.0, 1.0]},
        'distortion_coefficients': {'data': [0.1, -0.02, 1e-05, 0.0, 0.3]},
        'rectification_matrix': {'data': [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]},
        'projection_matrix': {'data': [9.9, 0.0, 5.0, -0.7, 0.0, 9.8, 3.5, 0.0, 0.0, 0.0, 1.0, 0.0]}}
# looks down by 0.3 rad
POSE = np.array([[1, 0, 0, 0.1], [0, -np.sin(0.3), np.cos(0.3), 0.2], [0, -np.cos(0.3), -np.sin(0.3), 1.3],
                 [0, 0, 0, 1]])
SEQUENCE = {'fps': 15.0, 'frame_id': 'lens', 'T_world_camera': POSE.tolist()}


def random_image(random, kind):
    channels = (3,) * (kind == 'bgr8')
    dtype = np.uint16 if kind.endswith('16') else np.uint8
    return random.integers(0, np.iinfo(dtype).max, (H, W, *channels), dtype, endpoint=True)


def make_folder(folder, kind='bgr8', suffix='.png', depth='.png', names='012'):
    """A folder of random images without a description; the images by stream."""
    random = np.random.default_rng(7)
    recorded = {}
    for stream, ending in (('rgb', suffix), ('depth', depth)):
        for name in names if ending else ():
            image = random_image(random, 'mono16' if stream == 'depth' else kind)
            if stream == 'depth':
                image = np.where(np.arange(H * W).reshape(H, W), image % 9000, 0).astype(np.uint16)
                image = depth_to_metres(image, 1234.5) if ending == '.tiff' else image
            path = folder / stream / (name + ending)
            path.parent.mkdir(parents=True, exist_ok=True)
            assert cv2.imwrite(str(path), image)
            image = cv2.imread(str(path), cv2.IMREAD_ANYCOLOR) if ending == '.jpg' else image
            recorded.setdefault(stream, []).append(image)
    return recorded


def describe(folder, lens=LENS, **sequence):
    (folder / 'camera.yaml').write_text(yaml.safe_dump(lens))
    (folder / 'sequence.yaml').write_text(yaml.safe_dump({**SEQUENCE, **sequence}))


def write_lists(folder, **stamps):
    for stream, of_stream in stamps.items():
        lines = [f'{stamp} {stream}/{path.name}' for stamp, path in zip(of_stream, sorted((folder / stream).iterdir()))]
        (folder / f'{stream}.txt').write_text('# comment\n' + '\n'.join(lines) + '\n')


def to_bag(folder, bag, *arguments):
    return images_to_bag.main([str(folder), '-o', str(bag), *map(str, arguments)])


def to_images(bag, folder, *arguments):
    return bag_to_images.main([str(bag), '-o', str(folder), *map(str, arguments)])


def messages(bag):
    """The messages by topic, in order, each with its time; the time is that of the header."""
    found = {}
    with rosbag.Bag(str(bag)) as opened:
        times = []
        for topic, message, stamp in opened.read_messages():
            times.append(stamp)
            if topic != '/tf_static':
                assert stamp == message.header.stamp
            found.setdefault(topic, []).append(message)
    assert times == sorted(times)
    return found


# Kinds of images, and every kind of depth with raw and compressed images.
KINDS = [('bgr8', '.png', '.png'), ('bgr8', '.jpg', '.tiff'), ('mono8', '.png', '.tiff'), ('mono8', '.jpg', None),
         ('bgr8', '.png', None)]


@pytest.mark.parametrize('number, kind, suffix, depth', [(i, *kind) for i, kind in enumerate(KINDS)])
def test_bag_images_bag_is_the_same_bag(tmp_path, number, kind, suffix, depth):
    compression = ('none', 'lz4', 'bz2')[number % 3]
    options = ('--compression', compression, *(('--compressed',) if number % 2 else ()))
    make_folder(tmp_path / 'in', kind, suffix, depth)
    describe(tmp_path / 'in')
    assert to_bag(tmp_path / 'in', tmp_path / '1.bag', *options) == DONE
    assert to_images(tmp_path / '1.bag', tmp_path / 'out') == DONE
    assert to_bag(tmp_path / 'out', tmp_path / '2.bag', *options) == DONE
    assert (tmp_path / '1.bag').read_bytes() == (tmp_path / '2.bag').read_bytes()
    with rosbag.Bag(str(tmp_path / '1.bag')) as bag:
        assert bag.get_compression_info().compression == compression


def test_a_bag_has_stamps_intrinsics_and_pose_of_the_folder(tmp_path):
    make_folder(tmp_path / 'in')
    describe(tmp_path / 'in')
    assert to_bag(tmp_path / 'in', tmp_path / 'out.bag') == DONE
    found = messages(tmp_path / 'out.bag')
    info = found[f'{NS}/camera_info'][0]
    for name in ('camera_info', 'image_color', 'image_depth_rect'):
        assert [(message.header.stamp.to_nsec(), message.header.seq, message.header.frame_id)
                for message in found.pop(f'{NS}/{name}')] == [(1000000000000 + stamp, number, 'lens')
                                                              for number, stamp in enumerate((0, 66666667, 133333333))]
    assert list(found) == ['/tf_static']
    assert (info.header.frame_id, info.width, info.height, info.distortion_model) == ('lens', W, H, 'plumb_bob')
    assert [list(info.K), list(info.D), list(info.P)] == [LENS[key]['data'] for key in (
        'camera_matrix', 'distortion_coefficients', 'projection_matrix')]
    transform, = found['/tf_static'][0].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ('world', 'lens')
    rotation, translation = rotation_and_translation(transform)
    np.testing.assert_allclose(rotation, POSE[:3, :3], atol=1e-11)
    np.testing.assert_array_equal(translation, POSE[:3, 3])


def test_the_shipped_sequence_comes_back_and_can_be_played(tmp_path):
    assert to_bag(SHIPPED, tmp_path / '1.bag', '--compressed') == DONE
    assert to_images(tmp_path / '1.bag', tmp_path / 'out') == DONE
    for number in (0, 17, 39):
        assert ((tmp_path / 'out' / 'rgb' / f'{number:06d}.jpg').read_bytes()
                == (SHIPPED / 'rgb' / f'{number:03d}.jpg').read_bytes())
    found, shipped = RgbdSequence.read(tmp_path / 'out'), RgbdSequence.read(SHIPPED)
    assert (len(found), found.fps, found.frame_id) == (40, 15.0, 'kinect2_rgb_optical_frame')
    # what is shipped has six digits
    np.testing.assert_allclose(found.T_world_camera, shipped.T_world_camera, atol=1e-6)
    np.testing.assert_array_equal(found.frame(17).depth, shipped.frame(17).depth)


def test_a_folder_of_the_tum_benchmark_has_its_scale_and_its_stamps(tmp_path):
    recorded = make_folder(tmp_path / 'in', names='abc')
    write_lists(tmp_path / 'in', rgb=['1.000000001', '1.1', '1.2'], depth=['1.01', '1.15', '1.21'])
    assert to_bag(tmp_path / 'in', tmp_path / 'out.bag', '--intrinsics', '10', '11', '5.5', '3.5') == DONE
    found = messages(tmp_path / 'out.bag')
    nanoseconds = {topic: [message.header.stamp.to_nsec() for message in of_topic]
                   for topic, of_topic in found.items()}
    assert nanoseconds[f'{NS}/image_color'] == [1000000001, 1100000000, 1200000000]
    assert nanoseconds[f'{NS}/image_depth_rect'] == [1010000000, 1150000000, 1210000000]
    assert nanoseconds[f'{NS}/camera_info'] == sorted(nanoseconds[f'{NS}/image_color']
                                                      + nanoseconds[f'{NS}/image_depth_rect'])
    assert found[f'{NS}/image_depth_rect'][1].encoding == '32FC1'
    info = found[f'{NS}/camera_info'][0]
    assert (info.width, info.height, list(info.D)) == (W, H, [0] * 5)
    # 16-bit PNG of the same scale are the same images again
    assert to_images(tmp_path / 'out.bag', tmp_path / 'back', '--depth-scale', '5000') == DONE
    assert (tmp_path / 'back/depth.txt').read_text().splitlines()[2:] == [
        '1.010000000 depth/000000.png', '1.150000000 depth/000002.png', '1.210000000 depth/000003.png']
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / 'back/depth/000002.png'), cv2.IMREAD_UNCHANGED),
                                  recorded['depth'][1])
    assert to_bag(tmp_path / 'back', tmp_path / 'again.bag') == DONE
    assert (tmp_path / 'again.bag').read_bytes() == (tmp_path / 'out.bag').read_bytes()


def test_the_pose_is_latched(tmp_path):
    make_folder(tmp_path / 'in')
    describe(tmp_path / 'in')
    assert to_bag(tmp_path / 'in', tmp_path / 'out.bag') == DONE
    with rosbag.Bag(str(tmp_path / 'out.bag')) as bag:
        sent, = bag.read_messages(topics=['/tf_static'], return_connection_header=True)
    assert '1' in str(sent.connection_header['latching'])


def test_several_cameras_have_topics_and_frames_of_their_own(tmp_path, capsys):
    for name in ('left', 'right'):
        make_folder(tmp_path / 'in' / name)
        describe(tmp_path / 'in' / name)
    assert to_bag(tmp_path / 'in', tmp_path / 'out.bag', '--cameras') == DONE
    found = messages(tmp_path / 'out.bag')
    assert {topic for topic in found if topic != '/tf_static'} == {
        f'/{name}/qhd/{topic}' for name in ('left', 'right')
        for topic in ('image_color', 'image_depth_rect', 'camera_info')}
    assert {message.header.frame_id for message in found['/left/qhd/image_color']} == {'left_rgb_optical_frame'}
    assert [one.child_frame_id for one in found['/tf_static'][0].transforms] == [
        'left_rgb_optical_frame', 'right_rgb_optical_frame']
    assert to_bag(tmp_path / 'in', tmp_path / 'no.bag', '--cameras', 'left/rgb', 'right/rgb') == REFUSED
    assert 'would both be written to the same topics' in capsys.readouterr().err


def test_a_damaged_image_is_left_out_with_a_warning(tmp_path, caplog):
    make_folder(tmp_path / 'in')
    describe(tmp_path / 'in')
    (tmp_path / 'in/rgb/1.png').write_bytes(b'half an image')
    assert to_bag(tmp_path / 'in', tmp_path / 'out.bag') == SOME_FAILED
    assert '1.png is not an image' in caplog.text
    found = messages(tmp_path / 'out.bag')
    counts = {name: len(found[f'{NS}/{name}']) for name in ('image_color', 'image_depth_rect', 'camera_info')}
    assert counts == {'image_color': 2, 'image_depth_rect': 3, 'camera_info': 3}


def image_of(name, array):
    return lambda folder: cv2.imwrite(str(folder / name), array)


@pytest.mark.parametrize('damage, arguments, words', [
    (image_of('rgb/1.png', np.zeros((H, W + 1, 3), np.uint8)), (), ['1.png is 13 x 8', 'expected 12 x 8']),
    (image_of('depth/1.png', np.zeros((H, W + 1), np.uint16)), (), ['1.png is 13 x 8', 'colour image is 12 x 8']),
    (lambda folder: [path.write_bytes(b'') for path in (folder / 'rgb').iterdir()], (),
     ['none of the 3 colour images']),
    (None, ('--camera', 'nowhere.yaml'), ['nowhere.yaml can not be read'])])
def test_a_folder_that_does_not_fit_is_refused_in_one_line(tmp_path, monkeypatch, capsys, damage, arguments, words):
    make_folder(tmp_path / 'in')
    describe(tmp_path / 'in')
    monkeypatch.chdir(tmp_path / 'in')
    if damage:
        damage(tmp_path / 'in')
    assert to_bag(tmp_path / 'in', tmp_path / 'out.bag', *arguments) == REFUSED
    error, = capsys.readouterr().err.strip().splitlines()[-1:]
    assert error.startswith('images_to_bag: ')
    assert all(word in error for word in words), error
    assert sorted(path.name for path in tmp_path.iterdir()) == ['in']


# ------------------------------------------------------------------------------------------------------ other bags

def write_bag(path, items):
    """items: topic, message, stamp [ns]; returns the path."""
    with rosbag.Bag(str(path), 'w') as bag:
        for topic, message, stamp in items:
            message.header = Header(stamp=genpy.Time(0, stamp), frame_id='cam')
            bag.write(topic, message, genpy.Time(0, stamp + 5))
    return path


GREY = np.arange(H * W, dtype=np.uint8).reshape(H, W)
GREY_IMAGE = pixels_to_image(GREY, 'mono8', Header())


def camera_items(image='/cam/color/image_raw', depth='/cam/aligned_depth/image_raw'):
    bgr, metres = np.dstack([GREY] * 3), GREY.astype(np.float32) / 7
    for i in range(2):
        stamp = 10 ** 12 + i * 10 ** 8
        yield image, pixels_to_image(bgr, 'bgr8', Header()), stamp
        yield depth, pixels_to_image(metres, '32FC1', Header()), stamp + 1
        yield '/cam/color/camera_info', CameraInfo(width=W, height=H, K=[9, 0, 5, 0, 9, 4, 0, 0, 1]), stamp


def test_topics_of_other_cameras_are_found(tmp_path):
    others = [('/cam/infra1/image_raw', GREY_IMAGE, 10 ** 12),
              ('/cam/color/image_raw/compressed', CompressedImage(format='jpeg', data=b'x'), 10 ** 12),
              ('/openpose_ros/detected_poses_image', GREY_IMAGE, 10 ** 12),
              ('/cam/depth/image_raw', pixels_to_image(np.zeros((4, 4), np.uint16), '16UC1', Header()), 10 ** 12),
              ('/cam/depth/camera_info', CameraInfo(width=4, height=4), 10 ** 12)]
    bag = write_bag(tmp_path / 'in.bag', [*camera_items(), *others])
    assert to_images(bag, tmp_path / 'out') == DONE
    assert (tmp_path / 'out/rgb.txt').read_text().splitlines()[2:] == [
        '1000.000000000 rgb/000000.png', '1000.100000000 rgb/000001.png']
    assert (tmp_path / 'out/depth.txt').read_text().splitlines()[2:] == [
        '1000.000000001 depth/000000.tiff', '1000.100000001 depth/000001.tiff']
    depth = cv2.imread(str(tmp_path / 'out/depth/000001.tiff'), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(depth, GREY.astype(np.float32) / 7)
    assert yaml.safe_load((tmp_path / 'out/camera.yaml').read_text())['image_width'] == W


def test_a_bag_with_clouds_alone_gives_their_depth(tmp_path, capsys):
    depth, lens = np.where(GREY > 0, 1 + GREY / 100, np.nan), CameraModel(W, H, LENS['camera_matrix']['data'])
    cloud = cloud_to_message(cloud_from_depth(depth, lens, np.dstack([GREY] * 3)), Header())
    bag = write_bag(tmp_path / 'in.bag', [('/cam/points', cloud, 10 ** 12), ('/cam/image', GREY_IMAGE, 10 ** 12)])
    assert to_images(bag, tmp_path / 'out', '--depth-scale', 1000) == DONE
    assert '1  depth/ of /cam/points' in capsys.readouterr().out
    found = cv2.imread(str(tmp_path / 'out/depth/000000.png'), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(found, np.nan_to_num(1000 * depth), atol=0.5001)


def test_messages_without_an_image_are_left_out_with_a_warning(tmp_path, caplog):
    bag = write_bag(tmp_path / 'in.bag', [
        ('/cam/image/compressed', CompressedImage(format='jpeg', data=data), 10 ** 12 + i)
        for i, data in enumerate([cv2.imencode('.jpg', GREY)[1].tobytes(), b'', b'GIF89a'])])
    assert to_images(bag, tmp_path / 'out') == SOME_FAILED
    assert [path.name for path in (tmp_path / 'out/rgb').iterdir()] == ['000000.jpg']
    assert "6 bytes of format 'jpeg' are neither JPEG nor PNG" in caplog.text
    assert (tmp_path / 'out/rgb.txt').read_text().splitlines()[2:] == ['1000.000000000 rgb/000000.jpg']


@pytest.mark.parametrize('items, arguments, words', [
    ([], (), ['no topic of colour images', 'no messages at all']),
    ([('/a/image', GREY_IMAGE, 5), ('/b/image', GREY_IMAGE, 5)], (),
     ['2 topics', 'colour', '/a/image, /b/image', '--image']),
    ([('/a/image', GREY_IMAGE, 0)], (), ['no stamp']),
    ([('/a/image', GREY_IMAGE, 7)] * 2, (), ['stamp of another'])])
def test_bags_without_usable_images_are_refused_in_one_line(tmp_path, capsys, items, arguments, words):
    bag = write_bag(tmp_path / 'in.bag', items)
    assert to_images(bag, tmp_path / 'out', *arguments) == REFUSED
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith('bag_to_images: ')
    assert all(word in error for word in words), error
    assert [path.name for path in tmp_path.iterdir()] == ['in.bag']
