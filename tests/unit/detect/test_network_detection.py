"""People keep their ids in the images of a stream, each camera for itself."""
import pytest

from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import DetectorParams, DetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.params.parameters import build
from stand_in_networks import MovenetNetwork, Together, chart, person_at

LEFT, RIGHT = person_at(160, 120, 250), person_at(450, 150, 220)
IMAGE = chart(640, 480)


@pytest.fixture
def network():
    return MovenetNetwork([LEFT, RIGHT])


@pytest.fixture
def stream(network):
    settings = build(DetectorSettings, {'mode': 'fast', 'look_closer': 0})
    detector = Detector(settings, Together(movenet_multipose=network))
    return NetworkDetection(detector, TrackingParams(), FollowingParams())


def test_each_camera_has_ids_of_its_own(stream, network):
    stream.detect(ImageFrame('left', 10.0, IMAGE))
    network.people = [RIGHT]
    assert stream.detect(ImageFrame('right', 10.1, IMAGE)).ids.tolist() == [1]
    network.people = [LEFT, RIGHT]
    assert sorted(stream.detect(ImageFrame('left', 10.1, IMAGE)).ids) == [1, 2]


def test_new_limits_hold_for_all_cameras(stream):
    stream.detect(ImageFrame('left', 10.0, IMAGE))
    stream.reconfigure(TrackingParams(track_timeout=0.5))
    assert sorted(stream.detect(ImageFrame('left', 10.4, IMAGE)).ids) == [1, 2]
    assert sorted(stream.detect(ImageFrame('left', 11.2, IMAGE)).ids) == [3, 4]


@pytest.mark.parametrize('following, detector, wanted', [
    ('auto', {}, False), ('auto', {'target_rate': 10.0}, True),
    ('auto', {'target_rate': 10.0, 'mode': 'accurate'}, False),
    ('never', {'target_rate': 10.0}, False), ('always', {'mode': 'accurate'}, True)], ids=str)
def test_people_are_followed_where_that_is_wanted(following, detector, wanted):
    assert FollowingParams(following=following).wanted(DetectorParams(**detector)) == wanted
