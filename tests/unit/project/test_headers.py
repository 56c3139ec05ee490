"""Headers for C++ programs say what the Python tables say: joints, limbs, constants of the camera fit."""
import dataclasses
import re
from pathlib import Path

import pytest

from openpose_ros_pkg.skeletons import SKELETONS
from skeleton_extract_3d.points.constants import CameraFitConstants

ROOT = Path(__file__).parents[3]
JOINTS_H = (ROOT / 'openpose_ros_msgs/include/openpose_ros_msgs/joints.h').read_text()
PINHOLE_FIT_H = (ROOT / 'openpose_ros_pkg/include/openpose_ros_pkg/pinhole_fit.h').read_text()
FIELDS = re.findall(r'^BodypartDetection_3d (\w+)$', (ROOT / 'msg/PersonDetection_3d.msg').read_text(), re.MULTILINE)


def listed(beginning):
    """Return the words of a list in the header, without Joint::, &Person:: and quotes, in lower case."""
    inside = re.search(re.escape(beginning) + r'\s*{(.*?)\n *};', JOINTS_H, re.DOTALL)[1]
    return [word.lower() for word in re.findall(r'(?:Joint::|&Person::|")?\b([A-Za-z_]+)\b(?!::)"?', inside)]


@pytest.mark.parametrize('beginning', ['enum class Joint', 'Joint ALL_JOINTS[] =', 'char* NAMES[] =', 'MEMBERS[] ='])
def test_joints_are_those_of_the_messages_in_their_order(beginning):
    assert len(FIELDS) == 27
    assert listed(beginning) == FIELDS


@pytest.mark.parametrize('name', SKELETONS)
def test_joints_and_limbs_of_the_skeletons(name):
    assert listed(f'Joint {name}_JOINTS[] =') == list(SKELETONS[name].joints)
    ends = iter(listed(f'Limb {name}_LIMBS[] ='))
    assert list(zip(ends, ends)) == list(SKELETONS[name].drawn_limbs)


def test_every_skeleton_is_found_by_its_name():
    found = re.findall(r'pose_model == "(\w+)"\)\s+return detail::skeleton\((\w+)_JOINTS, (\w+)_LIMBS\);', JOINTS_H)
    assert found == [(name, name, name) for name in SKELETONS]


def test_constants_of_the_camera_fit():
    written = {name: float(value) for name, value in re.findall(r'\b(\w+) = ([\d.e-]+)[,;]', PINHOLE_FIT_H)}
    expected = dataclasses.asdict(CameraFitConstants())
    expected['columns'], expected['rows'] = expected.pop('grid')
    assert {name: written.get(name) for name in expected} == expected
