"""Running nodes: a camera driver that plays sequences of a chosen number of people, watched results, networks alone."""
import argparse
import contextlib
import io
import itertools
import shutil
import statistics
import subprocess
import time
import xmlrpc.client
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence

import cv2
import numpy as np
import psutil
import rosnode
import rospy
from openpose_ros_msgs.msg import Timing

from chain_runs import open_sequence, read_truth
from common import DEMO, Usage, elapsed
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import DetectorSettings, create_detector
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build, parameter_fields
from openpose_ros_tools.ros import images_to_bag
from session import ResultWatch, Session, wait_for
from skeleton_extract_3d.points.rgbd_sequence import RgbdFrame, RgbdSequence

NAMESPACE = '/kinect2/qhd'
# What the driver publishes, by the points that the chain reads.
TOPICS = {'depth_image': 'image_color camera_info image_depth_rect', 'point_cloud': 'image_color points'}
PEOPLE_3D = '/openpose_ros/skeleton_3d/detected_poses_3d'
START_TIMEOUT = 240.0
_PASSES = 15
# Depth before the empty scene, and from the mean depth of the joints, of the pixels of a person [m].
_BEFORE, _AT_JOINTS = 0.1, 0.5
# Copies: person, delay [frames], shift to the right and away over the floor [m].
_COPIES = ((1, 12, -0.5, 0.4), (0, 20, 1.3, 0.9), (1, 25, 0.8, 1.4), (0, 6, -0.7, 1.2), (1, 34, -1.4, 1.8),
           (0, 30, 0.3, 1.6))


def make_bag(sequence: Path, bag: Path, cloud: bool = True) -> Path:
    """Write a sequence folder into a bag for the driver; return the bag."""
    with contextlib.redirect_stdout(io.StringIO()):
        status = images_to_bag.main([str(sequence), '-o', str(bag), '--overwrite', *(['--cloud'] if cloud else [])])
    if status:
        raise OSError(f'{sequence} could not be written into {bag}')
    return bag


def start_camera(session: Session, bag: Path, rate: float, stamps: Optional[Path] = None,
                 remap: Optional[Mapping[str, str]] = None, **parameters: object) -> 'subprocess.Popen[bytes]':
    """Start the driver; return its process. See bag_camera.cpp for the parameters.

    Args:
        stamps: file for `played_stamps`; None: beside the bag.
        remap: other names for topics, and for the node (__name).
    """
    remap = {'__name': 'camera', **(remap or {})}
    return session.start(remap['__name'], ['rosrun', 'openpose_ros_nodelets', 'bag_camera', f'_bag:={bag}',
                                           f'_rate:={rate}', *(f'{key}:={value}' for key, value in remap.items()),
                                           *(f'_{key}:={value}' for key, value in parameters.items())],
                         stamps or bag.with_suffix('.txt'))


def start_named_camera(session: Session, bag: Path, rate: float, stamps: Path, names: Sequence[str]
                       ) -> 'subprocess.Popen[bytes]':
    """Start a driver of depth images with a node name and a namespace of topics of its own; return its process."""
    node, topics = names
    published = TOPICS['depth_image']
    remap = {f'{NAMESPACE}/{topic}': f'{topics}/{topic}' for topic in published.split()}
    return start_camera(session, bag, rate, stamps, {'__name': node, **remap}, topics=published, frame_id=node)


def played_stamps(stamps: Path) -> List[int]:
    """Return the stamps of the frames that a driver has published to a subscriber until now [ns]."""
    lines = stamps.read_text().splitlines(keepends=True)
    return [int(line) for line in lines if line.endswith('\n') and line.strip().isdigit()]  # others are the log's


def node_processes() -> Dict[str, psutil.Process]:
    """Return the process of each node but for this one."""
    return {name: node_process(name) for name in rosnode.get_node_names()
            if name not in ('/rosout', rospy.get_name())}


def node_process(name: str) -> psutil.Process:
    """Return the process of a node.

    Raises:
        OSError: it does not answer.
    """
    node = xmlrpc.client.ServerProxy(rospy.get_master().lookupNode(name)[2])
    return psutil.Process(node.getPid(rospy.get_name())[2])


