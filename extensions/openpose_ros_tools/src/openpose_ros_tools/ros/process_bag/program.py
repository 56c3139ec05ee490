"""Find the people in recordings: every frame once, as fast as the machine computes, without a master.

The results are those of the nodes, on the same topics: openpose_ros/skeleton_3d/... where the bag has points (a cloud,
or depth images and camera info), openpose_ros/... where it has images alone. The outputs appear when all is done; the
same bag and parameters give the same table to the byte.

    rosrun openpose_ros_tools process_bag walk.bag -o walk_people.bag --csv walk.csv
    rosrun openpose_ros_tools process_bag walk.bag -o walk_people.bag --set mode=accurate --copy all
    rosrun openpose_ros_tools process_bag walk.bag -o out.bag --image /cam/color/image_raw/compressed \\
        --depth /cam/aligned_depth_to_color/image_raw --config skeleton_extract_3d_node.yaml --json keypoints/
    rosrun openpose_ros_tools process_bag rosbag2_2026_11_20/ -o people.mcap      # ROS 2, for Foxglove and ROS 2
    rosrun openpose_ros_tools process_bag walk.mp4 -o walk.bag --set points_source=none   # walk.yaml: calibration

With points_source=none, which needs camera info alone, people are placed in space by the images of one camera.

Several bags, or a folder of them, are spread over processes of this machine, or with --scheduler over the workers of a
cluster (Dask distributed), which need this workspace and the same paths; OUT and FILE of --csv are folders then. In
parts of one recording (rosbag record --split) people keep their ids. Bags whose results are there are skipped.

    rosrun openpose_ros_tools process_bag recordings/ -o people/ --csv tables/ --workers 4
    rosrun openpose_ros_tools process_bag /data/recordings -o /data/people --scheduler tcp://192.168.1.10:8786

With --cameras, the cameras of one bag, or of one bag each, see the same people: each camera is processed by itself,
with results under /NAME/openpose_ros/, then fused under /people/openpose_ros/; --csv is the table of these. Poses and
clocks of the cameras are those of tf in the bags, or of --rig; tf is copied into OUT.

    rosrun openpose_ros_tools process_bag room.bag -o people.bag --cameras left right door --csv people.csv
    rosrun openpose_ros_tools process_bag left.bag door.bag -o people.bag --cameras left --rgb-cameras door \\
        --rig rig.yaml

--set hands=true and --set face=true add detected_hands(_3d) and detected_faces(_3d). JSON files have OpenPose's layout;
pose_keypoints_3d are x, y, z [m] and score of each joint, 0 where MISSING, or INFERRED without a joint in the image.

Exit status: 0 all done; 1 some of several bags failed, the others are done; 2 nothing was done, as the command line, a
parameter, the network or the bag is wrong; 130 interrupted, bags that were done are complete, others are not there.
"""
import argparse
import os
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence

from openpose_ros_fusion.rig import read_rig
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, Progress, add_settings, run_command, setting_values
from openpose_ros_pkg.command_options import command_parser, plain_path, whole_number
from openpose_ros_pkg.detect.detection import Detection
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.errors import OpenposeRosError, ParameterError
from openpose_ros_pkg.output.files import check_outputs, natural_key
from openpose_ros_pkg.params.camera_presets import AUTO, find_preset
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import accepted_names, frame_name, parameter_fields
from openpose_ros_pkg.ros.topics import CameraTopics
from openpose_ros_pkg.structured_text import file_values
from openpose_ros_tools.outputs import files_of
from openpose_ros_tools.parallel import run_tasks
from openpose_ros_tools.recording_paths import MCAP_SUFFIX, is_bag, is_ros2, is_video
from openpose_ros_tools.ros.bag_files import COMPRESSIONS, parts_of_recordings
from openpose_ros_tools.ros.process_bag.job import (
    BagJob,
    BagReport,
    BagSettings,
    Input,
    Outputs,
    RigInput,
    Settings,
    build_settings,
)
from openpose_ros_tools.ros.process_bag.output import json_names
from openpose_ros_tools.ros.process_bag.several_cameras import process_rig, rig_input
from openpose_ros_tools.ros.process_bag.work import process, process_parts
from openpose_ros_tools.tables.keypoint_csv import LAYOUTS
from skeleton_extract_3d.node_params import ExtractorSettings
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME

