"""The report's section on real recordings: files are read as they were written, people are drawn where they are."""
import json

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from results import NeedsDataError, Options
from sections.real_recordings import SIZE, figures_of, frames_of_folder, measure, picture
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

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
    with pytest.raises(NeedsDataError, match='hsr_bags'):
        measure(Options(data={'real_recordings': tmp_path}))


def test_the_camera_is_written_column_by_column(frame):
    np.testing.assert_array_equal(frame.grid.camera_model().matrix, MATRIX)


def test_people_are_drawn_over_image_and_depth(frame):
    """The forearm over both; where there is no depth it is black."""
    drawn = picture(frame, person(MEASURED))
    assert drawn.shape == (SIZE[1], 2 * SIZE[0], 3)
    wrist = int(SIZE[0] / 640 * (MATRIX[0, 0] * 0.25 + MATRIX[0, 2]))
    assert np.abs(drawn[int(SIZE[0] / 640 * MATRIX[1, 2]), wrist - 20].astype(int) - 128).max() > 60
    assert (drawn[20, SIZE[0] + 20] == 0).all() and drawn[20, -20].any()


def test_numbers(frame):
    values = figures_of('kinect', [person(MEASURED), person(INFERRED)])
    assert {key: figure.value for key, figure in values.items()} == {
        'kinect_people': 2, 'kinect_ids': 1, 'kinect_measured': 2, 'kinect_inferred': 2}