class Watched(NamedTuple):
    """Results of nodes in some seconds.

    Attributes:
        start: from their start to the first results of all topics [s].
        arrivals, latencies, people: time [s], delay [s] and people of each result, by topic.
        processor, memory: of each node [% of a core], [MB].
        stages: mean of each stage [ms].
        parameters: of each node.
    """

    start: float
    seconds: float
    arrivals: List[np.ndarray]
    latencies: List[np.ndarray]
    people: List[np.ndarray]
    processor: Dict[str, float]
    memory: Dict[str, float]
    stages: Dict[str, float]
    parameters: Dict[str, Dict[str, Any]]


def watch_nodes(session: Session, command: List[str], topics: Mapping[str, type], options: argparse.Namespace,
                timing: str = '') -> Watched:
    """Start nodes, and watch them for a while after they have warmed up; end them.

    Args:
        topics: of the results, with their types.
        options: of `Parser.add_live`.
        timing: topic of the stages.
    """
    began, stages = time.monotonic(), Timing()
    nodes = session.start('nodes', command)
    watches = [ResultWatch(topic, kind) for topic, kind in topics.items()]
    wait_for(lambda: all(watch.arrivals for watch in watches), START_TIMEOUT, 'first results', nodes)
    start = time.monotonic() - began
    time.sleep(options.warm_up)
    first, begin, usage = [len(watch.arrivals) for watch in watches], time.monotonic(), Usage(node_processes())
    time.sleep(options.seconds)
    last, seconds, processor = [len(watch.arrivals) for watch in watches], time.monotonic() - begin, usage.processor()
    memory = usage.memory()
    if timing:
        stages = rospy.wait_for_message(timing, Timing, START_TIMEOUT)
    parameters = {node: rospy.get_param(node, {}) for node in memory}
    for watch in watches:
        watch.stop()
    session.stop(nodes)
    series = ([np.array(getattr(watch, name)[slice(*part)]) for watch, *part in zip(watches, first, last)]
              for name in ('arrivals', 'latencies', 'people'))
    return Watched(start, seconds, *series, processor, memory, {stage.stage: stage.mean for stage in stages.stages},
                   parameters)


class Unit:
    """T: one pass of mobilenet_thin at 656 x 368 in f32 on two threads, to compare machines by."""

    def __init__(self) -> None:
        self._detector = create_detector(build(DetectorSettings, {
            'pose_model': 'mobilenet_thin', 'net_input_width': 656, 'net_input_height': 368, 'threads': 2}))
        self._frame = self._detector.prepare(open_sequence(DEMO).frame(0).bgr)
        self.milliseconds()

    def milliseconds(self) -> float:
        """Return the median of some passes [ms]; nothing else should be at work."""
        return statistics.median(1e3 * self._detector.compute(self._frame).network_seconds for _ in range(_PASSES))


