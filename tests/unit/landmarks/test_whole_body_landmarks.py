"""Hands and faces by the 133 points of a network for whole bodies: no other network runs."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_landmark_detector import BOTH, body, people

from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.face_points import SHAPE, with_depth
from openpose_ros_pkg.landmarks.landmark_network import LANDMARKS
from openpose_ros_pkg.people import People2D

IMAGE = np.zeros((480, 640, 3), np.uint8)
WRISTS = {'left': (150, 200), 'right': (450, 200)}
NOSE = (320, 100)
SIDES = {'left': slice(91, 112), 'right': slice(112, 133)}


def refuse(kind):
    raise AssertionError(f'{kind.model.name} is loaded')


@pytest.fixture
def detector():
    return LandmarkDetector(BOTH, refuse, whole_body=True)


def face_at(nose, turn=0.0, scale=8.0):
    """Return the 68 points of an average face that is turned about its vertical axis [rad]."""
    turned = Rotation.from_euler('y', turn).apply(SHAPE[:68] - SHAPE[30])
    return nose + scale * turned[:, :2] * (1, -1)


def points(score=0.9, wrists=None, nose=NOSE):
    """Return the points of a person: each hand goes up from its wrist, by 3 px a point."""
    result = np.full((133, 3), score, np.float32)
    result[:23, :2] = 0
    for side, part in SIDES.items():
        result[part, :2] = np.array((wrists or WRISTS)[side]) - [(0, 3 * k) for k in range(21)]
    result[23:91, :2] = face_at(nose)
    return result


def presence(score):
    """Return the score of a hand or a face by the mean of those of its points."""
    return 0.5 * score / 0.3 if score < 0.3 else 0.5 + 0.5 * (score - 0.3) / 0.7


def whole(*bodies, at=None, ids=None):
    """Return people with their points."""
    known = people(*bodies, ids=ids)
    given = [points()] * len(bodies) if at is None else at
    return People2D(known.skeleton, known.keypoints, known.scores, known.ids,
                    points=np.array(given, np.float32).reshape(-1, 133, 3))


def test_hands_and_face_are_those_of_the_points(detector):
    found = detector.detect(IMAGE, whole(body(), ids=[7]), None, 'c', 1.0)
    assert found.hands.people.tolist() == [7, 7] and found.hands.left.tolist() == [True, False]
    for keypoints, side in zip(found.hands.keypoints, SIDES):
        np.testing.assert_array_equal(keypoints, points()[SIDES[side]])
    assert found.faces.people.tolist() == [7] and found.faces.scores[0] == pytest.approx(presence(0.9))
    np.testing.assert_array_equal(found.faces.keypoints[0, :68], points()[23:91])
    for pupil, eye in ((68, slice(36, 42)), (69, slice(42, 48))):
        middle = points()[23:91][eye, :2].mean(axis=0)
        np.testing.assert_allclose(found.faces.keypoints[0, pupil, :2], middle, atol=1e-3)


@pytest.mark.parametrize('score, seen', [(0.31, True), (0.29, False), (1.7, True)])  # mmpose shows points from 0.3 on
def test_hands_and_faces_below_the_thresholds_are_absent(detector, score, seen):
    found = detector.detect(IMAGE, whole(body(), at=[points(score)]), None, 'c', 1.0)
    assert len(found.hands) == 2 * seen and len(found.faces) == seen
    assert found.hands.scores.max(initial=0) <= 1


def test_without_a_look_at_the_person_hands_move_with_the_body_for_a_moment(detector):
    nothing = np.full((133, 3), (np.nan, np.nan, 0))
    detector.detect(IMAGE, whole(body()), None, 'c', 1.0)
    moved = detector.detect(IMAGE, whole(body(left=(160, 200)), at=[nothing]), None, 'c', 1.1)
    np.testing.assert_allclose(moved.hands.keypoints[0, :, :2], points()[91:112, :2] + (10, 0), atol=1e-3)
    assert moved.hands.scores[0] == pytest.approx(presence(0.9) * (1 - 0.1 / LANDMARKS.follow_time), rel=1e-5)
    assert len(moved.faces) == 1
    gone = detector.detect(IMAGE, whole(body(), at=[nothing]), None, 'c', 1.0 + LANDMARKS.follow_time)
    assert len(gone.hands) == len(gone.faces) == 0


def test_missing_points_are_missing(detector):
    at = points()
    at[95] = at[60] = (np.nan, np.nan, 0)
    found = detector.detect(IMAGE, whole(body(), at=[at]), None, 'c', 1.0)
    np.testing.assert_array_equal(found.hands.keypoints[0, 4], (np.nan, np.nan, 0))
    assert np.isfinite(np.delete(found.hands.keypoints[0], 4, axis=0)).all()
    np.testing.assert_array_equal(found.faces.keypoints[0, 37], (np.nan, np.nan, 0))
    np.testing.assert_allclose(found.faces.mesh[0, 37, :2], points()[60, :2], atol=0.1)  # where the face has it


@pytest.mark.parametrize('turn', np.radians([-60, -20, 0, 35]))
def test_depth_of_a_turned_face(turn):
    scale, rotation = 5.0, Rotation.from_euler('yxz', [turn, 0.2, -0.1])
    seen = scale * rotation.apply(SHAPE) * (1, -1, -1) + (300, 200, 0)
    given = np.column_stack([seen[:, :2], np.ones(70)])
    given[[5, 40]] = np.nan, np.nan, 0
    result = with_depth(given)
    np.testing.assert_allclose(result[:, :2], seen[:, :2], atol=1e-6)
    # from the middle of the points; those that are missing shift it a little
    np.testing.assert_allclose(result[:, 2] - result[0, 2], seen[:, 2] - seen[0, 2], atol=1e-6)


@pytest.mark.parametrize('known', [[], [36, 39, 45], [8, 27, 28, 29, 30]])  # none, few, those of the middle alone
def test_points_that_tell_no_direction_tell_no_depth(known):
    given = np.full((70, 3), (np.nan, np.nan, 0))
    given[known] = np.insert(SHAPE[known, :2], 2, 1, axis=1)
    assert np.isnan(with_depth(given)).all()
