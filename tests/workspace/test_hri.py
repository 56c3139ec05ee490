"""People as REP-155 has them, with the real hri_msgs, which is built in a workspace of its own where it is found."""
import shutil

import pytest

from workspaces import ROOT, SETTINGS, shell

# Release 0.9.0 for ROS 1, beside the checkout; as a package, ROS noetic alone has it.
SOURCE = ROOT.parent / 'shared' / 'data' / 'hri_msgs'
CHECK = ROOT / 'tests' / 'workspace' / 'check_hri.py'


@pytest.mark.skipif(not SOURCE.is_dir(), reason=f'the sources of hri_msgs are not in {SOURCE}')
def test_bodies_and_persons_with_hri_msgs(tmp_path, environment):
    shutil.copytree(str(SOURCE), str(tmp_path / 'src' / 'hri_msgs'))
    shell(f'catkin_make {SETTINGS}', tmp_path, environment)
    shell(f'source {ROOT}/devel/setup.bash\nsource {tmp_path}/devel/setup.bash --extend\n/usr/bin/python3 {CHECK}',
          tmp_path, environment)


def test_without_hri_msgs_the_node_says_how_to_get_it(tmp_path, environment):
    output = shell(f'source {ROOT}/devel/setup.bash\n/usr/bin/python3 {CHECK} --without', tmp_path, environment)
    assert 'the messages of the package hri_msgs are not found' in output
    assert 'https://github.com/ros4hri/hri_msgs' in output
