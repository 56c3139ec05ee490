"""Separation: the least distance of people from links, and the bound below it, by each source of uncertainty."""
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from animated_skeleton import ADULT, Pose, people_of, without
from capsule_rows import rows
from openpose_ros_bridges.guard import View
from openpose_ros_bridges.moving_parts import Links, spheres_of
from openpose_ros_bridges.node_params import SeparationParams
from openpose_ros_bridges.separation import CONSTANTS, SeparationEstimator
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import CAPSULES, CapsuleConstants, capsules_of, tail
from skeleton_extract_3d.body.body import BODY
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel

PARAMS, NO_FEET = SeparationParams(), replace(CONSTANTS, feet=False)
NONE = People3D.empty(COCO_18)
# A link stands so far before a person at the origin [m].
AHEAD = 2.0
# Hands that are known to be straight.
STRAIGHT_HANDS = CapsuleConstants(hand_bend=0.0)
UNSEEN = np.nan, np.nan, np.nan


def person(sigma=0.0, name=7, velocity=(0.0, 0.0, 0.0), place=(0.0, 0.0)):
    """Return a person who stands and faces x, with the same sigma and velocity of all joints."""
    people = people_of([Pose(place=place)], [name], np.random.RandomState(1))
    return replace(people, sigma=np.full((1, 18), sigma), velocity=np.broadcast_to(velocity, (1, 18, 3)))


def several(*people):
    return People3D(COCO_18, *(np.concatenate([getattr(each, name) for each in people]) for name in (
        'xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity')))


def link(*centres, radius=0.1, away=0.0):
    centres = centres or ((AHEAD, 0.0, 1.25),)
    return Links([f'link_{number}' for number in range(len(centres))], np.array(centres), np.full(len(centres), radius),
                 np.full(len(centres), away))


FAR = link((8.0, 0.0, 1.25))


def truth(people, links):
    """Return the distance of links from the capsules of people, by brute force."""
    shares = np.linspace(0, 1, 501)[:, np.newaxis]
    return min(float(np.linalg.norm((1 - shares) * capsule.ends[0] + shares * capsule.ends[1] - centre, axis=1).min())
               - capsule.radius - radius for capsule in rows(capsules_of(people))
               for centre, radius in zip(links.centres, links.radii))


def seen(people, params=PARAMS, at=0.0, links=None, constants=NO_FEET, **how):
    """Return the separation `at` seconds after the only frame."""
    estimator = SeparationEstimator(params, constants, **how)
    estimator.take(people, 10.0)
    return estimator.at(10.0 + at, links or link())


def in_turn(*frames, links=None, period=0.1):
    """Return the separation at the last of frames that come one after another."""
    estimator = SeparationEstimator(PARAMS, NO_FEET)
    for number, people in enumerate(frames):
        estimator.take(people, 10.0 + number * period)
    return estimator.at(10.0 + (len(frames) - 1) * period, links or link())


def after(seconds, people=NONE):
    """Return the separation from a far link when a person was seen at first, and other people in frames since."""
    return in_turn(person(), *[people] * round(seconds * 10), links=FAR)


def test_without_people_it_is_unknown_or_infinite():
    found = SeparationEstimator(PARAMS).at(10.0, link())
    assert math.isnan(found.distance) and math.isnan(found.age) and found.reason
    assert (found.bound, found.people, found.person) == (0.0, 0, 0)
    found = seen(NONE)
    assert (found.distance, found.bound, found.people, found.reason, found.age) == (math.inf, math.inf, 0, '', 0.0)


@pytest.mark.parametrize('centre', [(AHEAD, 0.0, 1.25), (0.3, 0.6, 0.9), (-1.0, 0.0, 2.5), (0.0, -3.0, 0.0)])
def test_without_errors_the_bound_is_the_distance(centre):
    people, links = person(), link(centre)
    found = seen(people, links=links, capsules=STRAIGHT_HANDS)
    assert found.distance == pytest.approx(truth(people, links), abs=1e-4)
    assert found.bound == pytest.approx(found.distance, abs=1e-4)
    assert (found.person, found.people, found.age, found.status, found.reason) == (7, 1, 0.0, MEASURED, '')


