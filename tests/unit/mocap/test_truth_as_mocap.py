"""True joints of a sequence as a motion capture file: against curves that are known between the pictures."""
import json
from pathlib import Path

import numpy as np
import pytest

from openpose_ros_pkg.command_line import DONE, REFUSED
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.mocap.files import read_mocap
from openpose_ros_tools.mocap.joints import JointRecording, joints_of
from openpose_ros_tools.mocap.marker_map import read_marker_map
from truth_as_mocap import as_markers, main, read_truth, resample, rigid_transform

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
RATE = 15.0


def curve(times, joint):
    """Return the place of a joint that sways by 0.2 m within 2 s, (..., 3) [m]."""
    phase = np.pi * np.asarray(times) + 0.3 * joint
    return np.stack([0.2 * np.sin(phase), 0.2 * np.cos(phase), 2 + 0 * phase], axis=-1)


@pytest.fixture()
def folder(tmp_path):
    """Person 3 is there all the time, person 7 from frame 5 to 9, in frame 15 alone, and from frame 20."""
    frames = []
    for i in range(30):
        people = [3] + [7] * (5 <= i < 10 or i == 15 or i >= 20)
        frames.append({'i': i, 't': round(i / RATE, 6), 'people': [
            {'id': person, 'xyz': [curve(i / RATE, joint).tolist() for joint in range(18)]} for person in people]})
    (tmp_path / 'gt.json').write_text(json.dumps({'joints': list(COCO_18.joints), 'frames': frames}))
    return tmp_path


def test_the_truth_is_read(folder):
    truth = read_truth(folder)
    assert truth.subjects == ('person3', 'person7')
    assert len(truth.times) == 30
    np.testing.assert_allclose(truth.positions[0, :, :18], curve(truth.times[:, None], np.arange(18)), atol=1e-5)
    assert np.isnan(truth.positions[:, :, 18:]).all()
    there = np.isfinite(truth.positions[1, :, 0, 0])
    assert np.flatnonzero(there).tolist() == [5, 6, 7, 8, 9, 15, *range(20, 30)]


def test_between_the_pictures_it_follows_the_curve(folder):
    joints = resample(read_truth(folder), 120.0, clock_offset=12.345)
    np.testing.assert_allclose(joints.times * 120, np.rint(joints.times * 120), atol=1e-9)
    assert joints.times[0] >= 12.345 > joints.times[0] - 1 / 120
    # a natural bound for splines of 15 Hz on a motion of 0.5 Hz
    expected = curve(joints.times[:, None] - 12.345, np.arange(18))
    np.testing.assert_allclose(joints.positions[0, :, :18], expected, atol=2e-4)


def test_nothing_is_made_up_where_a_person_is_away(folder):
    joints = resample(read_truth(folder), 120.0)
    frame = joints.times * RATE
    there = np.isfinite(joints.positions[1, :, 0, 0])
    stay = ((frame > 4.999) & (frame < 9.001)) | (frame > 19.999)
    assert np.array_equal(there, stay)


def test_the_same_rate_gives_the_same_places(folder):
    truth = read_truth(folder)
    joints = resample(truth, RATE)
    alone = np.s_[1, 15]
    np.testing.assert_allclose(np.delete(joints.positions[1], 15, 0), np.delete(truth.positions[1], 15, 0), atol=1e-5)
    assert np.isnan(joints.positions[alone]).all()


def test_nobody_is_resampled_to_nobody():
    joints = resample(JointRecording((), [0.0, 1.0], np.zeros((0, 2, 27, 3))), 10.0)
    assert joints.positions.shape == (0, 11, 27, 3)
    assert as_markers(joints, np.eye(4)).names == ()


def test_too_low_a_rate_is_refused(folder):
    with pytest.raises(BadInputError, match=r'hold no sample at 0\.1 Hz'):
        resample(read_truth(folder), 0.1, clock_offset=1.0)


def test_transforms_by_hand():
    np.testing.assert_allclose(rigid_transform((90, 0, 0), (1, 2, 3)) @ [0, 1, 0, 1], [1, 2, 4, 1], atol=1e-12)
    np.testing.assert_allclose(rigid_transform((0, 90, 0), (0, 0, 0)) @ [0, 0, 1, 1], [1, 0, 0, 1], atol=1e-12)
    # first about x, then about z
    np.testing.assert_allclose(rigid_transform((90, 0, 90), (0, 0, 0)) @ [1, 2, 3, 1], [3, 1, 2, 1], atol=1e-12)


