"""The room: what it says of frames that tf does not connect."""
import numpy as np
from std_msgs.msg import Header

from openpose_ros_web.ros.room import Room


def test_the_fault_names_the_frames_that_are_not_connected_until_it_rests(monkeypatch):
    known = {'right'}
    monkeypatch.setattr(Room, '_pose', lambda _room, _target, header: (
        (np.eye(3), np.zeros(3)) if header.frame_id in known else None))
    room = Room('map')
    assert room.fault() == ''
    assert room.place(Header(frame_id='left_optical')).frame == 'left_optical_upright'
    assert [room.place(Header(frame_id=frame)).frame for frame in ('right', 'map')] == ['map', 'map']
    assert room.fault() == "tf does not connect 'map' with 'left_optical', shown in its place"
    room.place(Header(frame_id='a'))
    assert "with 'a, left_optical', shown" in room.fault()
    known.add('a')
    room.place(Header(frame_id='a'))
    assert "with 'left_optical', shown" in room.fault()
    room.rest()
    assert room.fault() == ''
