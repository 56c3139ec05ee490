"""Write the pictures of a camera in a bag as files; no ROS master is needed.

    rosrun openpose_ros_tools bag_to_images walk.bag -o walk/
    rosrun openpose_ros_tools bag_to_images walk.bag -o walk/ --layout tum --depth-scale 5000
    rosrun openpose_ros_tools bag_to_images lab.bag -o lab/ --image /camera/color/image_raw/compressed \\
        --depth /camera/aligned_depth_to_color/image_raw --camera-info /camera/color/camera_info

The folder has one of these layouts; images_to_bag makes of either the same pictures, stamps, calibration and frame_id
again.

    sequence   rgb/, depth/ and masks/ with the same name for the pictures of a frame, 000000 and so on; stamps.csv with
               the stamps [ns]; rgbd_player_node plays it if each frame has both pictures and depth is in mm
    tum        rgb/, depth/ and masks/ with the stamps as names; rgb.txt, depth.txt and masks.txt as in the TUM RGB-D
               benchmark, with all nine digits

Both have camera.yaml, as camera_calibration writes it, and sequence.yaml with the frame_id and, where /tf_static says
it, the camera's pose. Nothing is rounded: compressed images are written as they came (.jpg, .png), others as PNG, depth
in mm as 16-bit PNG and depth in m as TIFF of float32. Only raw Bayer and YUV images are converted, to bgr8. Where the
bag has clouds and no depth image, depth is the z of the cloud.

Topics are found by their types, encodings and names, or named. The folder appears when all is written.

Exit status: 0 done; 1 done but for messages that hold no picture; 2 nothing was written, as the command line or the
bag is wrong; 130 interrupted, there is no folder.
"""
import argparse
import logging
import statistics
import sys
import time
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import genpy
import numpy as np
import rosbag
import yaml
from tqdm import tqdm

from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.ros.convert import compressed_depth_to_image, image_to_bgr, image_to_pixels
from openpose_ros_tools.images.calibration import Calibration, calibration_text
from openpose_ros_tools.images.image_layouts import FOLDERS, STAMPS_FILE, STREAMS, TUM_LISTS
from openpose_ros_tools.images.picture_files import (
    MILLIMETRES,
    depth_to_metres,
    depth_to_units,
    encode_png,
    encode_tiff,
    picture_kind,
)
from openpose_ros_tools.images.stamps import SECOND, associate
from openpose_ros_tools.outputs import output_folder
from openpose_ros_tools.parallel.threads import ordered_map
from openpose_ros_tools.ros.bag_files import StampedMessage, open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.calibration_message import calibration_from_message
from openpose_ros_tools.ros.camera_topics import (
    CLOUD,
    COMPRESSED,
    DEPTH_ENCODINGS,
    IMAGE,
    INFO,
    camera_of,
    image_topics,
    listed,
    organized_clouds,
    preferred,
)
from openpose_ros_tools.ros.images_to_bag import TF_TOPIC, positive_number
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME
from skeleton_extract_3d.ros.convert import cloud_from_message, rotation_and_translation

_log = logging.getLogger(__name__)

_NAME = 'bag_to_images'
LAYOUTS = ('sequence', 'tum')
_SUFFIXES = {'jpeg': '.jpg', 'png': '.png'}
# Of the layout tum and sequence: all that this command writes.
_OWN = (*(names[0] for names in FOLDERS.values()), *(names[0] for names in TUM_LISTS.values()), STAMPS_FILE,
        'camera.yaml', 'sequence.yaml')


@dataclass(frozen=True)
class CameraTopics:
    """The topics of a camera in a bag; None: none.

    Attributes:
        streams: by stream ('colour', 'depth', 'mask') its topic, of images or, for depth, clouds.
        camera_info: of the calibration.
    """

    streams: Dict[str, str]
    camera_info: Optional[str] = None


@dataclass
class Scan:
    """What was read of a bag before the pictures.

    Attributes:
        stamps: by stream those of its messages [ns], in the order of the bag.
        frame_ids: by stream that of its first message.
        calibration: the first CameraInfo, or None.
        changed: how many CameraInfo differ from it.
        parents: by child frame the parent, and (4, 4) from child to parent, of all static transforms.
    """

    stamps: Dict[str, List[int]] = field(default_factory=dict)
    frame_ids: Dict[str, str] = field(default_factory=dict)
    calibration: Optional[Calibration] = None
    changed: int = 0
    parents: Dict[str, Tuple[str, np.ndarray]] = field(default_factory=dict)


