#!/usr/bin/python3
"""Measure postures, gestures, pointing and falls of people, on RGB-D sequences with known joints, without ROS.

Where gt.json labels gestures, these are scored (scoring/signals.py), and the latency of each, the pointing rays and
what they hit are printed. Without labels, gestures are compared with those of the true joints, within half a second;
postures and places on the floor are compared frame by frame. --step 2 omits every other frame after detection.

    ./run bench people signals signals floor wave turn group --step 2
"""
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from chain_runs import Finder, Frames, camera_poses, open_sequence, read_truth
from common import Parser, elapsed, markdown
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import body_of, joints_of, stature_of
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.postures import posture_degrees
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import UNKNOWN, PersonSignals, Ray, Target
from openpose_ros_tools.alignment.people import pair_people
from scoring.figures import figures
from scoring.signals import STATISTICS, Person, Told, score_signals
from scoring.tables import lines_of
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.transform import transform_people

LABELS = {'standing': 'stand', 'sitting': 'sit'}
# Gestures of true joints this near are the same [s].
NEAR = 0.5
# Maximum median distance of the joints of a person; of a hit from the middle of its target [m].
SAME_PERSON, AT_TARGET = 0.3, 0.25
# Pixels between the points of the cloud that rays may meet.
CLOUD_STEP = 4

Signals = List[Tuple[float, Tuple[PersonSignals, ...]]]


@dataclass(frozen=True)
class Sequence:
    """A sequence, see chain_runs.py: gt.json, poses of the camera (F, 4, 4), true and found people in its frame."""

    folder: Path
    truth: Dict[str, Any]
    poses: np.ndarray
    true: Frames
    found: Frames
    step: int  # between the frames that are read

    @property
    def moves(self) -> bool:
        return bool((self.poses != self.poses[0]).any())

    def read(self, frames: Frames, around: Optional[List[Surroundings]] = None) -> Signals:
        """Return the signals of people, in the world where the camera moves, else in its frame."""
        reader, signals = SignalReader(), []
        for number in range(0, len(frames), self.step):
            (stamp, people), pose = frames[number], self.poses[number]
            if self.moves:
                people = transform_people(people, pose[:3, :3], pose[:3, 3])
            up = np.array([0.0, 0.0, 1.0]) if self.moves else pose[2, :3]
            signals.append((stamp, reader.update(people, stamp, up, around[number] if around else Surroundings())))
        return signals

    def joined(self, signals: Signals) -> Iterator[Tuple[int, Dict[int, int], Tuple[PersonSignals, ...]]]:
        """Yield number, ids of the true people by those of the found ones, and signals of each frame."""
        persons_at = dict(signals)
        for number, ((_, true), (stamp, people)) in enumerate(zip(self.true, self.found)):
            pairs = pair_people(people.xyz, true.xyz, SAME_PERSON)
            yield number, {people.ids[row]: true.ids[other] for row, other in pairs}, persons_at.get(stamp, ())


def read_sequence(folder: Path, found: Frames, step: int = 1) -> Sequence:
    """Return the truth of a folder with what was found there."""
    (truth, order), source, true = read_truth(folder), open_sequence(folder), []
    for frame in truth['frames']:
        joints = np.array([person['xyz'] for person in frame['people']]).reshape(-1, len(COCO_18.joints), 3)
        shape = joints.shape[:2]
        true.append((frame['t'], People3D(COCO_18, joints[:, order], np.ones(shape), np.full(shape, MEASURED),
                                          np.full(shape, 0.02), [person['id'] for person in frame['people']])))
    return Sequence(folder, truth, camera_poses(folder, source), true, found, step)


def clouds(sequence: Sequence) -> List[Surroundings]:
    """Return the points of the depth images of a sequence."""
    source = open_sequence(sequence.folder)
    rows, columns = np.mgrid[:source.camera.height:CLOUD_STEP, :source.camera.width:CLOUD_STEP]
    uv = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float64)
    return [Surroundings(points=source.camera.rays(uv) * DepthImage(
        frame.depth, source.camera).depths(columns, rows).reshape(-1, 1)) for frame in source]


