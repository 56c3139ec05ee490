"""Figures of a comparison with motion capture agree with what was put in."""
import dataclasses

import numpy as np
import pytest

from known_tables import known_table
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.mocap.evaluation import compare
from openpose_ros_tools.mocap.figures import summarize
from openpose_ros_tools.mocap.joints import JointRecording
from simulated_mocap import STANDING
from skeleton_extract_3d.people import INFERRED, MISSING

JOINTS = len(MESSAGE_JOINTS)
WRIST, NOSE, ELBOW = (MESSAGE_JOINTS.index(name) for name in ('right_wrist', 'nose', 'right_elbow'))
RATE, OFFSET = 10, 100.0
ALIGNED = Alignment(0.0, np.eye(3), np.zeros(3), clock_offset=OFFSET, clock_given=True, transform_given=True)


def body():
    points = np.full((JOINTS, 3), np.nan)
    for name, place in STANDING.items():
        points[MESSAGE_JOINTS.index(name)] = place
    return points


def reference(*paths, times=None):
    """Standing subjects at places along x [m], one path (T,) each."""
    positions = np.array(paths, float)[..., None, None] * (1, 0, 0) + body()
    times = np.arange(positions.shape[1]) / RATE if times is None else np.array(times, float)
    return JointRecording(tuple(f'subject{number}' for number in range(len(paths))), times + OFFSET, positions)


def estimate(rows):
    """Rows of (frame, id, place along x [m]); all joints measured."""
    frames, ids, places = (np.array(column) for column in zip(*rows))
    positions = places[:, None, None] * (1.0, 0, 0) + body()
    return known_table(np.rint(frames * 1e9 / RATE).astype(np.int64), ids, positions, MESSAGE_JOINTS)


def moved(table, rows, joint, by, status=None):
    positions, statuses = table.positions.copy(), table.status.copy()
    positions[rows, joint] += by
    if status is not None:
        statuses[rows, joint] = status
    return dataclasses.replace(table, positions=positions, status=statuses)


def standing(frames=4):
    return estimate([(frame, 5, 0.0) for frame in range(frames)]), reference([0.0] * frames)


def test_errors_of_one_joint():
    """Of four answers one is 60, one 120 mm off and inferred, and one is missing."""
    table, truth = standing()
    table = moved(table, 1, WRIST, (0.06, 0, 0))
    table = moved(table, 2, WRIST, (0, 0.12, 0), INFERRED)
    table = moved(table, 3, WRIST, np.nan, MISSING)
    values = summarize(compare(table, truth, ALIGNED))
    wrist = values['joints']['right_wrist']
    assert (wrist['reference'], wrist['answered'], wrist['share_answered']) == (4, 3, 0.75)
    assert values['overall']['reference'] == 4 * len(STANDING)
    assert wrist['mean_mm'] == pytest.approx(60, abs=0.01) and wrist['median_mm'] == pytest.approx(60, abs=0.01)
    assert wrist['p90_mm'] == pytest.approx(108, abs=0.01)
    # of the reference, so what is missing is wrong; and of what is answered
    assert [wrist[f'pck_{distance}'] for distance in (50, 100, 150)] == [0.25, 0.5, 0.75]
    assert wrist['pck_100_of_answered'] == pytest.approx(2 / 3, abs=1e-4)
    assert wrist['measured']['answered'] == 2 and wrist['measured']['mean_mm'] == pytest.approx(30, abs=0.01)
    assert wrist['inferred']['answered'] == 1 and wrist['inferred']['mean_mm'] == pytest.approx(120, abs=0.01)
    assert values['joints']['nose']['pck_50'] == 1
    assert values['joints']['nose']['mean_mm'] == pytest.approx(0, abs=1e-3)  # float32
    right, samples = values['sigma']['measured'], 4 * len(STANDING) - 2
    assert (right['samples'], right['within_1_sigma']) == (samples, pytest.approx(1 - 1 / samples, abs=1e-4))
    assert values['sigma']['inferred'] == {'samples': 1, 'within_1_sigma': 0, 'within_2_sigma': 0,
                                           'rms_sigma_mm': pytest.approx(20), 'rms_error_mm': pytest.approx(120)}