class NetworksAlone:
    """The networks of a node in this process.

    Args:
        values: the node's parameters; others than those of its detection do not count.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        names = {field.name for field in parameter_fields(ServiceSettings)}
        settings = build(ServiceSettings, {name: value for name, value in values.items() if name in names})
        self._stream = NetworkDetection(create_detector(settings.detector), settings.tracking, settings.following)
        self._stream.warm_up()

    def rate(self, sequence: Path, stamps: Sequence[float]) -> float:
        """Return the images of a sequence per second, without the first fifth, with the stamps of results [s]."""
        images = [frame.bgr for frame in open_sequence(sequence)]
        times = []
        for bgr, stamp in zip(itertools.cycle(images + images[-2:0:-1]), stamps):
            frame = self._stream.prepare(ImageFrame('alone', stamp, bgr))
            times.append(elapsed(lambda frame=frame: self._stream.finish(self._stream.compute(frame)))[0])
        return 1000 / float(np.mean(times[len(times) // 5:])) if times else float('nan')


def median_and_95(seconds: Sequence[float]) -> str:
    """Return median and 95th percentile of times [s] in ms, as text."""
    return ' / '.join(f'{1e3 * value:.0f}' for value in np.percentile(seconds, (50, 95))) if len(seconds) else '-'


def make_crowd(people: int, folder: Path) -> Path:
    """Write a sequence with 0 to 8 people, if it is not there, and return its folder.

    One: the nearer of the two of the shipped sequence alone. More: both, and copies of them in other phases of their
    walk, farther away and aside. Shadows on the floor and contours are not those of a camera.
    """
    if people == 2:
        return DEMO
    if folder.is_dir():
        return folder
    sequence = open_sequence(DEMO)
    frames = list(sequence)
    for name in ('rgb', 'depth'):
        (folder / name).mkdir(parents=True)
    for name in ('camera.yaml', 'sequence.yaml'):
        shutil.copy(str(DEMO / name), str(folder / name))
    depths = np.array([frame.depth for frame in frames])
    farthest, (rows, columns) = depths.argmax(axis=0), np.indices(depths.shape[1:])
    room = CutOut(np.array([frame.bgr for frame in frames])[farthest, rows, columns],
                  depths.max(axis=0) / np.float32(1000), np.ones(farthest.shape, bool))
    cut = [_cut_out(frame, room, true['people']) for frame, true in zip(frames, read_truth(DEMO)[0]['frames'])]
    forth_and_back = cut + cut[-2:0:-1]
    for number, both in enumerate(cut):
        copies = [_moved(forth_and_back[(number + late) % len(forth_and_back)][row], shift, sequence)
                  for row, late, *shift in _COPIES[:max(people - 2, 0)]]
        bgr, depth = room.bgr.copy(), room.depth.copy()
        for person in (*both[max(2 - people, 0):], *copies):
            nearer = person.mask & ((depth == 0) | (person.depth < depth))
            bgr[nearer], depth[nearer] = person.bgr[nearer], person.depth[nearer]
        cv2.imwrite(str(folder / 'rgb' / f'{number:05d}.jpg'), bgr, [cv2.IMWRITE_JPEG_QUALITY, 92])
        cv2.imwrite(str(folder / 'depth' / f'{number:05d}.png'), np.rint(1000 * depth).astype(np.uint16))
    return folder


class CutOut(NamedTuple):
    """A person in a frame: (H, W, 3) uint8 BGR, (H, W) float32 depth [m], (H, W) bool mask of the person."""

    bgr: np.ndarray
    depth: np.ndarray
    mask: np.ndarray


def _cut_out(frame: RgbdFrame, room: CutOut, people: Sequence[Dict[str, Any]]) -> List[CutOut]:
    """Return the people of a frame, who are truly there, in the order of their ids."""
    depth, cut = frame.depth / np.float32(1000), []
    for person in sorted(people, key=lambda person: person['id']):
        middle = np.array(person['xyz'], np.float32)[:, 2].mean()
        own = (depth > 0) & (depth < room.depth - _BEFORE) & (np.abs(depth - middle) < _AT_JOINTS)
        # the contour has no depth: it gets that of the body
        mask = cv2.morphologyEx(own.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8)) > 0
        cut.append(CutOut(frame.bgr, np.where(own, depth, middle).astype(np.float32), mask))
    return cut


def _moved(person: CutOut, shift: Sequence[float], sequence: RgbdSequence) -> CutOut:
    """Return a person moved over the floor [m], as flat as a picture for the change of perspective."""
    camera, step = sequence.camera, np.asarray(sequence.T_world_camera)[:3, :3].T @ np.array([*shift, 0.0])
    middle = float(np.median(person.depth[person.mask])) if person.mask.any() else 1.0
    scale = middle / (middle + step[2])
    focal, centre = camera.matrix[[0, 1], [0, 1]], camera.matrix[:2, 2]
    matrix = np.column_stack([scale * np.eye(2), centre - scale * centre + focal * step[:2] / (middle + step[2])])
    depth, mask = (cv2.warpAffine(image, matrix, (camera.width, camera.height), flags=cv2.INTER_NEAREST)
                   for image in (person.depth, person.mask.astype(np.uint8)))
    return CutOut(cv2.warpAffine(person.bgr, matrix, (camera.width, camera.height)), depth + np.float32(step[2]),
                  mask > 0)
