"""The room: what it says of frames that tf does not connect."""
import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header

from openpose_ros_web.ros.room import Room


def test_the_fault_names_the_frames_that_are_not_connected_until_it_rests(monkeypatch):
    known = {'right'}
    monkeypatch.setattr(Room, '_pose', lambda _room, _target, header: (
        (np.eye(3), np.zeros(3)) if header.frame_id in known else None))
    room = Room('map')
    assert room.fault() == ''
    assert room.place(Header(frame_id='left_optical'))[0] == 'left_optical_upright'
    assert [room.place(Header(frame_id=frame))[0] for frame in ('right', 'map')] == ['map', 'map']
    assert room.fault() == "tf does not connect 'map' with 'left_optical', shown in its place"
    room.place(Header(frame_id='a'))
    assert "with 'a, left_optical', shown" in room.fault()
    known.add('a')
    room.place(Header(frame_id='a'))
    assert "with 'left_optical', shown" in room.fault()
    room.rest()
    assert room.fault() == ''


def test_a_moving_camera_is_where_it_was_when_a_recording_is_played_again(monkeypatch):
    buffers = []
    monkeypatch.setattr(tf2_ros, 'TransformListener', buffers.append)  # without a master
    room, places = Room('map'), []
    room.place(Header(frame_id='camera'))
    for seconds in (30, 5):
        for second in range(seconds + 1):
            header = Header(stamp=rospy.Time(1000 + second), frame_id='map')
            moved = TransformStamped(header=header, child_frame_id='camera')
            moved.transform.translation.x, moved.transform.rotation.w = second, 1.0
            buffers[0].set_transform(moved, 'test')
        places += [room.place(Header(stamp=rospy.Time(1000 + late), frame_id='camera'))[1][1][0]
                   for late in (seconds - 1, seconds, seconds + 1)]
    assert places == [29, 30, 30, 4, 5, 5]
