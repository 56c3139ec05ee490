"""The unit tests with the libraries of Ubuntu 20.04 run wherever a Python 3.8 is found, and say so where none is."""
import pytest

from development import commands, set_up, testing


@pytest.fixture()
def pythons(tmp_path, monkeypatch):
    """A function that puts a python3.8 with an exit status into a folder of pyenv or of PATH; there are no others."""
    monkeypatch.setenv('PYENV_ROOT', str(tmp_path / 'pyenv'))
    monkeypatch.setenv('PATH', str(tmp_path / 'path'))

    def put(folder, status=0):
        path = tmp_path / folder / 'python3.8'
        path.parent.mkdir(parents=True)
        path.write_text(f'#!/bin/sh\nexit {status}\n')
        path.chmod(0o755)
        return path
    return put


def test_without_a_python_the_group_is_left_out(pythons, capsys):
    assert set_up.find_python_38() is None
    assert testing._run_group('focal') == 0
    assert 'LEFT OUT, as this needs a Python 3.8' in capsys.readouterr().out


def test_without_a_python_the_group_can_not_be_asked_for(pythons):
    with pytest.raises(SystemExit, match=r'the test group focal needs a Python 3\.8') as caught:
        commands.test(['focal'])
    assert caught.value.code != 0


def test_a_python_of_pyenv_is_found_and_one_that_does_not_work_is_passed_over(pythons):
    works = pythons('pyenv/versions/3.8.18/bin')
    pythons('pyenv/versions/3.8.1/bin', status=1)
    assert set_up.find_python_38() == str(works)


def test_a_python_on_path_is_found(pythons):
    pythons('path')
    assert set_up.find_python_38() == 'python3.8'
