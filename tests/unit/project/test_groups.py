"""Groups of tests: what fails in real time runs once more."""
import pytest

from development import testing


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
