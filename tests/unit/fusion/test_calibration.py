"""Cameras that see the same people are placed to one another, in time and space, or it is said why not."""
import dataclasses

import numpy as np
import pytest

from openpose_ros_fusion.calibration.calibrate import CalibrationParams, calibrate
from openpose_ros_pkg.errors import BadInputError
from simulated_mocap import walkers
from simulated_room import Camera, around, record_all, rig_errors, up_error

# Clocks may differ by this [s].
CLOCKS = (0.0, 0.07, -0.3, 0.9)


def check(found, cameras, angle=0.4, position=0.02, clock=0.005):
    """Compare with the truth; limits: [degrees], [m], [s]."""
    errors = rig_errors(found.rig, cameras)
    assert np.all(errors < (angle, position, clock)), errors


@pytest.fixture(scope='module')
def four():
    cameras = [dataclasses.replace(camera, clock=clock) for camera, clock in zip(around(4), CLOCKS)]
    return cameras, calibrate(record_all(cameras))


def test_nobody_and_one_camera_are_refused():
    first, second = record_all(around(2))
    with pytest.raises(BadInputError, match=r'people of 0 cameras \(none\), expected of 2'):
        calibrate([])
    with pytest.raises(BadInputError, match=r'people of 1 cameras \(camera_0\)'):
        calibrate([first])
    empty = dataclasses.replace(second, **{name: getattr(second, name)[:0]
                                           for name in ('stamps', 'ids', 'points', 'sigma')})
    with pytest.raises(BadInputError, match='camera_1 saw somebody in 0 frames'):
        calibrate([first, empty])
    with pytest.raises(BadInputError, match="two cameras have the name 'camera_0'"):
        calibrate([first, first])


def test_four_cameras_with_clocks_of_their_own(four):
    cameras, found = four
    check(found, cameras)
    assert [camera.name for camera in found.rig.cameras] == [f'camera_{number}' for number in range(4)]
    assert found.rig.camera('camera_3').frame_id == 'camera_3_optical' and not found.warnings
    assert len(found.edges) == 6 and all(edge.joints > 100 for edge in found.edges)
    # two measurements, each with 15 mm per axis; what is left of them beside the adjusted joints, in pixels at 4 m
    assert all(0.02 < edge.distance < 0.05 and 0.5 < edge.pixels < 4 for edge in found.edges)


def test_standard_deviations_are_those_of_the_errors(four):
    """Within a factor of 4 of single errors; those of clocks leave out what straight lines between frames err by."""
    cameras, found = four
    errors = rig_errors(found.rig, cameras)
    assert np.all(errors[:, :2] < 4 * found.std[1:, :2]) and np.all(found.std[0] == 0)
    assert np.all(found.std[1:] < (0.3, 0.02, 0.004))


def test_z_is_up_from_the_floor(four):
    """The ankles of `walkers` are 0.08 m high; the first camera looks along x."""
    cameras, found = four
    assert up_error(found.rig, cameras) < 0.5
    rotation, centre = found.rig.cameras[0].pose
    np.testing.assert_allclose(centre, [0, 0, 1.5], atol=0.03)
    assert rotation[0, 2] > 0.9 and abs(rotation[1, 2]) < 1e-9
    heights = np.nanpercentile(found.people[:, :, 2], (1, 99))
    assert abs(heights[0] - 0.09) < 0.05 and 1.5 < heights[1] < 1.9


def test_a_chain_of_cameras_that_do_not_all_overlap():
    """The first and the last one see nobody together."""
    cameras = [Camera('left', (-3, -4, 1.6), (-2, 0, 1), sees=lambda at: at[..., 0] < -0.2),
               Camera('middle', (0, -4, 1.8), clock=0.05, sees=lambda at: np.abs(at[..., 0]) < 1.5),
               Camera('right', (3, -4, 1.4), (2, 0, 1), clock=0.1, sees=lambda at: at[..., 0] > 0.2)]
    found = calibrate(record_all(cameras, seconds=30, people=3))
    check(found, cameras, angle=0.8, position=0.06, clock=0.01)
    assert {(edge.first, edge.second) for edge in found.edges} == {('left', 'middle'), ('middle', 'right')}


def test_groups_that_share_nobody_are_named():
    cameras = around(4)
    recordings = record_all(cameras[:2], seed=1) + record_all(cameras[2:], seed=2)
    with pytest.raises(BadInputError, match=r'2 groups that share no people: camera_0, camera_1 \| camera_2, camera_3'):
        calibrate(recordings)


@pytest.mark.parametrize('people', [1, 3])
def test_one_person_and_people_of_one_stature(people):
    truth = walkers(12, people, seed=3)
    first = truth.joints.positions[0] - truth.joints.positions[0][:, [1]]
    same = np.stack([person[:, [1]] + np.roll(first, 40 * number, axis=0)
                     for number, person in enumerate(truth.joints.positions)])
    truth = dataclasses.replace(truth, joints=dataclasses.replace(truth.joints, positions=same))
    cameras = [dataclasses.replace(camera, clock=clock) for camera, clock in zip(around(3), CLOCKS)]
    check(calibrate(record_all(cameras, truth)), cameras)


