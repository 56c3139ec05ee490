"""Find the people in recordings: every frame once, as fast as the machine computes, without a master.

The results are those of the nodes, on the same topics: openpose_ros/skeleton_3d/... where the bag has points (a cloud,
or depth images and camera info), openpose_ros/... where it has images alone. Each result has the time of recording of
its frame, and the stamp of its image or cloud; header.seq is the number of the frame. The outputs appear when all is
done, and do not depend on --workers or threads: the same bag and parameters give the same table to the byte.

    rosrun openpose_ros_tools process_bag walk.bag -o walk_people.bag --csv walk.csv
    rosrun openpose_ros_tools process_bag walk.bag -o walk_people.bag --set mode=accurate --copy all
    rosrun openpose_ros_tools process_bag walk.bag -o out.bag --image /cam/color/image_raw/compressed \\
        --depth /cam/aligned_depth_to_color/image_raw --config skeleton_extract_3d_node.yaml --json keypoints/
    rosrun openpose_ros_tools process_bag rosbag2_2026_11_20/ -o people.mcap      # ROS 2, for Foxglove and ROS 2

Several bags, or a folder of them, are spread over processes of this machine, or with --scheduler over the workers of a
cluster (Dask distributed), which need this workspace and the same paths; OUT and FILE of --csv are folders then. The
bag of a worker that dies is done by another one. In parts of one recording (rosbag record --split) people keep their
ids, and latched messages hold in later parts. Bags that are done with the same parameters are skipped; anything else in
the place of a result is only replaced with --overwrite.

    rosrun openpose_ros_tools process_bag recordings/ -o people/ --csv tables/ --workers 4
    rosrun openpose_ros_tools process_bag /data/recordings -o /data/people --scheduler tcp://192.168.1.10:8786

With --cameras, the cameras of one bag, or of one bag each, see the same people: each camera is processed by itself,
with results under /NAME/openpose_ros/, then fused into one set of people in the fixed frame on
/people/openpose_ros/skeleton_3d/detected_poses_3d and .../detected_poses_keypoints_3d; --csv is the table of these. A
camera without depth takes part with its images and camera info. Poses and clocks of the cameras are those of tf in the
bags, or of --rig and --clock-offset; tf is copied into OUT.

    rosrun openpose_ros_tools process_bag room.bag -o people.bag --cameras left right door --csv people.csv
    rosrun openpose_ros_tools process_bag left.bag door.bag -o people.bag --cameras left --rgb-cameras door \\
        --rig rig.yaml --clock-offset door=0.07

--set hands=true and --set face=true add detected_hands(_3d) and detected_faces(_3d). JSON files have OpenPose's layout;
pose_keypoints_3d are x, y, z [m] and score of each joint, 0 where MISSING, or INFERRED without a joint in the image.

Exit status: 0 all done; 1 some of several bags failed, the others are done; 2 nothing was done, as the command line, a
parameter, the network or the bag is wrong; 130 interrupted, bags that were done are complete, others are not there.
"""
import argparse
import logging
import os
import sys
from contextlib import closing
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Union

from openpose_ros_pkg.allocator import keep_large_blocks
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, Progress, add_settings, run_command, setting_values
from openpose_ros_pkg.command_options import command_parser, plain_path, whole_number
from openpose_ros_pkg.detect.detection import Detection
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.errors import OpenposeRosError, ParameterError
from openpose_ros_pkg.natural_order import natural_key
from openpose_ros_pkg.params.camera_presets import AUTO, find_preset
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import parameter_fields
from openpose_ros_pkg.structured_text import file_values
from openpose_ros_tools.outputs import delete_parts, new_run
from openpose_ros_tools.parallel.cluster import run_on_cluster
from openpose_ros_tools.parallel.processes import run_in_processes
from openpose_ros_tools.recording_paths import MCAP_SUFFIX, is_bag, is_ros2
from openpose_ros_tools.ros.bag_files import COMPRESSIONS, parts_of_recordings
from openpose_ros_tools.ros.process_bag.job import BagJob, BagReport, BagSettings, CameraTopics, RigJob, build_settings
from openpose_ros_tools.ros.process_bag.output import is_done
from openpose_ros_tools.ros.process_bag.several_cameras import (
    add_cameras,
    camera_names,
    check_cameras,
    process_rig,
    rig_job,
)
from openpose_ros_tools.ros.process_bag.work import process, process_parts
from openpose_ros_tools.tables.keypoint_csv import LAYOUTS
from skeleton_extract_3d.node_params import ExtractorSettings

