"""Keypoints as CSV: columns, what is written comes back, and what a file may have suffered."""
import io

import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter, columns, read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import FIELDS, MISSING_PART, PersonRow
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

NOSE, CHEST, TOE = (MESSAGE_JOINTS.index(joint) for joint in ('nose', 'chest', 'left_big_toe'))
# An epoch stamp that no float64 holds.
STAMP = 1_700_000_000_123_456_789


def row(dimensions=3, time=STAMP, stamp=STAMP, person=1, number=1, sequence=0, frame_id='camera', **joints):
    parts = [joints.get(joint, MISSING_PART[dimensions]) for joint in MESSAGE_JOINTS]
    return PersonRow(time, sequence, stamp, frame_id, number, person, parts)


def text_of(rows, layout, dimensions=3):
    handle = io.StringIO()
    writer = KeypointCsvWriter(handle, layout, dimensions)
    writer.write(rows)
    return handle.getvalue()


def read(tmp_path, text):
    path = tmp_path / 'poses.csv'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_keypoint_csv(path)


def test_the_originals_columns():
    # as the figures of the original's readme show them
    assert columns('original', 3)[:8] == [
        '%time', 'field.num_people_detected', 'field.person_ID', 'field.nose.x', 'field.nose.y', 'field.nose.z',
        'field.nose.confidence', 'field.neck.x']
    assert columns('original', 2)[-3:] == ['field.chest.x', 'field.chest.y', 'field.chest.confidence']


def test_values_come_back(tmp_path):
    x = float(np.float32(0.1))
    person = row(sequence=7, number=2, person=4, frame_id='a "b", c', nose=(x, -2.0, 3.0, 0.5, MEASURED, 0.25),
                 left_big_toe=(1.0, 2.0, 4.0, 0.0, INFERRED, 0.5))
    text = text_of([person], 'extended')
    assert f'{STAMP},7,{STAMP},"a ""b"", c",2,4,0.10000000149011612,-2.0,3.0,0.5,1,0.25,nan,nan,nan,0.0,0,nan,' in text
    table = read(tmp_path, text.replace('"a ', '"/a '))  # tf2 refuses leading slashes
    assert (table.stamps[0], table.frame_ids[0], table.ids[0]) == (STAMP, 'a "b", c', 4)
    np.testing.assert_array_equal(table.positions[0, NOSE], np.float32([x, -2, 3]))
    np.testing.assert_array_equal(table.positions[0, TOE], np.float32([1, 2, 4]))
    assert table.status[0, [NOSE, TOE, CHEST]].tolist() == [MEASURED, INFERRED, MISSING]
    np.testing.assert_array_equal(table.sigma[0, [NOSE, TOE, CHEST]], np.float32([0.25, 0.5, np.nan]))
    assert np.isnan(table.positions[0, CHEST]).all()


def test_the_originals_columns_tell_no_status(tmp_path):
    people = [row(nose=(1.0, 2.0, 3.0, 0.5, MEASURED, 0.25), neck=(1.0, 2.0, 3.0, 0.0, INFERRED, 0.5)),
              # a message that was never filled in, from a node whose messages have no status
              row(person=2, nose=(0.0, 0.0, 0.0, 0.0, MISSING, np.nan))]
    table = read(tmp_path, text_of(people, 'original'))
    assert table.status.tolist() == [[MEASURED, MEASURED] + [MISSING] * 25, [MISSING] * 27]
    assert np.isnan(table.sigma).all() and np.isnan(table.positions[1]).all()
    assert table.frame_ids[0] == '' and table.stamps[0] == STAMP


def test_in_the_image_confidence_0_is_missing(tmp_path):
    person = row(2, nose=(0.0, 0.0, 0.5), neck=(3.0, 4.0, 0.0))
    for layout in ('original', 'extended'):
        table = read(tmp_path, text_of([person], layout, 2))
        np.testing.assert_array_equal(table.positions[0, NOSE], [0, 0])
        assert np.isnan(table.positions[0, 1:]).all()
        assert table.status[0].tolist() == [MEASURED] + [MISSING] * 26


def test_people_of_a_frame_have_one_stamp_without_a_header(tmp_path):
    # times of arrival as the original's CSV has them; 30 Hz
    period = 33_333_333
    times = [0, 400_000, period, 2 * period, 2 * period + 9_000_000, 3 * period, 3 * period + 20_000_000]
    people = [(0, 2), (1, 2), (0, 1), (0, 2), (1, 2), (0, 2), (1, 2)]
    rows = [row(time=STAMP + time, person=person, number=number) for time, (person, number) in zip(times, people)]
    table = read(tmp_path, text_of(rows, 'original'))
    assert (table.stamps - STAMP).tolist() == [0, 0, period, 2 * period, 2 * period, 3 * period,
                                               3 * period + 20_000_000]


def test_the_long_form_has_a_row_per_joint():
    rows = [row(person=3, number=2, nose=(1.0, 2.0, 3.0, 0.5, MEASURED, 0.25)),
            row(person=5, number=2, neck=(1.0, 2.0, 3.0, 0.0, INFERRED, 0.5)),
            row(stamp=STAMP + 1, person=3, left_ear=(1.0, 2.0, 3.0, 0.5, 7, 0.25))]
    lines = text_of(rows, 'tidy').splitlines()
    assert lines == ['time,frame,frame_id,person_ID,joint,x,y,z,confidence,status,sigma',
                     f'{STAMP},0,camera,3,nose,1.0,2.0,3.0,0.5,measured,0.25',
                     f'{STAMP},0,camera,5,neck,1.0,2.0,3.0,0.0,inferred,0.5',
                     f'{STAMP + 1},1,camera,3,left_ear,1.0,2.0,3.0,0.5,7,0.25']
    assert text_of([row(2, nose=(1.0, 2.0, 0.5))], 'tidy', 2).splitlines() == [
        'time,frame,frame_id,person_ID,joint,x,y,confidence,status', f'{STAMP},0,camera,1,nose,1.0,2.0,0.5,measured']


