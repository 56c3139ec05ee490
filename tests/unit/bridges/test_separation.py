"""Separation: the least distance of people from links, and the bound below it, by each source of uncertainty."""
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from animated_skeleton import ADULT, Pose, people_of, without
from capsule_rows import rows
from openpose_ros_bridges.capsules import CAPSULES, CapsuleConstants, capsules_of
from openpose_ros_bridges.guard import View
from openpose_ros_bridges.moving_parts import Links, spheres_of, tail
from openpose_ros_bridges.node_params import SeparationParams
from openpose_ros_bridges.separation import CONSTANTS, SeparationEstimator
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import BODY
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel

PARAMS = SeparationParams(feet=False)
NONE = People3D.empty(COCO_18)
# A link stands so far before a person at the origin [m].
AHEAD = 2.0
# Hands that are known to be straight.
STRAIGHT_HANDS = CapsuleConstants(hand_bend=0.0)


def person(sigma=0.0, name=7, velocity=(0.0, 0.0, 0.0), place=(0.0, 0.0)):
    """Return a person who stands and faces x, with the same sigma and velocity of all joints."""
    people = people_of([Pose(place=place)], [name], np.random.RandomState(1))
    return replace(people, sigma=np.full((1, 18), sigma), velocity=np.broadcast_to(velocity, (1, 18, 3)))


def link(*centres, radius=0.1, away=0.0):
    centres = centres or ((AHEAD, 0.0, 1.25),)
    return Links([f'link_{number}' for number in range(len(centres))], np.array(centres), np.full(len(centres), radius),
                 np.full(len(centres), away))


def truth(people, links):
    """Return the distance of links from the capsules of people, by brute force."""
    shares = np.linspace(0, 1, 501)[:, np.newaxis]
    return min(float(np.linalg.norm((1 - shares) * capsule.ends[0] + shares * capsule.ends[1] - centre, axis=1).min())
               - capsule.radius - radius for capsule in rows(capsules_of(people))
               for centre, radius in zip(links.centres, links.radii))


def seen(people, params=PARAMS, at=0.0, links=None, **how):
    """Return the separation `at` seconds after the only frame."""
    estimator = SeparationEstimator(params, **how)
    estimator.take(people, 10.0)
    return estimator.at(10.0 + at, links or link())


def test_before_the_first_frame_nothing_is_known():
    found = SeparationEstimator(PARAMS).at(10.0, link())
    assert math.isnan(found.distance) and math.isnan(found.age)
    assert (found.bound, found.people, found.person) == (0.0, 0, 0)
    assert found.reason


def test_without_people_it_is_infinite():
    found = seen(NONE)
    assert (found.distance, found.bound, found.people, found.reason) == (math.inf, math.inf, 0, '')
    assert found.age == 0.0


@pytest.mark.parametrize('centre', [(AHEAD, 0.0, 1.25), (0.3, 0.6, 0.9), (-1.0, 0.0, 2.5), (0.0, -3.0, 0.0)])
def test_without_errors_the_bound_is_the_distance(centre):
    people, links = person(), link(centre)
    found = seen(people, links=links, capsules=STRAIGHT_HANDS)
    assert found.distance == pytest.approx(truth(people, links), abs=1e-4)
    assert found.bound == pytest.approx(found.distance, abs=1e-4)
    assert (found.person, found.people, found.age, found.status, found.reason) == (7, 1, 0.0, MEASURED, '')


def test_a_link_in_a_person_is_at_zero():
    found = seen(person(), links=link((0.0, 0.0, 1.2)))
    assert (found.distance, found.bound) == (0.0, 0.0)
    assert found.person == 7


def test_the_pair_is_named():
    people = person()
    wrist = people.xyz[0, COCO_18.index['left_wrist']].astype(float)
    found = seen(people, links=link((5.0, 5.0, 1.0), tuple(wrist + np.array([0.0, 0.3, -0.1]))))
    assert (found.link, found.part) == ('link_1', 'left_hand')


@pytest.mark.parametrize('change', [
    {'sigma': 0.05}, {'sigma': 0.10}, {'at': 0.1}, {'at': 0.3}, {'velocity': (1.0, 0.0, 0.0), 'at': 0.1},
    {'velocity': (np.nan,) * 3, 'at': 0.1}, {'sigma': np.nan}])
