"""The core knows no ROS: arrows point from scripts/ to ros/ to the core, never back."""
import re

import pytest

from development import PACKAGES, ROOT
from imports import imported_modules

LAYERS = [PACKAGES[name] / 'src' / name
          for name in ('openpose_ros_pkg', 'skeleton_extract_3d', 'openpose_ros_fusion', 'openpose_ros_signals',
                       'openpose_ros_bridges', 'openpose_ros_nodelets', 'openpose_ros_web', 'openpose_ros_tools',
                       'openpose_ros_bringup')]
# start.py belongs to the scripts: it imports the module that each of them names.
CORE = sorted(path for package in LAYERS for path in package.rglob('*.py')
              if 'ros' not in path.relative_to(package).parts[:-1] and path.name != 'start.py')
ROS = re.compile(r'(\w+_(msgs|srvs)|tf2?(_\w+)?|ros[a-z]+|cv_bridge|image_\w+|genpy|message_filters|'
                 r'dynamic_reconfigure|diagnostic_updater|actionlib|a module by a name .*|\w+\.ros)(\.|$)')


def ros_parts(names):
    """Those of the modules that belong to ROS: its own, or a `ros` room of this project."""
    return {name for name in names if ROS.match(name)}


@pytest.mark.parametrize('source, sees', [
    ('def f():\n    import tf2_ros', True), ('import numpy, cv_bridge', True), ('from .ros import convert', True),
    ('from openpose_ros_pkg import ros', True), ('import importlib\nimportlib.import_module("ros" + "py")', True),
    ('import os.path, numpy as np\nfrom openpose_ros_pkg.people import People2D', False)])
def test_this_test_sees_ros(source, sees):
    assert bool(ros_parts(imported_modules(source, 'openpose_ros_pkg'))) is sees


def test_core_imports_no_ros():
    assert {'detector.py', 'parameters.py', 'lifting.py'} <= {path.name for path in CORE}
    found = {str(path.relative_to(ROOT)): ros_parts(imported_modules(path.read_text(), path.name))
             for path in CORE}
    assert {path: names for path, names in found.items() if names} == {}


def test_packages_do_not_know_those_built_upon_them():
    for number, package in enumerate(LAYERS):
        later = tuple(other.name for other in LAYERS[number + 1:])
        for path in package.rglob('*.py'):
            assert not any(name.startswith(later) for name in imported_modules(path.read_text(), package.name)), path