class Picture(NamedTuple):
    """A message and where it goes, without suffix."""

    stream: str
    stamp: int
    stem: str
    message_type: Any
    data: bytes


class WrittenFile(NamedTuple):
    """A picture that was written; path is None where it could not be, for the reason."""

    picture: Picture
    path: Optional[Path]
    reason: str = ''
    rounded: float = 0.0


# ------------------------------------------------------------------------------------------------------------ topics

def find_topics(bag: rosbag.Bag, wanted: Dict[str, Optional[str]], camera_info: Optional[str] = None) -> CameraTopics:
    """Return the topics of the camera in a bag.

    Args:
        wanted: by stream the topic; None: to be found; empty: none.
        camera_info: in the same way.

    Raises:
        BadInputError: a topic is not there or has another type, or it is not clear which one to take.
    """
    types = topic_types(bag)
    for topic in filter(None, (*wanted.values(), camera_info)):
        if topic not in types:
            raise BadInputError(f"{bag.filename} has no topic '{topic}'; it has {listed(types)}")
    found = image_topics(bag, types)
    found['depth'] = found['depth'] or organized_clouds(bag, types)
    streams = {}
    for stream in STREAMS:
        topic = wanted.get(stream)
        if topic is None:
            topic = _the_one(bag, stream, found[stream])
        allowed = (IMAGE, COMPRESSED, CLOUD) if stream == 'depth' else (IMAGE, COMPRESSED)
        if topic and types[topic] not in allowed:
            raise BadInputError(f"topic '{topic}' is {types[topic]}, expected {' or '.join(allowed)}")
        if topic:
            streams[stream] = topic
    if not set(streams) & {'colour', 'depth'}:
        raise BadInputError(f'{bag.filename} has no images of a camera; it has {listed(types)}')
    if camera_info and types[camera_info] != INFO:
        raise BadInputError(f"topic '{camera_info}' is {types[camera_info]}, expected {INFO}")
    if camera_info is None:
        camera_info = _info_of(streams.get('colour') or streams['depth'],
                               [name for name, kind in types.items() if kind == INFO])
    return CameraTopics(streams, camera_info or None)


def _the_one(bag: rosbag.Bag, stream: str, topics: List[str]) -> Optional[str]:
    """Return the topic to take of those that may be it: the only one, or the only one that is preferred."""
    if not topics:
        return None
    best = preferred(topics, stream)
    if len(best) != 1:
        raise BadInputError(f'{bag.filename} has {len(topics)} topics that may be {stream} images: '
                            f"{', '.join(sorted(topics))}; choose one with {_OPTIONS[stream]}")
    return best[0]


def _info_of(image: str, infos: List[str]) -> Optional[str]:
    """Return the CameraInfo topic beside an image topic, or the only one."""
    beside = f'{camera_of(image)}/camera_info'
    if beside in infos or len(infos) == 1:
        return beside if beside in infos else infos[0]
    if infos:
        _log.warning('none of the topics with CameraInfo is beside %s: %s; choose one with --camera-info', image,
                     ', '.join(sorted(infos)))
    return None


# ----------------------------------------------------------------------------------------------------------- reading

