"""Toes and heels by a network for landmarks of bodies, which tells what it is told here."""
import shutil

import numpy as np
import pytest

from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import Detector, create_detector
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.network_detection import NetworkDetection, people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarks
from openpose_ros_pkg.landmarks.feet import FEET, SeenFeet, feet_of, look_at_feet
from openpose_ros_pkg.networks.model_registry import MOVENET_MULTIPOSE, MOVENET_THUNDER, POSE_LANDMARK
from openpose_ros_pkg.networks.models import joint_set, weights_path
from openpose_ros_pkg.networks.proof import _truth
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import ExpectedPeople, People2D
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, BODY_25, COCO_18
from optional_weights import need_weights
from stand_in_networks import MovenetNetwork, ThunderNetwork, Together, chart, person_at

IMAGE = np.zeros((400, 300, 3), np.uint8)
SIZE = 200.0  # half the diagonal of the box of the joints of PERSON, about [px]
PLACES = {'nose': (150, 40), 'left_shoulder': (170, 80), 'right_shoulder': (130, 80), 'left_hip': (165, 180),
          'right_hip': (135, 180), 'left_knee': (165, 270), 'right_knee': (135, 270), 'left_ankle': (165, 350),
          'right_ankle': (135, 350)}
HEEL, TOE = np.array((5.0, 10.0)), np.array((25.0, 15.0))  # from the ankle [px]
PARTS = ('left_big_toe', 'left_heel', 'right_big_toe', 'right_heel')
TIP = TOE + FEET.tip * (TOE - HEEL)


def person(**moved):
    pose = np.full((25, 3), (np.nan, np.nan, 0), np.float32)
    for name, xy in {**PLACES, **moved}.items():
        pose[BODY_25.index[name]] = *xy, 0.8
    return pose


def landmarks(visibility=0.9, **moved):
    """Return what the network says of the person: joints with an error, feet on its own ankles."""
    points, visible = np.zeros((33, 2)), np.full(33, visibility)
    for name, xy in {**PLACES, **moved}.items():
        points[BLAZEPOSE_33.index[name]] = xy
    for side in ('left', 'right'):
        ankle = points[BLAZEPOSE_33.index[f'{side}_ankle']]
        for part, offset in (('heel', HEEL), ('big_toe', TOE)):
            points[BLAZEPOSE_33.index[f'{side}_{part}']] = ankle + offset
    return BodyLandmarks(points, visible, 0.9, np.zeros((33, 3)))


class Told:
    """Stands in for `BodyLandmarkNetwork`."""

    def __init__(self, *seen):
        self.seen, self.looked = seen, []

    def observe(self, bgr, keypoints, skeleton, chosen):
        self.looked.append(list(chosen))
        return [self.seen[i] for i in chosen]


def people(*poses):
    return People2D(BODY_25, np.array(poses).reshape(-1, 25, 3), np.ones(len(poses)), np.arange(1, len(poses) + 1))


def feet_in(look, row=0):
    return look.people.keypoints[row, [BODY_25.index[name] for name in PARTS]]


def test_no_people_have_no_feet():
    look = look_at_feet(Told(), IMAGE, people(), [], 1.0)
    assert len(look.people) == 0 and look.feet == [] and look.looked == 0


def test_toes_and_heels_are_on_the_ankles_of_the_person():
    seen = landmarks(left_ankle=(165 + 6, 350 - 8))  # the network has the ankle elsewhere
    look = look_at_feet(Told(seen), IMAGE, people(person()), [None], 1.0)
    left, right = np.array(PLACES['left_ankle']), np.array(PLACES['right_ankle'])
    np.testing.assert_allclose(feet_in(look)[:, :2], [left + TIP, left + HEEL, right + TIP, right + HEEL], atol=1e-4)
    np.testing.assert_allclose(feet_in(look)[:, 2], 0.8)  # no surer than the ankle
    small = [BODY_25.index[f'{side}_small_toe'] for side in ('left', 'right')]
    assert not look.people.present[0, small].any()
    others = [i for i, name in enumerate(BODY_25.joints) if 'toe' not in name and 'heel' not in name]
    np.testing.assert_array_equal(look.people.keypoints[0, others], person()[others])


