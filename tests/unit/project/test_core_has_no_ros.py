"""The core knows no ROS: arrows point from scripts/ to ros/ to the core, never back."""
import importlib.util
import sys
import sysconfig
from pathlib import Path

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
ALLOWED = {'c3d', 'cv2', 'distributed', 'matplotlib', 'numpy', 'onnxruntime', 'openpose_ros_decode',
           'openvino', 'pandas', 'scipy', 'skeleton_extract_3d_lifting', 'toml', 'tomllib', 'tornado', 'tqdm', 'yaml',
           'openpose_ros_bridges', 'openpose_ros_bringup', 'openpose_ros_fusion', 'openpose_ros_pkg',
           'openpose_ros_nodelets', 'openpose_ros_signals', 'openpose_ros_tools', 'openpose_ros_web',
           'skeleton_extract_3d'}
STANDARD_LIBRARY = Path(sysconfig.get_paths()['stdlib']).resolve()


def is_standard(name):
    """Whether a top-level module comes with Python."""
    spec = importlib.util.find_spec(name)
    if name in sys.builtin_module_names or spec is None or spec.origin == 'frozen':
        return spec is not None
    path = Path(spec.origin or '').resolve()
    return STANDARD_LIBRARY in path.parents and not {'site-packages', 'dist-packages'} & set(path.parts)


def ros_parts(names):
    """Those of the modules that belong to ROS: its own, or a `ros` room of this project."""
    tops = {name: name.split('.')[0] for name in names}
    return {name for name, top in tops.items()
            if not (top in ALLOWED or is_standard(top)) or name.split('.')[1:2] == ['ros']}


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
