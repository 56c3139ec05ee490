"""Pictures of keypoints: what is chosen, what the axes hold, gaps, and files that are the same each time."""
import numpy as np
import pytest

from known_tables import known_table
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.plots import keypoint_plots
from openpose_ros_tools.plots.plotting import save_figure
from openpose_ros_tools.tables.keypoint_selection import ground_places, select, vertical_axis

BEGIN = 1700000000 * 10 ** 9
STEP = 10 ** 8
# Heights above the hips [m] of joints that stand upright; all others are at the hips.
HEIGHTS = {'nose': 0.7, 'neck': 0.5, 'right_ankle': -0.9, 'left_ankle': -0.9}
NUMBER = {joint: number for number, joint in enumerate(MESSAGE_JOINTS)}


def a_table(frames, persons=(0,), dimensions=3, up=(0.0, -1.0, 0.0)):
    """Upright people with COCO's joints at 10 Hz; person p goes to the right by 0.1 m a frame, at p + 2 m.

    Args:
        frames: numbers of the frames with all people.
        up: direction in which heads are.
    """
    frame, person = np.array([(frame, person) for frame in frames for person in persons], np.int64).T
    heights = np.array([HEIGHTS.get(joint, 0.0) for joint in COCO_18.joints])
    places = np.stack([0.1 * frame, 0.0 * frame, person + 2.0], axis=1)[:, np.newaxis] + heights[:, np.newaxis] * up
    joints = places if dimensions == 3 else 100 * places[..., :2] / places[..., 2:]
    return known_table(BEGIN + frame * STEP, person, joints, confidence=0.9)


@pytest.mark.parametrize('kind', ['png', 'svg'])
def test_same_bytes_each_time(tmp_path, kind):
    # rows that come in another order are the same recording
    table, paths = a_table(range(5), (0, 1), dimensions=2), [tmp_path / f'{name}.{kind}' for name in 'ab']
    for rows, path in zip((table, table.select(np.arange(len(table))[::-1])), paths):
        save_figure(keypoint_plots.paths_of_people(select(rows)), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_single_frame_can_be_plotted(tmp_path):
    selection = select(a_table([0], (0, 5)))
    for figure in (keypoint_plots.detections(selection), keypoint_plots.paths_of_people(selection),
                   keypoint_plots.trajectory(selection, 'neck')):
        save_figure(figure, tmp_path / 'a.png')
        assert (tmp_path / 'a.png').stat().st_size > 5000


def test_most_seen_people_are_chosen():
    table = a_table(range(10), range(10))
    selection = select(table.select(table.stamps <= BEGIN + table.ids * STEP))
    assert selection.persons == tuple(range(2, 10)) and selection.left_out == 2


def test_frames_without_people_are_no_gap():
    selection = select(a_table([0, 1, 2, 3, 9, 10]), BEGIN + np.arange(12) * STEP)
    assert len(selection.frames) == 12
    counts = keypoint_plots.detections(selection).axes[1].get_lines()[0].get_ydata()
    assert counts.tolist() == [1, 1, 1, 1, 0, 0, 0, 0, 0, 1, 1, 0]


@pytest.mark.parametrize('up, axis', [((0, -1, 0), (1, -1)), ((0, 0, 1), (2, 1)), ((1, 0, 0), (0, 1)),
                                      ((0, -0.95, 0.3), (1, -1))])
def test_which_axis_is_vertical(up, axis):
    assert vertical_axis(a_table(range(3), up=up)) == axis


def test_view_from_above_in_the_cameras_frame():
    axes = keypoint_plots.paths_of_people(select(a_table(range(5), (0, 1)))).axes[0]
    lines = {line.get_label(): line.get_xydata() for line in axes.get_lines() if 'person' in line.get_label()}
    assert lines['person 1 (mid hip)'] == pytest.approx(np.stack([np.arange(5) * 0.1, np.full(5, 3.0)], 1))
    assert any(text.get_text() == 'camera' for text in axes.texts)


def test_neck_stands_for_hips_that_are_not_seen():
    table = a_table(range(4))
    table.positions[1:, NUMBER['left_hip']] = np.nan
    places, joint = ground_places(table)
    assert joint == 'neck' and places[:, 1] == pytest.approx(-0.5)


def test_trajectory_breaks_at_gaps_and_misses():
    table = a_table([0, 1, 2, 3, 4, 14, 15])
    table.positions[2, NUMBER['neck']] = np.nan
    line = keypoint_plots.trajectory(select(table), 'neck').axes[0].get_lines()[0]
    assert line.get_ydata() == pytest.approx(np.array([0, 0.1, np.nan, 0.3, 0.4, 0.4, np.nan, 1.4, 1.5]), nan_ok=True)
