"""Postures, gestures and pointing."""
import json
from dataclasses import replace
from pathlib import Path
from typing import List, Tuple

import numpy as np

from chain_runs import Frames, camera_poses
from ground_truth import true_frames
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import PersonSignals
from results import NeedsDataError, Options, Section, Table, scenes_with
from results.counting import count, people_of
from scoring.counts import Counts, blocks_of
from scoring.figures import Ratio, few_scenes, figures
from scoring.signals import LABELS, MARGIN, STATISTICS, Label, Person, score_signals
from skeleton_extract_3d.points.transform import transform_people

POINTING = 'f1', 'arm', 'point_given', 'point_15', 'point_median', 'eye_sigmas_2', 'shoulder_sigmas_2'
FALSE = {'false_per_minute': Ratio('gestures per minute of a scene that the true joints do not make',
                                   lambda counts: 60 * counts.sums['false'], lambda counts: counts.sums['seconds'],
                                   digits=2)}
LABEL_OF_POSTURE = {'standing': 'stand', 'sitting': 'sit'}
# Gestures of true joints this near are the same [s].
NEAR = 0.5

Signals = List[Tuple[float, Tuple[PersonSignals, ...]]]


def measure(options: Options) -> Section:
    """Run the signals on what mode balanced finds in scenes with labels, and in those without.

    Scenes with labels are among the rendered ones, or in --data signals=FOLDER.
    """
    plain = [false_gestures(folder, each) for folder, each in zip(options.scenes, count(options, {'mode': 'balanced'}))
             if 'targets' not in json.loads((folder / 'gt.json').read_text())]
    named = figures(plain, FALSE)
    tables = [Table('Gestures that are not made', [['', 'figure'], *([each.text, each] for each in named.values())])]
    counts, blocks = [], []
    try:
        folders = scenes_with(options, 'signals', 'targets')
        for folder, each in zip(folders, count(replace(options, scenes=folders, quick=False), {'mode': 'balanced'})):
            people = people_of(folder, each)
            labels = labels_of(people, signals_of(people, camera_poses(folder)))
            counts.append(score_signals(folder, labels))
            blocks += [score_signals(folder, labels, part=block) for block in blocks_of(folder)]
    except NeedsDataError:
        print('signals: scenes with labels are missing: --data signals=FOLDER')
    labelled = few_scenes(counts, blocks, STATISTICS) if counts else {}
    if counts:
        tables = [Table('Labels', [['label', 'F1', 'frames'], *([name, labelled[f'f1_{name}'], int(sum(
            each.sums[f'right_{name}'] + each.sums[f'missed_{name}'] for each in counts))] for name in LABELS)]),
                  Table('Gestures', [['', 'figure'], *([labelled[name].text, labelled[name]] for name in POINTING)]),
                  *tables]
    return Section(f'{len(counts)} scenes with labels, {len(plain)} without, mode balanced; a label counts in each '
                   f'frame, without those within {MARGIN:g} s of its beginning or end. Pointing: angle between the ray '
                   'and the true target; frames without a ray count as wrong. In scenes without labels, gestures are '
                   'compared with those of the true joints, within half a second. Intervals of labels: bootstrap over '
                   'scenes, of less than five over their seconds.', {**named, **labelled}, tables)


def signals_of(frames: Frames, poses: np.ndarray) -> Signals:
    """Return the signals of people, by the camera's poses (F, 4, 4); in the world where it moves, else in its frame."""
    reader, signals, moves = SignalReader(), [], bool((poses != poses[0]).any())
    for (stamp, people), pose in zip(frames, poses):
        if moves:
            people = transform_people(people, pose[:3, :3], pose[:3, 3])
        signals.append((stamp, reader.update(people, stamp, np.array([0.0, 0.0, 1.0]) if moves else pose[2, :3])))
    return signals


def labels_of(frames: Frames, signals: Signals) -> List[Tuple[float, List[Person]]]:
    """Return the labels of people, as they are scored."""
    labels: List[Tuple[float, List[Person]]] = []
    for (stamp, people), (_, persons) in zip(frames, signals):
        labels.append((stamp, []))
        for person in persons:
            name = LABEL_OF_POSTURE.get(person.posture.name)
            own = {name: Label()} if name else {}
            for gesture in person.gestures:
                arm, pointing = gesture.arm.replace('both', ''), gesture.pointing
                rays = [Label(arm, ray.origin, ray.direction, ray.sigma) for ray in (
                    () if pointing is None else (pointing, pointing.eye_ray, pointing.arm_ray))]
                own[gesture.name] = Label(arm) if not rays else rays[0]._replace(
                    styles=dict(zip(('eye', 'shoulder'), rays[1:])))
            neck = people.xyz[people.ids.tolist().index(person.id), COCO_18.index['neck']]
            labels[-1][1].append(Person(neck, own))
    return labels


def intervals(signals: Signals) -> List[Tuple[float, float, int, str, str]]:
    """Return begin, end, person, gesture and arm of all gestures."""
    rows, since = [], {}
    for stamp, persons in [*signals, (signals[-1][0], ())]:
        made = {(person.id, gesture.name, gesture.arm) for person in persons for gesture in person.gestures}
        rows += [(since.pop(key), stamp, *key) for key in set(since) - made]
        for key in made:
            since.setdefault(key, stamp)
    return sorted(rows)


def false_gestures(folder: Path, counts: Counts) -> Counts:
    """Return the seconds of a scene, and the number of gestures that its true joints do not make."""
    people, poses = people_of(folder, counts), camera_poses(folder)
    true = intervals(signals_of([(frame.time, frame.people) for frame in true_frames(folder)], poses))
    false = sum(not any(name == other[3] and other[0] - NEAR <= end and other[1] + NEAR >= start for other in true)
                for start, end, _, name, _ in intervals(signals_of(people, poses)))
    return Counts(counts.scene, counts.tags, {'false': false, 'seconds': people[-1][0] - people[0][0]}, {})