def scan(bag: rosbag.Bag, topics: CameraTopics, bag_time: bool = False) -> Scan:
    """Read the stamps, the calibration and the static transforms; no picture is decoded.

    Args:
        bag_time: take the times of recording in place of the stamps in the headers.

    Raises:
        BadInputError: a stamp is missing, or there twice, or the bag is damaged.
    """
    found = Scan(stamps={stream: [] for stream in topics.streams})
    stream_of = {topic: stream for stream, topic in topics.streams.items()}
    names = [*stream_of, *filter(None, [topics.camera_info]), TF_TOPIC]
    total = bag.get_message_count(names)
    with tqdm(total=total, desc='stamps', unit='message', disable=None) as bar:
        for message in stamped_messages(bag, names):
            if message.topic in stream_of:
                stream = stream_of[message.topic]
                found.stamps[stream].append(message.time if bag_time else message.stamp)
                found.frame_ids.setdefault(stream, message.frame_id)
            elif message.topic == topics.camera_info:
                calibration = calibration_from_message(_deserialized(bag, message))
                found.calibration = found.calibration or calibration
                found.changed += calibration != found.calibration
            elif message.topic == TF_TOPIC:
                for transform in _deserialized(bag, message).transforms:
                    matrix = np.eye(4)
                    matrix[:3, :3], matrix[:3, 3] = rotation_and_translation(transform)
                    parent = transform.header.frame_id.lstrip('/')
                    found.parents[transform.child_frame_id.lstrip('/')] = (parent, matrix)
            bar.update()
    for stream, stamps in found.stamps.items():
        _check_stamps(topics.streams[stream], stamps)
    return found


def _deserialized(bag: rosbag.Bag, message: StampedMessage) -> Any:
    try:
        return message.kind().deserialize(message.data)
    except genpy.DeserializationError as error:
        raise BadInputError(f'{bag.filename} is damaged: a message of {message.topic}: {error}') from error


def pose_in(world_frame: str, frame_id: str, parents: Dict[str, Tuple[str, np.ndarray]]
            ) -> Tuple[Optional[np.ndarray], str]:
    """Return the pose of a frame in another one by static transforms.

    Returns:
        (4, 4) that takes points of frame_id to world_frame, None where they are not connected; and the topmost frame
        above frame_id.
    """
    matrix, frame, seen = np.eye(4), frame_id.lstrip('/'), set()
    while frame != world_frame and frame in parents and frame not in seen:
        seen.add(frame)
        frame, step = parents[frame]
        matrix = step @ matrix
    return (matrix if frame == world_frame and seen else None), frame


def _check_stamps(topic: str, stamps: List[int]) -> None:
    if 0 in stamps:
        raise BadInputError(f"{stamps.count(0)} of {len(stamps)} messages on '{topic}' have no stamp in their header; "
                            '--bag-time takes the times of recording')
    twice = len(stamps) - len(set(stamps))
    if twice:
        raise BadInputError(f"{twice} of {len(stamps)} messages on '{topic}' have the stamp of another one; --bag-time "
                            'takes the times of recording')


# ---------------------------------------------------------------------------------------------------------- planning

def file_stems(stamps: Dict[str, List[int]], layout: str, max_difference: int, only_pairs: bool
               ) -> Tuple[Dict[str, Dict[int, str]], List[str]]:
    """Return by stream and stamp the names of the files, without suffix, and remarks on what has no partner.

    Args:
        stamps: by stream [ns], each one once.
        max_difference: of the pictures of a frame [ns].
        only_pairs: leave out what has no partner: it gets no name.
    """
    ordered = {stream: sorted(of_stream) for stream, of_stream in stamps.items() if of_stream}
    main = 'colour' if 'colour' in ordered else 'depth'
    # a frame is a stamp of the main stream, and the stamps of the others by stream
    frames = [{main: stamp} for stamp in ordered[main]]
    remarks = []
    for stream, of_stream in ordered.items():
        if stream == main:
            continue
        pairs = associate(ordered[main], of_stream, max_difference)
        for i, j in pairs:
            frames[i][stream] = of_stream[j]
        paired = {j for _, j in pairs}
        alone = [stamp for j, stamp in enumerate(of_stream) if j not in paired]
        for count, total, one, other in ((len(ordered[main]) - len(pairs), len(ordered[main]), main, stream),
                                         (len(alone), len(of_stream), stream, main)):
            if count:
                remarks.append(f'{count} of {total} {one} images have no {other} image within '
                               f'{max_difference / SECOND:g} s')
        frames += [{stream: stamp} for stamp in alone]
    if only_pairs and 'depth' in ordered:
        frames = [frame for frame in frames if main in frame and 'depth' in frame]
    frames.sort(key=lambda frame: [frame.get(stream, min(frame.values())) for stream in STREAMS])
    stems: Dict[str, Dict[int, str]] = {stream: {} for stream in ordered}
    for number, frame in enumerate(frames):
        for stream, stamp in frame.items():
            stems[stream][stamp] = f'{number:06d}' if layout == 'sequence' else _seconds(stamp)
    return stems, remarks


