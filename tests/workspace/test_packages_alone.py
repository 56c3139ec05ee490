"""Each package builds and installs alone, in a workspace that has only what its package.xml names.

What it needs of this repository comes from install spaces that were built in the same way before. Its modules are
imported and its programs asked for --help there, without a master.
"""
import shutil
import xml.etree.ElementTree as ElementTree

import pytest

from development import PACKAGES as FOLDERS
from workspaces import NOT_SOURCE, ROOT, shell

CHECK = """
import importlib, importlib.util, pkgutil, sys
for name in sys.argv[2].split():
    assert importlib.util.find_spec(name) is None, f'{name} is there, although nothing names it'
if sys.argv[1] != 'openpose_ros':  # no modules in Python
    package = importlib.import_module(sys.argv[1])
    for module in pkgutil.walk_packages(package.__path__, f'{package.__name__}.'):
        importlib.import_module(module.name)
"""


def needed_by(package):
    """Packages of this repository that a package names for its build or for running, and those that these name."""
    kinds = ('depend', 'build_depend', 'exec_depend', 'build_export_depend')
    root = ElementTree.parse(str(FOLDERS[package] / 'package.xml')).getroot()
    named = [element.text for kind in kinds for element in root.iter(kind) if element.text in FOLDERS]
    return sorted({*named, *(further for name in named for further in needed_by(name))})


METAPACKAGE = 'openpose_ros'  # catkin installs nothing of it but its manifest
PACKAGES = sorted(FOLDERS, key=lambda package: len(needed_by(package)))


@pytest.fixture(scope='module')
def spaces(tmp_path_factory):
    return tmp_path_factory.mktemp('spaces')


@pytest.mark.parametrize('package', PACKAGES)
def test_package_alone(package, spaces, environment, tmp_path):
    """It builds, installs, imports all its modules and answers --help with nothing but what it names."""
    needed = needed_by(package)
    assert all((spaces / name).is_dir() for name in needed), 'what it needs could not be installed'
    shutil.copytree(str(FOLDERS[package]), str(tmp_path / 'src' / package), symlinks=True, ignore=NOT_SOURCE)
    sources = '\n'.join(f'source {spaces / name}/setup.bash --extend' for name in needed)
    build = f'catkin_make_isolated --install --install-space {spaces / package} -DPYTHON_EXECUTABLE=/usr/bin/python3'
    shell(f'{sources}\n{build}', tmp_path, environment)
    for folder in ('src', 'build_isolated', 'devel_isolated'):
        shutil.rmtree(str(tmp_path / folder))

    (tmp_path / 'check.py').write_text(CHECK)
    # the module openpose_ros is of skeleton_extract_3d
    strangers = ' '.join(set(PACKAGES) - {package, METAPACKAGE, *needed})
    shell(f"""
        export OPENPOSE_ROS_VENV={ROOT}/.venv
        {sources}
        source {spaces / package}/setup.bash --extend
        export ROS_MASTER_URI=http://localhost:1
        if grep -rI {tmp_path} {spaces / package}; then echo 'a path of the build is installed'; exit 1; fi
        /usr/bin/python3 check.py {package} '{strangers}'
        {'' if package == METAPACKAGE else f'test -s {spaces / package}/share/{package}/LICENSE'}
        for program in $(find {spaces / package}/lib/{package} -type f 2>/dev/null); do
          $program --help >help.txt || {{ echo "$program --help failed"; exit 1; }}
          test -s help.txt
        done""", tmp_path, environment)
