"""Make a bag of a folder of images, on the topics of a camera; no ROS master is needed.

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
    images     the same folders without any of those files, or the images themselves

An image has the stamp that the lists or stamps.csv of its folder name. Without them its stamp is in its name
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

With --cameras, FOLDER holds such a folder for each of several cameras. The topics of each are then under /NAME/qhd, as
cameras.launch has them, and its frame is NAME_rgb_optical_frame.

    rosrun openpose_ros_tools images_to_bag stage/ -o stage.bag --cameras
    rosrun openpose_ros_tools process_bag stage.bag -o people.bag --cameras cam0 cam1 cam2 --csv people.csv

Exit status: 0 done; 1 done but for images that can not be decoded; 2 nothing was written, as the command line or the
images are wrong; 130 interrupted, there is no bag.
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
from typing import Dict, List, NamedTuple, Optional, Sequence

import genpy
import numpy as np
from geometry_msgs.msg import TransformStamped
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header
from tqdm import tqdm

from openpose_ros_pkg.calibration import Calibration, pinhole_calibration, read_calibration
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.natural_order import natural_key
from openpose_ros_tools.command_options import add_output, command_parser, positive_number, seconds
from openpose_ros_tools.images.image_files import MILLIMETRES
from openpose_ros_tools.images.image_layouts import LAYOUTS, LayoutOptions, Recording, find_recording
from openpose_ros_tools.images.stamps import SECOND, UNITS, exact_number, parse_stamp
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.parallel.threads import ordered_map
from openpose_ros_tools.ros.bag_files import COMPRESSIONS, TF_TOPIC, new_bag, write_static_transforms
from openpose_ros_tools.ros.camera_topics import CAMERA_NAMESPACE, TOPICS
from openpose_ros_tools.ros.image_messages import DEPTH_ENCODINGS, BagOptions, MessageMaker, first_image, moments
from skeleton_extract_3d.points.camera import calibrated_camera
from skeleton_extract_3d.points.rgbd_sequence import DEFAULT_FRAME, WORLD_FRAME
from skeleton_extract_3d.ros.convert import transform_from_matrix

_log = logging.getLogger(__name__)

_NAME = 'images_to_bag'


@dataclass
class Report:
    """Number of messages by topic, of images that could not be decoded, and the greatest rounding of depth [m]."""

    messages: Dict[str, int] = field(default_factory=Counter)
    failed: int = 0
    rounded: float = 0.0


class Camera(NamedTuple):
    """What a camera has recorded, and the messages that are made of it."""

    recording: Recording
    options: BagOptions


def write_bag(path: Path, cameras: Sequence[Camera], compression: str = 'none') -> Report:
    """Write the recordings of cameras into a bag, in the order of the stamps.

    Args:
        compression: one of COMPRESSIONS.

    Raises:
        BadInputError: sizes or types of images do not fit.
        OSError: the bag can not be written.
    """
    report = Report()
    makers = [MessageMaker(camera.options, camera.recording) for camera in cameras]
    planned = sorted(((maker, moment) for maker, camera in zip(makers, cameras)
                      for moment in moments(camera.recording)), key=lambda one: one[1].stamp)
    with new_bag(path, compression) as bag, \
            tqdm(total=len(planned), unit='frame', disable=None) as bar, \
            closing(ordered_map(lambda one: one[0].messages(one[1]), planned)) as results:
        poses = _poses([camera.options for camera in cameras], planned[0][1].stamp)
        if poses:
            write_static_transforms(bag, poses, poses[0].header.stamp, _NAME)
            report.messages[TF_TOPIC] += 1
        for made, (_, moment) in zip(results, planned):
            for topic, message in made.messages:
                bag.write(topic, message, genpy.Time(0, moment.stamp))
                report.messages[topic] += 1
            for reason in made.failed:
                _log.warning('%s; left out', reason)
            report.failed += len(made.failed)
            report.rounded = max(report.rounded, made.rounded)
            bar.update()
    return report


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    options = _parser().parse_args(arguments)
    return run_command(_NAME, lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    began = time.monotonic()
    cameras = [_camera(options)] if options.cameras is None else [
        _camera(each) for each in _options_of_cameras(options)]
    with output_file(options.output, options.overwrite) as part:
        report = write_bag(part, cameras, options.compression)
    sys.stdout.write(_summary(options.output, [camera.recording for camera in cameras], report,
                              time.monotonic() - began))
    return SOME_FAILED if report.failed else DONE


def _camera(options: argparse.Namespace) -> Camera:
    recording = find_recording(options.folder, _layout_options(options))
    for remark in recording.remarks:
        _log.warning('%s', remark)
    if options.only_pairs:
        recording = recording.only_pairs()
    return Camera(recording, _bag_options(options, recording))


def _options_of_cameras(options: argparse.Namespace) -> List[argparse.Namespace]:
    """Return the options for each camera: its folder, namespace and frame.

    Raises:
        ParameterError: an option is that of one camera, or there are no folders.
    """
    one = ('colour', 'depth', 'masks', 'frame_id', 'camera_pose', 'start', *(f'{key}_topic' for key in TOPICS))
    given = [name for name in one if getattr(options, name) is not None]
    if given or options.folder is None:
        raise ParameterError('--cameras needs a folder that holds those of the cameras' if not given else
                             f"--{given[0].replace('_', '-')} is for one camera, and contradicts --cameras")
    folders = [options.folder / name for name in options.cameras] or sorted(
        (path for path in options.folder.glob('*') if path.is_dir() and not path.name.startswith('.')), key=natural_key)
    if not folders:
        raise ParameterError(f'{options.folder} holds no folders of cameras')
    first: Dict[str, Path] = {}
    for folder in folders:
        if first.setdefault(folder.name, folder) != folder:
            raise ParameterError(f'{first[folder.name]} and {folder} would both be written to topics below '
                                 f'/{folder.name}, as cameras are named after their folders; rename one of them')
    return [argparse.Namespace(**{**vars(options), 'folder': folder, 'camera_namespace': f'{folder.name}/qhd',
                                  'frame_id': f'{folder.name}_rgb_optical_frame'}) for folder in folders]


def _summary(path: Path, recordings: Sequence[Recording], report: Report, seconds: float) -> str:
    count = sum(len(recording.streams.get('colour') or recording.streams['depth']) for recording in recordings)
    streams = [items for recording in recordings for items in recording.streams.values()]
    first, last = min(items[0].stamp for items in streams), max(items[-1].stamp for items in streams)
    lines = [f'{path}: {count} frames over {(last - first) / SECOND:.3f} s, {path.stat().st_size / 1e6:.1f} MB; '
             f'{seconds:.1f} s, {count / seconds:.1f} frames/s',
             f'  layout {recordings[0].layout}, stamps from {recordings[0].timing}']
    lines += [f'  {number:6d}  {topic}' for topic, number in report.messages.items()]
    if report.rounded:
        lines.append(f'  depth was rounded to 1 mm, by up to {1e3 * report.rounded:.3f} mm; --depth-encoding 32FC1 '
                     'does not round')
    if report.failed:
        lines.append(f'  {report.failed} images left out, see the warnings')
    return '\n'.join(lines) + '\n'


def _layout_options(options: argparse.Namespace) -> LayoutOptions:
    sources = {'colour': options.colour, 'depth': options.depth, 'mask': options.masks}
    return LayoutOptions(options.layout, {stream: source for stream, source in sources.items() if source},
                         options.stamps, options.stamp_unit, options.rate, options.start,
                         round(options.max_difference * SECOND))


def _bag_options(options: argparse.Namespace, recording: Recording) -> BagOptions:
    calibration = _calibration(options, recording)
    if calibration is None:
        _log.warning('no calibration: there will be no camera_info, which depth images need; give --camera or '
                     '--intrinsics')
    elif not calibration.is_calibrated:
        _log.warning('the camera is not calibrated: K is 0; camera_info will say the same')
    else:
        calibrated_camera(calibration)  # checks it
    pose = recording.T_world_camera if options.camera_pose is None else _pose_matrix(options.camera_pose)
    namespace = '/' + options.camera_namespace.strip('/')
    topics = {key: getattr(options, f'{key}_topic') or f'{namespace.rstrip("/")}/{name}'
              for key, name in TOPICS.items()}
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
        image, _ = first_image(stream, recording.streams[stream])
        size = image.shape[1::-1]
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


def _poses(cameras: Sequence[BagOptions], stamp: int) -> List[TransformStamped]:
    """Return where the cameras stand of which this is known."""
    transforms = []
    for options in cameras:
        if options.T_world_camera is not None:
            header = Header(stamp=genpy.Time(0, stamp), frame_id=options.world_frame)
            transforms.append(transform_from_matrix(options.T_world_camera, header, options.frame_id))
    for rotation in (transform.transform.rotation for transform in transforms):
        for key in rotation.__slots__:
            # 12 digits, and no -0: then the way to a matrix and back gives the same bits
            setattr(rotation, key, round(getattr(rotation, key), 12) + 0.0)
    return transforms


# ------------------------------------------------------------------------------------------------------ command line

def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    # so that negative numbers are values
    parser._negative_number_matcher = re.compile(r'^-\d+$|^-\d*\.\d+([eE][-+]?\d+)?$|^-\d+[eE][-+]?\d+$')
    parser.add_argument('folder', nargs='?', type=Path, metavar='FOLDER', help='recording, see above')
    add_output(parser, 'bag')
    parser.add_argument('--cameras', nargs='*', metavar='NAME',
                        help='FOLDER holds a folder for each camera, all recorded by one clock: these, or all')
    _add_images_and_stamps(parser)
    _add_camera(parser)
    group = parser.add_argument_group('bag')
    group.add_argument('--camera-namespace', default=CAMERA_NAMESPACE, metavar='NS',
                       help='of the topics (default: %(default)s)')
    for key, option in (('image', '--image-topic'), ('depth', '--depth-topic'), ('mask', '--mask-topic'),
                        ('points', '--points-topic'), ('camera_info', '--info-topic')):
        group.add_argument(option, dest=f'{key}_topic', metavar='TOPIC', help=f'default: NS/{TOPICS[key]}')
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


def _add_images_and_stamps(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('images')
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
    group.add_argument('--max-difference', type=positive_number(seconds), default=0.02, metavar='SECONDS',
                       help='of the stamps of a pair, where names do not tell pairs (default: %(default)s)')
    group = parser.add_argument_group('stamps')
    group.add_argument('--rate', type=positive_number(_ratio), metavar='HZ',
                       help='of numbered images; may be a fraction such as 30000/1001 (default: fps of sequence.yaml '
                            'or meta.json)')
    group.add_argument('--stamps', type=Path, metavar='FILE', help='table of stamps')
    group.add_argument('--stamp-unit', choices=UNITS, help='unit of the stamps of --stamps, or of names that are '
                       'stamps (default: detected)')
    group.add_argument('--start', type=_stamp, metavar='SECONDS',
                       help='move all stamps so that the first is this one (default: as they are; 1000 for numbered '
                            'images)')


def _add_camera(parser: argparse.ArgumentParser) -> None:
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


def _ratio(text: str) -> Fraction:
    above, _, below = text.partition('/')
    return exact_number(above) / exact_number(below or '1')


def _stamp(text: str) -> int:
    try:
        return parse_stamp(text, 's')
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no time [s]") from None
