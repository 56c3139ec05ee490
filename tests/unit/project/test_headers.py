"""Headers for C++ programs say what the Python tables say: joints and limbs."""
import re
import subprocess
from pathlib import Path

import pytest

from development.generated import with_joints
from development.systems import this_system
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS, SKELETONS

ROOT = Path(__file__).parents[3]
JOINTS_H_PATH = ROOT / 'openpose_ros_msgs/include/openpose_ros_msgs/joints.h'
JOINTS_H = JOINTS_H_PATH.read_text()
PRINT = '''
#include <cstdio>
#include <openpose_ros_msgs/PersonDetection.h>
#include <openpose_ros_msgs/joints.h>
using namespace openpose_ros_msgs;
int main()
{
  PersonDetection person;
  for (Joint joint : ALL_JOINTS)
  {
    partOf(person, joint).confidence = 1.0f;
    std::printf("%s %d\\n", nameOf(joint), isKnown(partOf(person, joint)));
  }
  for (const char* name : { "COCO_18", "BODY_25", "MPI_15", "COCO_17" })
  {
    const Skeleton skeleton = skeletonOf(name);
    for (Joint joint : skeleton.joints)
      std::printf("%s %s\\n", name, nameOf(joint));
    for (const Limb& limb : skeleton.limbs)
      std::printf("%s %s-%s\\n", name, nameOf(limb.start), nameOf(limb.end));
  }
  std::printf("%zu\\n", skeletonOf("none").joints.size());
}
'''
FIELDS = re.findall(r'^BodypartDetection_3d (\w+)$', (ROOT / 'msg/PersonDetection_3d.msg').read_text(), re.MULTILINE)


def test_joints_and_skeletons_are_those_of_the_python_tables():
    assert with_joints(JOINTS_H) == JOINTS_H, 'write it again with: ./run config'
    assert list(MESSAGE_JOINTS) == FIELDS


def test_a_program_reads_them(tmp_path):
    """What the macros of the header make of the tables."""
    if not (ROOT / 'devel/include/openpose_ros_msgs').is_dir():
        pytest.skip('the messages are not built')
    (tmp_path / 'print.cpp').write_text(PRINT)
    subprocess.run(['g++', '-std=c++11', f'-I{ROOT}/devel/include', f'-I{JOINTS_H_PATH.parents[1]}',
                    f'-I{this_system().ros or "/usr"}/include',
                    str(tmp_path / 'print.cpp'), '-o', str(tmp_path / 'print')], check=True)
    lines = subprocess.run([str(tmp_path / 'print')], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    assert lines[:27] == [f'{name} 1' for name in FIELDS]
    assert lines[27:] == [f'{model.name} {joint}' for model in SKELETONS.values() for joint in (
        *model.joints, *(f'{start}-{end}' for start, end in model.drawn_limbs))] + ['0']