def _seconds(stamp: int) -> str:
    return f'{stamp // SECOND}.{stamp % SECOND:09d}'


# ----------------------------------------------------------------------------------------------------------- writing

class PictureWriter:
    """Writes pictures into the folders of their streams; may be called by several threads.

    Args:
        folder: that the folders of the streams are in.
        depth_scale: units per metre of 16-bit depth; None: mm stay, and metres are written as TIFF.
    """

    def __init__(self, folder: Path, depth_scale: Optional[float]) -> None:
        self._folder = folder
        self._depth_scale = depth_scale

    def write(self, picture: Picture) -> WrittenFile:
        """Write a picture; one that can not be decoded is told in the result.

        Raises:
            BadInputError: depth does not fit the depth scale.
            OSError: the file can not be written.
        """
        source = f'{picture.stream} image of {_seconds(picture.stamp)} s'
        try:
            message = picture.message_type().deserialize(picture.data)
            pixels = _pixels(picture.stream, message)
        except (BadInputError, genpy.DeserializationError) as error:
            return WrittenFile(picture, None, f'{source}: {error}')
        rounded = 0.0
        if pixels is None:
            suffix, content = _SUFFIXES[picture_kind(message.data)], message.data
        elif picture.stream == 'depth':
            suffix, content, rounded = self._depth(pixels, source)
        else:
            suffix, content = '.png', encode_png(pixels, source)
        path = Path(FOLDERS[picture.stream][0]) / (picture.stem + suffix)
        (self._folder / path).write_bytes(content)
        return WrittenFile(picture, path, rounded=rounded)

    def _depth(self, depth: np.ndarray, source: str) -> Tuple[str, bytes, float]:
        """Return suffix and content of the file of a depth image, and by how much it was rounded [m]."""
        scale, rounded = self._depth_scale, 0.0
        if scale is None or (depth.dtype == np.uint16 and scale == MILLIMETRES):
            if depth.dtype == np.float32:
                return '.tiff', encode_tiff(depth, source), 0.0
        else:
            metres = depth if depth.dtype == np.float32 else depth_to_metres(depth, MILLIMETRES)
            depth, rounded = depth_to_units(metres, scale, source)
        return '.png', encode_png(depth, source), rounded


def _pixels(stream: str, message: Any) -> Optional[np.ndarray]:
    """Return the pixels of a message; None for a compressed picture, whose bytes are the file.

    Raises:
        BadInputError: there are none.
    """
    if message._type == COMPRESSED and stream == 'depth':
        return image_to_pixels(compressed_depth_to_image(message))[0]
    if message._type == COMPRESSED:
        if picture_kind(message.data) is None:
            raise BadInputError(f"{len(message.data)} bytes of format '{message.format}' are neither JPEG nor PNG")
        return None
    if message._type == CLOUD:
        cloud = cloud_from_message(message)
        v, u = np.mgrid[:cloud.height, :cloud.width]
        return cloud.depths(u, v).astype(np.float32)
    if stream == 'depth':
        depth, _ = image_to_pixels(message)
        if depth.dtype not in (np.uint16, np.float32):
            raise BadInputError(f"depth has encoding '{message.encoding}', expected {', '.join(DEPTH_ENCODINGS)}")
        return depth
    try:
        return image_to_pixels(message)[0]
    except BadInputError:
        # Bayer and YUV: what they show; errors of any other kind are raised again
        return image_to_bgr(message)


def write_folder(folder: Path, bag: rosbag.Bag, topics: CameraTopics, stems: Dict[str, Dict[int, str]],
                 layout: str, depth_scale: Optional[float] = None, bag_time: bool = False) -> List[WrittenFile]:
    """Write the pictures of a bag and the lists of their stamps.

    Args:
        folder: is there and empty.
        stems: names of the files, see `file_stems`; a stamp without one is left out.

    Returns:
        What was written or could not be, without the data.
    """
    for stream in stems:
        (folder / FOLDERS[stream][0]).mkdir()
    writer, written = PictureWriter(folder, depth_scale), []
    with tqdm(total=sum(map(len, stems.values())), unit='image', disable=None) as bar, \
            closing(ordered_map(writer.write, _pictures(bag, topics, stems, bag_time))) as files:
        for file in files:
            if file.path is None:
                _log.warning('%s; left out', file.reason)
            written.append(file._replace(picture=file.picture._replace(data=b'')))
            bar.update()
    if layout == 'tum':
        _write_tum_lists(folder, written)
    else:
        _write_stamps(folder, written)
    return written


