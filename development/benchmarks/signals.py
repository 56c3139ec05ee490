#!/usr/bin/python3
"""Measure what is told of people's postures, gestures, pointing and falls, on RGB-D sequences with known joints.

Detects and lifts the people of each sequence, without ROS, and reads their signals. A sequence folder is as in
accuracy_3d.py. Where gt.json labels gestures, these are scored with the given script, and the latency of each one, the
pointing rays and what they meet are told. Without labels, gestures are compared with those that the true joints of all
people give, within half a second; postures and places on the floor are compared with those of the true joints, frame
by frame.
--step 2 leaves out every other frame after detection.

    benchmarks/signals.py signals --evaluate evaluate_signals.py
    benchmarks/signals.py signals floor wave turn group --evaluate evaluate_signals.py --step 2
"""
import csv
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from accuracy_3d import ChainSettings, Finder, open_sequence, run_chain
from common import Parser, errors_end_the_program, markdown
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import body_of, joints_of, stature_of
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.postures import posture_degrees
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import UNKNOWN, PersonSignals, Target
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.transform import transform_people

LABELS = {'standing': 'stand', 'sitting': 'sit'}
COLUMNS = ('stamp', 'id', 'x', 'y', 'z', 'label', 'arm', 'ox', 'oy', 'oz', 'dx', 'dy', 'dz')
# Frames this near to a change of a label do not count; gestures of true joints this near are the same [s].
MARGIN, NEAR = 0.2, 0.5
# Whose joints are nearer (median) is the same person; a hit this near to the middle of a target hits it [m].
SAME_PERSON, AT_TARGET = 0.3, 0.25
# Pixels between the points of the cloud that rays may meet.
CLOUD_STEP = 4

Frames = List[Tuple[float, People3D]]
Signals = List[Tuple[float, Tuple[PersonSignals, ...]]]


@dataclass(frozen=True)
class Truth:
    """A sequence with its truth: the place of the camera in each frame, people and what they do."""

    folder: Path
    truth: Dict[str, Any]
    poses: np.ndarray

    @property
    def labelled(self) -> bool:
        return 'targets' in self.truth

    @property
    def true_people(self) -> Frames:
        """Return the true people, in the frame of the camera."""
        order = [self.truth['joints'].index(joint) for joint in COCO_18.joints]
        frames = []
        for frame in self.truth['frames']:
            joints = np.array([person['xyz'] for person in frame['people']]).reshape(-1, len(COCO_18.joints), 3)
            shape = joints.shape[:2]
            frames.append((frame['t'], People3D(COCO_18, joints[:, order], np.ones(shape), np.full(shape, MEASURED),
                                                np.full(shape, 0.02), [person['id'] for person in frame['people']])))
        return frames


def read_truth(folder: Path) -> Truth:
    """Read the truth of a folder."""
    meta = json.loads((folder / 'meta.json').read_text())
    truth = json.loads((folder / 'gt.json').read_text())
    poses = meta.get('poses') or [meta['T_world_camera']] * len(truth['frames'])
    return Truth(folder, truth, np.array(poses))


def detect(folders: Sequence[Path], raw: Dict[str, Any]) -> Dict[str, Frames]:
    """Return the people of each frame of sequences, in the frame of the camera."""
    settings, found, finder = build(ChainSettings, raw), {}, None
    for folder in folders:
        sequence = open_sequence(folder)
        finder = finder or Finder(settings, 0.0, sequence.fps or 1.0)
        chain = PeopleChain(finder.stream(), settings.estimator)
        found[str(folder)] = run_chain(sequence, chain, finder).frames
    return found


def read_signals(sequence: Truth, frames: Frames, step: int, around: Optional[List[Surroundings]] = None) -> Signals:
    """Return the signals of the people of a sequence, in the world where the camera moves, else in its frame."""
    reader, signals = SignalReader(), []
    moving = (sequence.poses != sequence.poses[0]).any()
    for number in range(0, len(frames), step):
        stamp, people = frames[number]
        pose = sequence.poses[number]
        if moving:
            people = transform_people(people, pose[:3, :3], pose[:3, 3])
        up = np.array([0.0, 0.0, 1.0]) if moving else pose[2, :3]
        signals.append((stamp, reader.update(people, stamp, up, around[number] if around else Surroundings())))
    return signals


