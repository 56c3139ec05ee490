"""Write the images of a camera in a bag as an RGB-D folder; no ROS master is needed.

    rosrun openpose_ros_tools bag_to_images walk.bag -o walk/
    rosrun openpose_ros_tools bag_to_images walk.bag -o walk/ --only-pairs --depth-scale 1000
    rosrun openpose_ros_tools bag_to_images lab.bag -o lab/ --image /camera/color/image_raw/compressed \\
        --depth /camera/aligned_depth_to_color/image_raw --camera-info /camera/color/camera_info

images_to_bag makes of the folder the same images, stamps, calibration and frame_id again, tools of the TUM RGB-D
benchmark read its lists (--depth-scale 5000 for their unit), and rgbd_player_node plays it if each frame has both
images (--only-pairs) and depth is in mm.

    rgb/, depth/        images with the same name for those of a frame, 000000 and so on
    rgb.txt, depth.txt  the stamp of each image [s], with nine decimals
    camera.yaml         as camera_calibration writes it
    sequence.yaml       fps, frame_id, depth_scale, and the camera's pose in world where /tf_static has it

Nothing is rounded: compressed images are written as they came (.jpg, .png), others as PNG, depth in mm as 16-bit PNG
and depth in m as TIFF of float32. Only raw Bayer and YUV images are converted, to bgr8. Where the bag has clouds and no
depth image, depth is the z of the cloud.

Topics are found by their types, encodings and names, or named. The folder appears when all is written.

Exit status: 0 done; 1 done but for messages that contain no image; 2 nothing was written, as the command line or the
bag is wrong; 130 interrupted, there is no folder.
"""
import argparse
import functools
import logging
import sys
import time
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np
import rosbag
from tqdm import tqdm

from openpose_ros_pkg.calibration import Calibration
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import calibration_from_message
from openpose_ros_tools.command_options import add_output, command_parser, positive_number
from openpose_ros_tools.images import rgbd_folder_writer
from openpose_ros_tools.images.image_files import MILLIMETRES
from openpose_ros_tools.images.rgbd_folder import FOLDERS, LISTS, OLD_STAMPS
from openpose_ros_tools.images.rgbd_folder_writer import WrittenFile
from openpose_ros_tools.images.stamps import seconds_text
from openpose_ros_tools.outputs import output_folder
from openpose_ros_tools.parallel.threads import ordered_map
from openpose_ros_tools.ros.bag_files import TF_TOPIC, StampedMessage, deserialized, open_bag, stamped_messages
from openpose_ros_tools.ros.camera_topics import CLOUD, TopicFinder
from openpose_ros_tools.ros.image_messages import file_of_message
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME
from skeleton_extract_3d.ros.convert import rotation_and_translation

_log = logging.getLogger(__name__)

_NAME = 'bag_to_images'
# Everything that this command writes, or has written as version 1.0.
_OWN = (*(names[0] for names in FOLDERS.values()), *LISTS.values(), OLD_STAMPS, 'camera.yaml', 'sequence.yaml')


@dataclass
class BagContent:
    """The stamps, the calibration and the static transforms of a bag."""

    # by stream [ns], in the order of the bag
    stamps: Dict[str, List[int]] = field(default_factory=dict)
    frame_ids: Dict[str, str] = field(default_factory=dict)  # by stream that of its first message
    of_clouds: bool = False  # depth is that of clouds
    calibration: Optional[Calibration] = None  # the first CameraInfo, or None
    changed: int = 0  # number of CameraInfo that differ from it
    # by child frame the parent, and (4, 4) from child to parent, of all static transforms
    parents: Dict[str, Tuple[str, np.ndarray]] = field(default_factory=dict)

    @property
    def frame_id(self) -> str:
        """Frame of the camera."""
        return self.frame_ids.get('colour', self.frame_ids.get('depth', ''))


# ----------------------------------------------------------------------------------------------------------- reading

