"""Clock offset and transform between a camera and motion capture are found without a prior, or refused."""
import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.alignment import AlignmentParams, align
from openpose_ros_tools.alignment.candidates import rigid_transform
from openpose_ros_tools.mocap.joints import JointRecording
from simulated_mocap import Simulated, errors, sequence_truth, simulate, walkers
from skeleton_extract_3d.people import MISSING

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
FRAME_MS = 1e3 / 15


@pytest.fixture(scope='module')
def long_scene() -> Simulated:
    """Two people for 40 s, of which a camera sees 7 s, from the 21st second on."""
    return simulate(walkers(40, 2, seed=3), seed=4, seen=(21, 28))


NOTHING_GIVEN = AlignmentParams()


def refused_or_doubted(estimate, reference, params=NOTHING_GIVEN):
    """Whether there is an error or a warning."""
    try:
        return bool(align(estimate.measured(), reference, params).warnings)
    except BadInputError:
        return True


@pytest.mark.parametrize('seed', range(3))
def test_shipped_sequence(seed):
    """Limits: a quarter of a frame, 0.5 degrees, 5 mm at the people and at the camera."""
    scene = simulate(sequence_truth(SHIPPED), seed)
    found = align(scene.estimate.measured(), scene.reference)
    offset, angle, at_people, at_camera = errors(scene, found)
    assert offset < FRAME_MS / 4 and angle < 0.5 and at_people < 5 and at_camera < 5
    assert not found.warnings and not found.clock_given and not found.transform_given
    assert found.speed_correlation > 0.8 and abs(found.scale - 1) < 0.005


def test_part_of_a_long_recording(long_scene):
    found = align(long_scene.estimate.measured(), long_scene.reference)
    offset, angle, at_people, at_camera = errors(long_scene, found)
    assert offset < 2 and angle < 0.1 and at_people < 3 and at_camera < 5
    assert np.abs(long_scene.clock_offset) > 1e9  # the clocks are years apart


def test_standard_deviations_are_those_of_the_errors():
    """Root mean square of error / deviation over recordings is about 1."""
    truth, ratios = walkers(4, 1, seed=5), []
    for seed in range(10):
        scene = simulate(truth, seed)
        found = align(scene.estimate.measured(), scene.reference)
        offset, angle, _, _ = errors(scene, found)
        ratios.append((offset / (1e3 * found.std[0]), angle / found.std[1]))
    assert np.all(np.abs(np.sqrt(np.mean(np.square(ratios), axis=0)) - 1) < 0.5)


def test_what_is_given_is_kept(long_scene):
    transform = long_scene.rotation, long_scene.translation
    params = AlignmentParams(clock_offset=long_scene.clock_offset, transform=transform)
    both = align(long_scene.estimate.measured(), long_scene.reference, params)
    assert both.clock_offset == long_scene.clock_offset and both.speed_correlation is None
    np.testing.assert_array_equal(both.rotation, long_scene.rotation)
    np.testing.assert_array_equal(both.translation, long_scene.translation)
    assert both.clock_given and both.transform_given and np.isnan(both.std).all()
    clock = align(long_scene.estimate.measured(), long_scene.reference,
                  AlignmentParams(clock_offset=long_scene.clock_offset))
    assert errors(long_scene, clock)[1] < 0.1 and errors(long_scene, clock)[2] < 3
    place = align(long_scene.estimate.measured(), long_scene.reference,
                  AlignmentParams(transform=transform))
    assert errors(long_scene, place)[0] < 2


def test_offset_is_searched_within_its_limit(long_scene):
    """With clocks of one epoch. A true offset above the limit is not found, and that is told."""
    shifted = dataclasses.replace(long_scene.estimate, stamps=long_scene.estimate.stamps
                                  + np.int64(round(1e9 * (long_scene.clock_offset - 4.0))))
    found = align(shifted.measured(), long_scene.reference, AlignmentParams(max_clock_offset=10))
    assert abs(found.clock_offset - 4.0) < 0.002
    assert refused_or_doubted(shifted, long_scene.reference, AlignmentParams(max_clock_offset=1))


def test_standing_people_tell_no_clock():
    truth = walkers(6, 2, seed=0)
    still = JointRecording(truth.joints.subjects, truth.joints.times,
                           np.repeat(truth.joints.positions[:, :1], len(truth.joints.times), axis=1))
    scene = simulate(dataclasses.replace(truth, joints=still), seed=1)
    with pytest.raises(BadInputError, match='--clock-offset'):
        align(scene.estimate.measured(), scene.reference)
    found = align(scene.estimate.measured(), scene.reference,
                  AlignmentParams(clock_offset=scene.clock_offset))
    assert errors(scene, found)[1] < 0.3 and errors(scene, found)[2] < 3


def test_another_scene_is_refused_or_doubted(long_scene):
    assert refused_or_doubted(long_scene.estimate, simulate(walkers(30, 2, seed=8), seed=9).reference)


def stamps_from_0(table):
    return dataclasses.replace(table, stamps=np.where(np.arange(len(table)) == 0, 0, table.stamps))


@pytest.mark.parametrize('change, told', [
    (lambda table: table.select(np.zeros(len(table), bool)), 'no rows'),
    (lambda table: dataclasses.replace(table, status=np.full_like(table.status, MISSING)), 'in common'),
    (stamps_from_0, 'times of the poses span')], ids=['no people', 'no measured joints', 'a stamp of 0'])
def test_poses_that_tell_nothing_are_refused(long_scene, change, told):
    with pytest.raises(BadInputError, match=told):
        align(change(long_scene.estimate).measured(), long_scene.reference)


def test_sigma_weighs(long_scene):
    """Joints that are said to be bad do not bear on the result."""
    bad = np.arange(long_scene.estimate.positions.shape[1]) % 2 == 0
    random = np.random.RandomState(0)
    noise = 0.08 * random.normal(size=long_scene.estimate.positions.shape) * bad[:, None]
    noisy = dataclasses.replace(
        long_scene.estimate, positions=long_scene.estimate.positions + noise,
        sigma=np.where(bad, 0.14, long_scene.estimate.sigma).astype(np.float32))
    weighed = align(noisy.measured(), long_scene.reference, AlignmentParams(use_sigma=True))
    plain = align(noisy.measured(), long_scene.reference)
    assert errors(long_scene, weighed)[1] < 0.15 and weighed.std[1] < plain.std[1]


def test_rigid_transform_is_no_mirror_image():
    """Points in a plane, whose best fit could as well be a mirror image."""
    random = np.random.RandomState(0)
    points = random.normal(size=(20, 3)) * (1, 1, 0)
    rotation = cv2.Rodrigues(np.array([0.3, -1, 2]))[0]
    found, translation = rigid_transform(points, points @ rotation.T + (1, 2, 3), np.ones(20))
    np.testing.assert_allclose(found, rotation, atol=1e-12)
    np.testing.assert_allclose(translation, (1, 2, 3), atol=1e-12)