def test_a_file_of_some_joints_in_any_order_with_unknown_columns(tmp_path):
    names = [name for joint in reversed(COCO_18.joints) for name in (f'field.{joint}.{f}' for f in FIELDS[3])]
    values = {'field.mood': 'cheerful', **{name: '0' if name.endswith('status') else 'nan' for name in names},
              **{f'field.nose.{field}': '1.5' for field in FIELDS[3]}, 'field.nose.status': '2.0',
              'field.person_ID': '9', 'field.nose.colour': '255', 'field.num_people_detected': '1', '%time': '5'}
    table = read(tmp_path, ','.join(values) + '\n' + ','.join(values.values()) + '\n')
    assert (table.ids.tolist(), table.stamps.tolist()) == ([9], [5])
    np.testing.assert_array_equal(table.positions[0, NOSE], [1.5] * 3)
    assert table.status[0].tolist() == [INFERRED] + [MISSING] * 26
    assert np.isnan(table.positions[0, 1:]).all()


def test_numbers_that_are_not_there(tmp_path):
    # pandas writes nothing for NaN, R writes NA
    text = text_of([row(nose=(1.0, 2.0, 3.0, 0.5, MEASURED, np.nan))], 'extended')
    for word in ('', 'NA', 'NaN', ' nan'):
        table = read(tmp_path, text.replace('nan', word))
        np.testing.assert_array_equal(table.positions[0, NOSE], [1, 2, 3])
        assert table.status[0].tolist() == [MEASURED] + [MISSING] * 26


def test_windows_ends_a_byte_order_mark_and_repeated_names(tmp_path):
    text = text_of([row(), row(person=2)], 'extended')
    names, first, second = text.splitlines()
    again = '\r\n'.join(['\ufeff' + names, first, names, '', second]) + '\r\n'
    assert read(tmp_path, again).ids.tolist() == [1, 2]


@pytest.mark.parametrize('layout, dimensions', [('original', 2), ('extended', 3)])
def test_a_file_cut_off_anywhere_loses_its_last_line_at_most(tmp_path, caplog, layout, dimensions):
    rows = [row(dimensions, person=n, chest=(1.5, 2.5, 0.5) if dimensions == 2 else (1.5, 2.5, 3.5, 0.5, 1, 0.1))
            for n in range(3)]
    text = text_of(rows, layout, dimensions)
    _, second, third, _ = (i for i, sign in enumerate(text) if sign == '\n')
    for cut in range(second + 1, third, 7):
        caplog.clear()
        assert read(tmp_path, text[:cut]).ids.tolist() == [0]
        assert not caplog.text if cut == second + 1 else 'line 3' in caplog.text and 'dropped' in caplog.text
    assert read(tmp_path, text[:third]).ids.tolist() == [0, 1]


def test_a_damaged_line_before_the_last_is_an_error(tmp_path):
    names, *lines = text_of([row(person=n) for n in range(3)], 'extended').splitlines()
    lines[1] = lines[1][:100]
    with pytest.raises(BadInputError, match=r'poses\.csv: line 3: \d+ values, expected 168'):
        read(tmp_path, '\n'.join([names, *lines]))
    with pytest.raises(BadInputError, match='line 3: '):
        read(tmp_path, '\n'.join([names, *lines[:2]]) + '\n')


@pytest.mark.parametrize(('name', 'value', 'expected'), [
    ('%time', '1.7e18', '1.7e18'), ('%time', '-1', "column '%time': expected a whole number from 0 to .*, got '-1'"),
    ('field.header.stamp', 'nan', "got ''"), ('field.person_ID', '4294967296', 'from 0 to 4294967295'),
    ('field.num_people_detected', '', "got ''"), ('field.nose.x', '1,5', 'line 3: 169 values'),
    ('field.neck.y', 'far', 'far'), ('field.neck.status', '1.5', 'a status is no whole number'),
    ('field.neck.status', '256', 'from 0 to 255')])
def test_a_wrong_value_is_named(tmp_path, name, value, expected):
    names, *lines = text_of([row(person=n) for n in range(3)], 'extended').splitlines()
    values = lines[1].split(',')
    values[names.split(',').index(name)] = value
    lines[1] = ','.join(values)
    with pytest.raises(BadInputError, match=expected):
        read(tmp_path, '\n'.join([names, *lines]) + '\n')


@pytest.mark.parametrize(('text', 'expected'), [
    ('', 'is empty'),
    ('\n', 'no column %time'),
    ('a,b\n1,2\n', 'no column %time, field.num_people_detected.*the first columns are a, b'),
    (b'#ROSBAG V2.0\nE\x00\x00\x00\x10\x00\x00\x00', 'ROSBAG'),
    ('%time,field.num_people_detected,field.person_ID\n', 'no column field.nose.x'),
    ('%time,%time,field.num_people_detected,field.person_ID,field.nose.x,field.nose.y,field.nose.confidence\n',
     "'%time' is there twice"),
    (','.join(columns('tidy', 3)) + '\n', '--tidy')])
def test_other_files_are_refused(tmp_path, text, expected):
    with pytest.raises(BadInputError, match=expected):
        read(tmp_path, text)
