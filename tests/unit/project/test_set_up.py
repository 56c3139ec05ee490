"""What set-up deletes, leaves alone and remembers."""
import pytest

from development import set_up, workspace
from openpose_ros_pkg.networks.model_registry import BY_NAME
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


def test_workspaces_that_are_sourced_are_used(tmp_path, monkeypatch):
    for name in ('.catkin', 'setup.bash'):
        (tmp_path / name).touch()
    monkeypatch.setenv('SOURCED_WORKSPACES', f'{tmp_path.parent}:{tmp_path}:/opt/nowhere:')
    assert workspace.underlays() == [tmp_path]


@pytest.mark.parametrize('installed', [False, True])
def test_one_line_says_what_a_network_by_name_would_gain(monkeypatch, capsys, installed):
    monkeypatch.setattr(set_up, 'weights', lambda *words, quiet=False: installed or words[-1] != set_up.BETTER_MODEL)
    set_up._set_up_weights()
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == '[3/4] Weights of the networks: there and right' and len(lines) == (1 if installed else 2)
    assert installed or './run model get rtmpose-m' in lines[1]
    assert find_model(set_up.BETTER_MODEL) is BY_NAME[0]