def labelled(frames: Frames, signals: Signals) -> List[Tuple[float, List[Person]]]:
    """Return the labels of people, as they are scored."""
    people_at, labels = dict(frames), []
    for stamp, persons in signals:
        necks = dict(zip(people_at[stamp].ids.tolist(), people_at[stamp].xyz[:, COCO_18.index['neck']]))
        labels.append((stamp, [Person(necks[person.id], _labels_of(person)) for person in persons]))
    return labels


def _labels_of(person: PersonSignals) -> Dict[str, Told]:
    labels = {LABELS[person.posture.name]: Told()} if person.posture.name in LABELS else {}
    for gesture in person.gestures:
        arm, ray = gesture.arm.replace('both', ''), gesture.pointing
        labels[gesture.name] = Told(arm) if ray is None else _told(arm, ray)._replace(
            styles={'eye': _told(arm, ray.eye_ray), 'shoulder': _told(arm, ray.arm_ray)})
    return labels


def _told(arm: str, ray: Ray) -> Told:
    return Told(arm, ray.origin, ray.direction, ray.sigma)


def label_rows(sequence: Sequence, signals: Signals) -> List[List[object]]:
    """Return a row for each labelled gesture, with the time after which it is told."""
    rows, open_rows = [], {}
    for (_, names, persons), frame in zip(sequence.joined(signals), sequence.truth['frames']):
        told = {names.get(person.id): person for person in persons}
        labels = {(person['id'], detail['label']) for person in frame['people'] for detail in person['detail']
                  if detail['label'] not in ('sit', 'stand')}
        open_rows = {key: row for key, row in open_rows.items() if key in labels}
        for key in sorted(labels):
            if key not in open_rows:
                open_rows[key] = [*key, frame['t'], '-']
                rows.append(open_rows[key])
            if open_rows[key][3] == '-' and key[0] in told and told[key[0]].gesture(key[1]):
                open_rows[key][3] = round(frame['t'] - open_rows[key][2], 3)
    return rows


def hits(sequence: Sequence, around: List[Surroundings]) -> str:
    """Return how often the rays of labelled pointing hit their targets, as text."""
    right = count = 0
    signals = sequence.read(sequence.found, around)
    for (_, names, persons), frame in zip(sequence.joined(signals), sequence.truth['frames']):
        told = {names.get(person.id): person.gesture('point') for person in persons}
        for person in frame['people']:
            gesture = told.get(person['id'])
            for detail in (detail for detail in person['detail'] if detail['label'] == 'point' and gesture):
                hit = gesture.pointing.hit if gesture.pointing else None
                count += 1
                right += hit is not None and (hit.name == detail['target_name'] or (not hit.name and bool(
                    np.linalg.norm(hit.position - detail['target']) < AT_TARGET)))
    return f'{right} of {count}'


def intervals(signals: Signals) -> List[Tuple[float, float, int, str, str]]:
    """Return begin, end, person, gesture and arm of all gestures."""
    rows, since = [], {}
    for stamp, persons in [*signals, (signals[-1][0], ())]:
        told = {(person.id, gesture.name, gesture.arm) for person in persons for gesture in person.gestures}
        rows += [(since.pop(key), stamp, *key) for key in set(since) - told]
        for key in told:
            since.setdefault(key, stamp)
    return sorted(rows)


def gestures(sequence: Sequence, signals: Signals) -> List[Tuple[str, str, float, float, bool]]:
    """Return name, arm, begin and end [s] of the gestures of a sequence, and whether the true joints make them too."""
    true = intervals(sequence.read(sequence.true))
    return [(name, arm, start, end, any(name == other[3] and other[0] - NEAR <= end and other[1] + NEAR >= start
                                        for other in true)) for start, end, _, name, arm in intervals(signals)]


def print_postures(sequence: Sequence, signals: Signals) -> None:
    """Print, by the posture of the true joints, in how many frames it is found, unknown, or another one."""
    counts: Dict[str, List[int]] = defaultdict(lambda: [0, 0, 0])
    for number, names, persons in sequence.joined(signals):
        (_, true), told = sequence.true[number], {person.id: person.posture.name for person in persons}
        joints = joints_of(true)
        for row, name in enumerate(true.ids.tolist()):
            own = (joints[0][row], joints[1][row], joints[2][row])
            degrees = posture_degrees(body_of(sequence.found[number][0], own, sequence.poses[number][2, :3],
                                              stature_of(*own[:2])))
            posture, degree = max(degrees.items(), key=lambda item: item[1])
            for found in (key for key, value in names.items() if value == name and degree > 0.5 and key in told):
                counts[posture][0 if told[found] == posture else 1 if told[found] == UNKNOWN else 2] += 1
    for posture, (same, unknown, other) in sorted(counts.items()):
        print(f'{posture}: right {same}, unknown {unknown}, other {other}: {same / (same + unknown + other):.3f}')


