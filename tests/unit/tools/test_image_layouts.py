"""Recordings as folders: each layout, where stamps come from, who has no partner, and what is refused.

Files are empty: nothing here reads images.
"""
import json
from fractions import Fraction
from pathlib import Path

import pytest

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_tools.images.frame_stamps import DEFAULT_START, frame_numbers
from openpose_ros_tools.images.image_layouts import LayoutOptions, find_recording
from openpose_ros_tools.images.stamps import SECOND

CAMERA = """
image_width: 32
image_height: 18
camera_matrix: {rows: 3, cols: 3, data: [20, 0, 15.5, 0, 20, 8.5, 0, 0, 1]}
"""
META = {'K': [20, 0, 15.5, 0, 20, 8.5, 0, 0, 1], 'width': 32, 'height': 18, 'fps': 10, 'frame_id': 'cam', 'seed': 4}
POSE = [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]]


def touch(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b'')
    return folder


def tenths(recording, stream='colour'):
    """Stamps since the usual start, in tenths of a second."""
    return [(item.stamp - DEFAULT_START) / (SECOND // 10) for item in recording.streams[stream]]


def names(recording, stream='colour'):
    return [item.path.name for item in recording.streams[stream]]


def pairs_of(recording):
    """By stream the indices of the files that belong to each colour image."""
    stamps = {stream: [item.stamp for item in items] for stream, items in recording.streams.items()}
    return {stream: sorted((stamps['colour'].index(colour), stamps[stream].index(stamp))
                           for stamp, colour in pairs.items())
            for stream, pairs in recording.pairs.items() if pairs}


TEN = LayoutOptions(rate=Fraction(10))


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(BadInputError, match=r'no images in rgb .* holds: nothing'):
        find_recording(tmp_path, TEN)


def test_numbers_are_sorted_by_their_value_and_gaps_take_time(tmp_path):
    touch(tmp_path, *(f'rgb/image{i}.png' for i in (9, 10, 11, 13)), *(f'depth/d_{i:04d}.png' for i in (9, 10, 11, 13)))
    recording = find_recording(tmp_path, TEN)
    assert names(recording) == ['image9.png', 'image10.png', 'image11.png', 'image13.png']
    assert tenths(recording) == tenths(recording, 'depth') == [0, 1, 2, 4]
    assert pairs_of(recording) == {'depth': [(0, 0), (1, 1), (2, 2), (3, 3)]}
    assert recording.remarks == ['1 of the numbers 9 .. 13 are missing; the times of the others are as if they were '
                                 'there']


def test_a_missing_partner_shifts_nobody(tmp_path):
    touch(tmp_path, 'rgb/0.png', 'rgb/1.png', 'rgb/2.png', 'depth/0.png', 'depth/2.png', 'depth/3.png', 'masks/1.png')
    recording = find_recording(tmp_path, TEN)
    assert (tenths(recording), tenths(recording, 'depth'), tenths(recording, 'mask')) == ([0, 1, 2], [0, 2, 3], [1])
    assert pairs_of(recording) == {'depth': [(0, 0), (2, 1)], 'mask': [(1, 0)]}
    assert recording.remarks == ['1 of 3 colour images have no depth image: 1.png',
                                 '1 of 3 depth images have no colour image: 3.png',
                                 '2 of 3 colour images have no mask image: 0.png, 2.png']
    pairs = recording.only_pairs()
    assert (tenths(pairs), tenths(pairs, 'depth'), list(pairs.streams)) == ([0, 2], [0, 2], ['colour', 'depth'])
    assert pairs_of(pairs) == {'depth': [(0, 0), (1, 1)]}


def test_folders_without_numbers_go_by_name(tmp_path):
    touch(tmp_path, 'rgb/b.png', 'rgb/a.png', 'rgb/c.png', 'depth/c.png', 'depth/a.png')
    recording = find_recording(tmp_path, TEN)
    assert (names(recording), tenths(recording)) == (['a.png', 'b.png', 'c.png'], [0, 1, 2])
    assert tenths(recording, 'depth') == [0, 2]


@pytest.mark.parametrize('rate, last', [(Fraction(30000, 1001), 33366666667), (Fraction('29.97'), 33366700033),
                                        (Fraction(30), 33333333333)])
def test_rates_do_not_drift(tmp_path, rate, last):
    touch(tmp_path, *(f'{i:04d}.jpg' for i in range(1001)))
    recording = find_recording(tmp_path, LayoutOptions(rate=rate, start=7))
    assert recording.layout == 'images'
    assert recording.streams['colour'][-1].stamp == 7 + last


def test_names_may_be_stamps(tmp_path):
    touch(tmp_path, 'color/1305031102.175304.png', 'color/1305031102.211214.png', 'depth/1305031102.160407.png',
          'depth/1305031102.226738.png')
    recording = find_recording(tmp_path, LayoutOptions())
    assert [item.stamp for item in recording.streams['colour']] == [1305031102175304000, 1305031102211214000]
    assert pairs_of(recording) == {'depth': [(0, 0), (1, 1)]}
    assert recording.timing == 'file names [s]'
    with_shift = find_recording(tmp_path, LayoutOptions(start=5 * SECOND, max_difference=15 * 10 ** 6))
    assert [item.stamp for item in with_shift.streams['depth']] == [5 * SECOND, 5 * SECOND + 66331000]
    assert pairs_of(with_shift) == {'depth': [(0, 0)]}
    assert with_shift.remarks == ['1 of 2 colour images have no depth image: 1305031102.211214.png',
                                  '1 of 2 depth images have no colour image: 1305031102.226738.png']


@pytest.mark.parametrize('text, unit, stamp', [
    ('frame_1622547800123', None, 1622547800123000000), ('1622547800123456', None, 1622547800123456000),
    ('1622547800123456789', None, 1622547800123456789), ('250', 'ms', 250000000)])
def test_names_may_be_integers_of_several_units(tmp_path, text, unit, stamp):
    touch(tmp_path, f'{text}.png')
    recording = find_recording(tmp_path, LayoutOptions(stamp_unit=unit))
    assert [item.stamp for item in recording.streams['colour']] == [stamp]


def test_the_tum_layout_is_that_of_its_lists(tmp_path):
    touch(tmp_path, 'rgb/a.png', 'depth/b.png')
    (tmp_path / 'rgb.txt').write_text('# color images\n# file: x\n# timestamp filename\n1.5 rgb/a.png\n\n')
    (tmp_path / 'depth.txt').write_text('1.510000001 depth/b.png\n')
    (tmp_path / 'camera.yaml').write_text(CAMERA)
    recording = find_recording(tmp_path, LayoutOptions())
    assert (recording.layout, recording.depth_scale, recording.calibration.width) == ('tum', 5000.0, 32)
    assert recording.streams['depth'] == [(1510000001, tmp_path / 'depth/b.png', None)]
    assert pairs_of(recording) == {'depth': [(0, 0)]}
    (tmp_path / 'sequence.yaml').write_text('depth_scale: 1000')
    assert find_recording(tmp_path, LayoutOptions()).depth_scale == 1000


def test_a_sequence_says_rate_frame_and_pose(tmp_path):
    touch(tmp_path, 'rgb/000.jpg', 'rgb/001.jpg', 'depth/000.png', 'depth/001.png', 'gt.json')
    (tmp_path / 'camera.yaml').write_text(CAMERA)
    (tmp_path / 'sequence.yaml').write_text(f'fps: 10\nframe_id: cam\nT_world_camera: {POSE}')
    recording = find_recording(tmp_path, LayoutOptions())
    assert (recording.layout, recording.frame_id, recording.depth_scale) == ('sequence', 'cam', None)
    assert recording.T_world_camera.tolist() == POSE
    assert tenths(recording) == [0, 1]
    # a table in the folder counts more, a rate that is given counts most
    (tmp_path / 'stamps.csv').write_text('frame,colour [ns],depth [ns]\n000,5,6\n001,7,8\n')
    recording = find_recording(tmp_path, LayoutOptions())
    assert [item.stamp for item in recording.streams['depth']] == [6, 8]
    assert pairs_of(recording) == {'depth': [(0, 0), (1, 1)]}
    assert tenths(find_recording(tmp_path, LayoutOptions(rate=Fraction(5)))) == [0, 2]


def test_a_rendered_recording_is_described_by_meta_json(tmp_path):
    touch(tmp_path, 'rgb/000.jpg', 'depth/000.png')
    (tmp_path / 'meta.json').write_text(json.dumps({**META, 'T_world_camera': POSE}))
    recording = find_recording(tmp_path, LayoutOptions())
    assert (recording.layout, recording.frame_id, recording.calibration.matrix[0]) == ('rendered', 'cam', 20)
    assert recording.T_world_camera.tolist() == POSE


def test_sources_may_be_patterns(tmp_path):
    touch(tmp_path, 'f-0.color.png', 'f-0.depth.png', 'f-1.color.png', 'f-1.depth.png')
    recording = find_recording(None, LayoutOptions(rate=Fraction(10), sources={
        'colour': f'{tmp_path}/*.color.png', 'depth': f'{tmp_path}/*.depth.png'}))
    assert names(recording, 'depth') == ['f-0.depth.png', 'f-1.depth.png']
    assert pairs_of(recording) == {'depth': [(0, 0), (1, 1)]}


@pytest.mark.parametrize('table, stamps', [
    ('1.0\n1.5\n1.7', [10, 15, 17]), ('2.png,1.5\n10.png,1.7\n1.png,1.0', [10, 15, 17]),
    ('0001 1.0\n0002 1.5\n0010 1.7\n0011 9.0', [10, 15, 17])])
def test_a_table_names_the_stamps(tmp_path, table, stamps):
    touch(tmp_path, '1.png', '2.png', '10.png')
    (tmp_path / 'table').write_text(table)
    recording = find_recording(tmp_path, LayoutOptions(stamps=tmp_path / 'table'))
    assert [item.stamp * 10 // SECOND for item in recording.streams['colour']] == stamps
    assert recording.remarks == ['table has 1 lines without an image'] * ('0011' in table)


@pytest.mark.parametrize('options, words', [
    (LayoutOptions(), 'such as 1.png, are not times: give --rate'),
    (LayoutOptions(rate=Fraction(0)), 'rate 0'),
    (LayoutOptions(layout='tum'), 'has no rgb.txt, .* holds: 1.png, 2.png, two'),
    (LayoutOptions(stamps=Path('nowhere')), 'nowhere can not be read'),
    (LayoutOptions(rate=Fraction(1), stamp_unit='s'), 'contradicts'),
    (LayoutOptions(rate=Fraction(1), sources={'colour': 'nowhere'}), "no images in 'nowhere'"),
    (LayoutOptions(stamp_unit='s', start=0), 'more than 0'),
    (LayoutOptions(stamp_unit='s', start=2 ** 32 * SECOND), 'less than 4294967296')])
def test_what_can_not_be_is_refused(tmp_path, options, words):
    touch(tmp_path, '1.png', '2.png')
    (tmp_path / 'two').write_text('')
    with pytest.raises((BadInputError, ParameterError), match=words):
        find_recording(tmp_path, options)


def test_tables_that_do_not_fit_are_refused(tmp_path):
    touch(tmp_path, '1.png', '2.png')
    for text, words in (('1.0', '1 stamps for 2 frames'), ('1.png,1.0', 'no line for 1 colour images: 2.png'),
                        ('1.png,1.0\n1.png,2.0', "'1.png' is there twice"), ('1.0\n1.0', 'have one stamp'),
                        ('frame,depth [ns]\n1,5\n2,6', 'no colour stamp for 1.png')):
        (tmp_path / 'table').write_text(text)
        with pytest.raises(BadInputError, match=words):
            find_recording(tmp_path, LayoutOptions(stamps=tmp_path / 'table'))


def test_streams_without_a_common_frame_are_refused(tmp_path):
    touch(tmp_path, 'rgb/1.png', 'rgb/2.png', 'depth/11.png', 'depth/12.png')
    with pytest.raises(BadInputError, match=r'no colour image has a depth .* 1\.png at 1000\.0.* 11\.png at 1001\.0'):
        find_recording(tmp_path, TEN)


def test_a_bad_line_of_a_list_is_named(tmp_path):
    (tmp_path / 'rgb.txt').write_text('# x\n1.0 rgb/a.png\nsoon rgb/b.png\n')
    with pytest.raises(BadInputError, match=r"line 3: expected a time .*'soon rgb/b.png'"):
        find_recording(tmp_path, LayoutOptions())


@pytest.mark.parametrize('stems, numbers', [
    ([], None), (['a'], None), (['a1'], [1]), (['cam2_007_left1', 'cam2_008_left1'], [7, 8]), (['a1', 'b'], None),
    (['1_1', '1_2', '2_1'], None)])
def test_the_number_of_a_frame_is_the_last_that_is_never_twice_the_same(stems, numbers):
    assert frame_numbers([Path(stem + '.png') for stem in stems]) == numbers
