"""Cameras that see the same people are placed to one another, in time and space, or it is said why not."""
import dataclasses

import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.calibration import calibrate as calibration
from openpose_ros_tools.calibration.calibrate import CalibrationParams, calibrate
from openpose_ros_tools.calibration.gathering import gather
from simulated_mocap import walkers
from simulated_room import Camera, around, record_all, rig_errors, up_error

# Clocks of the cameras differ by this [s].
CLOCKS = (0.0, 0.07, -0.9)
IMAGES = CalibrationParams(clocks_agree=True)


def late(cameras):
    """Return the cameras with clocks of their own."""
    return [dataclasses.replace(camera, clock=clock) for camera, clock in zip(cameras, CLOCKS)]


def short(cameras, truth=None, seconds=6, **values):
    """Return recordings that are as short as they may be, for the sake of time."""
    return record_all([dataclasses.replace(camera, rate=min(camera.rate, 10)) for camera in cameras], truth, seconds,
                      **values)


def placed(truth, positions):
    """Return people whose joints are at other positions (S, T, 26, 3) [m]."""
    return dataclasses.replace(truth, joints=dataclasses.replace(truth.joints, positions=positions))


def apart(cameras):
    """Return the true distance of the first two cameras as it is given to the calibration."""
    return (cameras[0].name, cameras[1].name, float(np.linalg.norm(np.subtract(*(one.centre for one in cameras[:2])))))


def check(found, cameras, angle=0.4, position=0.02, clock=0.005):
    """Compare with the truth; limits: [degrees], [m], [s]."""
    errors = rig_errors(found.rig, cameras)
    assert np.all(errors < (angle, position, clock)), errors


@pytest.fixture(scope='module')
def three():
    cameras = late(around(3))
    return cameras, calibrate(short(cameras))


def test_no_people_and_one_camera_are_refused():
    first, second = short(around(2), seconds=2)
    empty = dataclasses.replace(second, **{name: getattr(second, name)[:0]
                                           for name in ('stamps', 'ids', 'positions', 'sigma')})
    for recordings, told in (([], r'people of 0 cameras \(none\), expected of 2'),
                             ([first], r'people of 1 cameras \(camera_0\)'),
                             ([first, empty], 'camera_1 saw people in 0 frames'),
                             ([first, first], "two cameras have the name 'camera_0'")):
        with pytest.raises(BadInputError, match=told):
            calibrate(recordings)


def test_three_cameras_with_clocks_of_their_own(three):
    cameras, found = three
    check(found, cameras)
    assert [camera.name for camera in found.rig.cameras] == [f'camera_{number}' for number in range(3)]
    assert found.rig.camera('camera_2').frame_id == 'camera_2_optical' and not found.warnings
    assert len(found.edges) == 3 and all(edge.joints > 50 for edge in found.edges)
    # two measurements, each with 15 mm per axis; what is left of them beside the adjusted joints, in pixels at 4 m
    assert all(0.02 < edge.distance < 0.05 and 0.5 < edge.pixels < 4 for edge in found.edges)


def test_gates_narrow_to_their_own_width(monkeypatch):
    wide = []
    monkeypatch.setattr(calibration, 'gather', lambda cameras, poses, factor: (
        wide.append(factor), gather(cameras, poses, factor))[1])
    calibrate(short(around(2)))
    assert wide[0] > wide[-1] == 1.0


@pytest.mark.parametrize('depth', [True, False])
def test_standard_deviations_are_those_of_the_errors(depth):
    """Errors last for half a second, half of them are alike in all joints of a person. On the mean over rigs."""
    ratios = []
    for seed in range(2):
        cameras = around(3, depth=depth)
        found = calibrate(short(cameras, seconds=8, seed=seed, noise=0.03, lasting=0.5), CalibrationParams(
            clocks_agree=True, distance=None if depth else apart(cameras)))
        assert np.all(found.std[0] == 0)
        ratios.append(rig_errors(found.rig, cameras)[:, :2] / found.std[1:, :2])
    spread = np.sqrt(np.square(ratios).mean(axis=(0, 1)))
    assert np.all((spread > 0.5) & (spread < 2)), spread


def test_groups_that_share_no_people_are_refused():
    """One camera sees another walk than the other two."""
    for depth, told in ((True, r'2 groups that share no people: camera_0, camera_1 \| camera_2\.'),
                        (False, 'do not tell how these')):
        cameras = around(3, depth=depth)
        with pytest.raises(BadInputError, match=told):
            calibrate(short(cameras[:2], seed=1, people=1) + short(cameras[2:], seed=2, people=1),
                      None if depth else IMAGES)


def test_z_is_up_from_the_floor(three):
    """The ankles of `walkers` are 0.08 m high; the first camera looks along x."""
    cameras, found = three
    assert up_error(found.rig, cameras) < 0.5
    rotation, centre = found.rig.cameras[0].pose
    np.testing.assert_allclose(centre, [0, 0, 1.5], atol=0.03)
    assert rotation[0, 2] > 0.9 and abs(rotation[1, 2]) < 1e-9