@pytest.mark.parametrize('seen', [
    None, landmarks(left_ankle=(165 + 1.1 * FEET.ankle * SIZE, 350), right_ankle=(135, 350 + 1.1 * FEET.ankle * SIZE)),
    landmarks(left_knee=(165, 270 + 1.1 * FEET.knee * SIZE), right_knee=(135 - 1.1 * FEET.knee * SIZE, 270)),
    landmarks(visibility=FEET.visibility - 0.01),
    landmarks(left_ankle=PLACES['right_ankle'], right_ankle=PLACES['left_ankle'], left_knee=(135, 200))],
    ids=['not seen', 'other ankles', 'other knees', 'hidden', 'other legs'])
def test_feet_that_the_network_is_not_sure_of_or_of_other_legs_do_not_count(seen):
    assert not feet_in(look_at_feet(Told(seen), IMAGE, people(person()), [None], 1.0))[:, 2].any()


def test_feet_without_an_ankle_or_beyond_the_image_are_none():
    lacking = person()
    lacking[BODY_25.index['left_ankle']] = np.nan, np.nan, 0
    assert (feet_in(look_at_feet(Told(landmarks()), IMAGE, people(lacking), [None], 1.0))[:, 2] > 0).tolist() == [
        False, False, True, True]
    low = np.zeros((364, 300, 3), np.uint8)  # ends below the heels
    assert (feet_in(look_at_feet(Told(landmarks()), low, people(person()), [None], 1.0))[:, 2] > 0).tolist() == [
        False, True, False, True]


def test_between_two_looks_feet_move_with_their_ankles_and_are_less_sure():
    network = Told(landmarks(), landmarks())
    first = look_at_feet(network, IMAGE, people(person(), person()), [None, None], 1.0)
    moved = person(left_ankle=(100, 300))
    soon = look_at_feet(network, IMAGE, people(moved, person()), first.feet, 1.0 + 0.5 * FEET.interval)
    np.testing.assert_allclose(feet_in(soon)[:2, :2], np.add((100, 300), [TIP, HEEL]), atol=1e-4)
    np.testing.assert_allclose(feet_in(soon)[:, 2], 0.8 * FEET.carried)
    later = look_at_feet(network, IMAGE, people(moved, person()), [soon.feet[0], None], 1.0 + 0.6 * FEET.interval)
    look_at_feet(network, IMAGE, people(moved, person()), soon.feet, 0.9)  # the clock was reset
    assert network.looked == [[0, 1], [], [1], [0, 1]] and later.feet[0] is first.feet[0]


def test_a_third_of_the_followed_people_are_looked_at_in_an_image_those_who_wait_longest():
    network = Told(*3 * [landmarks()])
    seen = [SeenFeet(feet_of(landmarks(), person(), SIZE), stamp) for stamp in (1.1, 1.0, 1.2)]
    look = look_at_feet(network, IMAGE, people(*3 * [person()]), seen, 1.39)
    assert network.looked == [[1, 0]] and look.looked == 2
    hurried = look_at_feet(network, IMAGE, people(*3 * [person()]), [*seen[:2], None], 1.39, hurried=True)
    assert network.looked.pop() == [2] and hurried.looked == 1
    late = look_at_feet(network, IMAGE, people(*3 * [person()]), look.feet, 1.39 + 1.1 * FEET.oldest)
    assert network.looked[1] == [2, 0]
    assert not feet_in(late, 1)[:, 2].any() and feet_in(late, 2)[:, 2].all()  # too old, and seen now


def test_a_foot_that_was_not_seen_is_not_carried():
    none = SeenFeet(feet_of(None, person(), SIZE), 1.0)
    assert not feet_in(look_at_feet(Told(), IMAGE, people(person()), [none], 1.05))[:, 2].any()