def test_noise_is_as_large_as_asked_for_and_the_same_again(folder):
    joints = resample(read_truth(folder), 120.0)
    plain, noisy, again = (as_markers(joints, np.eye(4), noise) for noise in (0.0, 0.005, 0.005))
    np.testing.assert_array_equal(noisy.positions, again.positions)
    assert np.nanstd(noisy.positions - plain.positions) == pytest.approx(0.005, rel=0.03)
    assert not np.allclose(noisy.positions, as_markers(joints, np.eye(4), 0.005, seed=1).positions, equal_nan=True)


@pytest.mark.parametrize('suffix', ['.csv', '.trc', '.c3d'])
def test_the_shipped_sequence_comes_back(tmp_path, suffix, capsys):
    out = tmp_path / f'cross{suffix}'
    arguments = [str(SHIPPED), str(out), '--rate', '30', '--clock-offset', '2', '--rotate-degrees', '90', '-20', '30',
                 '--move', '-1', '2', '0.5']
    assert main(arguments) == DONE
    assert '79 samples at 30 Hz, 36 markers of person1, person2' in capsys.readouterr().out
    joints, truth = joints_of(read_mocap(out), read_marker_map()), read_truth(SHIPPED)
    assert joints.subjects == truth.subjects
    transform = rigid_transform((90, -20, 30), (-1, 2, 0.5))
    expected = truth.positions[:, :, :18] @ transform[:3, :3].T + transform[:3, 3]
    # gt.json has its times in microseconds, in which people move less than 10 um
    np.testing.assert_allclose(joints.times[::2] - 2, truth.times, atol=2e-6)
    np.testing.assert_allclose(joints.positions[:, ::2, :18], expected, atol=1e-5)
    chest = joints.positions[:, ::2, MESSAGE_JOINTS.index('chest')]
    corners = [MESSAGE_JOINTS.index(f'{side}_{end}') for side in ('left', 'right') for end in ('shoulder', 'hip')]
    np.testing.assert_allclose(chest, expected[:, :, corners].mean(axis=2), atol=1e-5)


@pytest.mark.parametrize('options, told', [
    (['out.bvh'], 'expected one of .csv, .c3d, .trc'),
    (['there.csv'], 'is there already'),
    (['out.csv', '--rate', '0'], '--rate 0: expected a number above 0'),
    (['out.csv', '--noise', '-1'], '--noise -1: expected a number of 0 or more'),
    (['out.csv', '--move', 'nan', '0', '0'], 'expected finite numbers'),
    (['out.c3d', '--clock-offset', '-5'], 'from 0 on, got -5 s first'),
])
def test_wrong_options_are_refused_and_nothing_is_written(folder, capsys, options, told):
    (folder / 'there.csv').write_text('mine')
    before = sorted(folder.iterdir())
    assert main([str(folder), str(folder / options[0]), *options[1:]]) == REFUSED
    assert told in capsys.readouterr().err
    assert sorted(folder.iterdir()) == before
    assert (folder / 'there.csv').read_text() == 'mine'


def test_overwrite(folder):
    (folder / 'there.csv').write_text('mine')
    assert main([str(folder), str(folder / 'there.csv'), '--overwrite']) == DONE
    assert len(read_mocap(folder / 'there.csv').names) == 36


@pytest.mark.parametrize('content, told', [
    (None, 'can not be read: .*No such file'),
    ('{', 'can not be read'),
    ('[]', 'expected joints'),
    ('{"joints": ["knee"], "frames": []}', 'expected joints'),
    ('{"joints": ["nose"], "frames": [{"t": 0, "people": [{"id": 1, "xyz": [[1, 2]]}]}]}', 'expected joints'),
])
def test_a_wrong_truth_is_refused(tmp_path, content, told):
    if content is not None:
        (tmp_path / 'gt.json').write_text(content)
    with pytest.raises(BadInputError, match=told):
        read_truth(tmp_path)
