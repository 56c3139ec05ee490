"""Make a bag of RGB-D folders, on the topics of a camera; no ROS master is needed.

    rosrun openpose_ros_tools images_to_bag sequence/ -o walk.bag --compression lz4
    rosrun openpose_ros_tools images_to_bag rgbd_dataset_freiburg3/ -o walk.bag --intrinsics 535.4 539.2 320.1 247.6
    rosrun openpose_ros_tools images_to_bag photos/ -o photos.bag --rate 30 --camera camera.yaml --compressed

FOLDER holds, as bag_to_images writes it and rgbd_player_node plays it:

    rgb/ or color/      images with names that end in the number of the frame
    depth/              depth images with the same numbers, aligned to the colour images: 16 bit, or TIFF of float32 [m]
    camera.yaml         calibration, as camera_calibration writes it
    sequence.yaml       fps, frame_id, T_world_camera, depth_scale (units per metre, 1000 where nothing is said)
    meta.json           in place of these two: K, width, height, and the keys of sequence.yaml
    rgb.txt, depth.txt  a stamp [s] and a file on each line, as in the TUM RGB-D benchmark, whose folders are read as
                        they are: without depth_scale, 5000 units are then 1 m

All but the images may be missing. Stamps are those of the lists; without lists they follow from numbers and rate.

    /kinect2/qhd/image_color        sensor_msgs/Image (bgr8), or .../compressed with --compressed
    /kinect2/qhd/image_depth_rect   sensor_msgs/Image: 16UC1 of 16-bit depth in mm, else 32FC1 [m]
    /kinect2/qhd/camera_info        sensor_msgs/CameraInfo, for each stamp of a colour or depth image
    /tf_static                      from world to the camera, if its pose is known (T_world_camera)

With --cameras, FOLDER holds such a folder for each of several cameras. The topics of each are then under /NAME/qhd, as
cameras.launch has them, and its frame is NAME_rgb_optical_frame.

    rosrun openpose_ros_tools images_to_bag stage/ -o stage.bag --cameras
    rosrun openpose_ros_tools process_bag stage.bag -o people.bag --cameras cam0 cam1 cam2 --csv people.csv

Exit status: 0 done; 1 done but for images that can not be decoded; 2 nothing was written, as the command line or the
images are wrong; 130 interrupted, there is no bag.
"""
import argparse
import logging
import sys
from collections import Counter
from contextlib import closing
from fractions import Fraction
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import genpy
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header

from openpose_ros_pkg.calibration import pinhole_calibration, read_calibration
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, Progress, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, number, plain_path
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import natural_key
from openpose_ros_pkg.ros.topics import CAMERA_NAMESPACE
from openpose_ros_tools.images.image_files import MILLIMETRES
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.parallel import ordered_map
from openpose_ros_tools.ros.bag_files import COMPRESSIONS, TF_TOPIC, new_bag, write_static_transforms
from openpose_ros_tools.ros.image_messages import FolderMessages, first_size, size_text
from skeleton_extract_3d.points.camera import calibrated_camera
from skeleton_extract_3d.points.rgbd_folder import read_rgbd_folder
from skeleton_extract_3d.points.rgbd_sequence import DEFAULT_FRAME, WORLD_FRAME
from skeleton_extract_3d.points.stamps import SECOND
from skeleton_extract_3d.ros.convert import transform_from_matrix

_log = logging.getLogger(__name__)

_NAME = 'images_to_bag'


