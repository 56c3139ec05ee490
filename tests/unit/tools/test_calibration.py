"""Calibrations: read in all formats, written so that the same is read again."""
import json

import numpy as np
import pytest

from openpose_ros_pkg.calibration import Calibration, calibration_text, pinhole_calibration, read_calibration
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import calibrated_camera

PLAIN = pinhole_calibration(640, 480, (500.5, 501.25), (319.5, 239.5))
# Numbers that YAML would take for a text, or that have 17 digits.
FULL = Calibration(640, 480, 'rational_polynomial', (1e-5, -2e-17, 1 / 3, 0.1, 0.0, -0.0, 7, 1e22),
                   (500.1, 0, 319.7, 0, 1 / 7 * 3500, 239.2, 0, 0, 1), tuple(np.eye(3).ravel() * (1 - 1e-16)),
                   (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 1e-9), 'left', (2, 2), (8, 4, 240, 320, True))
UNCALIBRATED = Calibration(640, 480, '', (), (0,) * 9, (0,) * 9, (0,) * 12)


@pytest.mark.parametrize('calibration', [PLAIN, FULL, UNCALIBRATED], ids=['plain', 'full', 'uncalibrated'])
def test_what_is_written_is_read_again(tmp_path, calibration):
    (tmp_path / 'camera.yaml').write_text(calibration_text(calibration))
    assert read_calibration(tmp_path / 'camera.yaml') == calibration


PRINTED = """header:
  seq: 3
  stamp: {secs: 1, nsecs: 2}
  frame_id: "cam"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [0.1, -0.2, 0.0, 0.0, 0.0]
K: [500.5, 0.0, 319.5, 0.0, 501.25, 239.5, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [490.0, 0.0, 320.0, 0.0, 0.0, 491.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: False
---
height: 1
"""


def test_a_printed_camera_info_is_read_up_to_the_end_of_the_message(tmp_path):
    (tmp_path / 'echo.yaml').write_text(PRINTED)
    calibration = read_calibration(tmp_path / 'echo.yaml')
    assert (calibration.width, calibration.height, calibration.matrix) == (640, 480, PLAIN.matrix)
    assert (calibration.distortion[:2], calibration.projection[0]) == ((0.1, -0.2), 490.0)


@pytest.mark.parametrize('values', [
    {'width': 640, 'height': 480, 'K': list(PLAIN.matrix), 'fps': 15},
    # Open3D: column by column
    {'width': 640, 'height': 480, 'intrinsic_matrix': [500.5, 0, 0, 0, 501.25, 0, 319.5, 239.5, 1]}])
def test_json_is_read(tmp_path, values):
    (tmp_path / 'camera.json').write_text(json.dumps(values, indent='\t'))
    assert read_calibration(tmp_path / 'camera.json') == PLAIN


LENS = 'image_width: 640\nimage_height: 480\ncamera_matrix: {data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}\n'
ROS2 = 'width: 640\nheight: 480\nk: [500, 0, 320, 0, 500, 240, 0, 0, 1]\np: [5, 0, 3, 0, 0, 5, 2, 0, 0, 0, 1, 0]\n'
FOUR, FIVE = 'data: [0.1, -0.02, 0.001, 0.002]', 'data: [0.1, -0.02, 0.001, 0.002, 0.01]'


@pytest.mark.parametrize('text, model, count', [
    (f'{LENS}camera_model: equidistant\ndistortion_coefficients: {{{FOUR}}}', 'equidistant', 4),
    (f'{LENS}camera_model: Pinhole\ndistortion_model: plumb_bob\ndistortion_coefficients: {{{FOUR}}}', 'plumb_bob', 4),
    (f'%YAML:1.0\n---\n{LENS}distortion_coefficients: !!opencv-matrix\n  {FIVE}\n', 'plumb_bob', 5),
    (f'%YAML:1.0\n---\n{LENS}fisheye_model: 1\ndistortion_coefficients: !!opencv-matrix\n  {FOUR}\n', 'equidistant', 4),
    (f'{ROS2}d: [0, 0, 0, 0, 0]\ndistortion_model: Inverse Brown Conrady\n', 'Inverse Brown Conrady', 5)])
def test_the_model_is_what_the_file_names(tmp_path, text, model, count):
    (tmp_path / 'camera.yaml').write_text(text)
    calibration = read_calibration(tmp_path / 'camera.yaml')
    assert (calibration.distortion_model, len(calibration.distortion)) == (model, count)
    assert calibration.projection[0] == (5 if text.startswith(ROS2) else 500)


@pytest.mark.parametrize('more, words', [
    (f'distortion_coefficients: {{{FOUR}}}', 'names no distortion model'),
    (f'camera_model: pinhole\ndistortion_coefficients: {{{FOUR}}}', 'names no distortion model'),
    (f'camera_model: omni\ndistortion_coefficients: {{{FIVE}}}', "distortion model 'omni' is unknown; expected one of"),
    (f'camera_model: fisheye\ndistortion_model: radtan\ndistortion_coefficients: {{{FOUR}}}',
     'several distortion models: equidistant, plumb_bob')])
def test_a_model_that_is_not_known_is_refused(tmp_path, more, words):
    (tmp_path / 'camera.yaml').write_text(LENS + more)
    with pytest.raises(BadInputError, match=words):
        read_calibration(tmp_path / 'camera.yaml')


@pytest.mark.parametrize('region, binning, size', [
    ((0, 0, 0, 0, False), (0, 0), (640, 480)), ((160, 120, 240, 320, False), (0, 1), (320, 240)),
    ((0, 0, 0, 0, False), (2, 4), (320, 120)), ((600, 8, 200, 40, False), (2, 2), (20, 100))])
@pytest.mark.parametrize('rectified', [False, True])
def test_the_camera_is_that_of_the_images_after_the_region_and_binning(region, binning, size, rectified):
    values = (640, 480, 'plumb_bob', (0.1, -0.05, 0, 0, 0), (500, 0, 310, 0, 510, 250, 0, 0, 1), (1,) + (0,) * 8,
              (490, 0, 300, 7, 0, 495, 245, 0, 0, 0, 1, 0), '')
    sensor, camera = (calibrated_camera(Calibration(*values, *part), rectified) for part in ((), (binning, region)))
    assert (camera.width, camera.height) == size
    points = [(0.4, -0.3, 1.5), (-0.1, 0.2, 2.0)]
    # as image_geometry has it
    expected = (sensor.project(points) - region[:2]) / np.maximum(binning, 1)
    np.testing.assert_allclose(camera.project(points), expected, atol=1e-9)
    np.testing.assert_allclose(camera.scaled(2 * size[0], 2 * size[1]).project(points), 2 * expected + 0.5, atol=1e-9)


@pytest.mark.parametrize('text, words', [
    ('', 'no calibration'), ('[1, 2', 'can not be read'), ('{"K": ', 'can not be read'),
    ('fps: 3', 'camera_matrix, K or'),
    ('image_width: 3\ncamera_matrix: {data: [1, 2]}', 'image_height'),
    ('width: 3\nheight: 4\nK: [1, 2]', '2 numbers, expected 9'), ('width: x\nheight: 4\nK: []', 'expected 9'),
    ('width: x\nheight: 4\nK: [1, 0, 1, 0, 1, 1, 0, 0, 1]', 'invalid literal')])
def test_what_is_no_calibration_is_refused(tmp_path, text, words):
    (tmp_path / 'camera.yaml').write_text(text)
    with pytest.raises(BadInputError, match=words):
        read_calibration(tmp_path / 'camera.yaml')