_log = logging.getLogger(__name__)

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
    """Return the parameters in configuration files of the nodes that have a meaning here.

    A file holds the parameters of a node, or those of several by node, as `config` of launch files has them.

    Raises:
        ParameterError: a file can not be read, has a key that no node has, or two files contradict each other.
    """
    known = {field.name for field in parameter_fields(ServiceSettings, ExtractorSettings, BagSettings, old=True)}
    # Those of the nodes are for live images; a recording gives the same people on each machine.
    used = {field.name for field in parameter_fields(BagSettings, old=True)} - {'precision', 'target_rate'}
    values: Dict[str, Any] = {}
    for path in paths:
        content = file_values(path, f'--config {path}', ParameterError) or {}
        if not isinstance(content, dict):
            raise ParameterError(f'--config {path}: expected keys with values, got {type(content).__name__}')
        sections = {key: content.pop(key) for key, value in [*content.items()] if isinstance(value, dict)}
        for node in _DETECTORS:
            content.update(sections.get(node, {}))
        for key, value in content.items():
            if key not in known:
                raise ParameterError(f"--config {path}: unknown parameter '{key}'")
            if key in used and values.setdefault(key, value) != value:
                raise ParameterError(f"--config {path}: '{key}' is {value!r}, but {values[key]!r} in another file")
    return values


def _run(options: argparse.Namespace, settings: Dict[str, Any],
         create: Callable[[DetectorSettings], Detection]) -> int:
    values = {**read_config(options.config), **settings}
    build_settings(values)  # before anything is done
    if options.camera not in ('', AUTO):
        find_preset(options.camera)
    if bool(options.points) + bool(options.depth) + options.only_2d > 1:
        raise ParameterError('--points, --depth and --only-2d contradict each other; give one of them')
    check_cameras(options)
    jobs = _jobs_of(options, values, create)
    _check_outputs(jobs)
    by_workers = not camera_names(options) and (bool(options.scheduler) or _are_several(options.inputs))
    todo = [job for job in jobs if options.overwrite or not is_done(job)]
    if len(todo) < len(jobs):
        sys.stdout.write(f'{len(jobs) - len(todo)} of {len(jobs)} bags are done already, with these parameters; '
                         '--overwrite makes them again\n')
    if not todo:
        return DONE
    if by_workers:
        wanted = {_first_part(job) for job in todo}
        return _run_several([job for job in jobs if _first_part(job) in wanted], options)
    keep_large_blocks()
    return _run_one(todo[0])


def _run_one(job: Union[BagJob, RigJob]) -> int:
    with Progress(unit='frame') as progress:
        def show(done: int, total: int) -> None:
            progress.total = total
            progress.update(done - progress.n)

        report = process_rig(job, show) if isinstance(job, RigJob) else process(job, show)
    sys.stdout.write(f'{job.output}: {report.text()}\n')
    return DONE


def _first_part(job: Union[BagJob, RigJob]) -> str:
    return str((*job.cameras[0].earlier, job.sources[0])[0])


def _run_several(jobs: Sequence[Union[BagJob, RigJob]], options: argparse.Namespace) -> int:
    by_name: Dict[str, List[Union[BagJob, RigJob]]] = {}
    for job in jobs:
        by_name.setdefault(_first_part(job), []).append(job)
    failed = 0
    try:
        with Progress(total=len(jobs), unit='bag') as progress:
            ended = (run_on_cluster(process_in_worker, by_name, options.scheduler) if options.scheduler else
                     run_in_processes(process_in_worker, by_name, options.workers))
            with closing(ended):
                for name, results in ended:
                    parts = by_name[name]
                    for job, result in zip(parts, results if isinstance(results, list) else [results] * len(parts)):
                        progress.update()
                        failed += not isinstance(result, BagReport)
                        progress.write(_told(job, result), file=sys.stdout)
    finally:
        for job in jobs:  # what workers that were ended have left
            for path in job.outputs:
                delete_parts(path, job.cameras[0].run)
    sys.stdout.write(f'{len(jobs) - failed} bags done, {failed} failed\n')
    return SOME_FAILED if failed else DONE


def process_in_worker(jobs: Sequence[BagJob]) -> List[Union[BagReport, Exception]]:
    """Do the parts of a recording in a worker."""
    keep_large_blocks()
    return process_parts(jobs)


