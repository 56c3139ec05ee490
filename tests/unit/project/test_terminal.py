"""Steps of the set-up: their logs and exit status, and what an interrupt ends."""
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from development import terminal
from development.testing import MARK, end_processes

ROOT = Path(__file__).parents[3]
TIMEOUT = 30.0  # [s]


@pytest.fixture()
def logs(tmp_path, monkeypatch):
    monkeypatch.setattr(terminal, 'LOGS', tmp_path)
    return tmp_path


def speak(*words, status=0):
    subprocess.run(['echo', *words], check=True)
    return status


def test_output_of_a_step_goes_to_its_log(logs, capfd):
    terminal.step('[1/1] Words', 'words', 'none', speak, 'hello')
    assert (logs / 'setup_words.log').read_text() == 'hello\n'
    assert re.fullmatch(r'\[1/1\] Words\n      done in \d+ s\n', capfd.readouterr().out)


def test_a_step_that_fails_shows_the_end_of_its_log_and_what_to_do(logs):
    def fail():
        speak('the reason')
        subprocess.run(['false'], check=True)
    with pytest.raises(SystemExit, match=r'(?s)\[1/1\] Words: FAILED with exit status 1.*    the reason\n.*'
                                         r'What to do: think\.\nThen run the same command again'):
        terminal.step('[1/1] Words', 'words', 'think', fail)


@pytest.mark.parametrize('function, status', [
    (lambda: None, 0), (lambda: 3, 3), (lambda: sys.exit('no'), 1), (lambda: 1 / 0, 1),
    (lambda: os.kill(os.getpid(), signal.SIGKILL), 128 + signal.SIGKILL)])
def test_status_of_a_group(function, status, logs):
    assert terminal.run_in_group('nothing', function, log=logs / 'log') == status


def is_alive(process):
    try:
        return Path(f'/proc/{process}/stat').read_text().split()[2] != 'Z'
    except OSError:
        return False


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_ends_a_group_with_its_children(number, tmp_path):
    program = f"""
import subprocess, sys
sys.path.insert(0, {str(ROOT)!r})
from development import terminal
terminal.handle_signals()
terminal.run_in_group('sleeping', subprocess.run, ['sh', '-c', 'sleep 600 & echo $! > {tmp_path}/child; wait'])
"""
    process = subprocess.Popen([sys.executable, '-c', program], stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + TIMEOUT
    while not (tmp_path / 'child').exists() or not (tmp_path / 'child').read_text().endswith('\n'):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(number)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 128 + number
    assert 'Interrupted: sleeping.' in errors
    child = int((tmp_path / 'child').read_text())
    while is_alive(child):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_an_interrupt_ends_a_group_that_was_just_begun(tmp_path):
    program = f"""
import os, signal, subprocess, sys
sys.path.insert(0, {str(ROOT)!r})
from development import terminal
terminal.handle_signals()
fork = os.fork

def interrupted_fork():
    child = fork()
    if child:
        os.kill(os.getpid(), signal.SIGTERM)
    return child

os.fork = interrupted_fork
terminal.run_in_group('sleeping', subprocess.run, ['sleep', '600'])
"""
    done = subprocess.run([sys.executable, '-c', program], env={**os.environ, MARK: str(tmp_path)}, text=True,
                          stderr=subprocess.PIPE, timeout=TIMEOUT, check=False)
    assert end_processes(tmp_path, signal.SIGKILL, TIMEOUT)
    assert (done.returncode, 'Interrupted: sleeping.' in done.stderr) == (128 + signal.SIGTERM, True)


def test_what_a_test_run_leaves_running_is_named_and_ended(tmp_path, capsys):
    assert end_processes(tmp_path, signal.SIGTERM, 0.0)
    left = subprocess.Popen(['sleep', '600'], env={**os.environ, 'OPENPOSE_ROS_TEST': str(tmp_path)})
    try:
        assert not end_processes(tmp_path, signal.SIGTERM, 0.0)
        assert left.wait(timeout=TIMEOUT) == -signal.SIGTERM
    finally:
        left.kill()
        left.wait()
    assert f'left running: {left.pid} sleep 600' in capsys.readouterr().out
