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
    found = CameraInput('kitchen', FusionParams(cameras='kitchen', fixed_frame='room'), None, lambda: None, LONG)
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


def refuse(camera):
    with pytest.raises(NoTransformError):
        camera.take()


def refuse_at_once(camera):
    taken = threading.Thread(target=refuse, args=(camera,), daemon=True)
    taken.start()
    taken.join(LONG / 2)
    assert not taken.is_alive()


def test_people_without_a_stamp_are_refused(camera):
    place(camera, 100.0)
    send(camera, 0)
    with pytest.raises(NoStampError, match=r'kitchen.*driver has to'):
        camera.take()
    assert camera.take() is None


def test_a_transform_is_waited_for_only_where_it_may_come(camera):
    camera.has_transform = False  # after one was missed
    send(camera, 100.0)
    refuse_at_once(camera)
    place(camera, 100.0)
    send(camera, 100.2)
    late = threading.Timer(0.05, place, (camera, 100.3))
    late.start()
    sighting, _ = camera.take()
    assert sighting.stamp == pytest.approx(100.2) and camera.has_transform
    late.join()