def test_the_bound_falls_with_sigma_age_and_probability():
    for bounds in ([seen(person(sigma)).bound for sigma in (0.0, 0.01, 0.05, 0.1, 0.2)],
                   [seen(person(0.03), at=at).bound for at in (0.0, 0.05, 0.1, 0.2, 0.4, 0.8)],
                   [seen(person(0.03), replace(PARAMS, probability=probability)).bound
                    for probability in (0.5, 0.9, 0.99, 0.999)]):
        assert (np.diff(bounds) < 0).all()


def test_people_are_where_they_are_by_now():
    still, walks = seen(person(), at=0.2), seen(person(velocity=(1.0, 0.0, 0.0)), at=0.2)
    assert walks.distance == pytest.approx(still.distance - 0.2, abs=2e-3)
    # and not further than the motion is known
    assert seen(person(velocity=(1.0, 0.0, 0.0)), at=0.9).distance == pytest.approx(still.distance - 0.5, abs=5e-3)
    # of a velocity of which nothing is known, no part comes nearer than its greatest speed
    fast = seen(person(velocity=UNSEEN), at=0.3)
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


def test_feet_are_within_reach_of_the_ankles():
    low = link((0.5, 0.0, 0.02))
    bare, shod = (seen(person(), constants=constants, links=low) for constants in (NO_FEET, CONSTANTS))
    assert shod.part.endswith('foot') and shod.status == MISSING
    assert shod.bound < bare.bound - 0.1
    assert shod.distance == bare.distance


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


def test_the_nearest_person_and_link_decide():
    far, near = (-2.2, 0.0, 1.25), (AHEAD, 0.0, 1.25)
    alone, found = seen(person(0.05), links=link(near)), seen(person(0.05), links=link(far, near))
    assert (found.link, found.distance, found.bound) == ('link_1', alone.distance, alone.bound)
    assert seen(person(), links=link(away=0.07)).bound == pytest.approx(seen(person()).bound - 0.07, abs=1e-4)
    other = person(0.05, 8, place=(0.0, 0.05))
    both = seen(several(person(0.05), other))
    assert both.people == 2 and both.bound < min(alone.bound, seen(other).bound)


def test_a_lost_person_walks_on_and_is_forgotten_in_time():
    # from when on arms reach no further
    np.testing.assert_allclose(np.diff([after(seconds).bound for seconds in (1.4, 1.8, 2.2, 2.6)]),
                               -0.4 * CONSTANTS.walking, atol=1e-4)
    lost, whole = after(2.0), seen(person(), links=FAR)
    assert (lost.person, lost.people, lost.reason) == (7, 1, '')
    assert lost.age == pytest.approx(2.0)
    assert lost.distance == pytest.approx(whole.distance, abs=1e-4)
    arm = 2 * (BODY.upper_arm + BODY.forearm + CAPSULES.hand_length)
    assert whole.bound - 2.0 * CONSTANTS.walking - arm < lost.bound < whole.bound - 1.5 * CONSTANTS.walking
    assert math.isfinite(after(PARAMS.lost_timeout).bound)
    gone = after(PARAMS.lost_timeout + 0.1)
    assert (gone.bound, gone.distance, gone.people) == (math.inf, math.inf, 0)


def test_another_id_near_a_lost_person_frees_no_space():
    other = person(0.03, 8, place=(-0.05, 0.0))
    found = in_turn(person(0.03), other)
    assert (found.people, found.person) == (2, 7)
    assert found.bound < min(seen(person(0.03)).bound, seen(other).bound)
    assert [after(PARAMS.lost_timeout + more, other).people for more in (0.0, 0.1)] == [2, 1]