def test_bones():
    """Forearms 10 % too long in two frames, 10 % too short in two."""
    table, truth = standing()
    forearm = body()[WRIST] - body()[ELBOW]
    table = moved(moved(table, [0, 1], WRIST, 0.1 * forearm), [2, 3], WRIST, -0.1 * forearm)
    bone = summarize(compare(table, truth, ALIGNED))['bones']['right_elbow - right_wrist']
    length = 1e3 * np.linalg.norm(forearm)
    assert bone['reference_mm'] == pytest.approx(length, abs=0.01) and bone['bias_mm'] == pytest.approx(0, abs=0.01)
    assert bone['mean_abs_mm'] == pytest.approx(0.1 * length, abs=0.01)
    assert bone['variation'] == pytest.approx(np.std([1.1, 1.1, 0.9, 0.9], ddof=1), abs=1e-4)
    assert bone['reference_variation'] == 0


def test_switched_missed_and_further_people():
    table = estimate([(0, 1, 0.1), (0, 2, 2.1), (1, 2, 0.0), (1, 1, 2.0), (2, 2, 0.0), (2, 3, 5.0)])
    found = compare(table, reference([0, 0, 0], [2, 2, 2]), ALIGNED)
    assert found.subject[~found.found].tolist() == [1] and np.isnan(found.errors[~found.found]).all()
    values = summarize(found)
    assert values['compared']['id_switches'] == 2 and found.compared['people_without_reference'] == 1
    assert values['compared']['share_found'] == pytest.approx(5 / 6, abs=1e-4)
    # missed people count as wrong
    assert values['overall']['pck_150'] == pytest.approx(5 / 6, abs=1e-4)
    assert values['overall']['pck_150_of_answered'] == 1
    assert values['subjects']['subject0']['tracks'] == [1, 2] and values['subjects']['subject1']['frames_missed'] == 1


def test_reference_is_interpolated_but_not_extrapolated():
    """The subject walks 1 m/s; frames 0 and 4 are outside, frame 2 lies in a gap that is too long."""
    table = estimate([(frame, 1, 0.1 * frame) for frame in range(5)])
    truth = reference([0.05, 0.15, 0.25, 0.35], times=(0.05, 0.15, 0.25, 0.35))
    found = compare(table, truth, ALIGNED)
    assert found.compared['frames'] == 3 and found.compared['frames_outside_reference'] == 2
    np.testing.assert_allclose(found.errors[:, NOSE], 0, atol=1e-6)
    truth.positions[0, 1] = np.nan
    gap = compare(table, truth, ALIGNED)
    assert gap.times.tolist() == pytest.approx([0.3])


def test_people_are_paired_by_all_joints():
    """A wrist 0.8 m off alone is no other person."""
    table, truth = standing()
    table = moved(table, slice(None), WRIST, (0.8, 0, 0))
    found = compare(table, truth, ALIGNED)
    np.testing.assert_allclose(found.errors[:, found.joints.index('right_wrist')], 0.8, atol=1e-6)


def test_precision_with_clocks_of_an_epoch():
    """Stamps of 2020 in ns, a reference that starts at 0: 1 m/s times the error of the clocks is the error."""
    table = estimate([(frame, 1, 0.1 * frame) for frame in range(5)])
    table = dataclasses.replace(table, stamps=table.stamps + np.int64(1_600_000_000_123_456_789))
    truth = reference(0.01 * np.arange(41), times=0.01 * np.arange(41))
    alignment = dataclasses.replace(ALIGNED, clock_offset=OFFSET - 1_600_000_000.123456789)
    assert compare(table, truth, alignment).errors[:, :18].max() < 2e-6


def test_joints_of_one_side_and_what_can_not_be_compared():
    table, truth = standing()
    with pytest.raises(BadInputError, match=r'within 0\.5 m'):
        compare(estimate([(0, 1, 3.0), (1, 1, 3.0)]), reference([0.0, 0.0]), ALIGNED)
    truth.positions[:, :, NOSE] = np.nan
    found = compare(moved(table, slice(None), WRIST, np.nan, MISSING), truth, ALIGNED)
    assert found.compared['joints_only_in_reference'] == ['right_wrist']
    assert found.compared['joints_only_in_estimate'] == ['nose']