# Nodes whose parameters a configuration file by node may hold, in rising order of weight.
_DETECTORS = ('openpose_ros_service_node', 'openpose_ros_service_node_3d', 'skeleton_extract_3d_node')


def main(arguments: Optional[Sequence[str]] = None,
         create: Callable[[DetectorSettings], Detection] = create_detection) -> int:
    """Run the command; return the exit status.

    Args:
        arguments: of the command line; None: those of this process.
        create: makes what finds people, of its parameters; with processes a function that can be pickled.
    """
    parser = _parser()
    options = parser.parse_args(arguments)
    settings = setting_values(parser, options.settings)
    return run_command('process_bag', lambda: _run(options, settings, create))


def read_config(paths: Sequence[Path]) -> Dict[str, Any]:
    """Return the parameters in configuration files of the nodes that have a meaning here; later files count more.

    A file holds the parameters of a node, or those of several by node, as `config` of launch files has them.

    Raises:
        ParameterError: a file can not be read, or has a key that no node has.
    """
    known = accepted_names(ServiceSettings, ExtractorSettings, BagSettings)
    # Those of the nodes are for live images; a recording gives the same people on each machine.
    used = {field.name for field in parameter_fields(BagSettings)} - {'precision', 'target_rate'}
    values: Dict[str, Any] = {}
    for path in paths:
        content = file_values(path, f'--config {path}', ParameterError) or {}
        if not isinstance(content, dict):
            raise ParameterError(f'--config {path}: expected keys with values, got {type(content).__name__}')
        sections = {key: content.pop(key) for key, value in [*content.items()] if isinstance(value, dict)}
        for node in _DETECTORS:
            content.update(sections.get(node, {}))
        unknown = [key for key in content if key not in known]
        if unknown:
            raise ParameterError(f"--config {path}: unknown parameter '{unknown[0]}'")
        values.update({key: value for key, value in content.items() if key in used})
    return values


def _run(options: argparse.Namespace, settings: Dict[str, Any],
         create: Callable[[DetectorSettings], Detection]) -> int:
    values = {**read_config(options.config), **settings}
    build_settings(values)  # before anything is done
    if options.camera not in ('', AUTO):
        find_preset(options.camera)
    if bool(options.points) + bool(options.depth) + options.only_2d > 1:
        raise ParameterError('--points, --depth and --only-2d contradict each other; give one of them')
    several = not _camera_names(options) and (len(options.inputs) > 1 or (
        options.inputs[0].is_dir() and not is_ros2(options.inputs[0])))
    jobs = _jobs(options, Settings(values, create=create), several)
    _check_outputs(jobs)
    todo = _todo(jobs, options.overwrite)
    left = len(jobs) - sum(map(len, todo.values()))
    if left:
        sys.stdout.write(f'{left} of {len(jobs)} bags have their results already; --overwrite makes them again\n')
    if several or options.scheduler:
        return _run_several(todo, options) if todo else DONE
    return _run_one(jobs[0])


def _run_one(job: BagJob) -> int:
    with Progress(unit='frame') as progress:
        def show(done: int, total: int) -> None:
            progress.total = total
            progress.update(done - progress.n)

        report = process_rig(job.input, job, show) if isinstance(job.input, RigInput) else process(job, show)
    sys.stdout.write(f'{job.outputs.bag}: {report.text()}\n')
    return DONE