def find_topics(bag: rosbag.Bag, wanted: Dict[str, Optional[str]]) -> Dict[str, str]:
    """Return by stream the topics of the camera in a bag: 'colour', 'depth' and 'camera_info', as far as there.

    Args:
        wanted: by stream the topic; None: to be found; 'none': none.

    Raises:
        BadInputError: a topic is not there or has another type, or it is not clear which one to take.
    """
    finder = TopicFinder(bag)
    topics = {stream: finder.named(stream, topic, *[CLOUD] * (stream == 'depth'))
              for stream, topic in wanted.items() if topic not in (None, '', 'none')}
    for stream in LISTS:
        if wanted[stream] is None:
            found = finder.candidates[stream] or (finder.organized_clouds() if stream == 'depth' else [])
            topics[stream] = finder.choose(stream, found)
    topics = {stream: topics[stream] for stream in wanted if topics.get(stream)}
    if not topics.keys() & {'colour', 'depth'}:
        raise BadInputError(f'{bag.filename} has no images of a camera; it has {finder.listed()}')
    if wanted['camera_info'] is None:
        image, infos = topics.get('colour') or topics['depth'], finder.candidates['camera_info']
        info = finder.camera_info_of(image) or (infos[0] if len(infos) == 1 else None)
        if info is not None:
            topics['camera_info'] = info
        elif infos:
            _log.warning('none of the topics with CameraInfo is beside %s: %s; choose one with --camera-info', image,
                         ', '.join(infos))
    return topics


def scan(bag: rosbag.Bag, topics: Dict[str, str], bag_time: bool) -> BagContent:
    """Read the stamps, the calibration and the static transforms; no image is decoded.

    Args:
        bag_time: take the times of recording in place of the stamps in the headers.

    Raises:
        BadInputError: a stamp is missing, or there twice, or the bag is damaged.
    """
    found = BagContent(stamps={stream: [] for stream in LISTS if stream in topics})
    stream_of = {topic: stream for stream, topic in topics.items()}
    names = [*stream_of, TF_TOPIC]
    for message in tqdm(stamped_messages(bag, names), total=bag.get_message_count(names), desc='stamps',
                        unit='message', disable=None):
        stream = stream_of.get(message.topic)
        if stream == 'camera_info':
            calibration = calibration_from_message(deserialized(message))
            found.calibration = found.calibration or calibration
            found.changed += calibration != found.calibration
        elif stream is not None:
            found.stamps[stream].append(_stamp_of(message, bag_time))
            found.frame_ids.setdefault(stream, message.frame_id)
            found.of_clouds |= message.raw[0] == CLOUD
        else:
            for transform in deserialized(message).transforms:
                matrix = np.eye(4)
                matrix[:3, :3], matrix[:3, 3] = rotation_and_translation(transform)
                parent = transform.header.frame_id.lstrip('/')
                found.parents[transform.child_frame_id.lstrip('/')] = (parent, matrix)
    for stream, stamps in found.stamps.items():
        _check_stamps(topics[stream], stamps)
    return found


def pose_in_world(frame_id: str, parents: Dict[str, Tuple[str, np.ndarray]]) -> Optional[np.ndarray]:
    """Return the pose of a frame by static transforms, (4, 4) from frame_id to WORLD_FRAME [m]; None: not connected."""
    matrix, frame, passed = np.eye(4), frame_id.lstrip('/'), set()
    while frame != WORLD_FRAME and frame in parents and frame not in passed:
        passed.add(frame)
        frame, step = parents[frame]
        matrix = step @ matrix
    return matrix if frame == WORLD_FRAME and passed else None


def _stamp_of(message: StampedMessage, bag_time: bool) -> int:
    return message.time if bag_time else message.stamp or 0


def _check_stamps(topic: str, stamps: List[int]) -> None:
    twice = len(stamps) - len(set(stamps))
    for count, what in ((stamps.count(0), 'have no stamp in their header'), (twice, 'have the stamp of another one')):
        if count:
            raise BadInputError(f"{count} of {len(stamps)} messages on '{topic}' {what}; --bag-time takes the times of "
                                'recording')


# ----------------------------------------------------------------------------------------------------------- writing

def write_images(folder: Path, bag: rosbag.Bag, topics: Dict[str, str], stems: Dict[str, Dict[int, str]],
                 options: argparse.Namespace) -> List[WrittenFile]:
    """Write the images of a bag into an empty folder.

    Args:
        stems: names of the files, see `file_stems`; a stamp without one is left out.
        options: with depth_scale and bag_time.
    """
    for stream in stems:
        (folder / FOLDERS[stream][0]).mkdir()
    stream_of = {topic: stream for stream, topic in topics.items() if stream in stems}

    def items() -> Iterator[Tuple[WrittenFile, StampedMessage]]:
        for message in stamped_messages(bag, list(stream_of)):
            stream, stamp = stream_of[message.topic], _stamp_of(message, options.bag_time)
            if stamp in stems[stream]:
                yield WrittenFile(stream, stamp, stems[stream][stamp], None), message

    written = []
    write = functools.partial(_write_image, folder, options.depth_scale)
    with closing(ordered_map(write, items())) as files:
        for file in tqdm(files, total=sum(map(len, stems.values())), unit='image', disable=None):
            if file.path is None:
                _log.warning('%s; left out', file.reason)
            written.append(file)
    return written


