"""What the fusion node reads of one camera: stamps that are missing, and transforms that come late."""
import threading

import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from openpose_ros_msgs.msg import PersonDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_fusion.node_params import FusionParams
from openpose_ros_fusion.ros.camera_input import CameraInput
from openpose_ros_pkg.errors import NoStampError, NoTransformError

LONG = 10.0


@pytest.fixture()
def camera(monkeypatch):
    buffers = []
    # without a master: nothing is listened to
    monkeypatch.setattr(tf2_ros, 'TransformListener', buffers.append)
    found = CameraInput('kitchen', True, FusionParams(fixed_frame='room'), None, lambda: None)
    found.tf = buffers[0]
    return found


def people(seconds):
    header = Header(stamp=rospy.Time.from_sec(seconds), frame_id='kitchen')
    return PersonDetection_3dArray(header=header, pose_model='COCO_18')


def send(camera, seconds):
    camera.inputs[0].signalMessage(people(seconds))


def place(camera, seconds):
    header = Header(stamp=rospy.Time.from_sec(seconds), frame_id='room')
    transform = TransformStamped(header=header, child_frame_id='kitchen')
    transform.transform.rotation.w = 1.0
    camera.tf.set_transform(transform, 'test')


def test_people_without_a_stamp_are_refused(camera):
    place(camera, 100.0)
    send(camera, 0)
    with pytest.raises(NoStampError, match=r'kitchen.*driver has to'):
        camera.take()
    assert camera.take() is None


def test_a_transform_that_comes_late_is_waited_for_again_after_one_was_missed(camera):
    place(camera, 100.0)
    send(camera, 100.1)
    refuse(camera)
    camera.reconfigure(FusionParams(fixed_frame='room', tf_timeout=LONG))
    send(camera, 100.2)
    late = threading.Timer(0.05, place, (camera, 100.3))
    late.start()
    assert camera.take().stamp == pytest.approx(100.2) and camera.has_transform
    late.join()


def refuse(camera):
    with pytest.raises(NoTransformError):
        camera.take()


def test_frames_that_tf_does_not_connect_delay_no_frame_twice(camera):
    send(camera, 100.0)
    refuse(camera)
    camera.reconfigure(FusionParams(fixed_frame='room', tf_timeout=LONG))
    for seconds in (100.1, 100.2):
        send(camera, seconds)
        taken = threading.Thread(target=refuse, args=(camera,), daemon=True)
        taken.start()
        taken.join(LONG / 2)
        assert not taken.is_alive()
