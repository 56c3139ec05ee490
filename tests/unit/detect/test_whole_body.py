"""A network for whole bodies on crops: its 133 points come with the people, whatever way these are found."""
from dataclasses import replace

import cv2
import numpy as np
import pytest

from followed_stream import FollowedStream
from openpose_ros_pkg.detect import recipe_choice
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED
from openpose_ros_pkg.detect.network_detection import NetworkDetection, people_in
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.detect.recipes import DetectorParams, DetectorSettings
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import LANDMARKS
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import BODY_25
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MEASURED
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from stand_in_networks import Together, chart
from whole_bodies import FACE, HANDS, MODEL, PEOPLE, SIZE, networks_of, whole

LEFT, RIGHT = PEOPLE

CROPS = pytest.mark.parametrize('people', [[], [LEFT], [LEFT, RIGHT]], ids=['none', 'one', 'two'])
# Smaller ones are not looked at.
BOTH, SMALL = LandmarkParams(hands=True, face=True), replace(LANDMARKS, least_hand=2.0, least_face=2.0)


@pytest.fixture(autouse=True)
def _known_by_name(monkeypatch):
    find = recipe_choice.find_model
    monkeypatch.setattr(recipe_choice, 'find_model',
                        lambda name, folder='': MODEL if name == 'whole' else find(name, folder))


def detector(people, **values):
    networks = networks_of(people, SIZE)
    return Detector(build(DetectorSettings, {'crop_model': 'whole', **values}), Together(**networks)), networks['whole']


def by_x(people):
    return people.select(np.argsort(people.xy[:, BODY_25.index['neck'], 0]))


def check(people, truth):
    """Check that people have the points of the true ones, in bins of half a pixel of a crop that is smaller."""
    found = by_x(people)
    assert people.skeleton is BODY_25 and len(people) == len(truth)
    for points, person in zip(found.points, truth):
        np.testing.assert_allclose(points[:, :2], whole(person), atol=1.5)
        np.testing.assert_allclose(points[:, 2], 0.9, atol=1e-6)


def test_recipes_of_other_networks_have_no_points():
    for values, expected in (({}, False), ({'crop_model': 'movenet_thunder'}, False), ({'crop_model': 'whole'}, True),
                             ({'look_closer': 0}, False), ({'pose_model': 'whole'}, True)):
        assert recipe_of(build(DetectorParams, values)).whole_body is expected
    plain = Detector(build(DetectorSettings, {}), Together(**networks_of([LEFT], SIZE)))
    assert people_in(chart(*SIZE), plain).points is None


@CROPS
@pytest.mark.parametrize('mode', ['fast', 'balanced', 'accurate'])
def test_all_points_of_people_in_an_image(mode, people):
    check(people_in(chart(*SIZE), detector(people, mode=mode)[0]), people)


def test_hands_and_faces_of_followed_people_take_no_other_run_of_the_network():
    def refuse(kind):
        raise AssertionError(f'{kind.model.name} is loaded')

    runs = []
    for landmarks in (None, LandmarkDetector(BOTH, refuse, SMALL, whole_body=True)):
        one, network = detector([LEFT, RIGHT])
        stream = FollowedStream(one, dict.fromkeys(one.setup.networks, 1e-9))
        for i in range(6):
            people = stream.frame(1 + i / 30, chart(*SIZE))
            if landmarks is not None:
                landmarks.detect(chart(*SIZE), people, None, 'camera', 1 + i / 30)
        check(people, [LEFT, RIGHT])
        runs.append(len(network.inputs))
    assert runs[0] == runs[1] > 0


def test_the_chain_has_hands_and_faces_of_the_people_in_image_and_space():
    one = detector([LEFT, RIGHT])[0]
    chain = PeopleChain(NetworkDetection(one, NEVER_FOLLOWED), build(EstimatorSettings, {}),
                        LandmarkDetector(BOTH, lambda kind: None, SMALL, whole_body=True))
    camera = CameraModel(*SIZE, [500.0, 0, 319.5, 0, 500.0, 239.5, 0, 0, 1])
    shown = np.zeros(SIZE[::-1], np.uint8)  # where two round bodies stand before the wall
    for person in (LEFT, RIGHT):
        cv2.fillConvexPoly(shown, cv2.convexHull(np.rint(whole(person)).astype(np.int32)), 1)
    inwards = cv2.distanceTransform(cv2.dilate(shown, np.ones((15, 15))), cv2.DIST_L2, 5)
    depth = np.where(inwards > 0, 3100 - 100 * np.minimum(inwards / 25, 1), 5000).astype(np.uint16)
    for i in range(3):
        result = chain.update(Frame('camera', 1 + i / 30, chart(*SIZE), DepthImage(depth, camera)))
    in_image, in_space = result.landmarks
    ids = {int(people): person for people, person in zip(by_x(result.people_2d).ids, (LEFT, RIGHT))}
    assert len(ids) == 2 and sorted(in_image.hands.people.tolist()) == sorted(2 * list(ids))
    for keypoints, person, left in zip(in_image.hands.keypoints, in_image.hands.people, in_image.hands.left):
        expected = whole(ids[int(person)])[HANDS['left' if left else 'right']]
        np.testing.assert_allclose(keypoints[:, :2], expected, atol=1.5)
    assert sorted(in_image.faces.people.tolist()) == sorted(ids)
    for keypoints, person in zip(in_image.faces.keypoints, in_image.faces.people):
        np.testing.assert_allclose(keypoints[:68, :2], whole(ids[int(person)])[FACE], atol=1.5)
    assert len(in_space.hands) == 4 and (in_space.hands.points.status == MEASURED).all()
    np.testing.assert_allclose(in_space.hands.points.xyz[..., 2], 3.06, atol=0.07)
    assert len(in_space.faces) == 2 and np.isfinite(in_space.faces.orientations).all()
