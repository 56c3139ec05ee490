"""Calls are answered by processes: again where they failed or their process died, and none outlives its parent."""
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path

import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.parallel.processes import ProcessLostError, run_in_processes

TIMEOUT = 60.0  # [s] of what takes a second, as a loaded machine starts processes slowly


def comes(condition):
    """Return whether something comes true in time."""
    deadline = time.monotonic() + TIMEOUT
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()


def work(task):
    """Do what the task says, by its file where it tells of tries before."""
    verb, path = task
    if verb == 'wait':
        path.write_text(str(os.getpid()))
        time.sleep(TIMEOUT)
    with path.open('a') as tries:
        tries.write('x')
    first = path.stat().st_size == 1
    if verb == 'die' or (verb == 'die once' and first):
        os.kill(os.getpid(), signal.SIGKILL)
    if verb == 'fail' or (verb == 'fail once' and first):
        raise BadInputError('not this one')
    if verb == 'break':
        raise ValueError(threading.Lock())  # can not be sent
    if verb == 'return a lock':
        return threading.Lock()
    return f'did {verb}'


def run(folder, verbs, workers=2):
    """Return the outcomes by verb, and the number of tries of each."""
    tasks = {verb: (verb, folder / verb) for verb in verbs}
    outcomes = dict(run_in_processes(work, tasks, workers))
    return outcomes, {verb: (folder / verb).stat().st_size for verb in verbs}


def test_every_task_has_one_outcome(tmp_path):
    outcomes, tries = run(tmp_path, ['work', 'die once', 'fail once', 'fail'])
    assert {name: outcomes[name] for name in ('work', 'die once', 'fail once')} == {
        'work': 'did work', 'die once': 'did die once', 'fail once': 'did fail once'}
    assert isinstance(outcomes['fail'], BadInputError) and str(outcomes['fail']) == 'not this one'
    assert tries == {'work': 1, 'die once': 2, 'fail once': 2, 'fail': 2}


def test_what_ends_every_process_is_given_up_and_the_others_are_done(tmp_path):
    outcomes, tries = run(tmp_path, ['die', 'return a lock', 'work', 'break'], workers=1)
    assert isinstance(outcomes['die'], ProcessLostError) and tries['die'] == 3 and tries['return a lock'] == 1
    with pytest.raises(RuntimeError, match='can not be sent'):
        raise outcomes['return a lock']
    assert outcomes['work'] == 'did work'
    with pytest.raises(RuntimeError, match='ValueError'):
        raise outcomes['break']


def test_closing_ends_the_processes(tmp_path):
    tasks = {name: (verb, tmp_path / name) for name, verb in (('work', 'work'), ('wait', 'wait'), ('more', 'wait'))}
    waiting = tmp_path / 'wait'
    with closing(run_in_processes(work, tasks, 1)) as outcomes:
        assert next(outcomes) == ('work', 'did work')
        assert comes(lambda: waiting.exists() and waiting.read_text())
    assert not (tmp_path / 'more').exists()
    assert not lives(int(waiting.read_text()))


@pytest.mark.parametrize('end', ['kill', 'leave'])
def test_processes_end_with_their_parent(end, tmp_path):
    code = ('import os, sys, pathlib, test_processes as t\n'
            "if __name__ == '__main__':\n"
            '    folder = pathlib.Path(sys.argv[1])\n'
            "    tasks = {name: (name.split()[0], folder / name) for name in ('wait', 'wait 2', 'work')}\n"
            '    outcomes = t.run_in_processes(t.work, tasks, 3)\n'
            '    next(outcomes)\n'
            "    assert t.comes(lambda: all((folder / n).exists() and (folder / n).read_text() for n in tasks))\n"
            f"    if '{end}' == 'kill':\n"
            '        os.kill(os.getpid(), 9)\n')
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    parent = subprocess.run([sys.executable, '-c', code, str(tmp_path)], env=environment, check=False)
    assert parent.returncode == (-signal.SIGKILL if end == 'kill' else 0)
    pids = [int((tmp_path / name).read_text()) for name in ('wait', 'wait 2')]
    assert comes(lambda: not any(lives(pid) for pid in pids))


def lives(pid):
    return Path(f'/proc/{pid}').exists()