def clouds(sequence: Truth) -> List[Surroundings]:
    """Return what the depth images of a sequence show."""
    source = open_sequence(sequence.folder)
    rows, columns = np.mgrid[:source.camera.height:CLOUD_STEP, :source.camera.width:CLOUD_STEP]
    result = []
    for frame in source:
        depth = DepthImage(frame.depth, source.camera).depths(columns, rows)
        uv = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float64)
        result.append(Surroundings(points=source.camera.rays(uv) * depth.reshape(-1, 1)))
    return result


def pairs(true: People3D, people: People3D) -> Dict[int, int]:
    """Return the id of each true person who was found, by the found one's id."""
    apart = np.array([[np.nanmedian(np.linalg.norm(one - other, axis=1)) for other in people.xyz] for one in true.xyz])
    if not apart.size:
        return {}
    return {int(people.ids[column]): int(true.ids[row]) for row, column in zip(*linear_sum_assignment(apart))
            if apart[row, column] < SAME_PERSON}


def write_labels(path: Path, frames: Frames, signals: Signals) -> None:
    """Write the labels as the script that scores them reads them."""
    people_at = dict(frames)
    with path.open('w', newline='') as handle:
        writer = csv.DictWriter(handle, COLUMNS)
        writer.writeheader()
        for stamp, persons in signals:
            necks = dict(zip(people_at[stamp].ids.tolist(), people_at[stamp].xyz[:, COCO_18.index['neck']]))
            for person in persons:
                row = {'stamp': round(stamp * 1e9), 'id': person.id, **dict(zip('xyz', necks[person.id]))}
                writer.writerow(dict(row, label=LABELS.get(person.posture.name, '')))
                for gesture in person.gestures:
                    ray = gesture.pointing
                    writer.writerow(dict(row, label=gesture.name, arm=gesture.arm.replace('both', ''),
                                         **(dict(zip(COLUMNS[7:], (*ray.origin, *ray.direction))) if ray else {})))


def label_rows(sequence: Truth, frames: Frames, signals: Signals) -> Tuple[List[List[object]], List[float]]:
    """Return a row for each labelled gesture with its latency, and the errors of the rays of true pointing [deg]."""
    there = {stamp: (pairs(true, people), persons) for (_, true), (stamp, people), persons in
             ((true, found, dict(signals).get(found[0], ())) for true, found in zip(sequence.true_people, frames))}
    rows, errors, open_rows = [], [], {}
    for frame in sequence.truth['frames']:
        names, persons = there[frame['t']]
        told = {names.get(person.id): person for person in persons}
        for person in frame['people']:
            labels = {detail['label']: detail for detail in person['detail'] if detail['label'] not in ('sit', 'stand')}
            for label in [key for key in open_rows if key[0] == person['id'] and key[1] not in labels]:
                del open_rows[label]
            for label, detail in labels.items():
                key = (person['id'], label)
                if key not in open_rows:
                    open_rows[key] = [person['id'], label, frame['t'], '-']
                    rows.append(open_rows[key])
                gesture = told[person['id']].gesture(label) if person['id'] in told else None
                if gesture and open_rows[key][3] == '-':
                    open_rows[key][3] = round(frame['t'] - open_rows[key][2], 3)
                if label == 'point' and persons:
                    errors.append(_ray_error(gesture, detail))
    return rows, errors


def _ray_error(gesture: Any, detail: Dict[str, Any]) -> float:
    if gesture is None or gesture.pointing is None:
        return np.nan
    ray, to = gesture.pointing, np.array(detail['target']) - gesture.pointing.origin
    return float(np.degrees(np.arccos(np.clip(ray.direction @ to / np.linalg.norm(to), -1, 1))))


