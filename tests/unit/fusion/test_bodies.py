"""What is known of bodies: axes, where keypoints lie beside joints, and lengths of bones."""
import numpy as np

from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.correction import with_bones
from openpose_ros_fusion.estimate import Joints
from openpose_ros_fusion.observations import KeypointOffsets, body_axes
from openpose_ros_pkg.skeletons import COCO_18
from simulated_mocap import STANDING
from skeleton_extract_3d.body.measures import Sizes

# Looks along x, z up.
BODY = np.array([[STANDING[joint] for joint in COCO_18.joints]])
TURNED = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
LEFT, RIGHT = COCO_18.index['left_hip'], COCO_18.index['right_hip']
OFFSETS = KeypointOffsets()


def test_offsets_turn_with_the_body_and_are_mirrored():
    np.testing.assert_allclose(body_axes(BODY)[0], np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]).T, atol=0.02)
    offsets = OFFSETS.of_bodies(BODY)[0]
    np.testing.assert_allclose(OFFSETS.of_bodies(BODY @ TURNED.T)[0], offsets @ TURNED.T, atol=1e-12)
    outwards, up, forwards, _ = {name: values for name, *values in FUSION.shape.keypoints}['hip']
    np.testing.assert_allclose(offsets[LEFT], (forwards, outwards, up), atol=1e-3)
    np.testing.assert_allclose(offsets[RIGHT], (forwards, -outwards, up), atol=1e-3)


def test_bones_keep_the_length_that_was_learnt():
    elbow, wrist = COCO_18.index['left_elbow'], COCO_18.index['left_wrist']

    def bent(sizes, joints, measured):
        return with_bones(sizes, Joints(joints, covariance, *2 * (np.zeros(0),)), np.full((1, 18), measured),
                          np.ones((1, 18)))

    sizes = Sizes.assumed(np.array([1.7]))
    covariance = np.tile(0.02 ** 2 * np.eye(3), (1, 18, 1, 1))
    for _ in range(30):
        sizes, _ = bent(sizes, BODY, True)
    # this time the wrist is vague, and too far away
    covariance[0, wrist] *= 25
    longer = BODY.copy()
    longer[0, wrist] = BODY[0, elbow] + 1.3 * (BODY[0, wrist] - BODY[0, elbow])
    _, moved = bent(sizes, longer, False)
    assert np.linalg.norm(moved[0, wrist] - BODY[0, wrist]) < 0.4 * np.linalg.norm(longer[0, wrist] - BODY[0, wrist])
    longer[0, wrist] = np.nan
    assert np.isnan(bent(sizes, longer, False)[1][0, wrist]).all()
