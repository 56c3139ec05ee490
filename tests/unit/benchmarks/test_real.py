"""The report's section on real data: files are read as they were written, people count where they are marked."""
import json

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from results import NeedsDataError, Options
from sections import sensors
from sections.real import LIMBS, SIZE, Recording, _right, counted, frames_of_folder, measure, picture
from sections.sensors import filled, gaps
from skeleton_extract_3d.people import MEASURED, MISSING, People3D

MATRIX = np.array([[600.0, 0, 310], [0, 610, 250], [0, 0, 1]])


@pytest.fixture
def frame(tmp_path):
    """A frame of a camera before a wall, 3 m away, whose left half has no depth."""
    depth = np.full((480, 640), 3000, np.uint16)
    depth[:, :320] = 0
    for name, image in (('color', np.full((480, 640, 3), 128, np.uint8)), ('depth', depth)):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / '00020.png'), image)
    (tmp_path / 'cam_params_realsense.json').write_text(json.dumps(
        {'width': 640, 'height': 480, 'intrinsic_matrix': MATRIX.T.ravel().tolist()}))
    found, = frames_of_folder(tmp_path)
    return found


def person(status):
    """Return a person whose right arm alone is known, 2 m away, its wrist 0.4 m beside its elbow."""
    xyz, kinds = np.full((1, 18, 3), np.nan, np.float32), np.full((1, 18), MISSING, np.uint8)
    for joint, x in (('right_elbow', 0.1), ('right_wrist', 0.5)):
        xyz[0, COCO_18.index[joint]], kinds[0, COCO_18.index[joint]] = (x, 0.0, 2.0), status
    return People3D(COCO_18, xyz, np.ones((1, 18), np.float32), kinds, np.full((1, 18), 0.02, np.float32),
                    np.array([3]))


def test_nothing_there(tmp_path):
    with pytest.raises(NeedsDataError, match=f'^{tmp_path}'):
        measure(Options(data={'real': tmp_path}))


def test_depth_of_cameras_that_is_not_there_is_named(tmp_path):
    with pytest.raises(NeedsDataError, match=str(tmp_path / 'vcl_rs_depth')):
        sensors.measure(Options(data={'real': tmp_path}))


def test_the_camera_is_written_column_by_column(frame):
    np.testing.assert_array_equal(frame.grid.camera_model().matrix, MATRIX)


def test_people_are_drawn_over_image_and_depth(frame):
    """The forearm over both; where there is no depth it is black."""
    drawn = picture(frame, person(MEASURED))
    assert drawn.shape == (SIZE[1], 2 * SIZE[0], 3)
    wrist = int(SIZE[0] / 640 * (MATRIX[0, 0] * 0.25 + MATRIX[0, 2]))
    assert np.abs(drawn[int(SIZE[0] / 640 * MATRIX[1, 2]), wrist - 20].astype(int) - 128).max() > 60
    assert (drawn[20, SIZE[0] + 20] == 0).all() and drawn[20, -20].any()


def test_people_count_where_they_are_marked(frame):
    """The shoulder is at the pixel (370, 250); hips are behind the far end of a cloth, or on it."""
    people = person(MEASURED)
    for joint, place in (('right_shoulder', (0.2, 0, 2)), ('right_hip', (0.2, 0.5, 2.1)), ('left_hip', (0, 0.5, 1.8))):
        people.xyz[0, COCO_18.index[joint]] = place
    for mark, found in (((375, 250, 10), 1), ((385, 250, 10), 0)):
        recording = Recording('', frames_of_folder, [[mark, (100, 100, 10)]], cloth=[2.0])
        assert counted(people, frame, recording, 0) == (found, 2, 1 - found, 1, 2)
    no_trunk = person(MEASURED)
    assert counted(no_trunk, frame, Recording('', frames_of_folder, [[(375, 250, 10)]]), 0) == (0, 1, 1, 0, 0)


@pytest.mark.parametrize(('off', 'right'), [(19, 10), (21, 0)])
def test_joints_are_right_within_a_fifth_of_the_torso(off, right):
    """A torso of 100 px; two joints are hidden, and a second person is elsewhere."""
    truth = np.zeros((len(LIMBS), 3))
    truth[:, 2] = 1
    truth[:2, 2] = 0
    for joint, place in (('right_shoulder', (0, 80)), ('left_hip', (60, 0)), ('left_shoulder', (0, 80)),
                         ('right_hip', (60, 0))):
        truth[LIMBS.index(joint), :2] = place
    keypoints = np.full((2, 18, 3), (900, 900, 1), np.float32)
    keypoints[1, [COCO_18.index[joint] for joint in LIMBS], :2] = truth[:, :2] + (off, 0)
    for number, expected in ((2, right), (1, 0), (0, 0)):
        people = People2D(COCO_18, keypoints[:number], np.ones(number), np.arange(number))
        assert _right(people, truth) == (expected, 10)


def test_gaps_are_lost_between_a_near_surface_and_one_behind_it():
    """To the right of 2 m before 4 m three pixels, to the left one; 2 m before 2.1 m is no step, nor a line's end."""
    depth = np.array([[2, 2, 0, 0, 0, 4, 4, 0, 2], [0, 2, 0, 2.1, 2.1, 2.1, 2.1, 2.1, 2.1]])
    assert gaps(depth, 26.0).tolist() == [3]
    assert gaps(np.fliplr(depth), 26.0).tolist() == [1]
    assert filled(depth[:1])[0, [0, 2, 4, 8]].tolist() == [2, 2, 4, 2]
    assert not gaps(np.zeros((3, 4)), 26.0).size
