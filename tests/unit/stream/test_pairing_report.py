"""Why two streams do not pair, and that the parameters which the report suggests pair them."""
import pytest

from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher, pairing_report
from two_streams import EPOCH

IMAGE, CLOUD = 0, 1
NAMES = '/image', '/points'


def played(arrivals, **params):
    """Return a matcher that got messages, (stream, stamp [s]), and the number of pairs."""
    matcher = StampMatcher(PairingParams(**params))
    return matcher, sum(matcher.add(stream, EPOCH + round(stamp * 1e9), None) is not None for stream, stamp in arrivals)


def by_arrival(count, period, offset):
    """Return what came until the last image; the stamps of clouds differ by `offset` [s]."""
    sent = [(i * period, IMAGE, i * period) for i in range(count)]
    sent += [(i * period + offset, CLOUD, i * period + offset) for i in range(count)]
    return [(stream, stamp) for time, stream, stamp in sorted(sent) if time < count * period]


@pytest.mark.parametrize('arrivals, params, words, settings', [
    # one frame, as in recordings of single frames
    (by_arrival(1, 1.0, 0.21), {}, 'differ by 0.21 s, allowed are 0.005 s; slop:=0.3 pairs them', {'slop': 0.3}),
    # a slop of the user that is too small for a slow camera
    (by_arrival(6, 1.0, 0.21), {'slop': 0.03}, 'differ by 0.21 s, allowed are 0.03 s; slop:=0.3 pairs them',
     {'slop': 0.3}),
])
def test_what_the_report_suggests_pairs_the_streams(arrivals, params, words, settings):
    matcher, pairs = played(arrivals, **params)
    assert pairs == 0
    report = pairing_report(matcher)
    assert words in report.text(NAMES, '{}:={}')
    assert report.settings == settings
    matcher, pairs = played(arrivals, **{**params, **settings})
    assert pairs + len(matcher.finish()) == sum(stream == CLOUD for stream, _ in arrivals)


def test_clocks_that_differ_are_named_and_no_parameter_is_suggested():
    matcher, pairs = played([(stream, i / 30 + shift) for i in range(100) for stream, shift in ((IMAGE, 0.0),
                                                                                                (CLOUD, 1000.0))])
    assert pairs == 0
    report = pairing_report(matcher)
    assert report.settings == {}
    assert '/image is 1e+03 s behind /points: does its clock differ?' in report.text(NAMES, '{}:={}')
