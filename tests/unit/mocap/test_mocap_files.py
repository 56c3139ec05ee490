"""Files of motion capture systems: hand-written ones of each format, and what may be wrong with them."""
import logging

import numpy as np
import pytest

from mocap_files import MOTIVE, MOTIVE_SHORT, TRC, c3d_file
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files import read_mocap


def text_file(folder, name, content, encoding='utf-8', newline='\n'):
    path = folder / name
    path.write_bytes(content.replace('\n', newline).encode(encoding))
    return path


def of(recorded, name):
    return recorded.positions[:, recorded.names.index(name)]


@pytest.mark.parametrize('old, new', [
    ('', ''), ('Time (Seconds)', 'Time'), ('Version,1.23', 'Version,1.25'),
    ('\n,,Rotation', f"\n,Parent{',' * 30}\n,,Rotation")])
def test_motive_markers(tmp_path, old, new):
    read = read_mocap(text_file(tmp_path, 'walk.csv', MOTIVE.replace(old, new) if old else MOTIVE))
    assert read.names == ('Ann:Chest', 'Ben:Chest', 'Unlabeled 1234')
    np.testing.assert_allclose(read.times, [0.20, 0.22])
    np.testing.assert_allclose(of(read, 'Ann:Chest'), [[0.031, 0.032, 0.033], [np.nan] * 3])
    np.testing.assert_allclose(of(read, 'Unlabeled 1234'), [[np.nan] * 3, [0.061, 0.062, 0.063]])


def test_motive_without_labels_of_rows_and_with_time_codes(tmp_path):
    read = read_mocap(text_file(tmp_path, 'short.csv', MOTIVE_SHORT))
    assert read.names == ('Head',)
    np.testing.assert_allclose(read.positions[:, 0], [[1.5, -2.5, 0.001], [np.nan] * 3])


def test_trc_by_hand(tmp_path):
    read = read_mocap(text_file(tmp_path, 'walk.trc', TRC, 'utf-8-sig', '\r\n'))
    assert read.names == ('LSHO', 'RSHO')
    np.testing.assert_allclose(read.times, [0, 0.017, 0.033])
    np.testing.assert_allclose(of(read, 'LSHO'), [[0.01, 0.02, 0.03], [np.nan] * 3, [0.012, 0.022, 0.032]])
    np.testing.assert_allclose(of(read, 'RSHO'), [[1, 2, 3], [1.001, 2.001, 3.001], [np.nan] * 3])


def test_trc_in_metres_with_zeros(tmp_path):
    text = TRC.replace('\tmm\t', '\tm\t').replace('\t12.0\t22.0\t32.0\t', '\t0\t0.0\t0\t')
    read = read_mocap(text_file(tmp_path, 'walk.dat', text))
    np.testing.assert_allclose(of(read, 'LSHO')[[0, 2]], [[10, 20, 30], [np.nan] * 3])


@pytest.mark.parametrize('unit, expected', [('mm', 0.5), ('m', 500.0), ('cm  ', 5.0)])
def test_c3d_units_residuals_labels_and_frame_numbers(tmp_path, unit, expected):
    read = read_mocap(c3d_file(tmp_path / 'file.c3d', unit, first=201))
    assert read.names == ('A', 'B')
    np.testing.assert_allclose(read.times, [2.00, 2.01, 2.02])
    np.testing.assert_allclose(of(read, 'A')[:, 0], [expected, expected, np.nan])
    np.testing.assert_allclose(of(read, 'B')[:, 0], [expected, np.nan, expected])


@pytest.mark.parametrize('name, cut', [('walk.csv', MOTIVE[:-50]), ('walk.csv', MOTIVE + '12,0.24'),
                                       ('walk.trc', TRC + '4\t0.050\t13.0\t2')])
def test_a_last_line_that_breaks_off_is_left_out(tmp_path, caplog, name, cut):
    with caplog.at_level(logging.WARNING):
        read = read_mocap(text_file(tmp_path, name, cut))
    whole = read_mocap(text_file(tmp_path, name, MOTIVE if name == 'walk.csv' else TRC))
    np.testing.assert_array_equal(read.positions, whole.positions[:len(read)])
    assert len(read) >= len(whole) - 1 and 'breaks off' in caplog.text


def test_lines_of_trc_may_end_with_or_without_a_tab(tmp_path):
    bare = '\n'.join(line.rstrip('\t') for line in TRC.splitlines()) + '\n'
    assert bare != TRC
    read, whole = (read_mocap(text_file(tmp_path, 'walk.trc', text)) for text in (bare, TRC))
    np.testing.assert_array_equal(read.positions, whole.positions)


@pytest.mark.parametrize('content, expected', [
    ('', "it starts with ''"),
    ('a,b\n1,2\n', "Motive exported with 'Header Information' .* it starts with 'a,b"),
    ('Format Version,' + 200000 * '1', 'field larger than'),
    (MOTIVE.replace('Millimeters', 'Inches'), "lengths in 'Inches', expected one of m, "),
    (MOTIVE.replace('Length Units,', ''), "lengths in ''"),
    (MOTIVE.replace('Position', 'Rotation'), 'no positions of markers.*type Bone, Bone Marker, Marker, Rigid'),
    (MOTIVE.replace('0.220000', '0.200000'), 'times do not increase'),
    (MOTIVE.replace('31,32,33', '31,x,33', 1), "could not convert string to float: '?x"),
    (MOTIVE[:MOTIVE.index('10,0.2')], 'has a header, but no frames'),
    (MOTIVE[:300], 'rows of types, names'),
    (TRC[:60], 'breaks off in its header'),
    (TRC.replace('10.0\t', '10,0\t'), '10,0')])
def test_wrong_files_are_refused(tmp_path, content, expected):
    with pytest.raises(BadInputError, match=expected):
        read_mocap(text_file(tmp_path, 'a.csv', content))
