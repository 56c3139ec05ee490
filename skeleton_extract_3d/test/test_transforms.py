"""What tf knew of a recording that is played again, without a clock of its own; frames of cameras that are turned."""
from dataclasses import replace

import numpy as np
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import pixels_to_image, turned_header, turned_image, turned_info
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.points.depth import NoDepth
from skeleton_extract_3d.points.transform import quarter_turns
from skeleton_extract_3d.ros.convert import rotation_and_translation
from skeleton_extract_3d.ros.frames import FrameTransforms, points_from_message
from skeleton_extract_3d.ros.transforms import Transforms


@pytest.fixture()
def heard(monkeypatch):
    """Return transforms, and what takes those of tf: no master is asked."""
    buffers = []
    monkeypatch.setattr(tf2_ros, 'TransformListener', buffers.append)
    return Transforms(0.0), buffers[0]


def stamped(seconds, x, frame='camera'):
    found = TransformStamped(header=Header(stamp=rospy.Time.from_sec(seconds), frame_id='map'), child_frame_id=frame)
    found.transform.translation.x, found.transform.rotation.w = x, 1.0
    return found


def test_a_recording_that_is_played_again_has_its_own_transforms(heard):
    transforms, buffer = heard
    buffer.set_transform_static(stamped(0, 7.0, 'mast'), 'test')
    for begin, speed, step in ((1000, 1.0, 30), (1000, 2.0, 5), (998, 3.0, 5)):
        for second in range(step + 1):
            buffer.set_transform(stamped(begin + second, speed * second), 'test')
            buffer.set_transform(stamped(begin + second - 0.3, speed * second, 'late'), 'test')
        for found in (transforms.lookup('map', 'camera', rospy.Time(begin + step)),
                      transforms.newest('map', 'camera'), transforms.newest('map', 'late')):
            assert found.transform.translation.x == speed * step
        assert transforms.newest('map', 'mast').transform.translation.x == 7.0
    assert transforms.parents() == {'camera': 'map', 'late': 'map', 'mast': 'map'}


def test_transforms_that_are_a_little_late_change_nothing(heard):
    transforms, buffer = heard
    for seconds in (1000, 1001, 1000.6, 1002):
        buffer.set_transform(stamped(seconds, seconds), 'test')
    assert transforms.lookup('map', 'camera', rospy.Time.from_sec(1000.5)).transform.translation.x > 1000


@pytest.mark.parametrize('degrees', [0, 90, 180, 270])
@pytest.mark.parametrize('target', ['map', 'camera'])
def test_points_that_were_turned_are_where_the_camera_saw_them(degrees, target):
    params = ExtractorParams(rotate_image=degrees, points_source='depth_image', rectified='false', target_frame=target)
    header = Header(stamp=rospy.Time(5), frame_id='camera')
    depth = pixels_to_image(np.arange(2000, 2048, dtype=np.uint16).reshape(6, 8), '16UC1', header)
    info = CameraInfo(header=header, width=8, height=6, distortion_model='plumb_bob', D=[0.0] * 5,
                      K=[9, 0, 3, 0, 8, 2, 0, 0, 1], R=np.eye(3).ravel(), P=[9, 0, 3, 0, 0, 8, 2, 0, 0, 0, 1, 0])
    pose = stamped(5, 7.0)
    pose.transform.rotation.x, pose.transform.rotation.w = 0.6, 0.8
    transforms = FrameTransforms(params, lambda *asked: {('map', 'camera', header.stamp): pose}[asked])
    now, points = turned_header(header, degrees), []
    for grid in (points_from_message(depth, info, replace(params, rotate_image=angle)) for angle in (0, degrees)):
        found = grid.window(*np.mgrid[:grid.width, :grid.height].reshape(2, -1), 1)[:, 0]
        points.append(found[np.argsort(found[:, 2])])  # each has another depth
    before, after = points
    np.testing.assert_allclose(after, before @ quarter_turns(degrees).T, atol=1e-9)
    rotation, translation = rotation_and_translation(pose) if target == 'map' else (np.eye(3), np.zeros(3))
    turn = transforms.tracking_from_points(now), transforms._transform_to(target, now)
    assert turn[0] is None
    found = after if turn[1] is None else after @ turn[1][0].T + turn[1][1]
    np.testing.assert_allclose(found, before @ rotation.T + translation, atol=1e-9)
    assert (transforms.of_camera(now) is None) == (degrees == 0)
    if degrees:
        assert now.frame_id == 'camera_turned' == transforms.of_camera(now).child_frame_id
        back, _ = rotation_and_translation(transforms.of_camera(now))
        np.testing.assert_allclose(after @ back.T, before, atol=1e-9)
    assert turned_image(depth, degrees).header.frame_id == turned_info(info, degrees).header.frame_id == now.frame_id


def test_a_camera_without_depth_has_pixels_and_the_floor_of_the_room():
    params = ExtractorParams(points_source='none', rectified='false', use_floor=True, tracking_frame='map')
    header = Header(stamp=rospy.Time(5), frame_id='camera')
    info = CameraInfo(header=header, width=8, height=6, distortion_model='plumb_bob', D=[0.0] * 5,
                      K=[9, 0, 3, 0, 8, 2, 0, 0, 1])
    grid = points_from_message(None, info, params)
    assert isinstance(grid, NoDepth) and (grid.width, grid.height) == (8, 6)
    assert grid.camera_model().matrix[0, 0] == 9 and np.isnan(grid.depths(np.array([1]), np.array([2]))).all()
    assert points_from_message(None, info, replace(params, rotate_image=90)).camera_model().matrix[0, 0] == 8
    with pytest.raises(BadInputError, match='no camera info'):
        points_from_message(None, None, params)
    pose = stamped(5, 0.0)
    pose.transform.translation.z = 1.5
    pose.transform.rotation.x, pose.transform.rotation.w = -np.sqrt(0.5), np.sqrt(0.5)  # the camera is level
    transforms = FrameTransforms(params, lambda *asked: {('map', 'camera', header.stamp): pose}[asked])
    np.testing.assert_allclose(transforms.floor(header), [0, -1, 0, 1.5], atol=1e-9)
    for other in (replace(params, use_floor=False), replace(params, points_source='depth_image'),
                  replace(params, tracking_frame='')):
        assert FrameTransforms(other, lambda *asked: pose).floor(header) is None
