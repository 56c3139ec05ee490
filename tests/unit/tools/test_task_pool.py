"""Tasks are done by processes, each task to its end: again where it failed or its process died."""
import os
import signal
import threading
import time
from contextlib import closing

import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.parallel.task_pool import run_in_processes
from openpose_ros_tools.parallel.worker_processes import ProcessLostError


def work(task, tell):
    """Do what the task says, by its file where it tells of tries before."""
    verb, path = task
    if verb == 'wait':
        path.write_text(str(os.getpid()))
        tell(0.25)
        time.sleep(60)
    with path.open('a') as tries:
        tries.write('x')
    first = path.stat().st_size == 1
    if verb == 'die' or (verb == 'die once' and first):
        os.kill(os.getpid(), signal.SIGKILL)
    if verb == 'fail' or (verb == 'fail once' and first):
        raise BadInputError('not this one')
    if verb == 'break':
        raise ValueError(threading.Lock())  # can not be sent
    if verb == 'answer a lock':
        return threading.Lock()
    return f'did {verb}'


def run(folder, verbs, workers=2, retries=1):
    """Return the outcomes by verb, and the number of tries of each."""
    tasks = {verb: (verb, folder / verb) for verb in verbs}
    outcomes = dict(run_in_processes(work, tasks, workers=workers, retries=retries,
                                     on_progress=lambda name, share: None))
    return outcomes, {verb: (folder / verb).stat().st_size for verb in verbs}


def test_every_task_has_one_outcome(tmp_path):
    outcomes, tries = run(tmp_path, ['work', 'die once', 'fail once', 'fail'])
    assert {name: outcomes[name] for name in ('work', 'die once', 'fail once')} == {
        'work': 'did work', 'die once': 'did die once', 'fail once': 'did fail once'}
    assert isinstance(outcomes['fail'], BadInputError) and str(outcomes['fail']) == 'not this one'
    assert tries == {'work': 1, 'die once': 2, 'fail once': 2, 'fail': 2}


def test_what_ends_every_process_is_given_up_and_the_others_are_done(tmp_path):
    outcomes, tries = run(tmp_path, ['die', 'work', 'break'], workers=1, retries=0)
    assert isinstance(outcomes['die'], ProcessLostError) and tries['die'] == 3
    assert outcomes['work'] == 'did work'
    with pytest.raises(RuntimeError, match='ValueError'):
        raise outcomes['break']


def test_a_result_that_can_not_be_sent_is_an_error_and_the_process_lives_on(tmp_path):
    outcomes, tries = run(tmp_path, ['answer a lock', 'work'], workers=1, retries=0)
    with pytest.raises(RuntimeError, match='can not be sent'):
        raise outcomes['answer a lock']
    assert outcomes['work'] == 'did work' and tries['answer a lock'] == 1


def test_progress_is_told_and_closing_ends_the_processes(tmp_path):
    told, event = [], threading.Event()

    def on_progress(name, share):
        told.append((name, share))
        if share > 0:
            event.set()

    tasks = {name: (verb, tmp_path / name) for name, verb in (('work', 'work'), ('wait', 'wait'), ('more', 'wait'))}
    with closing(run_in_processes(work, tasks, workers=1, retries=5, on_progress=on_progress)) as outcomes:
        assert next(outcomes) == ('work', 'did work')
        assert event.wait(60)
    assert ('wait', 0.25) in told
    assert not (tmp_path / 'more').exists()
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / 'wait').read_text()), 0)
