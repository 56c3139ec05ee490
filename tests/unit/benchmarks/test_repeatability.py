"""The report's section on repeatability: known differences of two tables."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter
from openpose_ros_tools.tables.keypoint_table import PersonRow
from sections.repeatability import WAYS, difference, figures_of
from skeleton_extract_3d.people import INFERRED, MEASURED

FRAMES = 4


def write(path, frames=FRAMES, moved=0.0, inferred=0, ids=(1, 2)):
    """Write people at the same place in all frames; the first joint of the first person is moved along x [m]."""
    parts = np.zeros((len(MESSAGE_JOINTS), 6), np.float32)
    parts[:] = 1, 2, 3, 0.9, MEASURED, 0.02
    other = parts.copy()
    other[0, 0] += moved
    other[:inferred, 4] = INFERRED
    with path.open('w') as handle:
        writer = KeypointCsvWriter(handle, 'extended', 3)
        for frame in range(frames):
            writer.write([PersonRow(10 ** 9 * (frame + 1), frame, 10 ** 9 * (frame + 1), 'camera', len(ids), person,
                                    other if row == 0 else parts) for row, person in enumerate(ids)])
    return path


def test_the_same(tmp_path):
    found = difference(write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv'))
    assert found.same and found.people == (0, 2 * FRAMES) and found.status == (0, 2 * FRAMES * len(MESSAGE_JOINTS))
    assert found.errors.max() == 0


def test_the_first_frames_alone(tmp_path):
    """A shorter table is compared as far as it goes."""
    found = difference(write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv', frames=2))
    assert found.same and found.people == (0, 4) and len(found.errors) == 4 * len(MESSAGE_JOINTS)


def test_a_joint_moved_and_others_inferred(tmp_path):
    found = difference(write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv', moved=0.005, inferred=2))
    values = figures_of(WAYS[1], found)
    assert not found.same and values['again_status'].value == 2 * FRAMES
    assert values['again_maximum'].value == pytest.approx(5, abs=1e-3) and values['again_median'].value == 0


def test_another_id(tmp_path):
    """A person with another id is one that only one table has, in each frame and table."""
    found = difference(write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv', ids=(1, 3)))
    assert found.people == (2 * FRAMES, 3 * FRAMES)
