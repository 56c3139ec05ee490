"""Groups of tests: what fails in real time runs once more; focal runs wherever a Python 3.8 is found."""
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


@pytest.fixture()
def group(tmp_path, monkeypatch):
    """A function that runs a group in real time whose test passes from its Nth run on; returns the status."""
    monkeypatch.setattr(testing, 'LOGS', tmp_path)
    monkeypatch.setattr(testing, 'RESULTS', tmp_path)

    def run(passes_from):
        path = tmp_path / 'test_unsteady.py'
        path.write_text('from pathlib import Path\n\n\ndef test_steady():\n    pass\n\n\ndef test_unsteady():\n'
                        '    runs = Path(__file__).with_name("runs")\n'
                        '    runs.write_text("x" + (runs.read_text() if runs.exists() else ""))\n'
                        f'    assert len(runs.read_text()) >= {passes_from}\n')
        monkeypatch.setitem(testing.GROUPS, 'faults', testing.Group((str(path),), testing.ALONE))
        return testing._run_group('faults'), len((tmp_path / 'runs').read_text())
    return run


@pytest.mark.parametrize('passes_from, status, runs, summary', [
    (1, 0, 1, '2 passed, 0 failed, 0 skipped'), (2, 0, 2, '2 passed, 0 failed, 0 skipped'),
    (3, 1, 2, '1 passed, 1 failed, 0 skipped')])
def test_what_fails_in_real_time_runs_once_more_alone(group, capfd, passes_from, status, runs, summary):
    assert group(passes_from) == (status, runs)
    assert testing._summary(['faults'] * status, []) == status
    assert capfd.readouterr().out.endswith(f'{summary}\n')
