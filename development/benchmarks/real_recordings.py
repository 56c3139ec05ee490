#!/usr/bin/python3
"""Publish an RGB-D recording as a camera would, run the 3D chain on it and report what comes out.

Reports people per frame, rate, how many joints were measured and inferred, whether any is nearer than the surfaces
around it, and how constant and how symmetric the lengths of measured limbs are. Leaves the annotated images in the
output folder. With the recordings of this project's tests:

  real_recordings.py --colour 'rs_two_people_n40/color/*.png' --depth 'rs_two_people_n40/depth/*.png' \\
      --camera 617.25 617.55 317.39 245.98 --output out
  real_recordings.py --colour pcl_five_people/rgb.png --depth pcl_five_people/depth_mm.png --repeat 20 \\
      --camera 525 525 319.5 239.5 --output out
"""
import argparse
import glob
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, List

import cv2
import numpy as np
import pandas as pd
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray
from sensor_msgs.msg import Image

from common import Figures, Parser, errors_end_the_program, new_path, tell
from openpose_ros_pkg.errors import BadInputError, OpenposeRosError
from openpose_ros_pkg.ros.convert import image_to_bgr
from session import Session, wait_for
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.ros.convert import people_from_array

NAMESPACE = '/openpose_ros/skeleton_3d'
START_TIMEOUT = 60.0
# Results that have not come this long after the last frame was played never will [s].
LAST_RESULT = 3.0
# Limbs that were measured in fewer frames tell nothing of their constancy.
LEAST_LENGTHS = 5
# A joint is in front of the surfaces around its pixel if it is by more than the camera's noise [m].
SURFACE_REACH, SURFACE_NOISE = 0.045, 0.02
DEPTH_TOPIC = '/kinect2/qhd/image_depth_rect'
LIMBS = (('right_shoulder', 'left_shoulder'), ('right_shoulder', 'right_elbow'), ('left_shoulder', 'left_elbow'),
         ('right_elbow', 'right_wrist'), ('left_elbow', 'left_wrist'), ('right_hip', 'right_knee'),
         ('left_hip', 'left_knee'), ('right_knee', 'right_ankle'), ('left_knee', 'left_ankle'))


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--colour', required=True, metavar='GLOB', help='colour images')
    parser.add_argument('--depth', required=True, metavar='GLOB', help='aligned 16-bit depth images [mm], as many')
    parser.add_argument('--camera', required=True, nargs=4, type=float, metavar=('FX', 'FY', 'CX', 'CY'),
                        help='intrinsics [px]')
    parser.add_argument('--rate', type=float, default=4.0, help='frames per second (default %(default)s)')
    parser.add_argument('--repeat', type=int, default=1, help='times to play the images (default %(default)s)')
    parser.add_argument('--output', type=new_path, required=True, help='folder for annotated images and figures.json')
    parser.add_argument('launch_arguments', nargs='*', metavar='NAME:=VALUE',
                        help='passed on to openpose_skeleton_extract.launch')
    return parser.parse_args()


def make_sequence(arguments: argparse.Namespace, folder: Path) -> int:
    """Fill a sequence folder with links to the recording and its calibration; return the number of frames."""
    colour, depth = (sorted(glob.glob(pattern))  # noqa: PTH207 (Path.glob takes no absolute pattern)
                     for pattern in (arguments.colour, arguments.depth))
    if not colour or len(colour) != len(depth):
        raise BadInputError(f'{arguments.colour} has {len(colour)} images, {arguments.depth} has {len(depth)}; '
                            'expected as many of both, at least one')
    for kind, paths in (('rgb', colour), ('depth', depth)):
        (folder / kind).mkdir(parents=True)
        for i, path in enumerate(paths * arguments.repeat):
            (folder / kind / f'{i:05d}{Path(path).suffix}').symlink_to(Path(path).resolve())
    height, width = cv2.imread(colour[0]).shape[:2]
    fx, fy, cx, cy = arguments.camera
    # JSON is YAML
    (folder / 'camera.yaml').write_text(json.dumps({
        'image_width': width, 'image_height': height, 'distortion_model': 'plumb_bob',
        'distortion_coefficients': {'rows': 1, 'cols': 5, 'data': [0.0] * 5},
        'camera_matrix': {'rows': 3, 'cols': 3, 'data': [fx, 0, cx, 0, fy, cy, 0, 0, 1]}}))
    return len(colour) * arguments.repeat


class Recorder:
    """Keeps the people of each frame, and writes its annotated image."""

    def __init__(self, folder: Path) -> None:
        self.people: List[People3D] = []
        self.arrivals: List[float] = []
        self.stamps: List[int] = []
        self.depth: Dict[int, np.ndarray] = {}
        self._folder = folder
        self._subscribers = [
            rospy.Subscriber(f'{NAMESPACE}/detected_poses_3d', PersonDetection_3dArray, self._keep, queue_size=100),
            rospy.Subscriber(f'{NAMESPACE}/detected_poses_image', Image, self._write, queue_size=100),
            rospy.Subscriber(DEPTH_TOPIC, Image, self._keep_depth, queue_size=100)]

    def _keep(self, message: PersonDetection_3dArray) -> None:
        self.people.append(people_from_array(message))
        self.stamps.append(message.header.stamp.to_nsec())
        self.arrivals.append(time.monotonic())

    def _keep_depth(self, message: Image) -> None:
        self.depth[message.header.stamp.to_nsec()] = np.frombuffer(message.data, '<u2').reshape(message.height, -1)

    def _write(self, message: Image) -> None:
        cv2.imwrite(str(self._folder / f'{message.header.stamp.to_nsec()}.jpg'), image_to_bgr(message))


