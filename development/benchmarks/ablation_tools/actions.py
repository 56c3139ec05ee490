"""For the ablation of the signals: simulated people who do things, sequences with labels, counts of what is told."""
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Tuple

import numpy as np

from ablation_tools.changes import Counts, Sums, counted
from animated_skeleton import (
    BENT_OVER,
    CROSS_LEGGED,
    CROUCHING,
    KNEELING,
    LYING,
    ON_ALL_FOURS,
    ON_ONE_KNEE,
    RUNNING,
    SITTING,
    SITTING_ON_FLOOR,
    STANDING,
    UP,
    Limb,
    Pose,
    held,
)
from chain_runs import read_truth
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.constants import SignalConstants
from openpose_ros_signals.geometry import body_of, joints_of, stature_of
from openpose_ros_signals.person import BodyObservation, Person, Surroundings
from openpose_ros_signals.postures import posture_degrees
from openpose_ros_signals.reader import SignalReader, _observations
from openpose_ros_signals.records import UNKNOWN, PersonSignals
from openpose_ros_tools.alignment.people import pair_people
from scoring.signals import MARGIN, _angle, _changes
from simulated_population import BEGIN, END, GESTURES, NEARLY, arm_of, gestures, nearly, seen_of
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.points.transform import transform_people

Random = np.random.RandomState
Clip = List[Tuple[float, BodyObservation]]
_NOTHING = Surroundings()
# Postures are told from then on [s].
SETTLED = 0.4
SAME_PERSON = 0.6
GESTURE_LABELS = ('wave', 'point', 'raise_hand', 'arms_crossed', 'beckon', 'stop')
# Pointing is right within this angle [deg].
RIGHT_RAY = 15.0
WIDE_STEP = Pose(left_leg=Limb((0, 0.5, -1), (0, 0.2, -1)), right_leg=Limb((0, -0.4, -1), (0, -0.8, -0.8)))
ON_A_BED = replace(LYING, left_leg=Limb((0, 1, 0), (0, 0, -1)), right_leg=Limb((0, 1, 0), (0, 0, -1)))
ON_THE_BELLY = Pose(left_leg=Limb((0, -1, 0), (0, -1, 0)), right_leg=Limb((0, -1, 0), (0, -1, 0)), lean=90.0)
KNEES_UP = replace(LYING, left_leg=Limb((0, 0.6, 0.8), (0, 0.6, -0.8)), right_leg=Limb((0, 0.6, 0.8), (0, 0.6, -0.8)))
FOOT_ON_A_STEP = replace(STANDING, right_leg=Limb((0, 0.9, -0.4), (0, -0.1, -1)))
FOOT_HELD_BEHIND = replace(STANDING, right_leg=Limb((0, -0.1, -1), (0, -0.6, 0.7)))
POSES = {'standing': (STANDING, BENT_OVER, WIDE_STEP, RUNNING, FOOT_ON_A_STEP, FOOT_HELD_BEHIND),
         'sitting': (SITTING, SITTING_ON_FLOOR, CROSS_LEGGED), 'crouching': (CROUCHING, replace(CROUCHING, lean=60.0)),
         'kneeling': (KNEELING, ON_ONE_KNEE, ON_ALL_FOURS), 'lying': (LYING, ON_A_BED, ON_THE_BELLY, KNEES_UP)}


def clip_of(seen: Iterator[Tuple[float, People3D]]) -> Clip:
    """Return the observations of the one person of frames."""
    return [(stamp, _observations(people, joints_of(people), Landmarks3D.empty())[0]) for stamp, people in seen]


def told(clip: Clip, constants: SignalConstants) -> List[Tuple[float, PersonSignals]]:
    """Return what is told of a person."""
    person = Person(clip[0][0], constants)
    return [(stamp, person.read(1, stamp, seen, UP, _NOTHING)) for stamp, seen in clip]


def blinking(seen: Iterator[Tuple[float, People3D]], arm: str, random: Random) -> Iterator[Tuple[float, People3D]]:
    """Yield the frames; in some clips a joint of an arm is hidden for a moment, and inferred somewhere near."""
    begin = random.uniform(BEGIN + 0.8, END - 0.4) if random.rand() < 0.4 else np.inf
    end = begin + random.uniform(0.1, 0.35)
    hidden = np.array([name == f'{arm}_{random.choice(["wrist", "elbow"])}' for name in COCO_18.joints])
    for stamp, people in seen:
        if begin <= stamp <= end:
            xyz = people.xyz + np.where(hidden[:, np.newaxis], random.normal(0, 0.15, people.xyz.shape), 0)
            people = replace(people, xyz=xyz, status=np.where(hidden, INFERRED, people.status),
                             sigma=np.where(hidden, 0.25, people.sigma))
        yield stamp, people


