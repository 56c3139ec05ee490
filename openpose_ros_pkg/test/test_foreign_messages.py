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


@pytest.mark.parametrize('package, name, fields, text', [
    (ForeignPackage('no_such_msgs', 'https://example.org/none'), 'Thing', {},
     r'no_such_msgs.*apt install ros-\$ROS_DISTRO-no-such-msgs.*https://example\.org/none, and source its setup\.bash'),
    (GEOMETRY, 'Person', {}, r'geometry_msgs has no message Person.*https://example\.org/geometry'),
    (GEOMETRY, 'Point', {'x': 'float64', 'w': 'float64'}, 'w is missing, not float64'),
    (GEOMETRY, 'Point', {'x': 'float32'}, 'Point is defined otherwise than known here: x is float64, not float32'),
    (GEOMETRY, 'Point', {'y': 'string', 'v': 'bool'}, 'y is float64, not string; v is missing, not bool')])
def test_what_is_missing_or_other(package, name, fields, text):
    with pytest.raises(ForeignPackageError, match=text):
        package.message(name, fields)
