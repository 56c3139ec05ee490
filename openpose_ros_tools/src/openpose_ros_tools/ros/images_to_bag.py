"""Make a bag of a folder of pictures, on the topics of a camera; no ROS master is needed.

    rosrun openpose_ros_tools images_to_bag rgbd_dataset_freiburg3/ -o walk.bag --intrinsics 535.4 539.2 320.1 247.6
    rosrun openpose_ros_tools images_to_bag sequence/ -o walk.bag --cloud --compression lz4
    rosrun openpose_ros_tools images_to_bag --colour 'take/*.color.png' --depth 'take/*.depth.png' -o take.bag \\
        --rate 30 --camera camera.yaml --frame-id camera_color_optical_frame
    rosrun openpose_ros_tools images_to_bag photos/ -o photos.bag --stamps stamps.csv --stamp-unit ms --compressed

FOLDER is one of (--layout names it where it is not recognised):

    tum        rgb.txt, depth.txt: lines of a time [s] and a file, as in the TUM RGB-D benchmark; 5000 units are 1 m
    sequence   rgb/ or color/, depth/, masks/, with camera.yaml, sequence.yaml or stamps.csv; what bag_to_images and
               rgbd_player_node know
    rendered   rgb/, depth/ and meta.json with K, width, height and fps
    images     the same folders without any of those files, or the pictures themselves

A picture has the stamp that the lists or stamps.csv of its folder name. Without them its stamp is in its name
(1305031102.175304.png; also integers in ms, us or ns since 1970), or follows from the number in its name and the rate:
where numbers are missing, time passes all the same. --stamps FILE holds a stamp a line, in natural order (image2
before image10), or names and stamps. Stamps stay as they are, to the nanosecond; images without a partner are counted
and named, and come into the bag as well, unless --only-pairs is given.

Topics are those that the launch files of this project listen to; stamps of the bag are those of the headers.

    /kinect2/qhd/image_color        sensor_msgs/Image (bgr8, mono8, ...), or .../compressed with --compressed
    /kinect2/qhd/image_depth_rect   sensor_msgs/Image, 16UC1 [mm] or 32FC1 [m]
    /kinect2/qhd/image_mask         sensor_msgs/Image, mono8 or mono16
    /kinect2/qhd/points             sensor_msgs/PointCloud2 with --cloud: organized, x y z rgb, stamp of the depth image
    /kinect2/qhd/camera_info        sensor_msgs/CameraInfo, for each stamp of a colour or depth image
    /tf_static                      from --world-frame to the camera, if its pose is known

Exit status: 0 done; 1 done but for pictures that can not be decoded; 2 nothing was written, as the command line or the
pictures are wrong; 130 interrupted, there is no bag.
"""
import argparse
import logging
import re
import sys
import time
from collections import Counter
from contextlib import closing
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import genpy
import numpy as np
import rosbag
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from tqdm import tqdm

from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.ros.convert import pixels_to_image
from openpose_ros_tools.images.calibration import Calibration, pinhole_calibration, read_calibration
from openpose_ros_tools.images.image_layouts import LAYOUTS, LayoutOptions, Recording, find_recording
from openpose_ros_tools.images.picture_files import (
    MILLIMETRES,
    decode_depth,
    decode_picture,
    depth_to_metres,
    depth_to_units,
    encode_jpeg,
    encode_png,
    encoding_of,
    picture_kind,
    to_bgr8,
)
from openpose_ros_tools.images.stamps import SECOND, UNITS, parse_stamp
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.parallel.threads import ordered_map
from openpose_ros_tools.ros.bag_files import COMPRESSIONS
from openpose_ros_tools.ros.calibration_message import calibration_to_message
from openpose_ros_tools.ros.camera_topics import CAMERA_NAMESPACE, TOPICS
from skeleton_extract_3d.points.camera import check_same_aspect
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import DEFAULT_FRAME, WORLD_FRAME
from skeleton_extract_3d.ros.convert import cloud_to_message, transform_from_matrix