def _pictures(bag: rosbag.Bag, topics: CameraTopics, stems: Dict[str, Dict[int, str]], bag_time: bool
              ) -> Iterator[Picture]:
    stream_of = {topic: stream for stream, topic in topics.streams.items() if stream in stems}
    for message in stamped_messages(bag, list(stream_of)):
        stream, stamp = stream_of[message.topic], message.time if bag_time else message.stamp
        if stamp in stems[stream]:
            yield Picture(stream, stamp, stems[stream][stamp], message.kind, message.data)


def _write_tum_lists(folder: Path, written: Sequence[WrittenFile]) -> None:
    for stream in {file.picture.stream for file in written}:
        files = sorted((file.picture.stamp, file.path) for file in written
                       if file.picture.stream == stream and file.path is not None)
        lines = [f'# {stream} images', '# timestamp filename']
        lines += [f'{_seconds(stamp)} {path.as_posix()}' for stamp, path in files]
        (folder / TUM_LISTS[stream][0]).write_text('\n'.join(lines) + '\n')


def _write_stamps(folder: Path, written: Sequence[WrittenFile]) -> None:
    streams = [stream for stream in STREAMS if any(file.picture.stream == stream for file in written)]
    rows: Dict[str, Dict[str, int]] = {}
    for file in written:
        if file.path is not None:
            rows.setdefault(file.picture.stem, {})[file.picture.stream] = file.picture.stamp
    lines = [','.join(['frame', *(f'{stream} [ns]' for stream in streams)])]
    lines += [','.join([stem, *(str(rows[stem].get(stream, '')) for stream in streams)]) for stem in sorted(rows)]
    (folder / STAMPS_FILE).write_text('\n'.join(lines) + '\n')


def _write_description(folder: Path, found: Scan, frame_id: str, pose: Optional[np.ndarray],
                       depth_scale: Optional[float], layout: str) -> None:
    """Write camera.yaml and sequence.yaml."""
    if found.calibration is not None:
        (folder / 'camera.yaml').write_text(calibration_text(found.calibration))
    values: Dict[str, Any] = {}
    stamps = sorted(found.stamps.get('colour') or found.stamps['depth'])
    if len(stamps) > 1:
        rate = round(SECOND / statistics.median(np.diff(np.array(stamps, np.int64)).tolist()), 3)
        if 0 < rate <= 1000:
            values['fps'] = rate
    values['frame_id'] = frame_id
    if depth_scale is not None or layout == 'tum':
        values['depth_scale'] = MILLIMETRES if depth_scale is None else depth_scale
    if pose is not None:
        values['T_world_camera'] = pose.tolist()
    (folder / 'sequence.yaml').write_text(yaml.safe_dump(values, default_flow_style=None, sort_keys=False))


# ------------------------------------------------------------------------------------------------------ command line

