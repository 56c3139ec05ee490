"""What the user sees, and work in process groups of its own, which an interrupt ends with all their children."""
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path
from typing import Any, Callable, Dict, NoReturn, Optional

from development import LOGS

INTERRUPTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
GRACE = 10.0  # [s] in which an interrupted group may end by itself

_group: Optional[int] = None  # the process group at work: its leader's process id
_activity = ''  # what it does


def say(text: str) -> None:
    print(text, flush=True)


def die(message: str) -> NoReturn:
    sys.exit(f'run: {message}')


def succeeds(*command: str, quiet: bool = False, **options: Any) -> bool:
    """Run a command and return whether it was there and succeeded."""
    output: Dict[str, Any] = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL} if quiet else {}
    try:
        return subprocess.run(command, check=False, **output, **options).returncode == 0
    except FileNotFoundError as error:
        if not quiet:
            print(error, file=sys.stderr)
        return False


def output_of(*command: str) -> str:
    """Return what a command prints, whatever its exit status."""
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False).stdout


def step(title: str, log_name: str, advice: str, function: Callable[..., Any], *args: Any) -> None:
    """Run a function in a group, its output in a log, and show that it goes on; leave the program when it fails."""
    log = LOGS / f'setup_{log_name}.log'
    started = time.monotonic()
    say(title)
    status = run_in_group(title, function, *args, log=log)
    seconds = int(time.monotonic() - started)
    if status:
        end = log.read_text(errors='replace').splitlines()[-15:]
        sys.exit('\n'.join([f'{title}: FAILED with exit status {status} after {seconds} s. The end of {log}:',
                            *(f'    {line}' for line in end), f'What to do: {advice}.',
                            'Then run the same command again: what is done is kept.']))
    say(f'      done in {seconds} s')


def run_in_group(activity: str, function: Callable[..., Any], *args: Any, log: Optional[Path] = None) -> int:
    """Run a function in a forked process that leads a group of its own, and return its exit status.

    The status is the integer that the function returns (None: 0), or 1 where it raises.
    """
    global _group, _activity
    signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)  # until it is known which group they end
    child = os.fork()
    if child == 0:
        _lead_group(function, args, log)
    os.setpgid(child, child)  # here as well, whoever comes first
    _group, _activity = child, activity
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
    status = _wait_with_progress(child, log) if log else os.waitpid(child, 0)[1]
    _group = None
    return 128 + os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)


def _lead_group(function: Callable[..., Any], args: Any, log: Optional[Path]) -> NoReturn:
    status = 1
    try:
        os.setpgid(0, 0)
        for number in INTERRUPTS:
            signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        if log:
            os.dup2(os.open(str(log), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666), 1)
            os.dup2(1, 2)
        status = int(function(*args) or 0)
    except subprocess.CalledProcessError as error:
        print(error, file=sys.stderr)
    except BaseException:  # SystemExit too: what the parent would clean up is not this process's
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _wait_with_progress(child: int, log: Path) -> int:
    """Wait, on a terminal with a line that is written over again, elsewhere with a line every 20 s."""
    started = shown = time.monotonic()
    period, begin, end = (0.2, '\r\033[K', '') if sys.stdout.isatty() else (20.0, '', '\n')
    width = shutil.get_terminal_size((120, 24)).columns - 2
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            print(begin, end='', flush=True)
            return status
        time.sleep(0.2)
        now = time.monotonic()
        if now - shown >= period:
            shown = now
            last = log.read_text(errors='replace').rstrip().rpartition('\n')[2] if log.exists() else ''
            line = f'      {now - started:.0f} s  {"".join(filter(str.isprintable, last))}'
            print(f'{begin}{line[:width]}', end=end, flush=True)


def handle_signals() -> None:
    """From now on an interrupt ends the group that is at work, then this program."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # Python ignores it, and so would the commands that it becomes
    for number in INTERRUPTS:
        signal.signal(number, _interrupted)


def _interrupted(number: int, _frame: object) -> NoReturn:
    for interrupt in INTERRUPTS:
        signal.signal(interrupt, signal.SIG_IGN)
    if _group is not None:
        print(f'\nInterrupted: {_activity}. Ending it; the same command goes on from there.', file=sys.stderr)
        deadline = time.monotonic() + GRACE
        _signal_group(_group, signal.SIGTERM)
        while _signal_group(_group, 0) and time.monotonic() < deadline:
            time.sleep(0.1)
        _signal_group(_group, signal.SIGKILL)
    sys.exit(128 + number)


def _signal_group(group: int, number: int) -> bool:
    """Signal a group, what sudo runs in it as well, and return whether there was something."""
    with contextlib.suppress(ChildProcessError):
        os.waitpid(group, os.WNOHANG)
    try:
        os.killpg(group, number)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    if number and os.getuid() != 0:
        succeeds('sudo', '-n', 'kill', f'-{number}', '--', f'-{group}', quiet=True)
    return True