def _told(job: Union[BagJob, RigJob], result: Any) -> str:
    if isinstance(result, BagReport):
        return f'{job.output}: {result.text()}'
    kind = '' if isinstance(result, (OpenposeRosError, OSError)) else f'{type(result).__name__}: '
    return f'FAILED {job.sources[0]}: {kind}{result}'


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
    group.add_argument('--csv-layout', choices=LAYOUTS, default=BagJob.csv_layout,
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
    add_cameras(parser)
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


def _are_several(inputs: Sequence[Path]) -> bool:
    return len(inputs) > 1 or (inputs[0].is_dir() and not is_ros2(inputs[0]))


def _jobs_of(options: argparse.Namespace, values: Dict[str, Any], create: Callable[..., Any]
             ) -> Sequence[Union[BagJob, RigJob]]:
    """Return what is to be done.

    Raises:
        ParameterError: a bag is not there, or a folder has none.
    """
    several = not camera_names(options) and _are_several(options.inputs)
    bags = _bags(options.inputs)
    # workers share the cores of this machine; those of a cluster have as many threads as its owner started
    recordings = parts_of_recordings(bags) if several else []
    threads = max((os.cpu_count() or 1) // min(options.workers, len(recordings)), 1) if several else 0
    topics = CameraTopics(options.image, options.points, options.depth, options.camera_info)
    result, run = [], new_run()
    earlier = {path: tuple(parts[:number]) for parts in recordings for number, path in enumerate(parts)}
    for bag in bags:
        output, csv, json = (path and path.expanduser().absolute() / (own if several else '') for path, own in (
            (options.output, _result_name(bag)), (options.csv, f'{bag.stem}.csv'), (options.json, bag.stem)))
        result.append(BagJob(bag, output, csv, json, values, topics, options.camera, options.only_2d,
                             copied=tuple(options.copy),
                             markers=options.markers, signals=options.signals, csv_layout=options.csv_layout,
                             compression=options.compression, mcap=output.suffix == MCAP_SUFFIX,
                             threads=1 if options.scheduler else threads, create=create,
                             earlier=earlier.get(bag, ()), run=run))
    return [rig_job(result, options)] if camera_names(options) else result


def _result_name(bag: Path) -> str:
    """Return the name of the results of one of several bags."""
    return bag.name if bag.is_file() and bag.suffix in ('.bag', MCAP_SUFFIX) else bag.stem + MCAP_SUFFIX


def _bags(inputs: Sequence[Path]) -> List[Path]:
    """Return the bags of files and folders, in natural order; one that is named twice is there once."""
    bags: Dict[Path, None] = {}
    for path in (path.expanduser().absolute() for path in inputs):
        if path.is_dir() and not is_ros2(path):
            held = sorted((bag for bag in path.iterdir() if not bag.name.startswith('.')
                           and (is_ros2(bag) or (is_bag(bag) and bag.is_file()))), key=natural_key)
            if not held:
                raise ParameterError(f'{path} holds no bags')
            bags.update(dict.fromkeys(held))
        elif path.exists():
            bags[path] = None
        else:
            raise ParameterError(f'{path} does not exist')
    return list(bags)


def _check_outputs(jobs: Sequence[Union[BagJob, RigJob]]) -> None:
    """Raise ParameterError if a result would take the place of an input or another result, or can not be there."""
    sources = {source.resolve() for job in jobs for source in job.sources}
    first: Dict[Path, Union[BagJob, RigJob]] = {}
    for job in jobs:
        for path in job.outputs:
            other = first.setdefault(path.resolve(), job)
            if other is not job:
                raise ParameterError(f'{other.sources[0]} and {job.sources[0]} would both be written to {path}, as '
                                     'results are named after their recording; give them in commands with folders of '
                                     'their own')
            if path.resolve() in sources:
                raise ParameterError(f'{path} is an input; name another file, or folder')
        if len({path.resolve() for path in job.outputs}) < len(job.outputs):
            raise ParameterError(f'{job.output} is named twice; name another file, or folder')
        for path in job.outputs:
            if path != job.json and path.is_dir():
                raise ParameterError(f'{path} is a folder; name a file')
            for folder in ([path] if path == job.json else []) + list(path.parents):
                if folder.exists() and not folder.is_dir():
                    raise ParameterError(f'{folder} is a file; name a folder')
