"""What set-up deletes, leaves alone and remembers."""
import pytest

from development import set_up, workspace
from openpose_ros_pkg.networks.model_registry import BY_NAME, MOBILENET_AP
from openpose_ros_pkg.networks.models import find_model


def test_environment_of_the_user_is_left_alone(tmp_path):
    environment = tmp_path / '.venv'
    set_up.check_own(environment)  # there is none
    environment.mkdir()
    (environment / 'pyvenv.cfg').touch()
    with pytest.raises(SystemExit, match=r'\.venv was not made by \./run setup.*move it away'):
        set_up.check_own(environment)
    (environment / set_up.MADE_BY_RUN).touch()
    set_up.check_own(environment)
    link = tmp_path / 'link'
    link.symlink_to(environment)
    with pytest.raises(SystemExit, match='link was not made by'):
        set_up.check_own(link)


def test_workspaces_to_extend_are_remembered(tmp_path, monkeypatch):
    monkeypatch.setattr(workspace, 'EXTENDED', tmp_path / 'extended')
    for name in ('one/devel', 'two'):
        (tmp_path / name).mkdir(parents=True)
        for file in ('.catkin', 'setup.bash'):
            (tmp_path / name / file).touch()
    one, two = tmp_path / 'one/devel', tmp_path / 'two'
    monkeypatch.setenv('SOURCED_WORKSPACES', f'{tmp_path}:{two}:/opt/nowhere:')
    assert workspace.underlays() == [two], 'of the sourced folders, those that are workspaces'
    workspace.extend([str(one.parent), str(two)])
    assert workspace.underlays() == [one, two]
    with pytest.raises(SystemExit, match=r'/one/none has no setup\.bash of catkin'):
        workspace.extend([str(one), str(tmp_path / 'one/none')])
    assert workspace.underlays() == [one, two], 'as before'
    (one / '.catkin').unlink()
    with pytest.raises(SystemExit, match=r'/one/devel, of \./run setup --extend, is not there; to forget it: '):
        workspace.underlays()
    workspace.extend([])
    assert workspace.underlays() == [two]


@pytest.mark.parametrize('installed', [False, True])
def test_one_line_says_what_a_network_by_name_would_gain(monkeypatch, capsys, installed):
    monkeypatch.setattr(set_up, 'weights', lambda *words, quiet=False: installed or words[-1] != set_up.BETTER_MODEL)
    set_up._set_up_weights()
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == '[3/4] Weights of the networks: there and right' and len(lines) == (1 if installed else 2)
    assert installed or ('./run model get rtmpose-m' in lines[1] and '0.75 as published' in lines[1])
    best = find_model(set_up.BETTER_MODEL)
    assert best is BY_NAME[0] and f'{best.source.published_ap:.2f}' == f'{set_up.BETTER_AP:.2f}'
    assert f'{MOBILENET_AP:.2f}' == f'{set_up.MOBILENET_AP:.2f}'
