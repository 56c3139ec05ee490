"""Which camera stands elsewhere than it is believed to, and whose clock is late."""
import numpy as np
import pytest

from openpose_ros_fusion.cameras import CameraJudge
from openpose_ros_pkg.skeletons import COCO_18
from simulated_rig import around, walking
from skeleton_extract_3d.people import MEASURED, People3D

RATE = 15.0


def judge_of(cameras, people=3, seconds=4.0, seen=None):
    """Let the cameras see people, whose fused positions are the true ones, and return the judge."""
    room = walking(seconds + 1, people)
    judge = CameraJudge([camera.name for camera in cameras])
    for number in range(int(seconds * RATE)):
        time = 0.2 + number / RATE
        joints = room.at(time)
        shape = joints.shape[:2]
        fused = People3D(COCO_18, joints, np.ones(shape), np.full(shape, MEASURED, np.uint8), np.full(shape, 0.02),
                         np.arange(len(joints)) + 100, (room.at(time + 0.02) - room.at(time - 0.02)) / 0.04)
        known = {(camera.name, person + 1): person + 100 for camera in cameras for person in range(len(joints))}
        judge.update([camera.see(room, time, seen and seen[camera.name]) for camera in cameras], fused, time, known)
    return judge


def judged(cameras, **values):
    return judge_of(cameras, **values).judgements()


@pytest.mark.parametrize('count, moved, named', [(3, 0.0, []), (3, 0.1, ['camera1']), (2, 0.1, ['camera0', 'camera1'])],
                         ids=['right', 'one of three', 'one of two'])
def test_a_camera_that_stands_10_cm_elsewhere_disagrees(count, moved, named):
    """Of two cameras both are named, as none is known to be right."""
    cameras = around(count)
    cameras[1].moved = (0.6 * moved, -0.8 * moved, 0.0)
    found = judged(cameras)
    assert [name for name, camera in found.items() if camera.disagrees] == named
    assert found['camera1'].error == pytest.approx(moved, abs=0.01)
    assert count == 2 or (found['camera0'].error < 0.01 and found['camera2'].error < 0.01)
    assert moved or all(abs(camera.clock_offset) < 0.005 for camera in found.values())


@pytest.mark.parametrize('late, angle', [(0.07, None), (-0.03, None), (0.07, 0.005)])
def test_a_clock_that_is_late_is_found_by_how_people_move(late, angle):
    cameras = around(3)
    cameras[2].late, cameras[2].angle = late, angle
    found = judged(cameras)
    assert found['camera2'].clock_offset == pytest.approx(-late, abs=0.012)
    assert abs(found['camera0'].clock_offset) < 0.005 and abs(found['camera1'].clock_offset) < 0.005
    assert not any(camera.disagrees for camera in found.values())


def test_what_was_long_ago_is_forgotten():
    judge = judge_of(around(3))
    assert np.isfinite(judge.judgements()['camera0'].error)
    judge.update([], People3D.empty(COCO_18), 12.0, {})
    assert np.isnan(judge.judgements()['camera0'].error)
