"""The object keypoint similarity: values computed by hand, and how it behaves."""
import numpy as np
import pytest

from known_fields import FRONT
from openpose_ros_pkg.ensemble import area, sigmas, similarity
from openpose_ros_pkg.skeletons import COCO_17, COCO_18

SIGMAS = sigmas(COCO_18)
PERSON = np.column_stack([100 * FRONT, np.full(18, 0.8)])


def moved(x, y=0.0, person=PERSON):
    return person + np.array([x, y, 0])


def without(*joints, person=PERSON):
    result = person.copy()
    result[[COCO_18.index[joint] for joint in joints]] = (np.nan, np.nan, 0)
    return result


def test_sigmas_are_twice_those_of_coco():
    """pycocotools, kpt_oks_sigmas, in COCO's order; it uses (2 sigma)^2."""
    published = [.26, .25, .25, .35, .35, .79, .79, .72, .72, .62, .62, 1.07, 1.07, .87, .87, .89, .89]
    np.testing.assert_allclose(sigmas(COCO_17), 2 * np.array(published) / 10)


@pytest.mark.parametrize('places, expected', [
    ([(10, 20), (110, 220)], 0.53 * 1.3 * 100 * 200),
    ([(10, 20), (20, 220)], 0.53 * 1.3 * 80 * 80),      # narrow: as wide as 0.4 of its height
    ([(10, 20), (210, 20)], 0.53 * 1.3 * 80 * 80),
    ([(10, 20)], 0.53 * 1.3),                           # a pixel at least
    ([], 0.0)])
def test_area(places, expected):
    person = np.full((18, 3), (np.nan, np.nan, 0))
    for joint, place in zip(person, places):
        joint[:] = (*place, 0.5)
    assert area(person) == pytest.approx(expected)


def test_value():
    """Two joints with sigmas of 0.144 and 0.124 that span 100 x 100, one of them moved by 10."""
    one = np.full((18, 3), (np.nan, np.nan, 0))
    elbow, wrist = COCO_18.index['right_elbow'], COCO_18.index['right_wrist']
    one[elbow], one[wrist] = (0, 0, 0.5), (100, 100, 0.5)
    other = one.copy()
    other[wrist, 0] -= 10
    expected = (1 + np.exp(-100 / (2 * 0.53 * 1.3 * 100 * 100 * (2 * 0.062) ** 2))) / 2
    assert similarity(one, other, SIGMAS) == pytest.approx(expected)


@pytest.mark.parametrize('shared', [(), ('nose',)], ids=['none', 'one'])
def test_poses_without_two_joints_in_common_are_not_alike(shared):
    upper = without(*COCO_18.joints[8:14])
    lower = without(*(joint for joint in COCO_18.joints if joint in COCO_18.joints[:8] + COCO_18.joints[14:]
                      and joint not in shared))
    assert similarity(upper, lower, SIGMAS) == 0


def test_joints_weigh_by_their_scores():
    """The moved wrist counts with sqrt(0.9 * 0.4) = 0.6, the other joint with sqrt(0.2 * 0.2) = 0.2."""
    one, other = without(*COCO_18.joints), without(*COCO_18.joints)
    one[:2], other[:2] = [(0, 0, 0.2), (100, 100, 0.9)], [(0, 0, 0.2), (100, 1100, 0.4)]
    assert similarity(one, other, SIGMAS) == pytest.approx(0.2 / 0.8, abs=1e-6)
