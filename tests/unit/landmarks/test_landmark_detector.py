"""Hands and faces of people whose bodies are known, by networks that read off the image what they see."""
from dataclasses import replace

import cv2
import numpy as np
import pytest
from test_regions import HAND as OPEN_HAND
from test_regions import turned

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND, LANDMARKS
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18

SIZE, FOREARM, UNIT = (640, 480), 160.0, 10.0
BOTH = LandmarkParams(hands=True, face=True)
HANDS = LandmarkParams(hands=True)


class DotReader:
    """Sees a hand in dots of known colours, as `draw` paints them, and counts what it is asked."""

    fallback, description = '', 'dot reader'

    def __init__(self):
        self.passes, self.presence = 0, 0.95

    def infer_many(self, images):
        return [self._hand(image[0].astype(int)) for image in images]

    def _hand(self, image):
        self.passes += 1
        points = np.full((21, 3), 112.0)
        dots, seen, right = np.abs(image[..., 1] - 220) < 3, 0, 0.5
        for k in range(21):
            v, u = np.nonzero(dots & (np.abs(image[..., 2] - 10 * k) < 3))
            if len(u) > 5:
                points[k, :2] = u.mean() + 0.5, v.mean() + 0.5
                seen, right = seen + 1, float(np.median(image[v, u, 0])) / 200
        return points.reshape(1, 63), np.array([[self.presence * seen / 21]]), np.array([[right]])


class FaceTemplate:
    """Answers with the same places in any crop, and the score that it is told."""

    fallback, description, logit = '', 'face template', 5.0

    def infer_many(self, images):
        places = np.full((468, 3), 96.0)
        places[[33, 263], 0] = 60, 132
        places[[0, 1], 1] = 40, 150
        return [(places.reshape(1, 1, 1, -1), np.full((1, 1, 1, 1), self.logit)) for _ in images]


def draw(image, points, right):
    for k, (x, y) in enumerate(points.tolist()):
        cv2.circle(image, (round(x), round(y)), 4, (200 * right, 220, 10 * k), -1)


def body(left=(150, 200), right=(450, 200), up=True):
    """Return keypoints of a person with wrists there and elbows below them, or beside them."""
    keypoints = np.full((18, 3), (np.nan, np.nan, 0), np.float32)
    elbow = np.array((0, FOREARM) if up else (FOREARM, 0))
    for name, xy in (('left_wrist', left), ('right_wrist', right), ('left_elbow', left + elbow),
                     ('right_elbow', right + elbow), ('nose', (320, 100)), ('right_eye', (300, 90)),
                     ('left_eye', (340, 90))):
        keypoints[COCO_18.index[name]] = *xy, 0.9
    return keypoints


def people(*bodies, ids=None):
    return People2D(COCO_18, np.array(bodies).reshape(-1, 18, 3), np.ones(len(bodies)),
                    np.arange(1, len(bodies) + 1) if ids is None else ids)


def scene(left=(150, 200), right=(450, 200)):
    """Return an image with both hands, and their points."""
    image = np.full((*SIZE[::-1], 3), 90, np.uint8)
    hands = {True: turned(OPEN_HAND * (-1, 1), 0.0, UNIT, left), False: turned(OPEN_HAND, 0.0, UNIT, right)}
    for is_left, points in hands.items():
        draw(image, points, not is_left)
    return image, hands


@pytest.fixture
def reader():
    return DotReader()


@pytest.fixture
def detector(reader):
    return LandmarkDetector(BOTH, lambda kind: reader if kind is HAND else FaceTemplate())


def test_both_hands_are_where_they_are_and_whose_they_are(detector):
    image, hands = scene()
    found = detector.detect(image, people(body(), ids=[7]), None, 'c', 1.0).hands
    assert found.people.tolist() == [7, 7] and found.left.tolist() == [True, False]
    for keypoints, is_left, score in zip(found.keypoints, found.left, found.scores):
        np.testing.assert_allclose(keypoints[:, :2], hands[bool(is_left)], atol=1.0)
        assert (keypoints[:, 2] == score).all() and score == pytest.approx(0.95)


def test_hidden_missing_and_small_hands_are_not_looked_at(detector, reader):
    image, _ = scene()
    hidden = np.zeros((1, 18), bool)
    hidden[0, COCO_18.index['left_wrist']] = hidden[0, COCO_18.index['nose']] = True
    found = detector.detect(image, people(body()), hidden, 'c', 1.0)
    assert found.hands.left.tolist() == [False] and len(found.faces) == 0
    without = body()
    without[COCO_18.index['right_wrist']] = np.nan, np.nan, 0
    assert detector.detect(image, people(without), None, 'd', 1.0).hands.left.tolist() == [True]
    reader.passes = 0
    of_large = LandmarkDetector(LandmarkParams(hands=True), lambda kind: reader, replace(LANDMARKS, least_hand=113.0))
    assert len(of_large.detect(image, people(body()), None, 'e', 1.0).hands) == reader.passes == 0


