"""Write the images of a camera in a bag as an RGB-D folder; no ROS master is needed.

    rosrun openpose_ros_tools bag_to_images walk.bag -o walk/
    rosrun openpose_ros_tools bag_to_images walk.bag -o walk/ --depth-scale 1000
    rosrun openpose_ros_tools bag_to_images lab.bag -o lab/ --image /camera/color/image_raw/compressed \\
        --depth /camera/aligned_depth_to_color/image_raw --camera-info /camera/color/camera_info

images_to_bag makes of the folder the same depth, colours of 8 bits, stamps, calibration and frame_id again, tools of
the TUM RGB-D benchmark read its lists (--depth-scale 5000 for their unit), rgbd_player_node plays it. images_to_bag
--help says what is in the folder.

Compressed images are written as they came (.jpg, .png), others as PNG of 8-bit colours (of 16 bits the higher 8);
depth in mm as 16-bit PNG and depth in m as TIFF of float32, without loss. Where the bag has clouds and no depth image,
depth is the z of the cloud.

Exit status: 0 done; 1 done but for messages that contain no image; 2 nothing was written, as the command line or the
bag is wrong; 130 interrupted, there is no folder.
"""
import argparse
import logging
import sys
from contextlib import closing
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, Set, Tuple

import numpy as np
import rosbag

from openpose_ros_pkg.calibration import Calibration
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, Progress, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, number, plain_path
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.camera_presets import CLOUD
from openpose_ros_pkg.ros.convert import calibration_from_message
from openpose_ros_pkg.ros.topics import CameraTopics
from openpose_ros_tools.images.image_files import MILLIMETRES
from openpose_ros_tools.images.rgbd_folder import WrittenFile, number_files, write_description, write_lists
from openpose_ros_tools.outputs import output_folder
from openpose_ros_tools.parallel import ordered_map
from openpose_ros_tools.ros.bag_files import (
    TF_TOPIC,
    StampedMessage,
    deserialized,
    message_count,
    open_bag,
    stamped_messages,
    topic_finder,
)
from openpose_ros_tools.ros.image_messages import file_of_message
from skeleton_extract_3d.points.camera import calibrated_camera
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.plausibility import registration_fault
from skeleton_extract_3d.points.rgbd_folder import FOLDERS, LISTS
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME
from skeleton_extract_3d.points.stamps import seconds_text
from skeleton_extract_3d.ros.static_frames import frames_above

_log = logging.getLogger(__name__)

