"""Which camera stands elsewhere than it is believed to, and whose clock is late."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_fusion.cameras import CameraJudge
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_pkg.skeletons import COCO_18
from simulated_rig import around, walking
from skeleton_extract_3d.people import MEASURED, People3D

RATE = 15.0


def judged(cameras, people=3, seconds=4.0, seen=None, room=None):
    """Let the cameras see people, of whom the fused ones are the truth, and return the judgements."""
    room = walking(seconds + 1, people) if room is None else room
    judge = CameraJudge([camera.name for camera in cameras])
    for number in range(int(seconds * RATE)):
        time = 0.2 + number / RATE
        joints = room.at(time)
        shape = joints.shape[:2]
        fused = People3D(COCO_18, joints, np.ones(shape), np.full(shape, MEASURED, np.uint8), np.full(shape, 0.02),
                         np.arange(len(joints)) + 100, (room.at(time + 0.02) - room.at(time - 0.02)) / 0.04)
        known = {(camera.name, person + 1): person + 100 for camera in cameras for person in range(len(joints))}
        judge.update([camera.see(room, time, seen and seen[camera.name]) for camera in cameras], fused, time, known)
    return judge.judgements()


def test_nothing_is_known_of_cameras_that_see_nobody():
    for found in judged(around(2), people=1, seen={'camera0': (), 'camera1': ()}).values():
        assert np.isnan(found.error) and np.isnan(found.clock_offset) and not found.disagrees


def test_right_cameras_have_the_error_of_their_noise_and_one_clock():
    for found in judged(around(3)).values():
        assert found.error < 0.005 and abs(found.clock_offset) < 0.005 and not found.disagrees


def test_one_of_three_that_stands_10_cm_elsewhere_is_named():
    cameras = around(3)
    cameras[1].moved = (0.06, -0.08, 0.0)
    found = judged(cameras)
    assert [name for name, camera in found.items() if camera.disagrees] == ['camera1']
    assert found['camera1'].error == pytest.approx(0.1, abs=0.01)
    assert found['camera0'].error < 0.01 and found['camera2'].error < 0.01


def test_of_two_that_disagree_nobody_knows_which_is_wrong():
    cameras = around(2)
    cameras[1].moved = (0.1, 0.0, 0.0)
    assert all(camera.disagrees for camera in judged(cameras).values())


@pytest.mark.parametrize('late', [0.07, -0.03])
@pytest.mark.parametrize('angle', [None, 0.005])
def test_a_clock_that_is_late_is_found_by_how_people_move(late, angle):
    cameras = around(3)
    cameras[2].late, cameras[2].angle = late, angle
    found = judged(cameras)
    assert found['camera2'].clock_offset == pytest.approx(-late, abs=0.012)
    assert abs(found['camera0'].clock_offset) < 0.005 and abs(found['camera1'].clock_offset) < 0.005
    assert not any(camera.disagrees for camera in found.values())


def test_of_people_who_stand_still_no_clock_is_told():
    room = walking(5.0, 2)
    still = replace(room, joints=np.repeat(room.joints[:, :1], len(room.times), axis=1))
    cameras = around(2)
    cameras[1].late = 0.07
    assert all(np.isnan(camera.clock_offset) or name == 'camera0'
               for name, camera in judged(cameras, room=still).items())


def test_what_was_long_ago_is_forgotten():
    cameras = around(3)
    room = walking(8.0, 2)
    judge = CameraJudge([camera.name for camera in cameras])
    nobody = People3D.empty(COCO_18)
    joints = room.at(1.0)
    fused = People3D(COCO_18, joints, np.ones(joints.shape[:2]), np.full(joints.shape[:2], MEASURED, np.uint8),
                     np.full(joints.shape[:2], 0.02), np.arange(2), np.zeros(joints.shape))
    known = {(camera.name, person + 1): person for camera in cameras for person in range(2)}
    for _ in range(5):
        judge.update([camera.see(room, 1.0) for camera in cameras], fused, 1.0, known)
    assert np.isfinite(judge.judgements()['camera0'].error)
    judge.update([], nobody, 9.0, {})
    assert np.isnan(judge.judgements()['camera0'].error)


def fused_and_judged(cameras, room, seconds=4.0, seen=None):
    """Let the cameras see people who are fused, and return the judgements and how many people there were at most."""
    fusion, judge, most = PeopleFusion(), CameraJudge([camera.name for camera in cameras]), 0
    for number in range(int(seconds * RATE)):
        time = 0.2 + number / RATE
        sightings = [camera.see(room, time, seen and seen[camera.name]) for camera in cameras]
        people = fusion.update(sightings, time)
        judge.update(sightings, people, time, fusion.known)
        most = max(most, len(people))
    return judge.judgements(), most


def named(found):
    return [name for name, camera in found.items() if camera.disagrees]


@pytest.mark.parametrize('distance', [0.1, 0.2, 0.3, 0.4, 0.5, 0.8, 1.2])
@pytest.mark.parametrize('people', [1, 2, 3])
def test_a_camera_that_stands_elsewhere_is_named_whether_or_not_people_double(distance, people):
    cameras = around(3)
    cameras[1].moved = (0.6 * distance, -0.8 * distance, 0.0)
    found, _ = fused_and_judged(cameras, walking(6.0, people, seed=1))
    assert named(found) == ['camera1']
    if distance >= 0.4:
        assert found['camera1'].error == pytest.approx(distance, abs=0.1)


@pytest.mark.parametrize('seed', range(4))
def test_cameras_that_see_different_people_do_not_disagree(seed):
    """As those that do not overlap: nobody is seen by two of them."""
    seen = {'camera0': (0,), 'camera1': (1,), 'camera2': (2,)}
    found, most = fused_and_judged(around(3), walking(6.0, 3, seed=seed), seen=seen)
    assert named(found) == [] and most == 3


def test_of_people_who_stand_still_nobody_tells_that_a_camera_stands_far_away():
    room = walking(6.0, 2, seed=1)
    still = replace(room, joints=np.repeat(room.joints[:, :1], len(room.times), axis=1))
    cameras = around(3)
    cameras[1].moved = (0.8, 0.0, 0.0)
    assert named(fused_and_judged(cameras, still)[0]) == []
