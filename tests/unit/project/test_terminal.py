"""Steps of the set-up: their logs, what a failure shows, and what an interrupt ends."""
import re
import signal
import subprocess
import sys

import psutil
import pytest

from development import ROOT, terminal

TIMEOUT = 30.0  # [s]
PROGRAM = """
import subprocess, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from development import terminal
terminal.LOGS = Path(sys.argv[2])
terminal.handle_signals()
command = ['sh', '-c', 'sleep 600 & echo $! > "$0"; wait', sys.argv[3]]
terminal.step('sleeping', 'sleep', 'none', subprocess.run, command)
"""


def speak(word, status):
    subprocess.run(['sh', '-c', f'echo {word}; exit {status}'], check=True)


def test_output_of_a_step_goes_to_its_log(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(terminal, 'LOGS', tmp_path)
    terminal.step('[1/1] Words', 'words', 'none', speak, 'hello', 0)
    assert (tmp_path / 'setup_words.log').read_text() == 'hello\n'
    assert re.search(r'\[1/1\] Words\n(.|\n)* {6}done in \d+ s\n', capfd.readouterr().out)


def test_a_step_that_fails_shows_the_end_of_its_log_and_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(terminal, 'LOGS', tmp_path)
    with pytest.raises(SystemExit, match=r'(?s)\[1/1\] Words: FAILED with exit status 1.*    the-reason\n.*'
                                         r'What to do: think\.\nThen run the same command again'):
        terminal.step('[1/1] Words', 'words', 'think', speak, 'the-reason', 3)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_a_step_with_its_children(number, tmp_path):
    child = tmp_path / 'child'
    process = subprocess.Popen([sys.executable, '-c', PROGRAM, str(ROOT), str(tmp_path), str(child)],
                               stderr=subprocess.PIPE, text=True)
    while not child.exists() or not child.read_text().endswith('\n'):
        assert process.poll() is None
    sleeper = psutil.Process(int(child.read_text()))
    process.send_signal(number)
    assert 'Interrupted: sleeping.' in process.communicate(timeout=TIMEOUT)[1]
    assert psutil.wait_procs([sleeper], TIMEOUT)[1] == []
