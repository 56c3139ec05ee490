"""Steps of the set-up: their logs, and what a failure shows."""
import subprocess

import pytest

from development import terminal


def speak(word, status):
    subprocess.run(['sh', '-c', f'echo {word}; exit {status}'], check=True)


def test_a_step_has_a_log_and_one_that_fails_shows_its_end_and_what_to_do(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(terminal, 'LOGS', tmp_path)
    terminal.step('[1/1] Words', 'words', 'none', speak, 'hello', 0)
    assert (tmp_path / 'setup_words.log').read_text() == 'hello\n'
    assert capfd.readouterr().out.startswith('[1/1] Words\n')
    with pytest.raises(SystemExit, match=r'(?s)\[1/1\] Words: FAILED with exit status 1.*    the-reason\n.*'
                                         r'What to do: think\.\nThen run the same command again'):
        terminal.step('[1/1] Words', 'words', 'think', speak, 'the-reason', 3)