def varied(pose: Pose, random: Random) -> Pose:
    """Return a pose as another person holds it."""
    def limb(one: Limb) -> Limb:
        return Limb(*(tuple(np.array(way) / np.linalg.norm(way) + random.normal(0, 0.08, 3))
                      for way in (one.upper, one.lower)))
    return replace(pose, left_leg=limb(pose.left_leg), right_leg=limb(pose.right_leg),
                   lean=pose.lean + random.normal(0, 6), facing=random.uniform(0, 360))


def _gesture_clips(count: int) -> List[Tuple[str, str, Clip]]:
    found = []
    for name in GESTURES:
        random = Random(11)
        for _ in range(count):
            motion = gestures(name, random)
            arm = arm_of(motion)
            clip = clip_of(blinking(seen_of(motion, random), arm, random))
            found.append((name, 'both' if name == 'arms_crossed' else arm, clip))
    return found


def count_gesture(sums: Sums, unit: Tuple[str, str, Clip], constants: SignalConstants) -> None:
    """Count what is told of a gesture: frames, delay [s], and whether another one is told."""
    name, arm, clip = unit
    signals = told(clip, constants)
    right = [(stamp, any((one.name, one.arm) == (name, arm) for one in person.gestures)) for stamp, person in signals]
    held_frames = [one for stamp, one in right if BEGIN + 0.8 < stamp < END]
    sums.add('gestures', sum(held_frames), len(held_frames))
    first = next((stamp for stamp, one in right if one and stamp > BEGIN - 0.3), END)
    sums.add('delay', min(max(first - BEGIN, 0), END - BEGIN), 1)
    sums.add('other gesture', any((one.name, one.arm) != (name, arm)
                                  for _, person in signals for one in person.gestures), 1)


def _nearly_clips(count: int) -> List[Clip]:
    found = []
    for name in NEARLY:
        random = Random(12)
        found += [clip_of(seen_of(nearly(name, random), random, 5.0)) for _ in range(count)]
    return found


def count_nearly(sums: Sums, clip: Clip, constants: SignalConstants) -> None:
    """Count whether a gesture, or a fall, is told falsely of a person."""
    signals = told(clip, constants)
    sums.add('false gesture', any(person.gestures for _, person in signals), 1)
    sums.add('false fall', any(person.fall for _, person in signals), 1)


def _posture_clips(count: int) -> List[Tuple[str, Clip]]:
    found = []
    for name, poses in POSES.items():
        random = Random(13)
        found += [(name, clip_of(seen_of(held((0, varied(pose, random))), random, 1.2)))
                  for pose in poses for _ in range(count)]
    return found


def count_posture(sums: Sums, unit: Tuple[str, Clip], constants: SignalConstants) -> None:
    """Count frames with the right posture, and with a wrong one."""
    name, clip = unit
    names = [person.posture.name for stamp, person in told(clip, constants) if stamp > SETTLED]
    sums.add('posture', names.count(name), len(names))
    sums.add('wrong posture', len(names) - names.count(name) - names.count(UNKNOWN), len(names))


def _fall_clips(count: int) -> List[Tuple[bool, Clip]]:
    found = []
    random = Random(14)
    for _ in range(3 * count):
        before, facing = (STANDING, SITTING, STANDING)[random.randint(3)], random.uniform(0, 360)
        pose, flat = (replace(varied(one, random), facing=facing)
                      for one in (before, (ON_THE_BELLY, LYING)[random.randint(2)]))
        takes = random.uniform(0.45, 1.0)
        found.append((True, clip_of(seen_of(held((0, pose), (1, pose), (1 + takes, flat)), random, 3.0))))
        # lies down slowly, lies back from the floor, bends over
        slow = random.uniform(2.8, 4.5)
        sits = replace(SITTING_ON_FLOOR, lean=-10.0, facing=facing)
        lies = replace(LYING, facing=facing)
        for motion, seconds in ((held((0, pose), (0.5, pose), (0.5 + slow, lies)), 6.0),
                                (held((0, sits), (0.8, sits), (0.8 + takes, lies)), 3.0),
                                (held((0, pose), (0.8, pose), (0.8 + takes, replace(pose, lean=85.0))), 3.0)):
            found.append((False, clip_of(seen_of(motion, random, seconds))))
    return found


def count_fall(sums: Sums, unit: Tuple[bool, Clip], constants: SignalConstants) -> None:
    """Count falls that are told, once, and false ones."""
    falls, clip = unit
    stamps = {person.fall.stamp for _, person in told(clip, constants) if person.fall}
    sums.add('falls', falls and len(stamps) == 1, falls)
    sums.add('false falls', not falls and len(stamps) > 0, not falls)


def _walk_clips(count: int) -> List[Tuple[bool, Clip]]:
    random, found = Random(15), []
    for _ in range(2 * count):
        found.append((True, clip_of(seen_of(nearly('walks', random), random, END))))
        swaying = held(*((0.5 * number, replace(STANDING, lean=random.uniform(-5, 5))) for number in range(9)))
        found.append((False, clip_of(seen_of(swaying, random, END))))
        name = GESTURES[random.randint(len(GESTURES))]
        found.append((False, clip_of(seen_of(gestures(name, random), random, END))))
    return found