def _run_several(recordings: Mapping[str, Sequence[BagJob]], options: argparse.Namespace) -> int:
    count, failed = sum(map(len, recordings.values())), 0
    with Progress(total=count, unit='bag') as progress, closing(
            run_tasks(process_parts, recordings, options.workers, options.scheduler)) as ended:
        for name, results in ended:
            parts = recordings[name]
            for job, result in zip(parts, results if isinstance(results, list) else [results] * len(parts)):
                progress.update()
                text = f'{job.outputs.bag}: {result.text()}' if isinstance(result, BagReport) else ''
                if not text:
                    failed += 1
                    kind = '' if isinstance(result, (OpenposeRosError, OSError)) else f'{type(result).__name__}: '
                    text = f'FAILED {job.cameras[0].bag}: {kind}{result}'
                progress.write(text, file=sys.stdout)
    sys.stdout.write(f'{count - failed} bags done, {failed} failed\n')
    return SOME_FAILED if failed else DONE


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('process_bag', __doc__)
    parser.add_argument('inputs', nargs='+', type=plain_path, metavar='IN',
                        help='a bag, or a recording of ROS 2: a folder with metadata.yaml, .mcap or .db3; several, or '
                             'a folder of them')
    parser.add_argument('-o', '--output', required=True, type=plain_path, metavar='OUT',
                        help='bag with the results, or with the suffix .mcap a file for Foxglove and ROS 2; for '
                             'several, or a folder, a folder for files of the same names')
    group = parser.add_argument_group('results')
    group.add_argument('--csv', type=plain_path, metavar='FILE',
                       help='also as a table: people in space, or in the image where the bag has no points')
    group.add_argument('--csv-layout', choices=LAYOUTS, default=Outputs.csv_layout,
                       help='columns, as keypoints_to_csv has them (default: %(default)s: with status and sigma)')
    group.add_argument('--json', type=plain_path, metavar='DIR', help="also as OpenPose's JSON, one file per frame")
    group.add_argument('--markers', action='store_true', help='also the markers for RViz')
    group.add_argument('--signals', action='store_true', help='also postures, gestures, pointing and falls of '
                                                                'people in space')
    group.add_argument('--copy', action='append', default=[], metavar='TOPIC',
                       help="also an original topic, or 'all' of them but results; may be repeated")
    group.add_argument('--compression', choices=COMPRESSIONS, default='none', help='of OUT (default: %(default)s)')
    group.add_argument('--overwrite', action='store_true', help='make again, and replace, what is there')
    group = parser.add_argument_group('topics; found by type and name where there is only one to choose')
    group.add_argument('--camera', default='', metavar='NAME',
                       help='camera that was recorded: realsense, kinect2, ..., a file of the form of cameras.yaml, or '
                            'auto')
    group.add_argument('--image', default='', metavar='TOPIC', help='colour images, raw or compressed')
    group.add_argument('--points', default='', metavar='TOPIC', help='organized clouds')
    group.add_argument('--depth', default='', metavar='TOPIC', help='depth images, raw or PNG, in place of clouds')
    group.add_argument('--camera-info', default='', metavar='TOPIC', help='calibration of the depth images')
    group.add_argument('--only-2d', action='store_true', help='ignore points: people in the images only')
    group = parser.add_argument_group('several cameras that see the same people')
    group.add_argument('--cameras', nargs='+', default=[], metavar='NAME',
                       help='namespaces of the cameras in the bag; of several bags, names of their cameras in the same '
                            'order. Topics that are named are in the namespace of each camera')
    group.add_argument('--rgb-cameras', nargs='+', default=[], metavar='NAME',
                       help='further cameras, without depth, or whose points are ignored; their bags come last')
    group.add_argument('--fixed-frame', type=frame_name, default='', metavar='FRAME',
                       help=f'of the fused people (default: {WORLD_FRAME}, or that of --rig)')
    group.add_argument('--rig', type=plain_path, metavar='FILE',
                       help='where the cameras stand, and by which time their clocks differ (default: tf says where)')
    group = parser.add_argument_group('parameters')
    add_settings(group, 'of detection, tracking, lifting, pairing or markers; publish_tf=true writes joints to /tf')
    group.add_argument('--config', action='append', default=[], type=plain_path, metavar='FILE',
                       help="a node's YAML file; may be repeated. Its values for topics and saving are not used; --set "
                            'overrides it')
    group = parser.add_argument_group('machines')
    group.add_argument('--workers', type=whole_number(1), default=os.cpu_count() or 1, metavar='N',
                       help='number of bags that are processed at a time on this machine (default: %(default)s)')
    group.add_argument('--scheduler', default='', metavar='ADDRESS',
                       help='of an existing cluster of Dask distributed, whose workers do it instead')
    return parser


def _camera_names(options: argparse.Namespace) -> List[str]:
    """Return the names of several cameras, those without depth last; [] where the command line names none."""
    return [name.strip('/') for name in (*options.cameras, *options.rgb_cameras)]


