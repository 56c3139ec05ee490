"""What docs/reliability.md promises of the code: nothing that comes from outside is run or unpacked without a check.

The rules S of ruff (pyproject.toml) forbid yaml.load, pickle, shell=True, eval and the like; here is what they leave.
"""
import ast

import pytest
from packaging.requirements import Requirement

from development import PACKAGES, ROOT
from development.locks import (
    FOCAL_REQUIREMENTS,
    NUMPY_OF_SYSTEMS,
    OF_THE_SYSTEM,
    RENDER_PYTHON,
    RENDER_REQUIREMENTS,
    REQUIREMENTS,
    TEST_REQUIREMENTS,
    TOOLS,
    lock_of,
)
from imports import imported_modules

SOURCES = [path for folder in (*PACKAGES.values(), ROOT / 'development')
           for path in sorted(folder.rglob('*.py'))]
# The only modules that read archives: members whose checksum, or that of their archive, is right, into memory. The
# doctor writes one.
READ_ARCHIVES = {'openpose_ros_pkg/src/openpose_ros_pkg/networks/weights_install.py': {'tarfile', 'zipfile'},
                 'extensions/openpose_ros_bringup/src/openpose_ros_bringup/ros/doctor/program.py': {'zipfile'}}
UNPACKING = {'extractall', 'unpack_archive', 'extract'}
ARCHIVES = {'tarfile', 'zipfile'}
PICKLES = {'pickle', 'cPickle', 'cloudpickle', 'dill', 'joblib', 'marshal', 'shelve', 'torch'}


def faults(source):
    """What a module does that it must not: imports and calls by name."""
    found = {name.partition('.')[0] for name in imported_modules(source, 'ours')} & (PICKLES | ARCHIVES)
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            name = getattr(node.func, 'attr', getattr(node.func, 'id', ''))
            found |= {name} & UNPACKING
            found |= {keyword.arg for keyword in node.keywords} & {'allow_pickle'}
    return found


def test_no_module_unpickles_or_unpacks():
    assert len(SOURCES) > 200
    assert faults('import pickle\ntar.extractall(folder)\nload(path, allow_pickle=True)') == {
        'pickle', 'extractall', 'allow_pickle'}
    found = {str(path.relative_to(ROOT)): faults(path.read_text()) for path in SOURCES
             if '/test/' not in str(path)}
    assert {path: names for path, names in found.items() if names} == READ_ARCHIVES


def pins(lock, python):
    """The versions that a lock has for a Python, by name; each with checksums of its files."""
    found = {}
    for line in lock.read_text().replace('\\\n', '').splitlines():
        if not line.startswith('#') and line.strip():
            pin, *checksums = line.split('--hash=sha256:')
            requirement = Requirement(pin)
            if requirement.marker is None or requirement.marker.evaluate(
                    {'python_version': python, 'python_full_version': f'{python}.0'}):
                assert checksums and all(len(checksum.strip()) == 64 for checksum in checksums)
                assert requirement.name not in found
                found[requirement.name] = next(iter(requirement.specifier)).version
    return found


def wanted(requirements, python):
    """What a file of requirements asks for, by name."""
    lines = (line.partition('#')[0].strip() for line in requirements.read_text().splitlines())
    asked = [Requirement(line) for line in lines if line]
    return {entry.name.lower(): entry.specifier for entry in asked
            if entry.marker is None or entry.marker.evaluate({'python_version': python})}


@pytest.mark.parametrize('requirements, python', [
    *((path, python) for path in (REQUIREMENTS, TEST_REQUIREMENTS) for python in NUMPY_OF_SYSTEMS),
    (FOCAL_REQUIREMENTS, '3.8'), (RENDER_REQUIREMENTS, RENDER_PYTHON)])
def test_a_lock_pins_what_is_required_and_nothing_of_the_system(requirements, python):
    asked, found = wanted(requirements, python), pins(lock_of(requirements), python)
    assert asked
    for name, versions in asked.items():
        assert versions.contains(found[name]), name
    if requirements in (REQUIREMENTS, TEST_REQUIREMENTS):
        assert not set(OF_THE_SYSTEM) & set(found)


def test_locks_agree():
    """The nodes' packages are the same when those of the tests join them, and what fetches weights is pinned."""
    for python in NUMPY_OF_SYSTEMS:
        nodes, both = (pins(lock_of(path), python) for path in (REQUIREMENTS, TEST_REQUIREMENTS))
        assert nodes.items() <= both.items()
        assert all(set(names.split()) <= set(pins(lock, python)) for lock, names in TOOLS.items())
