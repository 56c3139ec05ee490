"""People of successive frames: ids, gaps, hidden joints, other skeletons."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import LYING, STANDING, UP, Limb, Pose, held, joints_of, people_of, without
from openpose_ros_pkg.skeletons import BODY_25, COCO_18
from openpose_ros_signals.reader import SignalReader, forward_view, nearest_first
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.transform import IDENTITY, UPRIGHT

RAISED = STANDING.with_arm('right', Limb((0.2, 0.1, 1.0), (0.1, 0.0, 1.0)))
LEFT, RIGHT = (0.0, 1.5), (0.0, -1.5)


def read(poses_at, ids_at, seconds=3.0, rate=10, up=UP, turn=None):
    """Return the signals by stamp: poses and ids are functions of time."""
    reader, random = SignalReader(), np.random.RandomState(0)
    result = {}
    for number in range(int(seconds * rate) + 1):
        stamp = number / rate
        people = people_of(poses_at(stamp), ids_at(stamp), random)
        if turn is not None:
            people = replace(people, xyz=people.xyz @ turn.T)
        result[stamp] = reader.update(people, stamp, up)
    return result


def test_any_direction_may_be_up():
    camera = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])  # z forward, y down
    person = read(lambda _: [RAISED], lambda _: [1], up=np.array([0.0, -2.0, 0.0]), turn=camera)[3.0][0]
    assert person.posture.name == 'standing' and person.gesture('raise_hand').arm == 'right'
    assert person.body.direction == pytest.approx([0, 0, 1], abs=0.1)


def test_a_new_id_in_the_same_place_is_a_new_person():
    signals = read(lambda _: [RAISED], lambda stamp: [1 if stamp < 1.55 else 2])
    assert (signals[1.6][0].posture.name, signals[1.6][0].walk) == ('unknown', None)
    since = {(people[0].id, people[0].gesture('raise_hand').since) for stamp, people in signals.items()
             if people[0].gesture('raise_hand')}
    assert sorted(name for name, _ in since) == [1, 2] and max(since)[1] >= 1.6


def test_a_person_hidden_by_a_passer_by_goes_on():
    def poses(stamp):
        passes = replace(STANDING, place=(-0.8, 1.2 * (stamp - 1.6)))
        return [passes] if 1.4 < stamp < 1.75 else [passes, RAISED]

    signals = read(poses, lambda stamp: [2, 1][:len(poses(stamp))])
    gestures = [person.gesture('raise_hand') for stamp, people in signals.items() if stamp > 0.5
                for person in people[1:]]
    assert all(gestures) and len({gesture.since for gesture in gestures}) == 1
    assert not any(people[0].gestures for people in signals.values())


def test_a_new_id_where_a_person_fell_did_not_fall():
    falls = held((0, STANDING), (1, STANDING), (1.5, LYING))
    told = [people[0] for stamp, people in read(
        lambda stamp: [falls(stamp)], lambda stamp: [1 if stamp < 3 else 2], 7.0).items() if stamp >= 2]
    assert [person.fall is not None for person in told] == [person.id == 1 for person in told]


@pytest.mark.parametrize('gap, kept', [(0.5, True), (1.5, False)])
def test_a_person_that_was_away_for_long_begins_anew(gap, kept):
    def ids(stamp):
        return [] if 1.0 < stamp < 1.0 + gap else [1]
    signals = read(lambda stamp: [STANDING] * len(ids(stamp)), ids, 4)
    back = min(stamp for stamp in signals if stamp > 1.0 and signals[stamp])
    assert (signals[back][0].posture.name == 'standing') is kept


@pytest.mark.parametrize('frames, there', [
    ([(5.0, [1]), (5.5, [1, 2]), (6.0, [2]), (6.5, [2])], [(2, 5.5)]), ([(5.0, [1, 2]), (5.1, [])], []),
    ([(5.0, [2]), (5.1, []), (5.9, [2])], [(2, 5.0)]), ([(5.0, [1, 2]), (5.9, []), (6.1, [2])], [(2, 6.1)]),
    ([(5.0, [1]), (5.1, [3])], [(3, 5.1)]), ([(100.0, [1, 2]), (99.9, [1])], [(1, 99.9)])],
    ids=['one is gone', 'all are gone', 'was away for less than a second', 'was away for longer',
         'a new id in the same place', 'time jumps back'])
def test_people_of_the_last_frame_and_since_when(frames, there):
    reader, random = SignalReader(), np.random.RandomState(0)
    assert reader.present == ()
    for stamp, ids in frames:
        reader.update(people_of([Pose(place=RIGHT if name == 2 else LEFT) for name in ids], ids, random), stamp, UP)
    assert [(present.signals.id, present.since) for present in reader.present] == there


def test_missing_joints_and_people_are_no_trouble():
    reader, random = SignalReader(), np.random.RandomState(0)
    people = people_of([STANDING], [1], random)
    for joint in COCO_18.joints:
        reader.update(without(people, [joint]), 0.0, UP)
    assert reader.update(People3D.empty(COCO_18), 0.05, UP) == ()
    person, = reader.update(without(people, COCO_18.joints), 0.1, UP)
    assert person.posture.name == 'unknown' and person.gestures == () and person.hidden_arms == ('left', 'right')
    assert person.body is None and person.head is None and np.isnan(person.place).all()


def read_again(people):
    """Return the signals of people who are the same in six frames."""
    reader = SignalReader()
    return [reader.update(people, number / 10, UP) for number in range(6)][-1]


@pytest.mark.parametrize('skeleton, sigma', [(BODY_25, 0.03), (COCO_18, np.nan)],
                         ids=['another skeleton', 'unknown errors'])
def test_joints_are_read_by_their_names_also_with_unknown_errors(skeleton, sigma):
    joints = dict(zip(COCO_18.joints, joints_of(RAISED)))
    xyz = np.array([[joints.get(name, np.full(3, np.nan)) for name in skeleton.joints]])
    status = np.where(np.isfinite(xyz[..., 0]), MEASURED, MISSING)
    person, = read_again(People3D(skeleton, xyz, status, status, np.where(status, sigma, np.nan), [1]))
    assert person.posture.name == 'standing' and person.gesture('raise_hand')


def test_people_whose_joints_are_all_inferred_do_what_their_keypoints_say():
    xyz = np.array([joints_of(RAISED)])
    told, far = np.ones(xyz.shape[:2]), np.full(xyz.shape[:2], 0.4)  # sigma of a person at an unsure distance
    person, = read_again(People3D(COCO_18, xyz, told, np.full(told.shape, INFERRED), far, [1]))
    assert person.posture.name == 'standing' and person.gesture('raise_hand')
    far[:, COCO_18.index['right_wrist']] = 0.6  # and a joint that is unsure against the others
    person, = read_again(People3D(COCO_18, xyz, told, np.full(told.shape, INFERRED), far, [1]))
    assert person.posture.name == 'standing' and not person.gesture('raise_hand')
    person, = read_again(People3D(COCO_18, xyz, 0 * told, np.full(told.shape, INFERRED), far, [1]))
    assert person.posture.name == 'unknown'  # hidden altogether


def test_the_nearest_person_is_the_first():
    """From a robot at (1, 0) that looks to y and leans forwards; a person without a known place is the last."""
    lean = np.radians(20.0)
    robot = (np.array([[0.0, -1.0, 0.0], [np.cos(lean), 0.0, np.sin(lean)], [-np.sin(lean), 0.0, np.cos(lean)]]),
             np.array([1.0, 0.0, 0.5]))
    reader = SignalReader()
    people = people_of([replace(STANDING, place=place) for place in ((9, 9), (1, 3), (0, 0), (2, 1))], [1, 2, 3, 4],
                       np.random.RandomState(1))
    hidden = np.arange(4)[:, np.newaxis] == 0
    people = replace(people, xyz=np.where(hidden[..., np.newaxis], np.nan, people.xyz),
                     status=np.where(hidden, MISSING, people.status), sigma=np.where(hidden, np.nan, people.sigma))
    reader.update(people, 0.0, UP)
    found = nearest_first(reader.present, robot, UP)
    assert [each.signals.id for each in found] == [3, 4, 2, 1]
    np.testing.assert_allclose([each.distance for each in found], [1, 2 ** 0.5, 3, np.nan], atol=0.06)
    np.testing.assert_allclose([each.bearing for each in found], [np.pi / 2, -np.pi / 4, 0, np.nan], atol=0.06)
    unknown = nearest_first(reader.present, None, UP)
    assert [each.signals.id for each in unknown] == [1, 2, 3, 4]
    assert np.isnan([each.distance for each in unknown]).all()


@pytest.mark.parametrize('camera, up', [
    ((UPRIGHT.T, np.zeros(3)), UP), (IDENTITY, UP), (IDENTITY, np.array([0.0, -1.0, 0.0])),
    (IDENTITY, np.array([0.0, -0.5, -0.75 ** 0.5]))], ids=['level', 'upright', 'optical', 'tilted by 60 degrees'])
def test_without_a_robot_the_camera_looks_forwards(camera, up):
    (rotation, place), optical = forward_view(camera, up), up[2] < 0.9
    np.testing.assert_allclose(rotation[:, 0], [0, 0, 1] if optical else [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(rotation[:, 1], [-1, 0, 0] if optical else [0, 1, 0], atol=1e-9)
    assert place.tolist() == [0, 0, 0]