_log = logging.getLogger(__name__)

_NAME = 'images_to_bag'
TF_TOPIC = '/tf_static'
DEPTH_ENCODINGS = ('16UC1', '32FC1')


@dataclass(frozen=True)
class BagOptions:
    """What is written, beside the pictures.

    Attributes:
        topics: by key of TOPICS, in full.
        frame_id: of all headers.
        calibration: of the camera, or None.
        T_world_camera: (4, 4) from the optical frame to world_frame [m], or None.
        world_frame: name of the frame in which the camera stands.
        compressed: CompressedImage in place of Image for the colour images.
        jpeg_quality: of pictures that are no JPEG yet, with `compressed`; None: they are PNG.
        depth_scale: units of integer depth per metre.
        depth_encoding: one of DEPTH_ENCODINGS; None: 16UC1 for depth in mm, 32FC1 for other depth.
        cloud: write clouds.
    """

    topics: Dict[str, str]
    frame_id: str = DEFAULT_FRAME
    calibration: Optional[Calibration] = None
    T_world_camera: Optional[np.ndarray] = None
    world_frame: str = WORLD_FRAME
    compressed: bool = False
    jpeg_quality: Optional[int] = None
    depth_scale: float = MILLIMETRES
    depth_encoding: Optional[str] = None
    cloud: bool = False


class Moment(NamedTuple):
    """The pictures of one stamp.

    Attributes:
        stamp: [ns].
        files: by stream the number of the picture in it and its path.
        colour_of_cloud: the colour image that belongs to the depth image here, which may have another stamp.
    """

    stamp: int
    files: Dict[str, Tuple[int, Path]]
    colour_of_cloud: Optional[Path]


class Written(NamedTuple):
    """What became of a moment.

    Attributes:
        messages: topic and message, in the order of writing.
        failed: files that can not be decoded, with the reason.
        rounded: greatest rounding of a depth [m].
    """

    messages: List[Tuple[str, Any]]
    failed: List[str]
    rounded: float


@dataclass
class Report:
    """What became of a recording."""

    messages: Dict[str, int] = field(default_factory=Counter)
    failed: int = 0
    rounded: float = 0.0


def moments(recording: Recording) -> Iterator[Moment]:
    """Yield the pictures of a recording by stamp, ascending."""
    by_stamp: Dict[int, Dict[str, int]] = {}
    for stream, items in recording.streams.items():
        for i, item in enumerate(items):
            by_stamp.setdefault(item.stamp, {})[stream] = i
    colour_of = {j: i for i, j in recording.pairs.get('depth', ())}
    for stamp in sorted(by_stamp):
        numbers = by_stamp[stamp]
        partner = colour_of.get(numbers.get('depth', -1))
        yield Moment(stamp, {stream: (i, recording.streams[stream][i].path) for stream, i in numbers.items()},
                     None if partner is None else recording.streams['colour'][partner].path)