def test_hand_that_is_followed_takes_one_pass(detector, reader):
    detector.detect(scene()[0], people(body()), None, 'c', 1.0)
    reader.passes = 0
    image, hands = scene(left=(155, 195))
    # the body's wrists are off by 30 px, and its forearms point elsewhere: the region is that of the points
    found = detector.detect(image, people(body((150, 230), (450, 230), up=False)), None, 'c', 1.1).hands
    assert reader.passes == 2
    np.testing.assert_allclose(found.keypoints[0, :, :2], hands[True], atol=1.0)


@pytest.mark.parametrize('stamp, ids, camera', [
    (1.0 + 1.1 * LANDMARKS.follow_time, [1], 'c'),
    (0.0, [1], 'c'), (1.1, [2], 'c'), (1.1, [1], 'other'), (1.1, [-1], 'c')])
def test_what_is_old_or_another_persons_is_not_followed(detector, reader, stamp, ids, camera):
    detector.detect(scene()[0], people(body()), None, 'c', 1.0)
    reader.passes = 0
    assert len(detector.detect(scene()[0], people(body(), ids=ids), None, camera, stamp).hands) == 2
    assert reader.passes == 4


def test_hand_that_left_the_wrist_is_looked_for_by_the_body(detector):
    detector.detect(scene()[0], people(body()), None, 'c', 1.0)
    image, hands = scene(left=(150, 400))  # the body is there; the old place is empty
    found = detector.detect(image, people(body(left=(150, 400))), None, 'c', 1.1).hands
    np.testing.assert_allclose(found.keypoints[0, :, :2], hands[True], atol=1.0)
    draw(image, scene()[1][True], False)  # a hand at the old place is none of this wrist's
    found = detector.detect(image, people(body(left=(150, 400))), None, 'c', 1.2).hands
    np.testing.assert_allclose(found.keypoints[0, :, :2], hands[True], atol=1.0)


def test_one_hand_for_two_wrists_is_the_one_whose_side_it_shows(detector):
    image, hands = scene()
    twice = body(left=(450, 205))
    found = detector.detect(image, people(twice), None, 'c', 1.0).hands
    assert found.left.tolist() == [False]
    np.testing.assert_allclose(found.keypoints[0, :, :2], hands[False], atol=1.0)


def test_hand_behind_another_one_is_carried_along_with_its_wrist(detector):
    image, hands = scene()
    detector.detect(image, people(body()), None, 'c', 1.0)
    only_right, _ = scene(left=(450, 200))
    draw(only_right, hands[False], True)
    found = detector.detect(only_right, people(body(left=(440, 215))), None, 'c', 1.1).hands
    assert found.left.tolist() == [True, False]
    np.testing.assert_allclose(found.keypoints[0, :, :2], hands[True] + (290, 15), atol=1.0)
    assert found.scores[0] == pytest.approx(0.95 * (1 - 0.1 / LANDMARKS.follow_time)) and found.scores[1] > 0.9
    later = detector.detect(only_right, people(body(left=(440, 215))), None, 'c', 1.1 + LANDMARKS.follow_time).hands
    assert later.left.tolist() == [False]


def test_within_a_budget_those_looked_at_longest_ago_come_first(detector, reader):
    detector.reconfigure(HANDS)
    detector.warm_up()  # measures what a pass takes
    image, _ = scene()
    first = detector.detect(image, people(body()), None, 'c', 1.0, seconds=0.0).hands
    assert len(first) == 1  # one in any case
    reader.passes = 0
    second = detector.detect(image, people(body()), None, 'c', 1.1, seconds=0.0).hands
    assert len(second) == 2 and reader.passes == 2  # the other one is new; the first is carried
    assert sorted(second.scores)[0] == pytest.approx(0.95 * (1 - 0.1 / LANDMARKS.follow_time))
    third = detector.detect(image, people(body()), None, 'c', 1.2, seconds=0.0).hands
    assert third.scores[first.left[0] == third.left] == pytest.approx([0.95])
    assert len(detector.detect(image, people(body()), None, 'c', 1.3, seconds=10.0).hands) == 2


@pytest.mark.parametrize('stamp', [0.0, -1.0])
def test_without_a_stamp_nothing_is_remembered(detector, reader, stamp):
    """A hand that is gone is not carried along, and one that appears is looked for at once."""
    detector.reconfigure(HANDS)
    image, hands = scene()
    nothing = np.full_like(image, 90)
    for shown, count in ((image, 2), (nothing, 0), (image, 2)):
        assert len(detector.detect(shown, people(body()), None, 'c', stamp).hands) == count
    only_right, _ = scene(left=(450, 200))
    draw(only_right, hands[False], True)
    assert len(detector.detect(only_right, people(body(left=(440, 215))), None, 'c', stamp).hands) == 1


def test_missing_network_is_a_fault_and_the_other_one_works(reader):
    def load(kind):
        if kind is FACE:
            raise ModelError('weights of face_landmark not found')
        return reader

    detector = LandmarkDetector(BOTH, load)
    assert detector.faults == ('face_landmark is missing, so faces are not found: '
                               'weights of face_landmark not found')
    found = detector.detect(scene()[0], people(body()), None, 'c', 1.0)
    assert len(found.hands) == 2 and len(found.faces) == 0