def test_each_error_lowers_the_bound(change):
    change = dict(change)
    at = change.pop('at', 0.0)
    certain, found = seen(person()), seen(person(**change), at=at)
    assert 0 < found.bound < certain.bound - 0.005
    assert found.age == pytest.approx(at)


def test_the_bound_falls_with_sigma_age_and_probability():
    def bounds(values, of):
        return np.diff([of(value).bound for value in values])
    assert (bounds([0.0, 0.01, 0.05, 0.1, 0.2], lambda sigma: seen(person(sigma))) < 0).all()
    assert (bounds([0.0, 0.05, 0.1, 0.2, 0.4, 0.8], lambda at: seen(person(0.03), at=at)) < 0).all()
    assert (bounds([0.5, 0.9, 0.99, 0.999], lambda probability: seen(
        person(0.03), replace(PARAMS, probability=probability))) < 0).all()


def test_guessed_joints_widen_it():
    people = person(0.05)
    guessed = seen(replace(people, status=np.full((1, 18), INFERRED)))
    assert guessed.bound < seen(people).bound - 0.02
    assert guessed.status == INFERRED


def test_the_distance_is_where_people_are_by_now():
    still, walks = seen(person(), at=0.2), seen(person(velocity=(1.0, 0.0, 0.0)), at=0.2)
    assert walks.distance == pytest.approx(still.distance - 0.2, abs=2e-3)
    # and not further than the motion is known
    assert seen(person(velocity=(1.0, 0.0, 0.0)), at=0.9).distance == pytest.approx(still.distance - 0.5, abs=5e-3)


def test_nothing_moves_faster_than_people_walk_and_reach():
    """A velocity of which nothing is known lets no part come nearer than its greatest speed."""
    fast = seen(person(velocity=(np.nan,) * 3), at=0.3)
    assert seen(person()).bound - (CONSTANTS.walking + CONSTANTS.limbs) * 0.3 - 1e-5 <= fast.bound


def test_a_missing_arm_is_anywhere_within_reach():
    people, links = person(), link((0.0, AHEAD, 1.4))
    armless = without(people, ('left_wrist', 'left_elbow'))
    found = seen(armless, links=links)
    assert (found.status, found.part) == (MISSING, 'left_hand')
    shoulder = people.xyz[0, COCO_18.index['left_shoulder']]
    reach = (BODY.upper_arm + BODY.forearm + CAPSULES.hand_length) * ADULT / BODY.adult_stature
    assert found.bound < np.linalg.norm(shoulder - links.centres[0]) - reach - 0.1
    # the distance is that of the parts that are known
    assert found.distance == pytest.approx(truth(armless, links), abs=1e-4)


def test_a_guessed_part_is_within_reach_of_a_measured_one():
    people, wrist, links = person(0.01), COCO_18.index['left_wrist'], link((0.0, AHEAD, 1.0))

    def bound(sigma):
        status, sigmas = people.status.copy(), people.sigma.copy()
        status[0, wrist], sigmas[0, wrist] = INFERRED, sigma
        return seen(replace(people, status=status, sigma=sigmas), links=links).bound

    assert bound(0.05) > bound(0.2) > bound(0.5) - 1e-9
    elbow = people.xyz[0, COCO_18.index['left_elbow']]
    reach = (BODY.forearm + CAPSULES.hand_length) * ADULT / BODY.adult_stature
    assert bound(50.0) > np.linalg.norm(elbow - links.centres[0]) - 1.2 * reach - 0.1 - 0.1


def test_several_people_lower_the_bound():
    one, two = person(0.05), person(0.05, 8, place=(0.0, 0.05))
    both = People3D(COCO_18, *(np.concatenate([getattr(one, name), getattr(two, name)]) for name in (
        'xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity')))
    found = seen(both)
    assert found.people == 2
    assert found.bound < min(seen(one).bound, seen(two).bound)


def test_an_id_that_comes_twice():
    """The other one's measured joints say nothing of where a hidden hand is."""
    people, other = without(person(0.05), ('left_wrist',)), person(0.05, place=(-1.0, 0.0))
    guessed = replace(people, status=np.minimum(people.status * INFERRED, INFERRED))
    both = People3D(COCO_18, *(np.concatenate([getattr(guessed, name), getattr(other, name)]) for name in (
        'xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity')))
    assert seen(both).bound == pytest.approx(seen(guessed).bound, abs=1e-3)
    assert seen(both).people == 2