_OPTIONS = {'colour': '--image', 'depth': '--depth', 'mask': '--mask'}


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status.

    Args:
        arguments: of the command line; None: those of this process.
    """
    options = _parser().parse_args(arguments)
    return run_command(_NAME, lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    began = time.monotonic()
    wanted = {'colour': _topic(options.image), 'depth': _topic(options.depth), 'mask': _topic(options.mask)}
    with open_bag(options.bag) as bag, output_folder(options.output, options.overwrite, _OWN) as part:
        topics = find_topics(bag, wanted, _topic(options.camera_info))
        found = scan(bag, topics, options.bag_time)
        stems, remarks = file_stems(found.stamps, options.layout, round(options.max_difference * SECOND),
                                    options.only_pairs)
        if not any(stems.values()):
            raise ParameterError('no image has a partner, so --only-pairs leaves nothing')
        frame_id = found.frame_ids.get('colour', found.frame_ids.get('depth', ''))
        pose, top = pose_in(options.world_frame, frame_id, found.parents)
        _warn(topics, found, remarks, frame_id, pose, top, options)
        written = write_folder(part, bag, topics, stems, options.layout, options.depth_scale, options.bag_time)
        _write_description(part, found, frame_id, pose, options.depth_scale, options.layout)
        types = topic_types(bag)
    return _tell(options, topics, types, written, time.monotonic() - began)


def _warn(topics: CameraTopics, found: Scan, remarks: List[str], frame_id: str, pose: Optional[np.ndarray], top: str,
          options: argparse.Namespace) -> None:
    for remark in remarks:
        _log.warning('%s', remark)
    if found.calibration is None:
        _log.warning('no calibration: there will be no camera.yaml')
    if found.changed:
        _log.warning('%d messages on %s differ from the first one, which camera.yaml is made of', found.changed,
                     topics.camera_info)
    others = {name for name in found.frame_ids.values() if name != frame_id}
    if others:
        _log.warning('the streams have several frames: %s; sequence.yaml names that of the %s images',
                     ', '.join(f'{stream} {name}' for stream, name in found.frame_ids.items()),
                     'colour' if 'colour' in found.frame_ids else 'depth')
    if pose is None and found.parents and top != frame_id:
        _log.warning("%s does not lead from '%s' to '%s' but to '%s'; --world-frame %s takes that one for the room",
                     TF_TOPIC, frame_id, options.world_frame, top, top)


def _tell(options: argparse.Namespace, topics: CameraTopics, types: Dict[str, str], written: Sequence[WrittenFile],
          seconds: float) -> int:
    failed = sum(file.path is None for file in written)
    lines = [f'{options.output}: {len(written) - failed} images, layout {options.layout}; {seconds:.1f} s, '
             f'{len(written) / seconds:.1f} images/s']
    for stream, topic in topics.streams.items():
        count = sum(file.picture.stream == stream and file.path is not None for file in written)
        made = ', from the z of the clouds' if types[topic] == CLOUD else ''
        lines.append(f'  {count:6d}  {FOLDERS[stream][0]}/ of {topic}{made}')
    rounded = max((file.rounded for file in written), default=0.0)
    if rounded:
        lines.append(f'  depth was rounded by up to {1e3 * rounded:.3f} mm, as --depth-scale asks for')
    if any(file.path is not None and file.path.suffix == '.tiff' for file in written):
        lines.append('  depth is in m as TIFF of float32, since the bag has it so; --depth-scale 1000 makes PNG in mm')
    if failed:
        lines.append(f'  {failed} messages left out, see the warnings')
    sys.stdout.write('\n'.join(lines) + '\n')
    return SOME_FAILED if failed else DONE


def _topic(name: Optional[str]) -> Optional[str]:
    """Return the topic of an option; none: empty."""
    return '' if name == 'none' else name


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=_NAME, description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag to read')
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='FOLDER', help='folder to write')
    parser.add_argument('--overwrite', action='store_true',
                        help='write the folder again if it is there and holds nothing else')
    parser.add_argument('--layout', choices=LAYOUTS, default=LAYOUTS[0], help='default: %(default)s')
    parser.add_argument('--image', metavar='TOPIC', help="colour images, raw or compressed; 'none' for none")
    parser.add_argument('--depth', metavar='TOPIC', help='depth images, raw or compressed, or clouds whose z is taken')
    parser.add_argument('--mask', metavar='TOPIC', help='masks')
    parser.add_argument('--camera-info', metavar='TOPIC', help='calibration')
    parser.add_argument('--world-frame', default=WORLD_FRAME, metavar='FRAME',
                        help='upright frame in which the camera stands, of T_world_camera (default: %(default)s)')
    parser.add_argument('--depth-scale', type=positive_number(float), metavar='UNITS',
                        help='write depth as 16-bit PNG with so many units per metre: 5000 for tools of the TUM '
                             'benchmark; says by how much it had to round')
    parser.add_argument('--max-difference', type=positive_number(float), default=0.02, metavar='SECONDS',
                        help='of the stamps of the pictures of a frame (default: %(default)s)')
    parser.add_argument('--only-pairs', action='store_true',
                        help='leave out colour images without depth image, and the other way round')
    parser.add_argument('--bag-time', action='store_true',
                        help='take the times of recording in place of the stamps in the headers')
    return parser
