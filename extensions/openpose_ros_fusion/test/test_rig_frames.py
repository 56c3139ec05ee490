"""What is published of a rig, beside what drivers and others publish on tf."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from openpose_ros_fusion.rig import rig_camera
from openpose_ros_fusion.ros.rig_frames import missing_frames
from simulated_rig import around
from skeleton_extract_3d.ros.convert import transform_from_matrix
from skeleton_extract_3d.ros.static_frames import frames_above

LEFT, RIGHT = (rig_camera(camera.name, f'{camera.name}_optical_frame', camera.pose) for camera in around(2))
CAMERAS = [(camera, camera.frame_id) for camera in (LEFT, RIGHT)]


def matrix(turn=(0.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0)):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_euler('xyz', turn).apply(np.eye(3)).T, shift
    return pose


def link(parent, child, pose):
    return {child: transform_from_matrix(pose, Header(frame_id=parent), child)}


def pose_of(frame, links, above='world'):
    return dict(frames_above(frame, links))[above]


def check(camera, links, frame=''):
    rotation, translation = pose_of(frame or camera.frame_id, links)
    np.testing.assert_allclose(rotation, camera.pose[0], atol=1e-9)
    np.testing.assert_allclose(translation, camera.pose[1], atol=1e-9)


MOUNT = {**link('camera0_base', 'camera0_link', matrix((0.1, 0.2, 0.3), (0.1, 0, 0.2))),
         **link('camera0_link', LEFT.frame_id, matrix((-1.5, 0, -1.5), (0, 0.05, 0)))}


@pytest.mark.parametrize('known, placed', [
    ({}, [LEFT.frame_id, RIGHT.frame_id]),  # no driver has frames
    (MOUNT, ['camera0_base', RIGHT.frame_id]),  # the root of those of a driver
    # cameras on one mount place it once
    ({**link('robot', LEFT.frame_id, matrix()), **link('robot', RIGHT.frame_id, matrix((0, 0, 0), (0.2, 0, 0)))},
     ['robot'])])
def test_the_roots_of_frames_are_placed(known, placed):
    found = missing_frames('world', CAMERAS, known)
    assert list(found) == placed
    for camera, _ in CAMERAS[:len(placed)]:
        check(camera, {**known, **found})
