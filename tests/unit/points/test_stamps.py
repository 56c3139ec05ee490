"""Stamps of images: exact to the nanosecond from and to text, and which belong together."""
import pytest

from skeleton_extract_3d.points.stamps import associate, parse_stamp, seconds_text


@pytest.mark.parametrize('text, stamp', [
    ('1305031102.175304', 1305031102175304000), ('1305031102.123456789', 1305031102123456789), ('0', 0),
    (' 12 ', 12000000000), ('1.305031102175304e+09', 1305031102175304000), ('0.0000000004', 0), ('0.0000000006', 1),
    ('1e-5000000', 0)])
def test_stamps_keep_all_digits(text, stamp):
    assert parse_stamp(text) == stamp


@pytest.mark.parametrize('text', ['', 'x', 'nan', '-1', '1/3', '4294967296', '1e5000000', '9' * 100000])
def test_text_that_is_no_stamp_is_refused_at_once(text):
    with pytest.raises(ValueError, match='is not a number of seconds'):
        parse_stamp(text)


def test_text_of_a_stamp_is_the_stamp():
    for stamp in (1, 999999999, 1305031102123456789):
        assert parse_stamp(seconds_text(stamp)) == stamp


@pytest.mark.parametrize('first, second, difference, pairs', [
    ([], [], 5, []), ([1], [], 5, []), ([], [1], 5, []), ([10], [10], 0, [(0, 0)]), ([10], [16], 5, []),
    # the nearest pair comes first
    ([10, 20], [14, 21], 5, [(0, 0), (1, 1)]), ([10, 20], [18], 9, [(1, 0)]), ([10, 12], [11], 5, [(0, 0)]),
    ([10, 20, 30], [19, 31], 50, [(1, 0), (2, 1)])])
def test_associated_pairs(first, second, difference, pairs):
    assert associate(first, second, difference) == pairs
