"""Stamps of images: exact to the nanosecond from text, units, tables of all kinds, and which belong together."""
import itertools

import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.images.stamps import associate, detect_unit, number_in_name, parse_stamp, read_stamp_table


@pytest.mark.parametrize('text, unit, stamp', [
    ('1305031102.175304', 's', 1305031102175304000), ('1305031102.123456789', 's', 1305031102123456789),
    ('0', 's', 0), (' 12 ', 'ms', 12000000), ('1622547800123456', 'us', 1622547800123456000),
    ('1403636579763555584', 'ns', 1403636579763555584), ('1.305031102175304e+09', 's', 1305031102175304000),
    ('0.0000000004', 's', 0), ('0.0000000006', 's', 1)])
def test_stamps_keep_all_digits(text, unit, stamp):
    assert parse_stamp(text, unit) == stamp


@pytest.mark.parametrize('text', ['', 'x', 'nan', '1/3', '1_0', '1e5000000', '1e-5000000', '9' * 100000])
def test_what_is_no_stamp_is_refused_at_once(tmp_path, text):
    with pytest.raises(ValueError, match='is no number, or has too many digits'):
        parse_stamp(text, 's')
    (tmp_path / 'stamps').write_text(f'frame,colour [s]\n0,1.0\n1,{text or "-"}\n')
    with pytest.raises(BadInputError, match='is no number, or has too many digits'):
        read_stamp_table(tmp_path / 'stamps')
    assert detect_unit([text]) is None


@pytest.mark.parametrize('texts, unit', [
    ([], None), (['1305031102.175304', '1305031103.2'], 's'), (['0.0', '0.1'], 's'), (['1305031102'], 's'),
    (['1305031102175'], 'ms'), (['1305031102175304'], 'us'), (['1305031102175304000'], 'ns'),
    (['000001', '000002'], None), (['20', '21'], None), (['a'], None), (['1305031102', '7'], None),
    (['1305031102', '1305031102175'], None)])
def test_the_unit_is_told_by_the_size(texts, unit):
    assert detect_unit(texts) == unit


@pytest.mark.parametrize('stem, text', [
    ('', ''), ('frame', ''), ('000012', '000012'), ('1305031102.175304', '1305031102.175304'),
    ('cam2_1622547800123456', '1622547800123456'), ('frame-000001.color', '000001')])
def test_the_number_of_a_name_is_its_last(stem, text):
    assert number_in_name(stem) == text


@pytest.mark.parametrize('text, names, stamps', [
    ('1.0\n1.5\n', None, [10 ** 9, 15 * 10 ** 8]),
    ('# a remark\nstamp\n1.0\n', None, [10 ** 9]),
    ('a.png,1.0\nb.png,1.5', ['a.png', 'b.png'], [10 ** 9, 15 * 10 ** 8]),
    ('000 1.0\n001 1.5', ['000', '001'], [10 ** 9, 15 * 10 ** 8]),
    ('name;stamp [ms]\n0;1000\n1;1500', ['0', '1'], [10 ** 9, 15 * 10 ** 8]),
    ('#timestamp [ns],filename\n1000000000,a.png', ['a.png'], [10 ** 9])])
def test_tables_of_one_or_two_columns_are_read(tmp_path, text, names, stamps):
    (tmp_path / 'stamps').write_text(text)
    table = read_stamp_table(tmp_path / 'stamps')
    assert (table.names, [row[''] for row in table.stamps]) == (names, stamps)


def test_a_table_may_have_stamps_of_each_stream(tmp_path):
    (tmp_path / 'stamps').write_text('frame,colour [ns],depth [ns]\n000,5,\n001,7,8\n')
    table = read_stamp_table(tmp_path / 'stamps')
    assert table.names == ['000', '001']
    assert table.stamps == [{'colour': 5}, {'colour': 7, 'depth': 8}]


def test_a_given_unit_counts_more_than_the_size(tmp_path):
    (tmp_path / 'stamps').write_text('0\n33\n')
    assert [row[''] for row in read_stamp_table(tmp_path / 'stamps', 'ms').stamps] == [0, 33000000]


@pytest.mark.parametrize('text, words', [
    ('', 'empty'), ('name,stamp\n', 'empty'), ('1.0\na,1.5\n', '1 to 2 columns'), ('0\n33\n', 'unit of 0'),
    ('1,2.0,3\n', '3 columns'), ('a,1.0\nb,x\n', 'unit of')])
def test_what_is_no_table_is_refused(tmp_path, text, words):
    (tmp_path / 'stamps').write_text(text)
    with pytest.raises(BadInputError, match=words):
        read_stamp_table(tmp_path / 'stamps')


def test_a_table_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(BadInputError, match='can not be read'):
        read_stamp_table(tmp_path / 'nowhere')


@pytest.mark.parametrize('first, second, pairs', [
    ([], [], []), ([1], [], []), ([], [1], []), ([10, 20], [11, 21], [(0, 0), (1, 1)]),
    # the nearest first: 12 takes 13, so 10 is left with nothing
    ([10, 12], [13], [(1, 0)]), ([10], [16], []), ([10], [15], [(0, 0)]), ([0, 100], [1, 50, 99], [(0, 0), (1, 2)])])
def test_partners_are_the_nearest(first, second, pairs):
    assert associate(first, second, 5) == pairs


def test_partners_are_those_of_comparing_all_with_all():
    random = np.random.default_rng(3)
    for _ in range(50):
        first, second = (sorted(set(random.integers(0, 300, size).tolist())) for size in random.integers(0, 30, 2))
        left, right, expected = set(range(len(first))), set(range(len(second))), []
        for i, j in sorted(itertools.product(left, right), key=lambda ij: (abs(first[ij[0]] - second[ij[1]]), ij)):
            if i in left and j in right and abs(first[i] - second[j]) <= 9:
                left.remove(i)
                right.remove(j)
                expected.append((i, j))
        assert associate(first, second, 9) == sorted(expected)
