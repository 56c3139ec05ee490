"""RGB-D folders: where stamps come from, missing partners, the description of the camera, errors.

Files are empty: no image is read here.
"""
import json
from fractions import Fraction

import pytest

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.rgbd_folder import DEFAULT_START, read_rgbd_folder
from skeleton_extract_3d.points.stamps import SECOND

CAMERA = """
image_width: 32
image_height: 18
camera_matrix: {rows: 3, cols: 3, data: [20, 0, 15.5, 0, 20, 8.5, 0, 0, 1]}
"""
META = {'K': [20, 0, 15.5, 0, 20, 8.5, 0, 0, 1], 'width': 32, 'height': 18, 'fps': 10, 'frame_id': 'cam', 'seed': 4}
POSE = [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]]
TEN = Fraction(10)


def touch(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b'')
    return folder


def tenths(found, stream='colour'):
    """Stamps since the default start, in tenths of a second."""
    return [(file.stamp - DEFAULT_START) / (SECOND // 10) for file in found.streams[stream]]


def pairs_of(found):
    """Indices of the colour and depth images of frames that have both."""
    colour, depth = ([file.stamp for file in found.streams[stream]] for stream in ('colour', 'depth'))
    return sorted((colour.index(one), depth.index(other)) for other, one in found.colour_of.items())


def test_numbers_are_sorted_by_value_and_gaps_take_time(tmp_path):
    touch(tmp_path, *(f'color/image{i}.png' for i in (9, 10, 11, 13)),
          *(f'depth/d_{i:04d}.png' for i in (9, 10, 11, 13)), 'depth/.0001.png')
    found = read_rgbd_folder(tmp_path, TEN)
    assert [file.path.name for file in found.streams['colour']] == ['image9.png', 'image10.png', 'image11.png',
                                                                    'image13.png']
    assert tenths(found) == tenths(found, 'depth') == [0, 1, 2, 4]
    assert pairs_of(found) == [(0, 0), (1, 1), (2, 2), (3, 3)]


def test_a_missing_partner_shifts_no_image(tmp_path):
    touch(tmp_path, 'rgb/0.png', 'rgb/1.png', 'rgb/2.png', 'depth/0.png', 'depth/2.png', 'depth/3.png')
    found = read_rgbd_folder(tmp_path, TEN)
    assert (tenths(found), tenths(found, 'depth')) == ([0, 1, 2], [0, 2, 3])
    assert pairs_of(found) == [(0, 0), (2, 1)]
    assert found.remarks == ['1 of 3 colour images have no partner', '1 of 3 depth images have no partner']


@pytest.mark.parametrize('rate, last', [(Fraction(30000, 1001), 33366666667), (Fraction('29.97'), 33366700033),
                                        (Fraction(30), 33333333333)])
def test_rates_do_not_drift(tmp_path, rate, last):
    touch(tmp_path, *(f'rgb/{i:04d}.jpg' for i in range(1001)))
    assert read_rgbd_folder(tmp_path, rate).streams['colour'][-1].stamp == DEFAULT_START + last


def test_lists_of_the_tum_benchmark_tell_the_stamps(tmp_path):
    (tmp_path / 'rgb.txt').write_text('# color images\n# timestamp filename\n1.6 rgb/c.png\n1.5 rgb/a.png\n\n')
    (tmp_path / 'depth.txt').write_text('1.510000001 depth/b.png\n1.7 depth/d.png\n')
    (tmp_path / 'camera.yaml').write_text(CAMERA)
    found = read_rgbd_folder(tmp_path)
    assert (found.depth_scale, found.calibration.width, found.timing) == (5000.0, 32, 'rgb.txt and depth.txt')
    assert found.streams == {'colour': [(1500000000, tmp_path / 'rgb/a.png'), (1600000000, tmp_path / 'rgb/c.png')],
                             'depth': [(1510000001, tmp_path / 'depth/b.png'), (1700000000, tmp_path / 'depth/d.png')]}
    assert pairs_of(found) == [(0, 0)]
    assert found.remarks == ['1 of 2 colour images have no partner', '1 of 2 depth images have no partner']
    (tmp_path / 'sequence.yaml').write_text('depth_scale: 1000')
    assert read_rgbd_folder(tmp_path).depth_scale == 1000


def test_a_folder_tells_rate_frame_and_pose(tmp_path):
    touch(tmp_path, 'rgb/000.jpg', 'rgb/001.jpg', 'depth/000.png', 'depth/001.png', 'gt.json')
    (tmp_path / 'meta.json').write_text(json.dumps({**META, 'T_world_camera': POSE}))
    rendered = read_rgbd_folder(tmp_path)
    (tmp_path / 'camera.yaml').write_text(CAMERA)
    (tmp_path / 'sequence.yaml').write_text(f'fps: 10\nframe_id: cam\nT_world_camera: {POSE}')
    for found in (rendered, read_rgbd_folder(tmp_path)):
        assert (found.frame_id, found.depth_scale, found.calibration.matrix[0]) == ('cam', None, 20)
        assert (found.T_world_camera.tolist(), tenths(found), found.remarks) == (POSE, [0, 1], [])
    assert tenths(read_rgbd_folder(tmp_path, Fraction(5))) == [0, 2]


@pytest.mark.parametrize('files, arguments, words', [
    ({'rgb/1.png': ''}, (), 'give --rate'),
    ({}, (TEN,), 'no images in rgb'),
    ({'rgb.txt': '0 a.png'}, (), 'more than 0'),
    ({'rgb/1305031102.175304.png': ''}, (TEN,), 'stamps belong into rgb.txt'),
    ({'rgb/1.png': '', 'rgb/01.jpg': ''}, (TEN,), r'01\.jpg and .*1\.png have one number'),
    ({'rgb/left.png': ''}, (TEN,), 'a name that ends in the number'),
    ({'rgb/1.png': '', 'depth/2.png': ''}, (TEN,), r'no colour image has a depth .* 1\.png at 1000\.0.* 1000\.1'),
    ({'rgb.txt': '# x\n1.0 rgb/a.png\nsoon rgb/b.png\n'}, (), r"line 3: expected a time .*'soon rgb/b.png'"),
    ({'rgb.txt': '1.0 a.png\n1.000 b.png\n'}, (), r'a\.png and .*b\.png have one stamp, 1\.0'),
    ({'rgb.txt': '1 a.png', 'depth.txt': '2 b.png'}, (), r'no colour image has a depth .* 1\.0.* 2\.0'),
    ({'rgb/1.png': '', 'meta.json': '[]'}, (), 'meta.json: expected keys with values'),
    ({'rgb/1.png': '', 'meta.json': '{'}, (), 'meta.json can not be read')])
def test_a_folder_that_does_not_fit_is_refused(tmp_path, files, arguments, words):
    for name, content in files.items():
        touch(tmp_path, name).joinpath(name).write_text(content)
    with pytest.raises(BadInputError, match=words):
        read_rgbd_folder(tmp_path, *arguments)
