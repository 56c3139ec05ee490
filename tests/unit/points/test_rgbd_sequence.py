"""Sequence folders: what is read, and what a user may get wrong."""
import json
import shutil
from itertools import islice

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.rgbd_sequence import PLAYBACKS, RgbdSequence, play_order

CAMERA = """
image_width: 32
image_height: 18
camera_name: test
camera_matrix: {rows: 3, cols: 3, data: [20, 0, 15.5, 0, 20, 8.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}
"""


@pytest.fixture()
def folder(tmp_path):
    """Three frames of 32 x 18; pixel (row 1, column 2) of frame i has colour (i, i, i) and depth 1000 + i."""
    (tmp_path / 'rgb').mkdir()
    (tmp_path / 'depth').mkdir()
    for i in range(3):
        bgr, depth = np.zeros((18, 32, 3), np.uint8), np.zeros((18, 32), np.uint16)
        bgr[1, 2], depth[1, 2] = i, 1000 + i
        cv2.imwrite(str(tmp_path / 'rgb' / f'{i:03d}.png'), bgr)
        cv2.imwrite(str(tmp_path / 'depth' / f'{i:03d}.png'), depth)
    (tmp_path / 'camera.yaml').write_text(CAMERA)
    (tmp_path / 'sequence.yaml').write_text('fps: 10\nframe_id: /cam\nT_world_camera: [[1, 0, 0, 0], [0, 0, 1, 0], '
                                            '[0, -1, 0, 1.5], [0, 0, 0, 1]]')
    return tmp_path


def test_a_folder_is_read(folder):
    sequence = RgbdSequence.read(folder)
    assert (len(sequence), sequence.fps, sequence.frame_id) == (3, 10, 'cam')
    assert (sequence.camera.width, sequence.camera.height) == (32, 18)
    assert sequence.camera.distortion.tolist() == [0.1, 0, 0, 0, 0]
    np.testing.assert_array_equal(sequence.T_world_camera[:3, 3], [0, 0, 1.5])
    frames = list(sequence)
    assert [frame.time for frame in frames] == [0.0, 0.1, 0.2]
    assert [frame.bgr[1, 2].tolist() for frame in frames] == [[i] * 3 for i in range(3)]
    assert [frame.depth[1, 2] for frame in frames] == [1000, 1001, 1002]


def test_depth_may_have_another_resolution_of_the_same_view(folder):
    cv2.imwrite(str(folder / 'depth' / '001.png'), np.ones((9, 16), np.uint16))
    assert RgbdSequence.read(folder).frame(1).depth.shape == (9, 16)


def test_all_kinds_of_folders_are_read(folder):
    meta = {'K': [20, 0, 15.5, 0, 20, 8.5, 0, 0, 1], 'width': 32, 'height': 18, 'fps': 10, 'depth_scale': 500}
    (folder / 'camera.yaml').unlink()
    (folder / 'meta.json').write_text(json.dumps(meta))
    (folder / 'depth' / '000.png').unlink()
    cv2.imwrite(str(folder / 'depth' / '002.tiff'), np.full((18, 32), 1.5, np.float32))
    (folder / 'depth' / '002.png').unlink()
    sequence = RgbdSequence.read(folder)
    assert [(frame.time, frame.bgr[1, 2, 0], frame.depth[1, 2]) for frame in sequence] == [
        (0.0, 1, 2002), (0.1, 2, 1500)]  # the first one has no depth
    (folder / 'rgb.txt').write_text('5.0 rgb/001.png\n5.5 rgb/000.png\n')
    (folder / 'depth.txt').write_text('5.51 depth/001.png\n')
    frame, = RgbdSequence.read(folder)
    assert (frame.bgr[1, 2, 0], frame.depth[1, 2]) == (0, 2002)


def remove(name):
    return lambda folder: (folder / name).unlink()


def write(name, text):
    return lambda folder: (folder / name).write_text(text)


def image(name, array):
    return lambda folder: cv2.imwrite(str(folder / name), array)


def empty_rgb(folder):
    for path in (folder / 'rgb').iterdir():
        path.unlink()


@pytest.mark.parametrize('damage, text', [
    (shutil.rmtree, 'does not exist'),
    (lambda folder: (folder / 'rgb').rename(folder / 'pictures'), 'depth images only'),
    (lambda folder: (folder / 'depth').rename(folder / 'z'), 'colour images only'),
    (empty_rgb, 'depth images only'),
    (remove('camera.yaml'), 'no calibration, expected camera.yaml or meta.json'),
    (write('camera.yaml', 'image_width: 32'), "is no calibration .*image_height"),
    (write('camera.yaml', '[1, 2'), 'camera.yaml can not be read'),
    (write('camera.yaml', 'text'), 'is no calibration'),
    (write('camera.yaml', CAMERA.replace('plumb_bob', 'magic')), "'magic' is unknown"),
    (write('sequence.yaml', 'fsp: 10'), 'unknown keys fsp; allowed: fps'),
    (write('sequence.yaml', 'fps: fast'), "fps = 'fast'"),
    (write('sequence.yaml', 'fps: 0'), 'fps = 0'),
    (write('sequence.yaml', 'depth_scale: 0'), 'depth_scale = 0, expected a number above 0'),
    (write('sequence.yaml', 'T_world_camera: [1, 2, 3]'), 'expected 4 x 4'),
    (write('sequence.yaml', 'T_world_camera: [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]'), 'no rotation'),
    (write('sequence.yaml', 'T_world_camera: [[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]'), 'no rotation'),
])
def test_bad_folders_are_refused_at_once(folder, damage, text):
    damage(folder)
    with pytest.raises(BadInputError, match=text):
        RgbdSequence.read(folder)


@pytest.mark.parametrize('damage, text', [
    (image('rgb/001.png', np.zeros((18, 30, 3), np.uint8)), '30 x 18, expected .* 32 x 18'),
    (image('depth/001.png', np.zeros((18, 32), np.uint8)), 'expected one channel of 16 bit .* uint8'),
    (image('depth/001.png', np.zeros((18, 32, 3), np.uint16)), r'expected one channel of 16 bit .*\(18, 32, 3\)'),
    (image('depth/001.png', np.zeros((24, 32), np.uint16)), '32 x 24'),
    (write('rgb/001.png', 'no picture'), '001.png is not an image that OpenCV can read'),
    (write('depth/001.png', ''), '001.png is not an image that OpenCV can read'),
])
def test_bad_frames_are_refused_and_the_others_are_read(folder, damage, text):
    damage(folder)
    sequence = RgbdSequence.read(folder)
    with pytest.raises(BadInputError, match=text):
        sequence.frame(1)
    assert sequence.frame(2).depth[1, 2] == 1002


@pytest.mark.parametrize('length, playback, expected', [
    (4, 'loop', [0, 1, 2, 3, 0, 1, 2, 3, 0]),
    (4, 'forth_and_back', [0, 1, 2, 3, 2, 1, 0, 1, 2]),
    (4, 'pause', [0, 1, 2, 3, None, None, 0, 1, 2]),
    (4, 'once', [0, 1, 2, 3]),
    (2, 'forth_and_back', [0, 1, 0, 1, 0, 1, 0, 1, 0]),
    (1, 'forth_and_back', [0] * 9),
], ids=str)
def test_the_order_in_which_frames_are_played(length, playback, expected):
    assert playback in PLAYBACKS
    assert list(islice(play_order(length, playback, pause=2), 9)) == expected
