"""Tests with nodes that fail are run again alone; the summary says which passed only then."""
from pathlib import Path

import pytest

from development import rostests
from development.junit import summary

PASSED = "<testsuite><testcase classname='Check' name='test_all'/></testsuite>"
FAILED = "<testsuite><testcase classname='Check' name='test_all'><failure/></testcase></testsuite>"


def write(folder, package, name, nodes):
    """Write what rostest leaves of a file whose check left the text `nodes`."""
    (folder / package).mkdir(parents=True, exist_ok=True)
    (folder / package / f'rosunit-check_{name}.xml').write_text(nodes)
    (folder / package / f'rostest-test_{name}.xml').write_text(
        "<testsuite><testcase classname='rostest.runner.RosTest' name='testcheck'/>"
        f'<system-out>results are in [rosunit-check_{name}.xml]</system-out></testsuite>')


@pytest.fixture()
def run(tmp_path, monkeypatch):
    """Return a function that runs the rostests, of which two fail and some pass in the second run."""
    folder, results = tmp_path / 'build', tmp_path / 'results'
    results.mkdir()
    monkeypatch.setattr(rostests, 'FOLDER', folder)
    monkeypatch.setattr(rostests, 'LOGS', tmp_path / 'logs')

    def start(*steady_alone):
        calls = []

        def succeeds(*command, env):
            calls.append(command)
            if command[0] == 'make':
                for package, name, text in (('a', 'one', PASSED), ('a', 'two', FAILED), ('b', 'three', FAILED)):
                    write(folder, package, name, text)
            if command[0] == 'rostest' and command[-1] in steady_alone:
                write(folder, command[-2], Path(command[-1]).stem, PASSED)
            if command[0] == 'catkin_test_results':
                return 'failure' not in ''.join(path.read_text() for path in folder.rglob('*.xml'))
            return command[0] != 'rostest' or command[-1] in steady_alone

        monkeypatch.setattr(rostests, 'succeeds', succeeds)
        return rostests.run_rostests(results, {}), [call[-2:] for call in calls if call[0] == 'rostest'], results
    return start


def test_what_passes_alone_passes_and_is_named(run, tmp_path, capfd):
    passed, again, results = run('two.test', 'three.test')
    assert passed
    assert again == [('a', 'two.test'), ('b', 'three.test')]
    assert summary(results, broken=False)
    said = capfd.readouterr().out
    assert said.count('UNSTEADY Check: test_all: failed, and passed when it was run again alone') == 2
    assert said.endswith('6 passed, 0 failed\n')
    assert 'failure' in (tmp_path / 'logs/test_ros/results_of_first_run_two/rosunit-check_two.xml').read_text()


def test_what_fails_twice_fails(run, capfd):
    passed, _, results = run('two.test')
    assert not passed
    assert not summary(results, broken=True)
    said = capfd.readouterr().out
    assert said.count('FAILED') == said.count('UNSTEADY') == 1
    assert said.endswith('5 passed, 1 failed\n')


@pytest.mark.parametrize('second, is_well', [(PASSED, True), (FAILED, False)])
def test_faults_that_fail_are_injected_again(tmp_path, monkeypatch, capfd, second, is_well):
    monkeypatch.setattr(rostests, 'LOGS', tmp_path / 'logs')
    results, asked = tmp_path / 'results', []
    results.mkdir()
    written = iter((PASSED[:-len('</testsuite>')] + FAILED[len('<testsuite>'):].replace('test_all', 'test_fault[a: b]'),
                    second.replace('test_all', 'test_fault[a: b]')))

    def pytest_run(name, paths):
        asked.append(paths)
        (results / f'{name}.xml').write_text(next(written))
        return second == PASSED and len(asked) == 2

    assert rostests.run_faults(results, pytest_run) == is_well
    assert asked == [['tests/faults'], ['tests/faults/test_faults.py::test_fault[a: b]']]
    assert summary(results, not is_well) == is_well
    said = capfd.readouterr().out
    assert said.endswith('2 passed, 0 failed\n' if is_well else '1 passed, 1 failed\n')
    assert ('UNSTEADY Check: test_fault[a: b]' in said) == is_well
    assert 'failure' in (tmp_path / 'logs/test_ros/results_of_first_run_faults.xml').read_text()


@pytest.mark.parametrize('left', [None, PASSED])
def test_faults_that_break_without_a_failure_are_not_run_again(tmp_path, left):
    def pytest_run(name, paths):
        assert paths == ['tests/faults']
        if left:
            (tmp_path / f'{name}.xml').write_text(left)
        return False
    assert not rostests.run_faults(tmp_path, pytest_run)


def test_a_program_that_breaks_and_no_tests_at_all_are_failures(tmp_path, capfd):
    assert not summary(tmp_path, broken=False)
    (tmp_path / 'one.xml').write_text(PASSED)
    assert summary(tmp_path, broken=False)
    assert not summary(tmp_path, broken=True)
    assert capfd.readouterr().out.endswith('1 passed, 1 failed\n')