def write_bag(path: Path, cameras: Sequence[FolderMessages], compression: str = 'none') -> Tuple[Dict[str, int], int]:
    """Write the images of cameras into a bag, in the order of the stamps.

    Args:
        compression: one of COMPRESSIONS.

    Returns:
        Number of messages by topic, and of images that could not be decoded.

    Raises:
        BadInputError: sizes or types of images do not fit.
        OSError: the bag can not be written.
    """
    counts: Dict[str, int] = Counter()
    planned = sorted(((camera, moment) for camera in cameras for moment in camera.moments()),
                     key=lambda one: one[1][0])
    with new_bag(path, compression) as bag, \
            Progress(total=len(planned), unit='frame') as bar, \
            closing(ordered_map(lambda one: one[0].messages(one[1]), planned)) as results:
        poses = _poses(cameras, planned[0][1][0])
        if poses:
            write_static_transforms(bag, poses, poses[0].header.stamp, _NAME)
            counts[TF_TOPIC] += 1
        failed = 0
        for (messages, reasons), (_, (stamp, _)) in zip(results, planned):
            for topic, message in messages:
                bag.write(topic, message, genpy.Time(0, stamp))
                counts[topic] += 1
            for reason in reasons:
                _log.warning('%s; left out', reason)
            failed += len(reasons)
            bar.update()
    return counts, failed


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    return run_command(_NAME, lambda: _run(_parser().parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    if options.cameras is None:
        cameras = [_camera(options, options.folder, CAMERA_NAMESPACE, '')]
    else:
        cameras = [_camera(options, folder, f'/{folder.name}/qhd', f'{folder.name}_rgb_optical_frame')
                   for folder in _camera_folders(options.folder, options.cameras)]
    with output_file(options.output, options.overwrite) as part:
        counts, failed = write_bag(part, cameras, options.compression)
    stamps = [file.stamp for camera in cameras for files in camera.folder.streams.values() for file in files]
    lines = [f'{options.output}: {(max(stamps) - min(stamps)) / SECOND:.3f} s, '
             f'{options.output.stat().st_size / 1e6:.1f} MB; stamps from {cameras[0].folder.timing}',
             *(f'  {count:6d}  {topic}' for topic, count in counts.items())]
    if failed:
        lines.append(f'  {failed} images left out, see the warnings')
    sys.stdout.write('\n'.join([*lines, '']))
    return SOME_FAILED if failed else DONE


def _camera(options: argparse.Namespace, place: Path, namespace: str, frame_id: str) -> FolderMessages:
    folder = read_rgbd_folder(place, options.rate)
    for remark in folder.remarks:
        _log.warning('%s', remark)
    size = first_size(folder)
    calibration = read_calibration(options.camera) if options.camera else folder.calibration
    if options.intrinsics:
        calibration = pinhole_calibration(*size, options.intrinsics[:2], options.intrinsics[2:])
    if calibration is None:
        _log.warning('no calibration: there will be no camera_info, which depth images need; give --camera or '
                     '--intrinsics')
    elif calibration.image_size != size:
        raise BadInputError(f"the images in {place} are {size_text(size)}, expected the calibration's "
                            f'{size_text(calibration.image_size)}')
    elif not calibration.is_calibrated:
        _log.warning('the camera is not calibrated: K is 0; camera_info will say the same')
    else:
        calibrated_camera(calibration)  # checks it
    return FolderMessages(folder, size, namespace, frame_id or folder.frame_id or DEFAULT_FRAME, calibration,
                          options.depth_scale or folder.depth_scale or MILLIMETRES, options.compressed)


def _camera_folders(folder: Path, names: Sequence[str]) -> List[Path]:
    """Return the folders of the cameras with these names, or of all."""
    folders = [folder / name for name in names] or sorted(
        (path for path in folder.glob('*') if path.is_dir() and not path.name.startswith('.')), key=natural_key)
    if not folders:
        raise ParameterError(f'{folder} holds no folders of cameras')
    if len({place.name for place in folders}) < len(folders):
        raise ParameterError(f"of {', '.join(map(str, folders))} two have one name, and would both be written to the "
                             'same topics; rename one of them')
    return folders


def _poses(cameras: Sequence[FolderMessages], stamp: int) -> List[TransformStamped]:
    header = Header(stamp=genpy.Time(0, stamp), frame_id=WORLD_FRAME)
    transforms = [transform_from_matrix(camera.folder.T_world_camera, header, camera.frame_id)
                  for camera in cameras if camera.folder.T_world_camera is not None]
    for rotation in (transform.transform.rotation for transform in transforms):
        for key in rotation.__slots__:
            # 12 digits, and no -0: then the way to a matrix and back gives the same bits
            setattr(rotation, key, round(getattr(rotation, key), 12) + 0.0)
    return transforms


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('folder', type=plain_path, metavar='FOLDER', help='see above')
    add_output(parser, 'bag')
    parser.add_argument('--cameras', nargs='*', metavar='NAME',
                        help='FOLDER holds a folder for each camera, all recorded by one clock: these, or all')
    group = parser.add_argument_group('images')
    group.add_argument('--rate', type=number(0.001, 1000, Fraction), metavar='HZ',
                       help='of numbered images; may be a fraction such as 30000/1001 (default: rgb.txt and depth.txt, '
                            'else fps of sequence.yaml or meta.json)')
    group.add_argument('--depth-scale', type=number(0.001, 1e6), metavar='UNITS',
                       help='units of 16-bit depth per metre (default: see above)')
    group = parser.add_argument_group('camera').add_mutually_exclusive_group()
    group.add_argument('--camera', type=plain_path, metavar='FILE',
                       help="calibration as camera_calibration writes it, a CameraInfo that 'rostopic echo' printed, "
                            "or JSON of Open3D (default: FOLDER's camera.yaml or meta.json)")
    group.add_argument('--intrinsics', type=number(-1e6, 1e6), nargs=4, metavar=('FX', 'FY', 'CX', 'CY'),
                       help='without distortion [px], in place of a file')
    group = parser.add_argument_group('bag')
    group.add_argument('--compressed', action='store_true',
                       help='colour as CompressedImage: JPEG and PNG files pass through untouched, others become PNG')
    group.add_argument('--compression', choices=COMPRESSIONS, default='none',
                       help='of the bag; bz2 is small and slow (default: %(default)s)')
    return parser