def limb_lengths(frames: List[People3D]) -> pd.DataFrame:
    """Return the lengths of limbs with both ends MEASURED, per person: person, limb, number, mean [m], variation."""
    lengths = []
    for frame in frames:
        for limb in LIMBS:
            ends = [frame.skeleton.index[joint] for joint in limb]
            for row in np.flatnonzero((frame.status[:, ends] == MEASURED).all(axis=1)):
                length = float(np.linalg.norm(np.diff(frame.xyz[row, ends].astype(float), axis=0)))
                lengths.append((int(frame.ids[row]), ' - '.join(limb), length))
    limbs = pd.DataFrame(lengths, columns=['person', 'limb', 'length']).groupby(['person', 'limb'], sort=False).length
    rows = pd.DataFrame({'number': limbs.count(), 'mean': limbs.mean(), 'variation': limbs.std(ddof=0) / limbs.mean()})
    return rows[rows.number >= LEAST_LENGTHS].reset_index()


def sides(limbs: pd.DataFrame) -> pd.DataFrame:
    """Return by how much left and right limbs differ, as a share of their mean: person, limb, difference."""
    left, right = (limbs[limbs.limb.str.count(side) == 2].replace({'limb': {side: ''}}, regex=True)
                   for side in ('left_', 'right_'))
    both = left.merge(right, on=['person', 'limb'], suffixes=('', '_right'))
    difference = 2 * (both['mean'] - both.mean_right).abs() / (both['mean'] + both.mean_right)
    return both[['person', 'limb']].assign(difference=difference)


def in_front_of_surfaces(recorder: Recorder, focal: np.ndarray, centre: np.ndarray) -> float:
    """Return the share of the placed joints that are nearer to the camera than every surface around their pixel."""
    joints = in_front = 0
    for frame, stamp in zip(recorder.people, recorder.stamps):
        depth = recorder.depth.get(stamp)
        if depth is None:
            continue
        for xyz in frame.xyz[frame.status != MISSING].astype(float):
            u, v = np.rint(xyz[:2] / xyz[2] * focal + centre).astype(int)
            reach = int(SURFACE_REACH * focal[0] / xyz[2])
            around = depth[max(v - reach, 0):v + reach + 1, max(u - reach, 0):u + reach + 1]
            surfaces = around[around > 0] * 0.001
            joints += surfaces.size > 0
            in_front += surfaces.size > 0 and xyz[2] < surfaces.min() - SURFACE_NOISE
    return in_front / max(joints, 1)


def figures(recorder: Recorder, played: int, camera: List[float]) -> Figures:
    """Return what came out; lengths in metres."""
    people = [len(frame) for frame in recorder.people]
    detected = sum(int((frame.confidence > 0).sum()) for frame in recorder.people)
    status = np.concatenate([frame.status.ravel() for frame in recorder.people])
    limbs = limb_lengths(recorder.people)
    span = recorder.arrivals[-1] - recorder.arrivals[0]
    return {'frames_played': played, 'frames_answered': len(people), 'rate_hz': (len(people) - 1) / span,
            'people_per_frame': {number: people.count(number) for number in sorted(set(people))},
            'ids': sorted({int(person) for frame in recorder.people for person in frame.ids}),
            'joints_detected': detected, 'joints_measured': int((status == MEASURED).sum()),
            'joints_inferred': int((status == INFERRED).sum()),
            'in_front_of_surfaces': in_front_of_surfaces(recorder, np.array(camera[:2]), np.array(camera[2:])),
            'limbs': limbs.to_dict('records'), 'sides': sides(limbs).to_dict('records')}


def run(arguments: argparse.Namespace, sequence: Path) -> Figures:
    """Play the recording once through the chain and return the figures."""
    played = make_sequence(arguments, sequence)
    with Session(arguments.output / 'log') as session:
        nodes = session.start('nodes', ['roslaunch', 'skeleton_extract_3d', 'openpose_skeleton_extract.launch',
                                        *arguments.launch_arguments])
        rospy.init_node('real_recordings', disable_signals=True)
        recorder = Recorder(arguments.output)
        rospy.wait_for_service('detect_poses_3d', START_TIMEOUT)
        player = session.start('player', [
            'roslaunch', 'skeleton_extract_3d', 'rgbd_player.launch', f'folder:={sequence}', f'rate:={arguments.rate}',
            'loop:=false', f'wait_for_subscribers:={START_TIMEOUT}'])
        wait_for(lambda: player.poll() is not None, 2 * START_TIMEOUT + played / arguments.rate, 'end of the player',
                 nodes)
        time.sleep(LAST_RESULT)
        if not recorder.people:
            raise OpenposeRosError(f'no result came; see {arguments.output}/log')
        return figures(recorder, played, arguments.camera)


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    with errors_end_the_program(), tempfile.TemporaryDirectory(prefix='openpose_ros_bench_') as folder:
        try:
            values = run(arguments, Path(folder) / 'sequence')
        except (OpenposeRosError, rospy.ROSException) as error:
            print(error, file=sys.stderr)
            return 1
    tell(values, arguments.output / 'figures.json')
    return 0


if __name__ == '__main__':
    sys.exit(main())