@pytest.mark.parametrize('seed', range(12))
def test_any_values_give_a_bound(seed):
    random = np.random.RandomState(seed)
    status = random.choice([MISSING, MEASURED, INFERRED], (3, 18), p=[0.3, 0.4, 0.3])
    scale = 10.0 ** random.randint(-3, 30, (3, 18, 1))
    xyz = np.where(status[..., np.newaxis] == MISSING, np.nan, scale * random.normal(size=(3, 18, 3)))
    values = np.array([np.nan, np.inf, -1.0, 0.0, 1e-30, 0.1, 1e30])
    people = People3D(COCO_18, xyz, np.ones((3, 18)), status, random.choice(values, (3, 18)), random.randint(0, 3, 3),
                      random.choice(values, (3, 18, 3)))
    found = seen(people, at=random.uniform(0, 1))
    assert 0 <= found.bound <= found.distance


def test_the_nearest_link_decides():
    far, near = (-2.2, 0.0, 1.25), (AHEAD, 0.0, 1.25)
    alone, found = seen(person(0.05), links=link(near)), seen(person(0.05), links=link(far, near))
    assert (found.link, found.distance, found.bound) == ('link_1', alone.distance, alone.bound)


def test_links_that_may_have_moved_lower_the_bound():
    assert seen(person(), links=link(away=0.07)).bound == pytest.approx(seen(person()).bound - 0.07, abs=1e-4)


def after(seconds, people=NONE, params=PARAMS, first=None, links=None):
    """Return the separation when a person was seen at first, and other people in frames since."""
    estimator = SeparationEstimator(params)
    estimator.take(person() if first is None else first, 10.0)
    for number in range(1, round(seconds * 10) + 1):
        estimator.take(people, 10.0 + number / 10)
    return estimator.at(10.0 + seconds, links or link((8.0, 0.0, 1.25)))


def test_a_lost_person_walks_on():
    # from when on arms reach no further
    bounds = [after(seconds).bound for seconds in (1.4, 1.8, 2.2, 2.6)]
    np.testing.assert_allclose(np.diff(bounds), -0.4 * CONSTANTS.walking, atol=1e-4)
    lost = after(2.0)
    assert (lost.person, lost.people, lost.reason) == (7, 1, '')
    assert lost.age == pytest.approx(2.0)
    assert lost.distance == pytest.approx(seen(person(), links=link((8.0, 0.0, 1.25))).distance, abs=1e-4)


def test_limbs_of_a_lost_person_reach_no_further_than_they_are_long():
    whole = seen(person(), links=link((8.0, 0.0, 1.25))).bound
    arm = 2 * (BODY.upper_arm + BODY.forearm + CAPSULES.hand_length)
    assert whole - 2.0 * CONSTANTS.walking - arm < after(2.0).bound < whole - 1.5 * CONSTANTS.walking


def several(*people):
    return People3D(COCO_18, *(np.concatenate([getattr(each, name) for each in people]) for name in (
        'xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity')))


def in_turn(*frames, links=None):
    """Return the separation at the last of frames that come 0.1 s after one another."""
    estimator = SeparationEstimator(PARAMS)
    for number, people in enumerate(frames):
        estimator.take(people, 10.0 + number / 10)
    return estimator.at(10.0 + (len(frames) - 1) / 10, links or link())


@pytest.mark.parametrize('place', [(-0.15, 0.0), (-6.0, 0.0)])
def test_an_id_is_a_person_wherever_it_is(place):
    moved = person(0.03, place=place)
    assert in_turn(person(0.03), moved) == seen(moved)


def test_another_id_near_a_lost_person_frees_no_space():
    other = person(0.03, 8, place=(-0.05, 0.0))
    found = in_turn(person(0.03), other)
    assert (found.people, found.person) == (2, 7)
    assert found.bound < min(seen(person(0.03)).bound, seen(other).bound)
    assert after(PARAMS.lost_timeout, other).people == 2
    assert after(PARAMS.lost_timeout + 0.1, other).people == 1


def test_exchanged_ids_leave_two_people():
    one, two = person(0.03), person(0.03, 8, place=(-1.5, 0.0))
    other_one, other_two = person(0.03, 8), person(0.03, place=(-1.5, 0.0))
    found = in_turn(several(one, two), several(other_one, other_two))
    assert found.people == 2
    assert found.bound == pytest.approx(seen(several(one, two)).bound)


