"""The report's section on repeatability: known differences of two tables."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter
from openpose_ros_tools.tables.keypoint_table import PersonRow
from sections.repeatability import difference
from skeleton_extract_3d.people import INFERRED, MEASURED

FRAMES = 4


def write(path, moved=0.0, inferred=0, ids=(1, 2)):
    """Write people at the same place in all frames; the first joint of the first person is moved along x [m]."""
    parts = np.zeros((len(MESSAGE_JOINTS), 6), np.float32)
    parts[:] = 1, 2, 3, 0.9, MEASURED, 0.02
    other = parts.copy()
    other[0, 0] += moved
    other[:inferred, 4] = INFERRED
    with path.open('w') as handle:
        writer = KeypointCsvWriter(handle, 'extended', 3)
        for frame in range(FRAMES):
            writer.write([PersonRow(10 ** 9 * (frame + 1), frame, 10 ** 9 * (frame + 1), 'camera', len(ids), person,
                                    other if row == 0 else parts) for row, person in enumerate(ids)])
    return path


@pytest.mark.parametrize('change, same, people, status, maximum', [
    ({}, True, (0, 2 * FRAMES), 0, 0), ({'moved': 0.005, 'inferred': 2}, False, (0, 2 * FRAMES), 2 * FRAMES, 5),
    ({'ids': (1, 3)}, False, (2 * FRAMES, 3 * FRAMES), 0, 0)])
def test_differences_of_tables(tmp_path, change, same, people, status, maximum):
    """A person with another id is one that only one table has, in each frame and table."""
    equal, found = difference(write(tmp_path / 'a.csv'), write(tmp_path / 'b.csv', **change))
    assert (equal, (found['people'].value, found['people'].n), found['status'].value) == (same, people, status)
    assert found['maximum'].value == pytest.approx(maximum, abs=1e-3) and found['median'].value == 0