def hits(sequence: Truth, frames: Frames, signals: Signals) -> str:
    """Return how often the rays of labelled pointing meet what was pointed at, as text."""
    right = count = 0
    persons_at = dict(signals)
    for frame, (_, true), (stamp, people) in zip(sequence.truth['frames'], sequence.true_people, frames):
        names = pairs(true, people)
        told = {names.get(person.id): person.gesture('point') for person in persons_at.get(stamp, ())}
        for person in frame['people']:
            gesture = told.get(person['id'])
            for detail in (detail for detail in person['detail'] if detail['label'] == 'point' and gesture):
                hit = gesture.pointing.hit if gesture.pointing else None
                count += 1
                right += hit is not None and (hit.name == detail['target_name'] or (not hit.name and bool(
                    np.linalg.norm(hit.position - detail['target']) < AT_TARGET)))
    return f'{right} of {count}'


def intervals(signals: Signals) -> List[Tuple[float, float, int, str, str]]:
    """Return begin, end, person, gesture and arm of everything that is told."""
    rows, since = [], {}
    for stamp, persons in [*signals, (signals[-1][0], ())]:
        told = {(person.id, gesture.name, gesture.arm) for person in persons for gesture in person.gestures}
        for key in set(since) - told:
            rows.append((since.pop(key), stamp, *key))
        for key in told:
            since.setdefault(key, stamp)
    return sorted(rows)


def posture_rows(sequence: Truth, frames: Frames, signals: Signals) -> Dict[str, List[int]]:
    """Return, by the posture of the true joints, in how many frames the same, unknown, or another one is told."""
    counts: Dict[str, List[int]] = {}
    persons_at = dict(signals)
    for (_, true), (stamp, people), pose in zip(sequence.true_people, frames, sequence.poses):
        names, told = pairs(true, people), {person.id: person.posture.name for person in persons_at.get(stamp, ())}
        joints = joints_of(true)
        for row, name in enumerate(true.ids.tolist()):
            own = (joints[0][row], joints[1][row], joints[2][row])
            degrees = posture_degrees(body_of(stamp, own, pose[2, :3], stature_of(*own[:2])))
            posture, degree = max(degrees.items(), key=lambda item: item[1])
            for found in (key for key, value in names.items() if value == name and degree > 0.5 and key in told):
                column = 0 if told[found] == posture else 1 if told[found] == UNKNOWN else 2
                counts.setdefault(posture, [0, 0, 0])[column] += 1
    return counts


def tell_floor(sequence: Truth, frames: Frames, step: int) -> None:
    """Print how far places on the floor, and how people are turned there, are from those of the true joints.

    The floor is z = 0 of the world; its height is also told where only the body tells it.
    """
    moving = (sequence.poses != sequence.poses[0]).any()
    around = [Surroundings(floor=np.array([0.0, 0.0, 1.0, 0.0]) if moving else pose[2]) for pose in sequence.poses]
    true = read_signals(sequence, sequence.true_people, step, around)
    found, alone = read_signals(sequence, frames, step, around), read_signals(sequence, frames, step)
    away, heights, turned = [], [], []
    for number, ((_, there), (_, persons), (_, bodies)) in enumerate(zip(true, found, alone)):
        place, plane = {person.id: person.floor for person in there}, around[step * number].floor
        names = pairs(sequence.true_people[step * number][1], frames[step * number][1])
        for person, body in zip(persons, bodies):
            if person.id in names and person.floor and place[names[person.id]]:
                truth = place[names[person.id]]
                away.append(np.linalg.norm(person.floor.position - truth.position))
                heights.append(abs(body.floor.position @ plane[:3] + plane[3]))
                forward, ahead = Rotation.from_quat([person.floor.orientation, truth.orientation]).apply([1, 0, 0])
                if person.body is not None:
                    turned.append(np.degrees(np.arccos(np.clip(forward @ ahead, -1, 1))))
    print(f'places on the floor: {len(away)}, median and 90 % ' + '; '.join(
        f'{name} {np.median(errors):.3f}, {np.percentile(errors, 90):.3f} {unit}' for name, errors, unit in (
            ('off by', away, 'm'), ('floor by the body', heights, 'm'), ('turned by', turned, 'deg')) if errors))