def test_of_people_without_ids_no_bound_is_known():
    """Where one of them goes is not known. Once they are gone, they are lost like others."""
    named, nameless = (several(*(person(0.03, name, place=(-0.4 * number, 0.0)) for number, name in enumerate(ids)))
                       for ids in ((7, 8, 9), (0, 0, 0)))
    found = in_turn(nameless, nameless)
    assert (found.people, found.bound, found.reason) == (3, 0.0, 'a person has no id')
    assert found.distance == seen(named).distance
    assert in_turn(nameless, NONE) == in_turn(named, NONE)._replace(person=0)
    assert seen(without(nameless, COCO_18.joints)).bound == 0.0


def test_feet_are_within_reach_of_the_ankles():
    low = link((0.5, 0.0, 0.02))
    bare, shod = (seen(person(), replace(PARAMS, feet=feet), links=low) for feet in (False, True))
    assert shod.part.endswith('foot') and shod.status == MISSING
    assert shod.bound < bare.bound - 0.1
    assert shod.distance == bare.distance


def test_a_lost_person_is_forgotten_in_time():
    assert math.isfinite(after(PARAMS.lost_timeout).bound)
    gone = after(PARAMS.lost_timeout + 0.1)
    assert (gone.bound, gone.distance, gone.people) == (math.inf, math.inf, 0)


def test_a_person_who_comes_back_is_where_it_is_seen():
    estimator = SeparationEstimator(PARAMS)
    for stamp, people in ((10.0, person()), (10.5, NONE), (11.0, person())):
        estimator.take(people, stamp)
    assert estimator.at(11.0, link()) == seen(person())


def test_without_messages_the_bound_goes_to_zero_in_bounded_time():
    for people in (person(0.03), NONE):
        estimator = SeparationEstimator(PARAMS)
        estimator.take(people, 10.0)
        times = np.arange(10.0, 13.0, 0.05)
        bounds = np.array([estimator.at(now, link((8.0, 0.0, 1.25))).bound for now in times])
        with np.errstate(invalid='ignore'):
            assert not (np.diff(bounds) > 0).any()
        assert (bounds[times > 10.0 + PARAMS.data_timeout] == 0).all()
        assert (bounds[times < 10.0 + PARAMS.data_timeout] > 0).all()
    found = estimator.at(12.0, link())
    assert math.isnan(found.distance) and found.age == pytest.approx(2.0)
    assert 'old' in found.reason


def test_a_person_without_a_position_may_be_anywhere():
    nowhere = without(person(), COCO_18.joints)
    found = seen(nowhere)
    assert math.isnan(found.distance)
    assert (found.bound, found.people) == (0.0, 1)
    assert 'person 7' in found.reason
    # from where it was known, it walks
    assert after(1.0, nowhere) == after(1.0)
    # until it may be anywhere
    assert after(PARAMS.lost_timeout + 0.1, nowhere).bound == 0.0


def test_stamps_that_go_back_a_little_change_nothing():
    estimator = SeparationEstimator(PARAMS)
    estimator.take(person(), 10.0)
    before = estimator.at(10.0, link())
    estimator.take(NONE, 9.95)
    assert estimator.at(10.0, link()) == before
    estimator.clear()
    assert estimator.at(10.0, link()).reason == SeparationEstimator(PARAMS).at(10.0, link()).reason


def test_stamps_of_another_clock_tell_nothing():
    assert seen(person(), at=-0.05).bound == pytest.approx(seen(person()).bound)
    found = seen(person(), at=-5.0)
    assert found.bound == 0.0
    assert 'ahead' in found.reason


def test_spheres_hold_a_link():
    ends = np.array([[0.0, 0.0, 0.0], [0.9, 0.0, 0.0]])
    centres, radius = spheres_of(ends, 0.1)
    assert 0.1 <= radius < 0.12
    random = np.random.RandomState(1)
    around = random.normal(size=(500, 3)) * (0.0, 1.0, 1.0)
    points = random.uniform(0, 0.9, (500, 1)) * (1.0, 0.0, 0.0) + 0.1 * around / np.linalg.norm(around, axis=1)[:, None]
    assert (np.linalg.norm(points[:, None] - centres, axis=2).min(axis=1) <= radius + 1e-9).all()
    alone, radius = spheres_of(ends[[1, 1]], 0.1)
    np.testing.assert_array_equal(alone, ends[[1]])
    assert radius == 0.1