def test_a_chain_of_cameras_that_do_not_all_overlap():
    """The first and the last one share no people."""
    cameras = [Camera('left', (-3, -4, 1.6), (-2, 0, 1), sees=lambda at: at[..., 0] < -0.2),
               Camera('middle', (0, -4, 1.8), clock=0.05, sees=lambda at: np.abs(at[..., 0]) < 1.5),
               Camera('right', (3, -4, 1.4), (2, 0, 1), clock=0.1, sees=lambda at: at[..., 0] > 0.2)]
    found = calibrate(short(cameras, seconds=12, people=3))
    check(found, cameras, angle=0.8, position=0.06, clock=0.01)
    assert {(edge.first, edge.second) for edge in found.edges} == {('left', 'middle'), ('middle', 'right')}


def test_cameras_of_different_rates_and_two_people_exchanged():
    cameras = [dataclasses.replace(camera, rate=rate) for camera, rate in zip(around(2), (20.0, 6.0))]
    first, second = record_all(cameras, walkers(8, 2, seed=1, rate=60))
    later = second.stamps > np.median(second.stamps)
    exchanged = dataclasses.replace(second, ids=np.where(later, 1 - second.ids, second.ids))
    check(calibrate([first, exchanged]), cameras, clock=0.01)


BIAS = np.isin(np.arange(18), [8, 11]) * 0.03 + np.isin(np.arange(18), [2, 5]) * 0.02


@pytest.mark.parametrize('cameras, people, limits', [
    (late(around(2)), 1, {}),
    # depths that all cameras misjudge alike: hips 30 mm, shoulders 20 mm too near; the cameras are around people
    (around(3, bias=BIAS), 2, {}),
    (late(around(2, depth=False)), 2, {'angle': 0.5, 'position': 0.05, 'clock': 0.015}),
], ids=['one person', 'biased depths', 'clocks of images alone'])
def test_cameras_of_other_kinds(cameras, people, limits):
    params = CalibrationParams() if cameras[0].depth else CalibrationParams(distance=apart(cameras))
    check(calibrate(short(cameras, walkers(6, people, seed=3)), params), cameras, **limits)


def test_scale_of_images_alone():
    """The distance of two cameras gives the scale exactly; the stature as well as it is known."""
    cameras = around(2, depth=False)
    recordings = short(cameras)
    found = [calibrate(recordings, dataclasses.replace(IMAGES, **given)) for given in (
        {'distance': apart(cameras)}, {'stature': 1.7}, {'stature': 1.87})]
    check(found[0], cameras, angle=0.3, position=0.03)
    distances = [np.linalg.norm(np.subtract(*(one.translation for one in each.rig.cameras))) for each in found]
    assert distances[0] == pytest.approx(apart(cameras)[2])
    assert distances[2] / distances[1] == pytest.approx(1.1, abs=0.01)


def test_four_images_of_people_partly_seen_by_a_detector_that_errs():
    """Keypoints are missing, or anywhere, or those of the other side of the body; legs are cut off by one image."""
    cameras = around(4, depth=False)
    random, recordings = np.random.RandomState(0), []
    for recording in short(cameras, seconds=8, people=1):
        points = recording.positions.copy()
        mirrored = random.uniform(size=len(points)) < 0.03
        points[mirrored] = points[mirrored][:, COCO_18.swap]
        anywhere = random.uniform(size=points.shape[:2]) < 0.05
        points[anywhere, :2] += random.normal(scale=0.1, size=(anywhere.sum(), 2))
        points[random.uniform(size=points.shape[:2]) < 0.2] = np.nan
        recordings.append(dataclasses.replace(recording, positions=points))
    cut = recordings[3].positions[..., 1] > 0.15
    recordings[3].positions[cut] = np.nan
    found = calibrate(recordings, dataclasses.replace(IMAGES, distance=apart(cameras)))
    check(found, cameras, angle=0.8, position=0.07)


TRUTH = walkers(6, 2, seed=0)
# One person whose neck stays in one place.
STILL = placed(TRUTH, (TRUTH.joints.positions - TRUTH.joints.positions[:, :, [1]] + [0, 0, 1.4])[:1])


def test_people_who_do_not_tell_the_poses_are_refused():
    """In one place, by two images; in a plane, which fits more than one way to stand of two images."""
    for truth, told in ((STILL, 'do not tell how these'), (placed(TRUTH, TRUTH.joints.positions * [1, 0, 1]), 'plane')):
        cameras = [Camera('left', (-2, -4, 1.5), depth=False), Camera('right', (2, -4, 1.8), depth=False)]
        with pytest.raises(BadInputError, match=told):
            calibrate(short(cameras, truth, noise=0.002), IMAGES)


def test_a_person_in_one_place_tells_the_poses_of_four_images():
    """Two images alone do not, so that each camera is found by the people that others have placed."""
    cameras = around(4, depth=False)
    found = calibrate(short(cameras, STILL, noise=0.004), dataclasses.replace(IMAGES, distance=apart(cameras)))
    check(found, cameras, angle=1.0, position=0.08)
    assert np.all(found.std[1:, 0] > 0.3)  # errors of keypoints that last do not average out


def test_without_ankles_there_is_no_floor():
    ankles = np.isin(np.arange(18), [10, 13])[:, None]
    recordings = [dataclasses.replace(one, positions=np.where(ankles, np.nan, one.positions))
                  for one in short(around(2))]
    found = calibrate(recordings)
    assert found.floor is None and 'z is not up' in found.warnings[-1]
    np.testing.assert_allclose(found.rig.cameras[0].translation, 0, atol=1e-12)