def print_floor(sequence: Sequence) -> None:
    """Print the errors of places and directions on the floor, and of the floor's height by the body alone."""
    around = [Surroundings(floor=np.array([0.0, 0.0, 1.0, 0.0]) if sequence.moves else pose[2])
              for pose in sequence.poses]
    true, found = sequence.read(sequence.true, around), sequence.read(sequence.found, around)
    alone, away, heights, turned = dict(sequence.read(sequence.found)), [], [], []
    there = {number * sequence.step: persons for number, (_, persons) in enumerate(true)}
    for number, names, persons in sequence.joined(found):
        place = {person.id: person.floor for person in there.get(number, ())}
        for person, body in zip(persons, alone.get(sequence.found[number][0], ())):
            if person.id in names and person.floor and place[names[person.id]]:
                truth, plane = place[names[person.id]], around[number].floor
                away.append(np.linalg.norm(person.floor.position - truth.position))
                heights.append(abs(body.floor.position @ plane[:3] + plane[3]))
                forward, ahead = Rotation.from_quat([person.floor.orientation, truth.orientation]).apply([1, 0, 0])
                if person.body is not None:
                    turned.append(np.degrees(np.arccos(np.clip(forward @ ahead, -1, 1))))
    print(f'places on the floor: {len(away)}, median and 90 % ' + '; '.join(
        f'{name} {np.median(errors):.3f}, {np.percentile(errors, 90):.3f} {unit}' for name, errors, unit in (
            ('off by', away, 'm'), ('floor by the body', heights, 'm'), ('turned by', turned, 'deg')) if errors))


def print_labelled(sequence: Sequence, signals: Signals) -> None:
    """Print scores of labels, latencies, and how right the rays are."""
    counts = score_signals(sequence.folder, labelled(sequence.found, signals))
    print(*lines_of(figures([counts], STATISTICS)), sep='\n')
    print(markdown([['person', 'label', 'begins [s]', 'told after [s]'], *label_rows(sequence, signals)]))
    targets = tuple(Target(name, np.array(place['camera'])) for name, place in sequence.truth['targets'].items())
    print('known targets hit:', hits(sequence, [Surroundings(targets)] * len(sequence.found)),
          'frames; points of the cloud at the target:', hits(sequence, clouds(sequence)), 'frames')


def report(sequence: Sequence) -> Tuple[float, float, float]:
    """Print the signals of a sequence; return its length [s], number of false gestures, time per person [ms]."""
    took, signals = elapsed(lambda: sequence.read(sequence.found))
    print(f'\n{sequence.folder}')
    false = 0
    if 'targets' in sequence.truth:
        print_labelled(sequence, signals)
    else:
        found = gestures(sequence, signals)
        print(markdown([['gesture', 'arm', 'begin [s]', 'end [s]', 'true joints too'], *found]))
        false = sum(not also for *_, also in found)
    print_postures(sequence, signals)
    print_floor(sequence)
    for name, fall in {(person.id, person.fall) for _, persons in signals for person in persons if person.fall}:
        print(f'fall of {name}: lying since {fall.stamp:.2f} s, after {fall.duration:.2f} s, {fall.speed:.1f} m/s')
    return signals[-1][0] - signals[0][0], false, took / max(sum(len(persons) for _, persons in signals), 1)


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    add_settings(parser, 'of the chain')
    parser.add_argument('--step', type=int, default=1, help='take every so many-th frame')
    arguments = parser.parse_args()
    finder = Finder(build(ChainSettings, setting_values(parser, arguments.settings)))
    sequences = [read_sequence(folder, finder.run(open_sequence(folder)).frames, arguments.step)
                 for folder in arguments.sequences]
    seconds, false, cost = np.array([report(sequence) for sequence in sequences]).T
    print(f'\nfalse gestures: {false.sum():.0f} in {seconds.sum():.1f} s, {60 * false.sum() / seconds.sum():.2f} '
          f'per minute\n{np.median(cost):.2f} ms per person and frame')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