# A camera at the origin that looks along z, 90 degrees wide and 60 high.
CAMERA = CameraModel(640, 370, [320, 0, 319.5, 0, 320, 184.5, 0, 0, 1])
GUARD = replace(PARAMS, guard=True, guard_range=6.0, guard_margin=0.25)


def guarded(centre, at=0.0, people=NONE, view=None):
    estimator = SeparationEstimator(GUARD)
    estimator.take(people, 10.0, view or View.of(CAMERA, (np.eye(3), np.zeros(3))))
    return estimator.at(10.0 + at, link(centre))


def test_people_may_come_from_where_the_camera_does_not_look():
    far = guarded((0.0, 0.0, 5.5))
    assert far.distance == math.inf
    assert far.bound == pytest.approx(6.0 - 5.5 - 0.1 - 0.25)
    assert (far.link, far.person, far.reason) == ('link_0', 0, 'guard volume')
    aside = guarded((1.0, 0.0, 3.0))
    assert aside.bound == pytest.approx((3.0 - 1.0) * math.sqrt(0.5) - 0.35)
    # a person, and an arm before it
    assert guarded((1.0, 0.0, 3.0), at=0.1).bound == pytest.approx(
        aside.bound - 0.1 * (CONSTANTS.walking + CONSTANTS.limbs))
    for outside in ((4.0, 0.0, 3.0), (0.0, 0.0, 7.0), (0.0, 0.0, -1.0)):
        assert guarded(outside).bound == 0.0


def test_links_that_may_have_moved_are_nearer_to_the_guard_volume():
    estimator = SeparationEstimator(GUARD)
    estimator.take(NONE, 10.0, View.of(CAMERA, (np.eye(3), np.zeros(3))))
    bounds = [estimator.at(10.0, link((0.0, 0.0, 5.5), away=away)).bound for away in (0.0, 0.05)]
    assert bounds[1] == pytest.approx(bounds[0] - 0.05)


def test_the_guard_volume_moves_with_the_camera():
    turn = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # z of the camera is x
    view = View.of(CAMERA, (turn, np.array([1.0, 2.0, 3.0])))
    assert guarded((6.5, 2.0, 3.0), view=view).bound == pytest.approx(guarded((0.0, 0.0, 5.5)).bound)


def test_the_nearer_one_of_person_and_guard_volume_counts():
    lying = replace(person(), xyz=person().xyz + np.array([0.0, -1.0, 3.0], np.float32))
    found = guarded((0.0, 0.0, 2.6), people=lying)
    assert found.person == 7 and found.reason == ''
    assert 0 < found.bound < found.distance < guarded((0.0, 0.0, 2.6)).bound


def test_without_camera_info_there_is_no_guard_volume():
    found = seen(NONE, GUARD)
    assert found.bound == 0.0
    assert 'camera info' in found.reason


def test_tails_are_those_of_students_t():
    deviations = np.array([-3.0, -0.5, 0.0, 0.7, 2.6, 8.0])
    np.testing.assert_allclose(tail(deviations), stats.t(3).sf(math.sqrt(3) * deviations), atol=1e-12)


@pytest.mark.parametrize('heavy', [False, True])
def test_the_bound_holds_with_the_probability(heavy):
    """Joints beside the truth by errors of their sigma: the true distance is below the bound as rarely as is said."""
    random, sigma, true, params = np.random.RandomState(3), 0.08, person(), replace(PARAMS, probability=0.95)
    slack, trials = [], 120
    for _ in range(trials):
        around = random.normal(size=3) * (0.8, 0.8, 0.6)
        links = link(tuple(np.array([0.0, 0.0, 1.0]) + 1.5 * around / np.linalg.norm(around)))
        size = np.sqrt(3 / random.chisquare(3, size=(1, 18, 1)) / 3) if heavy else 1.0
        error = sigma / math.sqrt(3) * random.normal(size=(1, 18, 3)) * size
        found = replace(true, xyz=true.xyz + error, sigma=np.full((1, 18), sigma))
        slack.append(truth(true, links) - seen(found, params, links=links).bound)
    assert (np.array(slack) < 0).sum() <= 0.05 * trials
    assert np.median(slack) < 0.25