def _jobs(options: argparse.Namespace, settings: Settings, several: bool) -> List[BagJob]:
    """Return what is to be done; ParameterError: a bag is not there, a folder has none, or options contradict."""
    bags, names = _bags(options.inputs), _camera_names(options)
    recordings = parts_of_recordings(bags) if several else []
    earlier = {path: tuple(parts[:number]) for parts in recordings for number, path in enumerate(parts)}
    topics = CameraTopics(options.image, options.points, options.depth, options.camera_info)
    inputs = [Input(bag, topics, options.camera, options.only_2d, earlier=earlier.get(bag, ())) for bag in bags]
    output, csv, json = (path and path.expanduser().absolute()
                         for path in (options.output, options.csv, options.json))
    outputs = Outputs(output, csv, json, options.csv_layout, tuple(options.copy), options.markers, options.signals,
                      options.compression)
    if names:
        for key in ('rotate_image', 'target_frame'):
            if settings.values.get(key):
                raise ParameterError(f"parameter '{key}' is for one camera, and contradicts --cameras, whose fused "
                                     'people are in the --fixed-frame')
        if options.scheduler:
            raise ParameterError('--scheduler is for several recordings; --cameras makes one of them')
        rig = rig_input(inputs, names, len(options.cameras), options.fixed_frame,
                        options.rig and read_rig(options.rig))
        return [BagJob(rig, outputs, settings)]
    for key in ('fixed_frame', 'rig'):
        if getattr(options, key):
            raise ParameterError(f"--{key.replace('_', '-')} belongs to --cameras")
    if not several:
        return [BagJob(inputs[0], outputs, settings)]
    # workers share the cores of this machine; those of a cluster have as many threads as its owner started
    threads = 1 if options.scheduler else max((os.cpu_count() or 1) // min(options.workers, len(recordings)), 1)
    return [BagJob(each, replace(outputs, bag=output / _result_name(each.bag), csv=csv and csv / f'{each.bag.stem}.csv',
                                 json=json and json / each.bag.stem), replace(settings, threads=threads))
            for each in inputs]


def _result_name(bag: Path) -> str:
    return bag.name if bag.is_file() and bag.suffix in ('.bag', MCAP_SUFFIX) else bag.stem + MCAP_SUFFIX


def _bags(inputs: Sequence[Path]) -> List[Path]:
    """Return the bags of files and folders, in natural order; one that is named twice is there once."""
    bags: Dict[Path, None] = {}
    for path in (path.expanduser().absolute() for path in inputs):
        if path.is_dir() and not is_ros2(path):
            held = sorted((bag for bag in path.iterdir() if not bag.name.startswith('.')
                           and (is_ros2(bag) or is_video(bag) or (is_bag(bag) and bag.is_file()))), key=natural_key)
            if not held:
                raise ParameterError(f'{path} holds no bags or videos')
            bags.update(dict.fromkeys(held))
        elif path.exists():
            bags[path] = None
        else:
            raise ParameterError(f'{path} does not exist')
    return list(bags)


def _check_outputs(jobs: Sequence[BagJob]) -> None:
    """Raise ParameterError if a result would take the place of an input or another result, or can not be there."""
    inputs = [camera.bag for job in jobs for camera in job.cameras]
    first: Dict[Path, Path] = {}  # by result the recording
    for job in jobs:
        bag = job.cameras[0].bag
        check_outputs([path for path in job.outputs.paths if path != job.outputs.json], True, inputs)
        for path in job.outputs.paths:
            if path.resolve() in first:
                raise ParameterError(f'{first[path.resolve()]} and {bag} would both be written to {path}; name another '
                                     'file, or folders of their own, as results are named after their recording')
            first[path.resolve()] = bag


def _todo(jobs: Sequence[BagJob], overwrite: bool) -> Dict[str, List[BagJob]]:
    """Return the jobs of each recording; of several without those whose outputs are there.

    The parts of a recording are made together: where one has no output, the others are made again.

    Raises:
        ParameterError: an output is there already, of a single bag or beside others that are not.
    """
    recordings: Dict[str, List[BagJob]] = {}
    for job in jobs:
        recordings.setdefault(str(job.recording), []).append(job)
    for name, parts in [*recordings.items()]:
        there = [_existing(job) for job in parts]
        for job, paths in zip(parts, there):
            if paths and not overwrite and (len(jobs) == 1 or len(paths) < len(job.outputs.paths)):
                raise ParameterError(f'{paths[0]} is there already; give another name, or --overwrite')
        if all(there) and not overwrite:
            del recordings[name]
    return recordings


def _existing(job: BagJob) -> List[Path]:
    """Return the outputs that are there; ParameterError: a folder is none."""
    outputs = job.outputs
    there = [path for path in (outputs.bag, outputs.csv) if path is not None and os.path.lexists(str(path))]
    if outputs.json is not None and any(files_of(
            outputs.json / camera.camera if len(job.cameras) > 1 else outputs.json, json_names(camera))
            for camera in job.cameras):
        there.append(outputs.json)
    return there
