"""Messages of packages that may be absent: found with their fields, or an error that says what to do."""

import pytest
from geometry_msgs.msg import Point

from openpose_ros_pkg.errors import ForeignPackageError
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage

GEOMETRY = ForeignPackage('geometry_msgs', 'https://example.org/geometry')


def test_found():
    assert GEOMETRY.message('Point', {}) is Point
    assert GEOMETRY.message('Point', {'x': 'float64', 'y': 'float64'}) is Point
    assert GEOMETRY.message('PointStamped', {'header': 'std_msgs/Header', 'point': 'geometry_msgs/Point'})


def test_missing_package():
    with pytest.raises(ForeignPackageError) as caught:
        ForeignPackage('no_such_msgs', 'https://example.org/none').message('Thing', {})
    text = str(caught.value)
    for part in ('no_such_msgs', 'apt install ros-$ROS_DISTRO-no-such-msgs', 'https://example.org/none', 'setup.bash'):
        assert part in text


def test_missing_message():
    with pytest.raises(ForeignPackageError, match=r'geometry_msgs has no message Person.*https://example\.org/geometry'):
        GEOMETRY.message('Person', {})


@pytest.mark.parametrize(('fields', 'text'), [
    ({'x': 'float64', 'w': 'float64'}, 'w is missing, not float64'),
    ({'x': 'float32'}, 'x is float64, not float32'),
    ({'y': 'string', 'v': 'bool'}, 'y is float64, not string; v is missing, not bool')])
def test_other_fields(fields, text):
    with pytest.raises(ForeignPackageError, match=f'geometry_msgs/Point is defined otherwise than known here: {text}'):
        GEOMETRY.message('Point', fields)
