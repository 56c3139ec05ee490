"""Work of threads in order; tasks in processes: done again where their process died, and none outlives its parent."""
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.parallel import WorkerLostError, ordered_map, prefetched, run_tasks

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
    if verb == 'die' or (verb == 'die once' and path.stat().st_size == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    if verb == 'fail':
        raise BadInputError('not this one')
    return f'did {verb}'


@pytest.mark.parametrize('workers', [1, 3])
def test_every_task_has_one_outcome(tmp_path, workers):
    tasks = {verb: (verb, tmp_path / verb) for verb in ('work', 'die once', 'fail', 'die')}
    outcomes = dict(run_tasks(work, tasks, workers))
    assert (outcomes['work'], outcomes['die once']) == ('did work', 'did die once')
    assert isinstance(outcomes['fail'], BadInputError) and str(outcomes['fail']) == 'not this one'
    assert isinstance(outcomes['die'], WorkerLostError) and (tmp_path / 'die').stat().st_size <= 3


def test_closing_ends_the_processes(tmp_path):
    tasks = {name: (verb, tmp_path / name) for name, verb in (('work', 'work'), ('wait', 'wait'))}
    with closing(run_tasks(work, tasks, 1)) as outcomes:
        assert next(outcomes) == ('work', 'did work')
        assert comes(lambda: (tmp_path / 'wait').exists() and (tmp_path / 'wait').read_text())
    assert not lives(int((tmp_path / 'wait').read_text()))


def test_processes_end_with_their_parent(tmp_path):
    code = ('import os, sys, pathlib, test_parallel as t\n'
            'folder = pathlib.Path(sys.argv[1])\n'
            "tasks = {name: (name.split()[0], folder / name) for name in ('wait', 'wait 2', 'work')}\n"
            'outcomes = t.run_tasks(t.work, tasks, 3)\n'
            'next(outcomes)\n'
            'assert t.comes(lambda: all((folder / n).exists() and (folder / n).read_text() for n in tasks))\n'
            'os.kill(os.getpid(), 9)\n')
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    parent = subprocess.run([sys.executable, '-c', code, str(tmp_path)], env=environment, check=False)
    assert parent.returncode == -signal.SIGKILL
    pids = [int((tmp_path / name).read_text()) for name in ('wait', 'wait 2')]
    assert comes(lambda: not any(lives(pid) for pid in pids))


def test_threads_import_nothing_of_multiprocessing():
    code = ('import sys\n'
            'from openpose_ros_tools.parallel import run_tasks\n'
            'before = set(sys.modules)\n'
            "assert len(list(run_tasks(abs, {'a': -1, 'b': -2}, 2))) == 2\n"
            "print(*(name for name in sys.modules.keys() - before if name.startswith('multiprocessing')))\n")
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, '-c', code], env=environment, check=True, stdout=subprocess.PIPE)
    assert done.stdout.split() == []


def lives(pid):
    return Path(f'/proc/{pid}').exists()


def test_few_items_are_taken_ahead():
    taken = []
    items = (taken.append(item) or item for item in range(100))
    for done, item in enumerate(ordered_map(lambda item: item, items, threads=2)):
        assert item == done and len(taken) <= done + 4


def test_an_error_of_reading_ahead_comes_after_the_items_before_it():
    def items():
        yield 1
        raise ValueError('damaged')

    ahead = prefetched(items(), 2)
    assert next(ahead) == 1
    with pytest.raises(ValueError, match='damaged'):
        next(ahead)
