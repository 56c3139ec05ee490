"""Files of motion capture systems: hand-written ones of each format, and what may be wrong with them."""
import logging
import struct
import sys

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


def test_motive_markers(tmp_path):
    read = read_mocap(text_file(tmp_path, 'walk.csv', MOTIVE))
    assert read.names == ('Ann:Chest', 'Ben:Chest', 'Unlabeled 1234')
    np.testing.assert_allclose(read.times, [0.20, 0.22])
    np.testing.assert_allclose(of(read, 'Ann:Chest'), [[0.031, 0.032, 0.033], [np.nan] * 3])
    np.testing.assert_allclose(of(read, 'Unlabeled 1234'), [[np.nan] * 3, [0.061, 0.062, 0.063]])


def test_motive_without_labels_of_rows_and_with_time_codes(tmp_path):
    read = read_mocap(text_file(tmp_path, 'short.csv', MOTIVE_SHORT))
    assert read.names == ('Head',)
    np.testing.assert_allclose(read.positions[:, 0], [[1.5, -2.5, 0.001], [np.nan] * 3])


@pytest.mark.parametrize('old, new', [
    ('Time (Seconds)', 'Time'), ('Version,1.23', 'Version,1.25'), ('\n,,Rotation', f"\n,Parent{',' * 30}\n,,Rotation")])
def test_headers_of_other_versions(tmp_path, old, new):
    read = read_mocap(text_file(tmp_path, 'walk.csv', MOTIVE.replace(old, new)))
    assert len(read.names) == 3
    np.testing.assert_allclose(read.times, [0.20, 0.22])


def test_equal_names_are_told_apart(tmp_path):
    text = MOTIVE.replace('Ben:Chest', 'Ann:Chest')
    read = read_mocap(text_file(tmp_path, 'walk.csv', text))
    np.testing.assert_allclose(of(read, 'Ann:Chest (2)')[0], [0.041, 0.042, 0.043])


@pytest.mark.parametrize('name, text, encoding, newline', [
    ('walk.csv', MOTIVE, 'utf-8-sig', '\n'), ('walk.trc', TRC, 'utf-16', '\n'), ('walk.trc', TRC, 'utf-8', '\r\n'),
    ('walk.csv', MOTIVE.replace('Ben', 'J\xf6rg'), 'latin-1', '\r\n')])
def test_encodings_and_line_ends(tmp_path, name, text, encoding, newline):
    plain = read_mocap(text_file(tmp_path, name, text))
    read = read_mocap(text_file(tmp_path, f'other_{name}', text, encoding, newline))
    assert read.names == plain.names
    np.testing.assert_array_equal(read.positions, plain.positions)


def test_trc_by_hand(tmp_path):
    read = read_mocap(text_file(tmp_path, 'walk.trc', TRC))
    assert read.names == ('LSHO', 'RSHO')
    np.testing.assert_allclose(read.times, [0, 0.017, 0.033])
    np.testing.assert_allclose(of(read, 'LSHO'), [[0.01, 0.02, 0.03], [np.nan] * 3, [0.012, 0.022, 0.032]])
    np.testing.assert_allclose(of(read, 'RSHO'), [[1, 2, 3], [1.001, 2.001, 3.001], [np.nan] * 3])


def test_trc_in_metres_with_rows_cut_at_the_end_zeros_and_no_times(tmp_path):
    text = TRC.replace('\tmm\t', '\tm\t').replace('0.000\t', '\t').replace('\n3\t0.033\t12.0\t22.0\t32.0\t\t\t\n',
                                                                       '\n3\t0.033\t0\t0.0\t0\n')
    read = read_mocap(text_file(tmp_path, 'walk.trc', text))
    np.testing.assert_allclose(read.times, [0, 1 / 60, 2 / 60])
    np.testing.assert_allclose(of(read, 'LSHO')[[0, 2]], [[10, 20, 30], [np.nan] * 3])
    np.testing.assert_allclose(of(read, 'RSHO')[2], [np.nan] * 3)


def test_content_decides_on_the_format(tmp_path):
    for name, text, names in (('a.trc', MOTIVE, 3), ('b.csv', TRC, 2), ('c.dat', TRC, 2)):
        assert len(read_mocap(text_file(tmp_path, name, text)).names) == names
    assert read_mocap(c3d_file(tmp_path / 'd.trc')).names == ('A', 'B')


@pytest.mark.parametrize('unit, expected', [('mm', 0.5), ('m', 500.0), ('cm  ', 5.0)])
def test_c3d_units_residuals_labels_and_frame_numbers(tmp_path, unit, expected):
    read = read_mocap(c3d_file(tmp_path / 'file.c3d', unit, first=201))
    assert read.names == ('A', 'B')
    np.testing.assert_allclose(read.times, [2.00, 2.01, 2.02])
    np.testing.assert_allclose(of(read, 'A')[:, 0], [expected, expected, np.nan])
    np.testing.assert_allclose(of(read, 'B')[:, 0], [expected, np.nan, expected])


def test_c3d_of_integers(tmp_path):
    read = read_mocap(c3d_file(tmp_path / 'file.c3d', scale=0.1))
    np.testing.assert_allclose(of(read, 'A')[0], [0.5] * 3, atol=1.01e-4)  # steps of 0.1 mm