class MessageMaker:
    """Makes the messages of moments; may be called by several threads.

    Args:
        options: what to write.
        recording: whose first pictures set the sizes and types that all others have to have.

    Raises:
        BadInputError: sizes do not fit each other or the calibration, or a cloud can not be made.
    """

    def __init__(self, options: BagOptions, recording: Recording) -> None:
        self._options = options
        self._shapes = {stream: _first_readable(stream, items) for stream, items in recording.streams.items()}
        self._check_sizes()
        self._rays: Optional[np.ndarray] = None
        self._camera = None
        if options.cloud:
            self._camera = options.calibration.camera()
            self._rays = self._camera.ray_grid()

    def messages(self, moment: Moment) -> Written:
        """Return the messages of one stamp.

        Raises:
            BadInputError: a picture has another size or type than the first of its stream, or depth does not fit.
        """
        options, failed, rounded = self._options, [], 0.0
        made: Dict[str, Any] = {}
        decoded: Dict[str, np.ndarray] = {}
        for stream, (number, path) in moment.files.items():
            try:
                content = _content(path)
                pixels = _decode(stream, content, path)
            except BadInputError as error:
                failed.append(str(error))
                continue
            self._check(stream, path, pixels)
            header = self._header(moment.stamp, number)
            decoded[stream] = pixels
            if stream == 'depth':
                made['depth'], rounded = self._depth_message(pixels, path, header)
            elif stream == 'colour':
                made['image'] = self._image_message(pixels, content, path, header)
            else:
                made['mask'] = pixels_to_image(pixels, encoding_of(pixels, str(path)), header)
        if options.calibration is not None and ('colour' in decoded or 'depth' in decoded):
            number = next(moment.files[stream][0] for stream in ('colour', 'depth') if stream in decoded)
            made['camera_info'] = calibration_to_message(options.calibration, self._header(moment.stamp, number))
        if options.cloud and 'depth' in decoded and moment.colour_of_cloud is not None:
            try:
                made['points'] = self._cloud_message(moment, decoded)
            except BadInputError as error:
                failed.append(f'no cloud: {error}')
        return Written([(options.topics[key], made[key]) for key in TOPICS if key in made], failed, rounded)

    def _header(self, stamp: int, number: int) -> Header:
        return Header(seq=number, stamp=genpy.Time(0, stamp), frame_id=self._options.frame_id)

    def _image_message(self, pixels: np.ndarray, content: bytes, path: Path, header: Header) -> Any:
        encoding = encoding_of(pixels, str(path))
        if not self._options.compressed:
            return pixels_to_image(pixels, encoding, header)
        kind = picture_kind(content)
        quality = self._options.jpeg_quality
        if quality is not None and kind != 'jpeg':
            content, kind = encode_jpeg(pixels, quality, str(path)), 'jpeg'
        elif kind is None:
            content, kind = encode_png(pixels, str(path)), 'png'
        # as compressed_image_transport writes it: encoding of the picture, codec, and the order of colours in the codec
        of_codec = encoding if encoding.startswith('bgr') else ''
        return CompressedImage(header=header, format=f'{encoding}; {kind} compressed {of_codec}', data=content)

    def _depth_message(self, depth: np.ndarray, path: Path, header: Header) -> Tuple[Any, float]:
        """Return the message of a depth image and the greatest rounding [m]."""
        options = self._options
        scale = 1.0 if depth.dtype == np.float32 else options.depth_scale
        in_mm = depth.dtype == np.uint16 and scale == MILLIMETRES
        encoding = options.depth_encoding or ('16UC1' if in_mm else '32FC1')
        rounded = 0.0
        if encoding == '16UC1' and not in_mm:
            depth, rounded = depth_to_units(_metres(depth, scale), MILLIMETRES, str(path))
        elif encoding == '32FC1':
            depth = _metres(depth, scale)
        return pixels_to_image(depth, encoding, header), rounded

    def _cloud_message(self, moment: Moment, decoded: Dict[str, np.ndarray]) -> Any:
        colour, (number, own_path) = moment.colour_of_cloud, moment.files.get('colour', (0, None))
        bgr = decoded.get('colour') if colour == own_path else None
        if bgr is None:
            bgr = _decode('colour', _content(colour), colour)
            self._check('colour', colour, bgr)
        number, _ = moment.files['depth']
        depth = decoded['depth']
        # as the player makes it, so that both give the same cloud
        depth = depth if depth.dtype == np.float32 else depth * (1.0 / self._options.depth_scale)
        return cloud_to_message(cloud_from_depth(depth, self._camera, to_bgr8(bgr), self._rays),
                                self._header(moment.stamp, number))

    def _check(self, stream: str, path: Path, pixels: np.ndarray) -> None:
        shape, dtype, first = self._shapes[stream]
        if (pixels.shape, pixels.dtype) != (shape, dtype):
            raise BadInputError(f'{path} is {_shape_text(pixels.shape, pixels.dtype)}, expected '
                                f'{_shape_text(shape, dtype)} as {first} is')

    def _check_sizes(self) -> None:
        """Raise BadInputError if the streams and the calibration are not of one view."""
        sizes = {stream: (shape[1], shape[0]) for stream, (shape, _, _) in self._shapes.items()}
        calibration = self._options.calibration
        main = 'colour' if 'colour' in sizes else 'depth'
        names = {stream: f'{stream} image {path}' for stream, (_, _, path) in self._shapes.items()}
        if calibration is not None and calibration.picture_size != sizes[main]:
            raise BadInputError(f"{names[main]} is {_times(sizes[main])}, expected the calibration's "
                                f'{_times(calibration.picture_size)}')
        for stream, size in sizes.items():
            check_same_aspect(names[stream], size, names[main], sizes[main])
        if not self._options.cloud:
            return
        if calibration is None or not calibration.is_calibrated:
            raise ParameterError('--cloud needs a calibration: --camera FILE, or --intrinsics FX FY CX CY')
        if calibration.picture_size != (calibration.width, calibration.height):
            raise ParameterError('--cloud can not be made with a calibration that has binning or a region of interest')
        if set(sizes) & {'colour', 'depth'} != {'colour', 'depth'} or sizes['colour'] != sizes['depth']:
            raise ParameterError('--cloud needs colour and depth images of one size; there are '
                                 + ', '.join(f'{stream} {_times(size)}' for stream, size in sizes.items()))


