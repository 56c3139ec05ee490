"""./run camera: from a name to the launch command; --help of commands."""
import subprocess

import pytest

from development import ROOT
from development.camera import launch_command

LAUNCH = ['roslaunch', 'openpose_ros_bringup', 'people.launch']


@pytest.mark.parametrize('arguments, has_display, command', [
    (['realsense'], True, ['camera:=realsense', 'driver:=true', 'rviz:=true']),
    (['usb_cam'], False, ['camera:=usb_cam', 'driver:=true', 'points:=none', 'rviz:=false']),
    (['auto', 'mode:=fast'], False, ['camera:=auto', 'rviz:=false', 'mode:=fast']),
    (['orbbec', 'femto_bolt.launch', 'rviz:=false'], True, [
        'camera:=orbbec', 'driver:=true', 'driver:=femto_bolt.launch', 'rviz:=true', 'rviz:=false']),
    (['files', 'source:=0'], False, ['camera:=files', 'points:=none', 'rviz:=false', 'source:=0'])])
def test_command(arguments, has_display, command):
    assert launch_command(arguments, has_display) == LAUNCH + command


def test_paths_are_absolute_as_nodes_have_folders_of_their_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'walk.mp4').touch()
    (tmp_path / 'mine.yaml').write_text('mine: {image: a}')
    assert launch_command(['files', 'source:=walk.mp4'], False)[-1] == f'source:={tmp_path}/walk.mp4'
    assert launch_command(['mine.yaml'], False)[3] == f'camera:={tmp_path}/mine.yaml'


@pytest.mark.parametrize('arguments, text', [
    ([], 'usage: ./run camera NAME'), (['realsens'], "did you mean 'realsense'"), (['a'], 'kinect2       Kinect v2')])
def test_unknown_name_gets_the_list(arguments, text):
    with pytest.raises(SystemExit, match=text):
        launch_command(arguments, False)


@pytest.mark.parametrize('command', ['camera', 'ros2', 'test'])
def test_help_does_nothing_else(command, tmp_path):
    shown = subprocess.run([str(ROOT / 'run'), command, '--help'], cwd=str(tmp_path), check=True, text=True,
                           stdout=subprocess.PIPE).stdout
    assert f'./run {command} ' in shown and not any(tmp_path.iterdir())