def test_c3d_with_late_frames(tmp_path):
    path = c3d_file(tmp_path / 'file.c3d', first=70001)
    content = path.read_bytes()
    for wrong in (70002, 70000):  # last and first frame as some versions of the library write them: one too low
        content = content.replace(struct.pack('<I', wrong), struct.pack('<I', wrong + 1))
    path.write_bytes(content)
    read = read_mocap(path)
    np.testing.assert_allclose(read.times, [700.00, 700.01, 700.02])


def test_c3d_with_points_that_have_no_label(tmp_path):
    assert read_mocap(c3d_file(tmp_path / 'file.c3d', labels=('A   ',))).names == ('A', 'point 2')
    assert read_mocap(c3d_file(tmp_path / 'none.c3d', labels=())).names == ('point 1', 'point 2')


def test_c3d_that_breaks_off(tmp_path, caplog):
    content = c3d_file(tmp_path / 'file.c3d', points=np.full((200, 2, 5), 500.0)).read_bytes()
    (tmp_path / 'cut.c3d').write_bytes(content[:-2000])
    with caplog.at_level(logging.WARNING):
        read = read_mocap(tmp_path / 'cut.c3d')
    assert 100 < len(read) < 200 and 'of 200 frames' in caplog.text


def test_without_the_library_c3d(tmp_path, monkeypatch):
    path = c3d_file(tmp_path / 'file.c3d')
    monkeypatch.setitem(sys.modules, 'c3d', None)
    with pytest.raises(BadInputError, match=r'library c3d is needed to read .*pip install c3d'):
        read_mocap(path)


@pytest.mark.parametrize('name, cut, told', [
    ('walk.csv', MOTIVE[:-50], 'has 13 cells, expected 24'),
    ('walk.csv', MOTIVE + '12,0.24', 'has 2 cells'),
    ('walk.trc', TRC + '4\t0.050\t13.0\t2', 'has 4 cells'),
    ('walk.trc', TRC + '4\t0.050\t13.0\t2\t3\t1\t2\t-', 'no number'),
])
def test_a_last_line_that_breaks_off_is_left_out(tmp_path, caplog, name, cut, told):
    with caplog.at_level(logging.WARNING):
        read = read_mocap(text_file(tmp_path, name, cut))
    whole = read_mocap(text_file(tmp_path, name, MOTIVE if name == 'walk.csv' else TRC))
    np.testing.assert_array_equal(read.positions, whole.positions[:len(read)])
    assert len(read) >= len(whole) - 1
    assert 'breaks off' in caplog.text and told in caplog.text


@pytest.mark.parametrize('name, content, told', [
    ('a.csv', '', 'is empty'),
    ('a.csv', 'a,b\n1,2\n', "starts with 'a,b', expected 'Format Version,...'; export with 'Header Information'"),
    ('a.csv', 'Format Version,' + 200000 * '1', 'field larger than'),
    ('a.csv', '\x00\x01\x02\x03', 'binary file, expected text'),
    ('a.c3d', MOTIVE, 'no C3D file'),
    ('a.txt', 'hello', 'no motion capture file that can be read.*hello'),
    ('a.csv', MOTIVE.replace(',', ';'), "separated by ';'"),
    ('a.csv', MOTIVE.replace('Millimeters', 'Inches'), "lengths in 'Inches', expected one of m, "),
    ('a.csv', MOTIVE.replace('Position', 'Rotation'), 'no positions of markers.*type Bone, Bone Marker, Marker, Rigid'),
    ('a.csv', MOTIVE.replace('0.220000', '0.200000'), '0.2 s is followed by 0.2 s'),
    ('a.csv', MOTIVE.replace('10,0.200000,0,0,0,1,11,12,13,1,1', '10,0.200000'), 'line 8: has 23 cells, expected 24'),
    ('a.csv', MOTIVE.replace('31,32,33', '31,x,33', 1), 'line 8: holds something that is no number.*x'),
    ('a.csv', MOTIVE[:MOTIVE.index('10,0.2')], 'has a header, but no frames'),
    ('a.trc', TRC[:60], 'breaks off in its header'),
    ('a.trc', TRC.replace('\t2\tmm', '\t3\tmm'), 'NumMarkers = 3, but line 4 names 2: LSHO, RSHO'),
    ('a.trc', TRC.replace('10.0\t', '10,0\t'), "line 7.*decimal commas can not be read, export with '.'"),
    ('a.trc', TRC.replace('60.00', '0').replace('0.000\t', '\t'), "without a time and DataRate = '0'"),
])
def test_wrong_files_are_refused(tmp_path, name, content, told):
    with pytest.raises(BadInputError, match=told):
        read_mocap(text_file(tmp_path, name, content))


@pytest.mark.parametrize('unit, told', [('ell', "lengths in 'ell'"), ('    ', 'does not tell its unit')])
def test_c3d_files_of_unknown_units_are_refused(tmp_path, unit, told):
    with pytest.raises(BadInputError, match=told):
        read_mocap(c3d_file(tmp_path / 'file.c3d', unit))
