"""The networks of hands and faces themselves, on the images of their self-check."""
import numpy as np
import pytest

from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.networks.backends.self_check import reference_path
from openpose_ros_pkg.networks.model_registry import FACE_LANDMARK, HAND_LANDMARK
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from optional_weights import need_weights

WIDTH = 700
# Where the images of the self-check lie; in them the wrist, and the middle between the eyes, are about there.
HAND_AT, FACE_AT, WRIST, NOSE = (80, 60), (420, 40), (112, 172), (96, 110)


@pytest.fixture(scope='module')
def detector():
    pytest.importorskip('openvino', reason='openvino is not installed: pip install openvino')
    need_weights(HAND_LANDMARK), need_weights(FACE_LANDMARK)
    return create_landmark_detector(LandmarkParams(hands=True, face=True), BackendParams())


@pytest.fixture(scope='module')
def scene():
    """Return an image with a right hand and a face, and the body that has them."""
    image = np.full((480, WIDTH, 3), 120, np.uint8)
    for model, (x, y) in ((HAND_LANDMARK, HAND_AT), (FACE_LANDMARK, FACE_AT)):
        with np.load(str(reference_path(model))) as reference:
            height, width = reference['image'].shape[:2]
            image[y:y + height, x:x + width] = reference['image']
    keypoints = np.full((18, 3), (np.nan, np.nan, 0), np.float32)
    wrist, nose = np.add(HAND_AT, WRIST), np.add(FACE_AT, NOSE)
    for name, xy in (('right_wrist', wrist), ('right_elbow', np.add(wrist, (20, 180))), ('nose', nose),
                     ('right_eye', nose - (25, 28)), ('left_eye', nose - (-25, 28))):
        keypoints[COCO_18.index[name]] = *xy, 0.9
    return image, keypoints


def people(keypoints):
    return People2D(COCO_18, keypoints[np.newaxis], np.ones(1), np.ones(1))


def test_hand_and_face_of_a_rendered_person(detector, scene):
    image, keypoints = scene
    found = detector.detect(image, people(keypoints), None, 'straight', 1.0)
    assert found.hands.left.tolist() == [False] and found.hands.scores[0] > 0.9 and found.faces.scores[0] > 0.9
    hand, face = found.hands.keypoints[0, :, :2] - HAND_AT, found.faces.keypoints[0, :, :2] - FACE_AT
    assert np.linalg.norm(hand[0] - WRIST) < 15
    assert (hand[[8, 12, 16, 20], 1] < 90).all()  # fingertips are up
    assert face[8, 1] > face[57, 1] > face[30, 1] > face[69, 1]  # chin, lip, nose, eye: upwards
    assert face[68, 0] < face[30, 0] < face[69, 0]  # the right eye is at the left
