"""What the commands share: how they end, and what they say then."""
import os
import signal

import pytest

from openpose_ros_pkg.command_line import DONE, INTERRUPTED, REFUSED, run_command
from openpose_ros_pkg.errors import BadInputError


def test_an_error_of_this_project_is_told_in_one_line(capsys):
    def work():
        raise BadInputError('no such thing')

    assert run_command('tool', work) == REFUSED
    assert capsys.readouterr().err == 'tool: no such thing\n'


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_all_ends_are_interrupts(number):
    assert run_command('tool', lambda: os.kill(os.getpid(), number)) == INTERRUPTED
    assert signal.getsignal(signal.SIGHUP) == signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_a_closed_terminal_does_not_end_what_nohup_started():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert run_command('tool', lambda: os.kill(os.getpid(), signal.SIGHUP) or DONE) == DONE
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
