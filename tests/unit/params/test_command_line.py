"""What the commands share: how they end, and what they say then."""
import os
import signal
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from openpose_ros_pkg.command_line import INTERRUPTED, PIPE_CLOSED, REFUSED, run_command
from openpose_ros_pkg.command_options import command_parser, named_value, number, plain_path, seconds, whole_number
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import check_outputs
from openpose_ros_pkg.structured_text import file_values


def test_an_error_of_this_project_is_told_in_one_line(capsys):
    def work():
        raise BadInputError('no such thing')

    assert run_command('tool', work) == REFUSED
    assert capsys.readouterr().err == 'tool: no such thing\n'


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_all_ends_are_interrupts(number):
    assert run_command('tool', lambda: os.kill(os.getpid(), number)) == INTERRUPTED
    assert signal.getsignal(signal.SIGHUP) == signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_one_interrupt_is_enough_and_others_do_not_disturb_cleaning_up(capsys):
    cleaned_up = []

    def work():
        try:
            os.kill(os.getpid(), signal.SIGINT)
        finally:
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
                os.kill(os.getpid(), number)
                cleaned_up.append(number)

    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        assert run_command('tool', work) == INTERRUPTED
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(cleaned_up) == 3
    assert capsys.readouterr().err == 'tool: interrupted\n'


@pytest.mark.parametrize('lines, stdout, status, told', [
    (3, '> /dev/full', REFUSED, b'tool: stdout: No space left on device\n'),
    (100000, '> /dev/full', REFUSED, b'tool: stdout: No space left on device\n'),
    (100000, '| head -1', PIPE_CLOSED, b'')])
def test_stdout_that_can_not_be_written(lines, stdout, status, told):
    script = ('import sys; from openpose_ros_pkg.command_line import run_command; '
              f'sys.exit(run_command("tool", lambda: print("line\\n" * {lines}) or 0))')
    done = subprocess.run(['bash', '-c', f'"$0" -c \'{script}\' {stdout}; exit ${{PIPESTATUS[0]}}', sys.executable],
                          env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path), 'PYTHONUNBUFFERED': ''},
                          timeout=60, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, check=False)
    assert (done.returncode, done.stderr) == (status, told)


def test_an_interrupt_within_the_imports_leaves_no_traceback(tmp_path):
    (tmp_path / 'slow.py').write_text('import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n')
    script = ('import signal; signal.signal(signal.SIGINT, signal.default_int_handler); '
              'from openpose_ros_pkg.start import run; run("slow")')
    path = os.pathsep.join([str(tmp_path), *sys.path])
    done = subprocess.run([sys.executable, '-c', script], env={**os.environ, 'PYTHONPATH': path}, timeout=60,
                          stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, b'')


def test_devices_are_refused(capsys, tmp_path):
    parser = command_parser('tool', None)
    parser.add_argument('--camera-info', type=named_value(plain_path, 'left=a'))
    assert parser.parse_args([f'--camera-info=left={tmp_path}']).camera_info == ('left', tmp_path)
    with pytest.raises(SystemExit, match='2'):
        parser.parse_args(['--camera-info=left=/dev/zero'])
    assert 'expected a file or folder, not a device, pipe or socket' in capsys.readouterr().err
    with pytest.raises(ParameterError, match='is no plain file'):
        check_outputs([Path('/dev/zero')], overwrite=True)
    with pytest.raises(BadInputError, match='it can not be read: it is no plain file'):
        file_values(Path('/dev/zero'), 'it')


@pytest.mark.parametrize('kind, good, bad', [
    (number(0.1, 3600), {'5': 5.0, '1e-1': 0.1}, ('nan', 'inf', '1e30', '-3', '0', 'x', '')),
    (number(0.001, 1000, Fraction), {'30000/1001': Fraction(30000, 1001)}, ('1e12', '1/0', '-1/2')),
    (whole_number(1), {'7': 7}, ('0', '1.5', '1000000000000', 'nan')), (seconds, {'-3.5': -3.5}, ('nan', '1e10'))])
def test_numbers_are_finite_and_in_range(kind, good, bad, capsys):
    parser = command_parser('tool', None)
    parser.add_argument('--value', type=kind)
    for text, value in good.items():
        assert parser.parse_args([f'--value={text}']).value == value
    for text in bad:
        with pytest.raises(SystemExit, match='2'):
            parser.parse_args([f'--value={text}'])
        assert 'expected a' in capsys.readouterr().err