def _write_image(folder: Path, depth_scale: Optional[float], item: Tuple[WrittenFile, StampedMessage]) -> WrittenFile:
    """Write an image; the result has the reason if it can not be decoded."""
    file, message = item
    source = f'{file.stream} image of {seconds_text(file.stamp)} s'
    try:
        suffix, content, rounded = file_of_message(file.stream, deserialized(message), depth_scale, source)
    except BadInputError as error:
        return file._replace(reason=f'{source}: {error}')
    path = Path(FOLDERS[file.stream][0]) / (file.stem + suffix)
    (folder / path).write_bytes(content)
    return file._replace(path=path, rounded=rounded)


# ------------------------------------------------------------------------------------------------------ command line

def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    options = _parser().parse_args(arguments)
    return run_command(_NAME, lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    began = time.monotonic()
    wanted = {'colour': options.image, 'depth': options.depth, 'camera_info': options.camera_info}
    with open_bag(options.bag) as bag, output_folder(options.output, options.overwrite, _OWN) as part:
        topics = find_topics(bag, wanted)
        found = scan(bag, topics, options.bag_time)
        stems, remarks = rgbd_folder_writer.file_stems(found.stamps, options.only_pairs)
        for remark in remarks + _remarks(topics, found):
            _log.warning('%s', remark)
        files = write_images(part, bag, topics, stems, options)
        rgbd_folder_writer.write_lists(part, files)
        pose = pose_in_world(found.frame_id, found.parents)
        rgbd_folder_writer.write_description(
            part, found.calibration, found.stamps.get('colour') or found.stamps['depth'], frame_id=found.frame_id,
            depth_scale=options.depth_scale or MILLIMETRES, T_world_camera=None if pose is None else pose.tolist())
    sys.stdout.write(_summary(options, topics, found, files, time.monotonic() - began))
    return SOME_FAILED if any(file.path is None for file in files) else DONE


def _remarks(topics: Dict[str, str], found: BagContent) -> List[str]:
    remarks = []
    if found.calibration is None:
        remarks.append('no calibration: there will be no camera.yaml')
    if found.changed:
        remarks.append(f"{found.changed} messages on {topics['camera_info']} differ from the first one, which "
                       'camera.yaml is made of')
    if set(found.frame_ids.values()) - {found.frame_id}:
        frames = ', '.join(f'{stream} {name}' for stream, name in found.frame_ids.items())
        remarks.append(f'the streams have several frames: {frames}; sequence.yaml names that of the '
                       f"{'colour' if 'colour' in found.frame_ids else 'depth'} images")
    return remarks


def _summary(options: argparse.Namespace, topics: Dict[str, str], found: BagContent, files: Sequence[WrittenFile],
             seconds: float) -> str:
    failed = sum(file.path is None for file in files)
    lines = [f'{options.output}: {len(files) - failed} images; {seconds:.1f} s, '
             f'{len(files) / seconds:.1f} images/s']
    for stream in found.stamps:
        count = sum(file.stream == stream and file.path is not None for file in files)
        origin = ', from the z of the clouds' if stream == 'depth' and found.of_clouds else ''
        lines.append(f'  {count:6d}  {FOLDERS[stream][0]}/ of {topics[stream]}{origin}')
    rounded = max((file.rounded for file in files), default=0.0)
    if rounded:
        lines.append(f'  depth was rounded by up to {1e3 * rounded:.3f} mm, as --depth-scale asks for')
    if any(file.path is not None and file.path.suffix == '.tiff' for file in files):
        lines.append('  depth is in m as TIFF of float32, since the bag has it so; --depth-scale 1000 makes PNG in mm')
    if failed:
        lines.append(f'  {failed} messages left out, see the warnings')
    return '\n'.join(lines) + '\n'


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('bag', type=Path, metavar='BAG', help='with the topics of a camera')
    add_output(parser, 'folder')
    for option, what in (('--image', 'colour images'), ('--depth', 'depth images or clouds'),
                         ('--camera-info', 'the calibration')):
        parser.add_argument(option, metavar='TOPIC', help=f"of {what} (default: found); 'none': none")
    parser.add_argument('--depth-scale', type=positive_number(float), metavar='UNITS',
                        help='write depth as 16-bit PNG with this number of units per metre: 5000 for tools of the TUM '
                             'benchmark; the rounding error is reported')
    parser.add_argument('--only-pairs', action='store_true',
                        help='leave out colour images without depth image, and the other way round')
    parser.add_argument('--bag-time', action='store_true',
                        help='take the times of recording in place of the stamps in the headers')
    return parser