# --- in the detection ------------------------------------------------------------------------------------------------

PERSON = person_at(150, 60, 300)


class Landmarks(Together):
    """Networks among which is one for landmarks; None: it is missing."""

    def __init__(self, network):
        super().__init__(movenet_multipose=MovenetNetwork([PERSON], (300, 400)),
                         movenet_thunder=ThunderNetwork([PERSON], (300, 400)))
        self.network = network

    def feet(self):
        return self.network


def scene(network, **values):
    return Detector(build(DetectorSettings, {'mode': 'fast', **values}), Landmarks(network))


@pytest.mark.parametrize('values, joints', [
    ({}, BODY_25), ({'pose_model': 'COCO'}, COCO_18), ({'look_closer': 0}, COCO_18),
    ({'pose_model': 'movenet_multipose'}, COCO_18)])
def test_the_joint_set_depends_on_the_parameters_alone(values, joints):
    for network in (None, Told(None)):
        detector = scene(network, **values)
        assert detector.skeleton == joints and NetworkDetection(detector, FollowingParams()).skeleton == joints
        found = people_in(chart(300, 400), detector)
        assert found.skeleton == joints and len(found) == 1


def test_a_client_of_the_service_has_the_joints_of_its_people():
    assert joint_set('auto') == BODY_25 and joint_set('COCO') == joint_set('movenet_multipose') == COCO_18


@pytest.mark.parametrize('following, looks', [('always', 3), ('never', 5)])
def test_a_followed_person_is_looked_at_in_every_second_image_and_others_in_each(following, looks):
    network = Told(landmarks())
    detection = NetworkDetection(scene(network), FollowingParams(following=following))
    expected, image = ExpectedPeople.none(BODY_25), chart(300, 400)
    for number in range(5):
        frame = ImageFrame('', 1 + number / 15, image)
        found = detection.look(frame, expected).people
        assert found.skeleton == BODY_25 and len(found) == 1
        detection.remember(frame, np.array([7]))
        expected = ExpectedPeople(BODY_25, found.keypoints, np.array([7]), np.ones(1), np.ones(1), np.zeros(1))
    assert sum(map(len, network.looked)) == looks


def test_the_networks_find_the_feet_of_a_known_picture():
    for model in (MOVENET_MULTIPOSE, MOVENET_THUNDER, POSE_LANDMARK):
        need_weights(model)
    truth = _truth()
    found = people_in(truth.bgr, create_detector(build(DetectorSettings, {'mode': 'fast'})))
    assert found.skeleton == BODY_25 and len(found) == 2
    for pose in found.keypoints:
        nose = np.linalg.norm(truth.joints[:, truth.names.index('nose')] - pose[0, :2], axis=1).argmin()
        for name in PARTS:
            true, ankle = (truth.joints[nose, truth.names.index(joint)] for joint in (
                name, f'{name.split("_")[0]}_ankle'))
            # of a quarter of a foot of 24 and 20 px, and the error of feet that were placed by hand
            assert np.linalg.norm(pose[BODY_25.index[name], :2] - true) < 9, name
            assert np.linalg.norm(pose[BODY_25.index[name], :2] - ankle) < 40


def test_without_the_network_there_is_one_line_and_no_fault(tmp_path):
    for model in (MOVENET_MULTIPOSE, MOVENET_THUNDER):
        need_weights(model)
    for model in (MOVENET_MULTIPOSE, MOVENET_THUNDER):
        shutil.copytree(str(weights_path(model).parent), str(tmp_path / model.name))
    detector = create_detector(build(DetectorSettings, {'mode': 'fast', 'model_folder': str(tmp_path)}))
    assert detector.faults == '' and set(detector.not_installed) == {'pose_landmark', 'picodet'}
    assert 'toes and heels are not found' in detector.not_installed['pose_landmark']
    found = people_in(_truth().bgr, detector)
    assert found.skeleton == BODY_25 and len(found) == 2
