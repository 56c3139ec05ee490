"""What set-up deletes, leaves alone and remembers."""
import pytest

from development import set_up, workspace


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
