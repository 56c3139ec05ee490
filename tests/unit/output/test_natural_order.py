"""File names are sorted as people number them."""
from pathlib import Path

from openpose_ros_pkg.natural_order import natural_key


def test_natural_order():
    paths = [Path(name) for name in ('image10.png', 'Image2.png', 'image1.png', 'a')]
    assert [path.name for path in sorted(paths, key=natural_key)] == ['a', 'image1.png', 'Image2.png', 'image10.png']