def write_bag(path: Path, recording: Recording, options: BagOptions, compression: str = 'none') -> Report:
    """Write a recording into a bag, in the order of the stamps.

    Args:
        path: of the bag.
        compression: one of COMPRESSIONS.

    Raises:
        BadInputError: sizes or types of pictures do not fit.
        OSError: the bag can not be written.
    """
    maker, report = MessageMaker(options, recording), Report()
    planned = list(moments(recording))
    with rosbag.Bag(str(path), 'w', compression=compression) as bag, \
            tqdm(total=len(planned), unit='frame', disable=None) as bar, \
            closing(ordered_map(maker.messages, planned)) as made:
        if options.T_world_camera is not None:
            _write_pose(bag, options, planned[0].stamp)
            report.messages[TF_TOPIC] += 1
        for written, moment in zip(made, planned):
            for topic, message in written.messages:
                bag.write(topic, message, genpy.Time(0, moment.stamp))
                report.messages[topic] += 1
            for reason in written.failed:
                _log.warning('%s; left out', reason)
            report.failed += len(written.failed)
            report.rounded = max(report.rounded, written.rounded)
            bar.update()
    return report


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status.

    Args:
        arguments: of the command line; None: those of this process.
    """
    parser = _parser()
    options = parser.parse_args(arguments)
    return run_command(_NAME, lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    began = time.monotonic()
    recording = find_recording(options.folder, _layout_options(options))
    for remark in recording.remarks:
        _log.warning('%s', remark)
    if options.only_pairs:
        recording = recording.only_pairs()
    bag_options = _bag_options(options, recording)
    with output_file(options.output, options.overwrite) as part:
        report = write_bag(part, recording, bag_options, options.compression)
    _tell(options.output, recording, report, time.monotonic() - began)
    return SOME_FAILED if report.failed else DONE


def _tell(path: Path, recording: Recording, report: Report, seconds: float) -> None:
    count = len(recording.streams.get('colour') or recording.streams['depth'])
    first = min(items[0].stamp for items in recording.streams.values())
    last = max(items[-1].stamp for items in recording.streams.values())
    lines = [f'{path}: {count} frames over {(last - first) / SECOND:.3f} s, {path.stat().st_size / 1e6:.1f} MB; '
             f'{seconds:.1f} s, {count / seconds:.1f} frames/s',
             f'  layout {recording.layout}, stamps from {recording.timing}']
    lines += [f'  {number:6d}  {topic}' for topic, number in report.messages.items()]
    if report.rounded:
        lines.append(f'  depth was rounded to 1 mm, by up to {1e3 * report.rounded:.3f} mm; --depth-encoding 32FC1 '
                     'does not round')
    if report.failed:
        lines.append(f'  {report.failed} pictures left out, see the warnings')
    sys.stdout.write('\n'.join(lines) + '\n')


def _layout_options(options: argparse.Namespace) -> LayoutOptions:
    sources = {stream: source for stream, source in (('colour', options.colour), ('depth', options.depth),
                                                     ('mask', options.masks)) if source}
    return LayoutOptions(options.layout, sources, options.stamps, options.stamp_unit, options.rate, options.start,
                         round(options.max_difference * SECOND))


def _bag_options(options: argparse.Namespace, recording: Recording) -> BagOptions:
    calibration = _calibration(options, recording)
    if calibration is None:
        _log.warning('no calibration: there will be no camera_info, which depth images need; give --camera or '
                     '--intrinsics')
    elif not calibration.is_calibrated:
        _log.warning('the camera is not calibrated: K is 0; camera_info will say the same')
    else:
        calibration.camera()
    pose = recording.T_world_camera if options.camera_pose is None else _pose_matrix(options.camera_pose)
    names = {'image': options.image_topic, 'depth': options.depth_topic, 'mask': options.mask_topic,
             'points': options.points_topic, 'camera_info': options.info_topic}
    namespace = '/' + options.camera_namespace.strip('/')
    topics = {key: names[key] or f'{namespace.rstrip("/")}/{name}' for key, name in TOPICS.items()}
    compressed = options.compressed or options.jpeg_quality is not None
    if compressed and not topics['image'].endswith('/compressed'):
        topics['image'] += '/compressed'
    twice = [topic for topic, count in Counter(topics.values()).items() if count > 1]
    if twice:
        raise ParameterError(f"topic '{twice[0]}' is named for two kinds of messages")
    return BagOptions(topics, options.frame_id or recording.frame_id or DEFAULT_FRAME, calibration, pose,
                      options.world_frame, compressed, options.jpeg_quality,
                      options.depth_scale or recording.depth_scale or MILLIMETRES, options.depth_encoding,
                      options.cloud)


def _calibration(options: argparse.Namespace, recording: Recording) -> Optional[Calibration]:
    if options.camera is not None and options.intrinsics:
        raise ParameterError('--camera and --intrinsics contradict each other; give one of them')
    if (options.distortion or options.distortion_model) and not options.intrinsics:
        raise ParameterError('--distortion belongs to --intrinsics')
    if options.camera is not None:
        return read_calibration(options.camera)
    if not options.intrinsics:
        return recording.calibration
    if len(options.intrinsics) not in (4, 6):
        raise ParameterError(f'--intrinsics has {len(options.intrinsics)} numbers, expected 4 (FX FY CX CY) or 6 (and '
                             'WIDTH HEIGHT)')
    fx, fy, cx, cy, *size = options.intrinsics
    if not size:
        stream = 'colour' if 'colour' in recording.streams else 'depth'
        shape, _, _ = _first_readable(stream, recording.streams[stream])
        size = shape[1::-1]
    return pinhole_calibration(int(size[0]), int(size[1]), (fx, fy), (cx, cy), options.distortion or (),
                               options.distortion_model)


def _pose_matrix(values: Sequence[float]) -> np.ndarray:
    quaternion = np.array(values[3:])
    if not np.isclose(np.linalg.norm(quaternion), 1, atol=1e-3):
        raise ParameterError(f'--camera-pose: the quaternion {quaternion.tolist()} has length '
                             f'{np.linalg.norm(quaternion):.4f}, expected 1')
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(quaternion).apply(np.eye(3)).T
    matrix[:3, 3] = values[:3]
    return matrix


def _write_pose(bag: rosbag.Bag, options: BagOptions, stamp: int) -> None:
    header = Header(stamp=genpy.Time(0, stamp), frame_id=options.world_frame)
    transform = transform_from_matrix(options.T_world_camera, header, options.frame_id)
    rotation = transform.transform.rotation
    for key in rotation.__slots__:
        # so that the way to a matrix and back gives the same bits (and no -0); this is a millionth of a millionth rad
        setattr(rotation, key, round(getattr(rotation, key), 12) + 0.0)
    message = TFMessage([transform])
    # latched, as of a static broadcaster: who listens later gets it all the same
    connection = {'topic': TF_TOPIC, 'type': TFMessage._type, 'md5sum': TFMessage._md5sum,
                  'message_definition': TFMessage._full_text, 'callerid': f'/{_NAME}', 'latching': '1'}
    bag.write(TF_TOPIC, message, genpy.Time(0, stamp), connection_header=connection)


def _first_readable(stream: str, items: Sequence[Any]) -> Tuple[Tuple[int, ...], np.dtype, Path]:
    """Return shape and type of the first picture of a stream that can be decoded, and its path."""
    error: Optional[BadInputError] = None
    for item in items:
        try:
            pixels = _decode(stream, _content(item.path), item.path)
        except BadInputError as reason:
            error = error or reason
            continue
        if stream == 'mask' and pixels.ndim != 2:
            raise BadInputError(f'{item.path} is {_shape_text(pixels.shape, pixels.dtype)}, expected a mask of one '
                                'channel')
        return pixels.shape, pixels.dtype, item.path
    raise BadInputError(f'none of the {len(items)} {stream} images can be decoded: {error}')


def _decode(stream: str, content: bytes, path: Path) -> np.ndarray:
    return decode_depth(content, str(path)) if stream == 'depth' else decode_picture(content, str(path))


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise BadInputError(f'{path} can not be read: {error.strerror or error}') from error


def _metres(depth: np.ndarray, scale: float) -> np.ndarray:
    return depth if depth.dtype == np.float32 else depth_to_metres(depth, scale)


def _shape_text(shape: Tuple[int, ...], dtype: np.dtype) -> str:
    return f'{_times(shape[1::-1])} with {shape[2] if len(shape) == 3 else 1} channels of {dtype}'


def _times(size: Sequence[int]) -> str:
    return f'{size[0]} x {size[1]}'


# ------------------------------------------------------------------------------------------------------ command line

def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=_NAME, description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    # so that negative numbers are values
    parser._negative_number_matcher = re.compile(r'^-\d+$|^-\d*\.\d+([eE][-+]?\d+)?$|^-\d+[eE][-+]?\d+$')
    parser.add_argument('folder', nargs='?', type=Path, metavar='FOLDER', help='recording, see above')
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='BAG', help='bag to write')
    parser.add_argument('--overwrite', action='store_true', help='write the bag again if it is there')

    group = parser.add_argument_group('pictures')
    group.add_argument('--layout', choices=LAYOUTS, help='of FOLDER (default: detected)')
    group.add_argument('--colour', '--color', metavar='SOURCE',
                       help="folder, or pattern in quotes, of the colour images, in place of FOLDER's")
    group.add_argument('--depth', metavar='SOURCE', help='the same of depth images that are aligned to the colour '
                       'images: 16-bit PNG, or TIFF of float32 [m]')
    group.add_argument('--masks', '--mask', metavar='SOURCE', help='the same of masks: one channel')
    group.add_argument('--depth-scale', type=positive_number(float), metavar='UNITS',
                       help='units of 16-bit depth per metre (default: as sequence.yaml says; 5000 for tum, else 1000)')
    group.add_argument('--only-pairs', action='store_true',
                       help='leave out colour images without depth image, and the other way round')
    group.add_argument('--max-difference', type=positive_number(float), default=0.02, metavar='SECONDS',
                       help='of the stamps of a pair, where names do not tell pairs (default: %(default)s)')

    group = parser.add_argument_group('stamps')
    group.add_argument('--rate', type=positive_number(Fraction), metavar='HZ',
                       help='of numbered pictures; a fraction such as 30000/1001 will do (default: fps of '
                            'sequence.yaml or meta.json)')
    group.add_argument('--stamps', type=Path, metavar='FILE', help='table of stamps')
    group.add_argument('--stamp-unit', choices=UNITS, help='unit of the stamps of --stamps, or of names that are '
                       'stamps (default: detected)')
    group.add_argument('--start', type=_stamp, metavar='SECONDS',
                       help='move all stamps so that the first is this one (default: as they are; 1000 for numbered '
                            'pictures)')

    group = parser.add_argument_group('camera')
    group.add_argument('--camera', type=Path, metavar='FILE',
                       help="calibration as camera_calibration writes it, a CameraInfo that 'rostopic echo' printed, "
                            "or JSON of Open3D (default: FOLDER's camera.yaml or meta.json)")
    group.add_argument('--intrinsics', type=float, nargs='+', metavar='V',
                       help='FX FY CX CY [WIDTH HEIGHT] [px], in place of a file')
    group.add_argument('--distortion', type=float, nargs='+', metavar='D',
                       help='with --intrinsics: 4 or 5 coefficients of plumb_bob, or 8 of rational_polynomial')
    group.add_argument('--distortion-model', default='', metavar='MODEL', help='of --distortion, such as equidistant')
    group.add_argument('--frame-id', help="of the camera's optical frame (default: as sequence.yaml or meta.json says, "
                       f'else {DEFAULT_FRAME})')
    group.add_argument('--camera-pose', type=float, nargs=7, metavar=('X', 'Y', 'Z', 'QX', 'QY', 'QZ', 'QW'),
                       help='of the optical frame in the world frame [m], for /tf_static (default: T_world_camera of '
                            'sequence.yaml or meta.json)')
    group.add_argument('--world-frame', default=WORLD_FRAME, metavar='FRAME', help='default: %(default)s')

    group = parser.add_argument_group('bag')
    group.add_argument('--camera-namespace', default=CAMERA_NAMESPACE, metavar='NS',
                       help='of the topics (default: %(default)s)')
    for key, option in (('image', '--image-topic'), ('depth', '--depth-topic'), ('mask', '--mask-topic'),
                        ('points', '--points-topic'), ('camera_info', '--info-topic')):
        group.add_argument(option, metavar='TOPIC', help=f'default: NS/{TOPICS[key]}')
    group.add_argument('--compressed', action='store_true',
                       help='colour as CompressedImage: JPEG and PNG files pass through untouched, others become PNG')
    group.add_argument('--jpeg-quality', type=int, choices=range(1, 101), metavar='1..100',
                       help='colour as CompressedImage: what is no JPEG becomes one')
    group.add_argument('--depth-encoding', choices=DEPTH_ENCODINGS,
                       help='default: 16UC1 for 16-bit depth in mm, else 32FC1, so that nothing is rounded')
    group.add_argument('--cloud', action='store_true', help='write clouds as well, 32 bytes per pixel')
    group.add_argument('--compression', choices=COMPRESSIONS, default='none',
                       help='of the bag; bz2 is small and slow (default: %(default)s)')
    return parser


def positive_number(kind: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return the reader of an option that is a finite number above 0.

    Args:
        kind: makes the number of the text.
    """
    def number(text: str) -> Any:
        try:
            value = kind(text)
        except (ValueError, ZeroDivisionError):
            raise argparse.ArgumentTypeError(f"'{text}' is no number") from None
        if not 0 < value < float('inf'):
            raise argparse.ArgumentTypeError(f"'{text}': expected a number above 0")
        return value
    return number


def _stamp(text: str) -> int:
    try:
        return parse_stamp(text, 's')
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no time [s]") from None