def count_walk(sums: Sums, unit: Tuple[bool, Clip], constants: SignalConstants) -> None:
    """Count frames of walking people who are told to walk, and of others."""
    walks, clip = unit
    moving = [bool(person.walk and person.walk.moving) for stamp, person in told(clip, constants) if stamp > 0.7]
    sums.add('walking' if walks else 'false walking', sum(moving), len(moving))


def _place_clips(count: int) -> List[Clip]:
    """Return people who hold postures, their trunk above the origin."""
    random = Random(16)
    return [clip_of(seen_of(held((0, varied(pose, random))), random, 1.2))
            for pose in (STANDING, SITTING, LYING, KNEELING, CROUCHING) for _ in range(count)]


def count_place(sums: Sums, clip: Clip, constants: SignalConstants) -> None:
    """Sum the errors of the height of the floor, by the body alone [m]."""
    signals = told(clip, constants)
    sums.add('floor', sum(abs(person.floor.position[2]) for _, person in signals), len(signals))


def suites(count: int) -> Dict[str, Callable[[SignalConstants], Counts]]:
    """Return what counts for constants, by name; with a number of people of each kind."""
    units = {'gestures': (count_gesture, _gesture_clips), 'nearly': (count_nearly, _nearly_clips),
             'postures': (count_posture, _posture_clips), 'falls': (count_fall, _fall_clips),
             'walks': (count_walk, _walk_clips), 'places': (count_place, _place_clips)}
    return {name: partial(counted, add, clips(count)) for name, (add, clips) in units.items()}


def scene_of(folder: Path, found: List[Tuple[float, People3D]], poses: np.ndarray) -> Dict[str, Any]:
    """Return frames of a sequence: stamp, people in a frame that stands still, up, and by true id its truth.

    Postures are those of the true joints, by the constants as they are.
    """
    truth, order = read_truth(folder)
    moves, frames = bool((poses != poses[0]).any()), []
    for (stamp, people), frame, pose in zip(found, truth['frames'], poses):
        joints = np.array([person['xyz'] for person in frame['people']], float).reshape(-1, len(order), 3)[:, order]
        pairs = dict(pair_people(people.xyz, joints, SAME_PERSON))
        up = pose[2, :3]
        names = []
        for one in joints:
            own = (one, np.full(len(order), MEASURED), np.full(len(order), 0.02))
            posture, degree = max(posture_degrees(body_of(stamp, own, up, stature_of(*own[:2]))).items(),
                                  key=lambda item: np.nan_to_num(item[1]))
            names.append(posture if degree > 0.8 else '')
        if moves:
            people, up = transform_people(people, pose[:3, :3], pose[:3, 3]), np.array([0.0, 0.0, 1.0])
        frames.append((stamp, people, up, pairs, frame['people'], names, None if moves else pose))
    labelled = any('labels' in person for frame in truth['frames'] for person in frame['people'])
    return {'frames': frames, 'labelled': labelled, 'changes': _changes(truth['frames']) if labelled else {}}


def count_scene(sums: Sums, scene: Dict[str, Any], constants: SignalConstants) -> None:
    """Count what is told in a sequence: labels (F1), rays within 15 degrees, postures; gestures without labels."""
    reader = SignalReader(constants)
    for stamp, people, up, pairs, truth, names, pose in scene['frames']:
        persons = reader.update(people, stamp, up)
        for row, person in ((row, person) for row, person in enumerate(persons) if row in pairs):
            true, posture = truth[pairs[row]], names[pairs[row]]
            if posture:
                sums.add('scene posture', person.posture.name == posture, 1)
                sums.add('scene wrong posture', person.posture.name not in (UNKNOWN, posture), 1)
            names_told = {gesture.name for gesture in person.gestures}
            if not scene['labelled']:
                sums.add('unlabelled', len(names_told) > 0, 1)
                continue
            for label in GESTURE_LABELS:
                if any(abs(stamp - at) < MARGIN for at in scene['changes'].get((true['id'], label), ())):
                    continue
                holds, is_told = label in true['labels'], label in names_told
                for name in ('labels', label):
                    sums.add(name, 2 * (holds and is_told), holds + is_told)
        if scene['labelled'] and pose is not None:
            told_by = {pairs[row]: person.gesture('point') for row, person in enumerate(persons) if row in pairs}
            for number, detail in ((number, detail) for number, true in enumerate(truth)
                                   for detail in true.get('detail', ()) if detail['label'] == 'point'):
                gesture = told_by.get(number)
                angle = _angle(gesture and gesture.pointing, np.array(detail['target']))
                sums.add('ray 15', angle <= RIGHT_RAY, 1)