def tell(sequence: Truth, frames: Frames, step: int, script: Optional[Path]) -> Tuple[float, float, float]:
    """Print what is told of a sequence; return its length [s], how many false gestures, and seconds per person."""
    begin = time.perf_counter()
    signals = read_signals(sequence, frames, step)
    cost = (time.perf_counter() - begin) / max(sum(len(persons) for _, persons in signals), 1)
    print(f'\n{sequence.folder}')
    false = 0
    if sequence.labelled:
        tell_labelled(sequence, frames, signals, step, script)
    else:
        true = intervals(read_signals(sequence, sequence.true_people, step))
        rows: List[List[object]] = [['gesture', 'arm', 'begin [s]', 'end [s]', 'true joints too']]
        for start, end, _, name, arm in intervals(signals):
            also = any(name == other[3] and other[0] - NEAR <= end and other[1] + NEAR >= start for other in true)
            false += not also
            rows.append([name, arm, f'{start:.2f}', f'{end:.2f}', 'yes' if also else 'no'])
        print(markdown(rows) if len(rows) > 1 else 'no gesture')
    for posture, (same, unknown, other) in sorted(posture_rows(sequence, frames, signals).items()):
        print(f'{posture}: right {same}, unknown {unknown}, other {other}: {same / (same + unknown + other):.3f}')
    falls = {(person.id, person.fall) for _, persons in signals for person in persons if person.fall}
    tell_floor(sequence, frames, step)
    for name, fall in falls:
        print(f'fall of {name}: lying since {fall.stamp:.2f} s, after {fall.duration:.2f} s, {fall.speed:.1f} m/s')
    return signals[-1][0] - signals[0][0], false, cost


def tell_labelled(sequence: Truth, frames: Frames, signals: Signals, step: int, script: Optional[Path]) -> None:
    """Print scores of labels, latencies, and how right the rays are."""
    if script:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'labels.csv'
            write_labels(path, frames, signals)
            subprocess.run([sys.executable, str(script), str(sequence.folder), str(path), '--margin', str(MARGIN)],
                           check=True)
    rows, errors = label_rows(sequence, frames, signals)
    print(markdown([['person', 'label', 'begins [s]', 'told after [s]'], *rows]))
    answered = np.array(errors)[np.isfinite(errors)]
    print(f'rays: {len(answered)} of {len(errors)} frames, median {np.median(answered):.1f} deg, within 15 deg '
          f'{(answered <= 15).mean():.2f} of these, {(answered <= 15).sum() / len(errors):.2f} of all')
    targets = tuple(Target(name, np.array(place['camera'])) for name, place in sequence.truth['targets'].items())
    known = read_signals(sequence, frames, step, [Surroundings(targets)] * len(frames))
    print('known targets hit:', hits(sequence, frames, known), 'frames; points of the cloud at the target:',
          hits(sequence, frames, read_signals(sequence, frames, step, clouds(sequence))), 'frames')


def main() -> None:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_settings('of the chain')
    parser.add_argument('--evaluate', type=Path, help='script that scores labels')
    parser.add_argument('--step', type=int, default=1, help='take every so many-th frame')
    arguments = parser.parse_args()
    with errors_end_the_program():
        found = detect(arguments.sequences, parser.settings(arguments.set))
        told = [tell(read_truth(folder), found[str(folder)], arguments.step, arguments.evaluate)
                for folder in arguments.sequences]
    seconds, false, cost = np.array(told).T
    print(f'\nfalse gestures: {false.sum():.0f} in {seconds.sum():.1f} s, {60 * false.sum() / seconds.sum():.2f} '
          f'per minute\n{1e3 * np.median(cost):.2f} ms per person and frame')


if __name__ == '__main__':
    main()
