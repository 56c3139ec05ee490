"""What is published of a rig, beside what drivers and others publish on tf."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from openpose_ros_fusion.rig import rig_camera
from openpose_ros_fusion.ros.rig_frames import rig_frames
from simulated_rig import around
from skeleton_extract_3d.ros.convert import rotation_and_translation, transform_from_matrix
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


def check(camera, found, known, frame=''):
    rotation, translation = pose_of(frame or camera.frame_id, {**known, **found.lacking})
    np.testing.assert_allclose(rotation, camera.pose[0], atol=1e-9)
    np.testing.assert_allclose(translation, camera.pose[1], atol=1e-9)


MOUNT = {**link('camera0_base', 'camera0_link', matrix((0.1, 0.2, 0.3), (0.1, 0, 0.2))),
         **link('camera0_link', LEFT.frame_id, matrix((-1.5, 0, -1.5), (0, 0.05, 0)))}


def test_optical_frames_are_placed_where_no_driver_has_frames():
    found = rig_frames('world', CAMERAS, {})
    assert set(found.lacking) == {LEFT.frame_id, RIGHT.frame_id} and found.apart == {}
    for camera, frame in CAMERAS:
        assert found.lacking[frame].header.frame_id == 'world'
        rotation, translation = rotation_and_translation(found.lacking[frame])
        np.testing.assert_allclose(rotation, camera.pose[0], atol=1e-9)
        np.testing.assert_allclose(translation, camera.pose[1], atol=1e-9)


def test_the_root_of_a_driver_s_frames_is_placed():
    found = rig_frames('world', CAMERAS, MOUNT)
    assert set(found.lacking) == {'camera0_base', RIGHT.frame_id}
    check(LEFT, found, MOUNT)
    check(RIGHT, found, MOUNT)


def test_nothing_is_placed_where_tf_has_it_and_differences_are_said():
    turned = matrix()
    turned[:3, :3], turned[:3, 3] = LEFT.pose[0] @ matrix((0, 0.2, 0))[:3, :3], LEFT.pose[1] + (0.3, 0, 0.4)
    known = {**link('map', 'world', matrix((0, 0, 1), (5, 5, 0))), **link('world', LEFT.frame_id, turned)}
    found = rig_frames('world', CAMERAS, known)
    assert set(found.lacking) == {RIGHT.frame_id} and found.lacking[RIGHT.frame_id].header.frame_id == 'world'
    assert found.apart['camera0'] == pytest.approx((0.5, 0.2))


def test_frames_that_a_common_root_connects_are_left_alone():
    """The fixed frame need not be above the camera: a floor's frame is below it."""
    pose = np.linalg.inv(np.vstack([np.column_stack(LEFT.pose), [0, 0, 0, 1]]))
    found = rig_frames('world', CAMERAS[:1], link(LEFT.frame_id, 'world', pose))
    assert found.lacking == {} and found.apart['camera0'] == pytest.approx((0, 0), abs=1e-6)


def test_cameras_on_one_mount_place_it_once():
    known = {**link('robot', LEFT.frame_id, matrix()), **link('robot', RIGHT.frame_id, matrix((0, 0, 0), (0.2, 0, 0)))}
    found = rig_frames('world', CAMERAS, known)
    assert set(found.lacking) == {'robot'} and set(found.apart) == {'camera1'}
    check(LEFT, found, known)


def test_the_frame_of_the_messages_counts():
    found = rig_frames('world', [(LEFT, 'kitchen')], {})
    assert set(found.lacking) == {'kitchen'}
    check(LEFT, found, {}, 'kitchen')