def test_cameras_of_different_rates_and_two_people_exchanged():
    cameras = [dataclasses.replace(camera, rate=rate) for camera, rate in zip(around(3), (30.0, 15.0, 5.0))]
    recordings = record_all(cameras, walkers(12, 2, seed=1, rate=60))
    later = recordings[1].stamps > np.median(recordings[1].stamps)
    recordings[1] = dataclasses.replace(recordings[1], ids=np.where(later, 1 - recordings[1].ids, recordings[1].ids))
    check(calibrate(recordings), cameras, clock=0.01)


def test_depths_that_all_cameras_misjudge_alike():
    """Hips are said to be 30 mm, shoulders 20 mm too near; the cameras see people from around."""
    bias = np.zeros(18)
    bias[[8, 11]], bias[[2, 5]] = 0.03, 0.02
    cameras = around(3, bias=bias)
    check(calibrate(record_all(cameras)), cameras)


def test_a_camera_without_depth_among_others():
    cameras = around(3)
    cameras[1] = dataclasses.replace(cameras[1], depth=False, clock=0.07)
    found = calibrate(record_all(cameras))
    check(found, cameras, position=0.03, clock=0.01)
    assert np.isnan(next(edge.distance for edge in found.edges if 'camera_1' in (edge.first, edge.second)))


def test_scale_of_images_alone():
    """The distance of two cameras gives the scale exactly; the stature as well as it is known."""
    cameras = around(3, depth=False)
    recordings = record_all(cameras)
    apart = float(np.linalg.norm(np.subtract(cameras[0].centre, cameras[1].centre)))
    given = CalibrationParams(clocks_agree=True, distance=('camera_0', 'camera_1', apart))
    found = calibrate(recordings, given)
    check(found, cameras, angle=0.3, position=0.03)
    assert np.linalg.norm(np.subtract(*(one.translation for one in found.rig.cameras[:2]))) == pytest.approx(apart)
    sizes = [calibrate(recordings, CalibrationParams(clocks_agree=True, stature=stature)).rig.cameras[1].translation
             for stature in (1.7, 1.87)]
    assert np.linalg.norm(sizes[1][:2]) / np.linalg.norm(sizes[0][:2]) == pytest.approx(1.1, abs=0.01)


def test_clocks_of_images_alone():
    cameras = around(3, depth=False)[:2]
    cameras[1] = dataclasses.replace(cameras[1], clock=0.07)
    apart = float(np.linalg.norm(np.subtract(cameras[0].centre, cameras[1].centre)))
    found = calibrate(record_all(cameras), CalibrationParams(distance=('camera_0', 'camera_1', apart)))
    check(found, cameras, angle=0.5, position=0.05, clock=0.015)


@pytest.mark.parametrize('depth', [True, False])
def test_somebody_who_stays_in_one_place_is_refused(depth):
    truth = walkers(10, 1, seed=0)
    still = truth.joints.positions - truth.joints.positions[:, :, [1]] + [0, 0, 1.4]
    truth = dataclasses.replace(truth, joints=dataclasses.replace(truth.joints, positions=still))
    with pytest.raises(BadInputError, match='stay in one place'):
        calibrate(record_all(around(2, depth=depth), truth), CalibrationParams(clocks_agree=True))


def test_joints_in_a_plane_are_refused_without_depth():
    """Two images of a plane fit more than one way to stand."""
    truth = walkers(10, 2, seed=0)
    flat = truth.joints.positions * [1, 0, 1]
    truth = dataclasses.replace(truth, joints=dataclasses.replace(truth.joints, positions=flat))
    cameras = [Camera('left', (-2, -4, 1.5), depth=False), Camera('right', (2, -4, 1.8), depth=False)]
    with pytest.raises(BadInputError, match='in a plane'):
        calibrate(record_all(cameras, truth, noise=0.002), CalibrationParams(clocks_agree=True))


def test_a_camera_with_a_known_tilt():
    cameras = around(2)
    tilt = float(np.degrees(np.arctan2(0.8, 4)))  # from 1.8 m to 1 m, 4 m away
    found = calibrate(record_all(cameras), CalibrationParams(tilt=('camera_1', tilt)))
    assert up_error(found.rig, cameras) < 0.3 and found.floor.std == 0


def test_without_ankles_there_is_no_floor():
    ankles = np.isin(np.arange(18), [10, 13])[:, None]
    recordings = [dataclasses.replace(one, points=np.where(ankles, np.nan, one.points))
                  for one in record_all(around(2))]
    found = calibrate(recordings)
    assert found.floor is None and 'z is not up' in found.warnings[-1]
    np.testing.assert_allclose(found.rig.cameras[0].translation, 0, atol=1e-12)


def test_wrong_parameters():
    recordings = record_all(around(2), seconds=3)
    with pytest.raises(BadInputError, match="no camera 'top', but camera_0, camera_1"):
        calibrate(recordings, CalibrationParams(tilt=('top', 10.0)))
    with pytest.raises(BadInputError, match='depth tells the scale'):
        calibrate(recordings, CalibrationParams(distance=('camera_0', 'camera_1', 3.0)))