_NAME = 'bag_to_images'
# Everything that this command writes, or has written as version 1.0.
_OWN = (*(names[0] for names in FOLDERS.values()), *LISTS.values(), 'camera.yaml', 'sequence.yaml')


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    return run_command(_NAME, lambda: _run(_parser().parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    with open_bag(options.bag) as bag, output_folder(options.output, options.overwrite, _OWN) as part:
        topics = _topics(bag, options.image, options.depth, options.camera_info)
        streams = {stream: topic for stream, topic in (
            ('colour', topics.image), ('depth', topics.points or topics.depth)) if topic}
        frame_id = next(stamped_messages(bag, [next(iter(streams.values()))])).frame_id
        calibration = _calibration(bag, topics)
        pose = _pose_in_world(bag, frame_id)
        written, failed = _write_images(part, bag, streams, options.depth_scale)
        files, remarks = number_files(part, written)
        for remark in remarks:
            _log.warning('%s', remark)
        write_lists(part, files)
        write_description(part, calibration, files, frame_id=frame_id, depth_scale=options.depth_scale or MILLIMETRES,
                          T_world_camera=pose)
    lines = [f'{options.output}: {len(files)} images', *(
        f'  {sum(file.stream == stream for file in files):6d}  {FOLDERS[stream][0]}/ of {topic}'
        for stream, topic in streams.items())]
    if any(file.path.suffix == '.tiff' for file in files):
        lines.append('  depth is in m as TIFF of float32, since the bag has it so; --depth-scale 1000 makes PNG in mm')
    if failed:
        lines.append(f'  {failed} messages left out, see the warnings')
    sys.stdout.write('\n'.join([*lines, '']))
    return SOME_FAILED if failed else DONE


def _topics(bag: rosbag.Bag, image: str, depth: str, camera_info: str) -> CameraTopics:
    """Return the topics, as named (depth: or 'none'), else found; `image_info` is the calibration of the folder."""
    finder, no_depth = topic_finder(bag), depth == 'none'
    is_cloud = finder.types.get(depth) == CLOUD
    named = CameraTopics(image, depth * is_cloud, '' if is_cloud or no_depth else depth, camera_info)
    topics, _ = finder.camera(named, '', no_depth, bool(finder.candidates['depth']))
    if camera_info:
        return topics._replace(image_info=finder.named('camera_info', camera_info))
    infos = finder.candidates['camera_info']
    return topics._replace(image_info=topics.image_info or (infos[0] if len(infos) == 1 else ''))


def _calibration(bag: rosbag.Bag, topics: CameraTopics) -> Optional[Calibration]:
    """Return the first calibration of the images; BadInputError: depth is of another camera."""
    infos = [calibration_from_message(deserialized(message))
             for message in stamped_messages(bag, [topics.image_info] * bool(topics.image_info))]
    changed, calibration = sum(info != infos[0] for info in infos), infos[0] if infos else None
    if not infos:
        _log.warning('no calibration: there will be no camera.yaml')
    if changed:
        _log.warning('%d messages on %s differ from the first one, which camera.yaml is made of', changed,
                     topics.image_info)
    depth = topics.points or topics.depth
    info = topic_finder(bag).camera_info_of(depth) if depth else None
    lens = calibration_from_message(deserialized(next(stamped_messages(bag, [info])))) if info else None
    if lens is not None and lens.is_calibrated:
        width, height = lens.image_size
        flat = DepthImage(np.ones((height, width), np.float32), calibrated_camera(lens))
        fault = registration_fault(flat, calibration)
        if fault:
            raise BadInputError(f'{depth}: {fault}, as the folder has it; --depth none leaves it out, and '
                                'process_bag registers it')
    return calibration


def _pose_in_world(bag: rosbag.Bag, frame_id: str) -> Optional[List[List[float]]]:
    """Return the transform (4, 4) from a frame to WORLD_FRAME [m] by /tf_static; None: they are not connected."""
    links = {one.child_frame_id.strip('/'): one for message in stamped_messages(bag, [TF_TOPIC])
             for one in deserialized(message).transforms}
    poses = [pose for frame, pose in frames_above(frame_id, links) if frame == WORLD_FRAME]
    return [*np.column_stack(poses[0]).tolist(), [0.0, 0.0, 0.0, 1.0]] if poses else None


def _write_images(folder: Path, bag: rosbag.Bag, streams: Dict[str, str], depth_scale: Optional[float]
                  ) -> Tuple[List[WrittenFile], int]:
    """Write images into a folder, named after their stamps; return the files and how many could not be decoded."""
    stream_of = {topic: stream for stream, topic in streams.items()}

    def messages() -> Iterator[StampedMessage]:
        taken: Set[Tuple[str, Optional[int]]] = set()
        for message in Progress(stamped_messages(bag, list(stream_of)), unit='image',
                                total=sum(message_count(bag, topic) for topic in stream_of)):
            if not message.stamp or (message.topic, message.stamp) in taken:
                raise BadInputError(f"a message on '{message.topic}' has "
                                    f"{'the stamp of another one' if message.stamp else 'no stamp in its header'}")
            taken.add((message.topic, message.stamp))
            yield message

    def write(message: StampedMessage) -> Optional[WrittenFile]:
        """Write an image; None: it can not be decoded, which is told."""
        stream, seconds = stream_of[message.topic], seconds_text(message.stamp or 0)
        source = f'{stream} image of {seconds} s'
        try:
            suffix, content = file_of_message(stream, deserialized(message), depth_scale, source)
        except BadInputError as error:
            _log.warning('%s: %s; left out', source, error)
            return None
        path = Path(FOLDERS[stream][0]) / (seconds + suffix)
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_bytes(content)
        return WrittenFile(stream, message.stamp or 0, path)

    with closing(ordered_map(write, messages())) as results:
        written = list(results)
    files = [file for file in written if file is not None]
    return files, len(written) - len(files)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('bag', type=plain_path, metavar='BAG', help='with the topics of a camera')
    add_output(parser, 'folder')
    for option, what in (('--image', 'colour images'), ('--depth', "depth images or clouds; 'none': none"),
                         ('--camera-info', 'the calibration')):
        parser.add_argument(option, default='', metavar='TOPIC', help=f'of {what} (default: found)')
    parser.add_argument('--depth-scale', type=number(0.001, 1e6), metavar='UNITS',
                        help='write depth as 16-bit PNG with this number of units per metre: 5000 for tools of the TUM '
                             'benchmark, 1000 for rgbd_player_node')
    return parser