@pytest.mark.parametrize('ids', [(0, 0, 0), (7, 7, 8), (7, 8, 0)])
def test_of_people_without_ids_of_their_own_no_bound_is_known(ids):
    """Where one of them goes is not known. Once they are gone, they are lost like others."""
    named, nameless = (several(*(person(0.03, name, place=(-0.4 * number, 0.0)) for number, name in enumerate(names)))
                       for names in ((7, 8, 9), ids))
    found = in_turn(nameless, nameless)
    assert (found.people, found.bound, found.reason) == (3, 0.0, 'a person has no id of its own')
    assert found.distance == seen(named).distance
    assert in_turn(nameless, NONE).bound == pytest.approx(in_turn(named, NONE).bound)
    assert seen(without(nameless, COCO_18.joints)).bound == 0.0


def test_without_messages_the_bound_goes_to_zero_in_bounded_time():
    for people in (person(0.03), NONE):
        times = np.arange(0.0, 3.0, 0.05)
        bounds = np.array([seen(people, at=at, links=FAR).bound for at in times])
        with np.errstate(invalid='ignore'):
            assert not (np.diff(bounds) > 0).any()
        assert (bounds[times > CONSTANTS.data_timeout] == 0).all()
        assert (bounds[times < CONSTANTS.data_timeout] > 0).all()
    found = seen(NONE, at=2.0)
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


def test_stamps_of_another_time_tell_nothing():
    estimator = SeparationEstimator(PARAMS)
    estimator.take(person(), 10.0)
    before = estimator.at(10.0, link())
    estimator.take(NONE, 9.95)
    assert estimator.at(10.0, link()) == before
    estimator.clear()
    assert estimator.at(10.0, link()).reason == 'no people message yet'
    assert seen(person(), at=-0.05).bound == pytest.approx(seen(person()).bound)
    found = seen(person(), at=-5.0)
    assert found.bound == 0.0 and 'ahead' in found.reason


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
UPRIGHT_POSE = np.eye(3), np.zeros(3)
GUARD = replace(PARAMS, guard=True, guard_range=6.0)


def guarded(centre, at=0.0, people=NONE, pose=UPRIGHT_POSE, away=0.0):
    estimator = SeparationEstimator(GUARD, replace(NO_FEET, guard_margin=0.25))
    estimator.take(people, 10.0, View.of(CAMERA, pose))
    return estimator.at(10.0 + at, link(centre, away=away))


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
    assert guarded((0.0, 0.0, 5.5), away=0.05).bound == pytest.approx(far.bound - 0.05)
    for outside in ((4.0, 0.0, 3.0), (0.0, 0.0, 7.0), (0.0, 0.0, -1.0)):
        assert guarded(outside).bound == 0.0
    turn = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # z of the camera is x
    assert guarded((6.5, 2.0, 3.0), pose=(turn, np.array([1.0, 2.0, 3.0]))).bound == pytest.approx(far.bound)
    unknown = seen(NONE, GUARD)
    assert unknown.bound == 0.0 and 'camera info' in unknown.reason


def test_people_may_come_from_behind_others():
    view, centre, radius = View.of(CAMERA, UPRIGHT_POSE), np.array([0.2, -0.1, 2.0]), 0.3
    points = np.random.RandomState(1).uniform((-2.0, -1.5, 0.5), (2.0, 1.5, 5.0), (4000, 3))
    sight, axis = (each / np.linalg.norm(each, axis=-1, keepdims=True) for each in (points, centre))
    meets = np.linalg.norm(centre - (sight @ centre)[:, np.newaxis] * sight, axis=1) < radius
    hidden = meets & (points @ axis > np.linalg.norm(centre))
    told = view.hidden_distances(points, centre[np.newaxis], np.array([radius]))
    np.testing.assert_array_equal(told < 0, hidden)
    nearest = np.linalg.norm(points[:, np.newaxis] - points[hidden], axis=2).min(axis=1)
    assert (told <= nearest).all() and np.median((nearest - told)[~hidden]) < 0.2
    along_x = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([0.0, 0.0, 1.25])
    free, behind = (guarded((3.5, 0.0, 1.25), people=people, pose=along_x)
                    for people in (NONE, person(place=(2.0, 0.0))))
    assert free.bound > 1
    assert (behind.bound, behind.reason) == (0.0, 'guard volume')


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
