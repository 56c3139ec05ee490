"""What the user sees, and steps with a log that an interrupt ends with all their children."""
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Dict, NoReturn

from development import LOGS


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
    """Run a function with its output in a log and show that it goes on; leave the program when it raises."""
    log = LOGS / f'setup_{log_name}.log'
    started = time.monotonic()
    say(title)
    child = multiprocessing.get_context('fork').Process(target=_run_with_log, args=(log, function, args))
    child.start()
    try:
        _show_progress(child, log, started)
    except KeyboardInterrupt:
        os.killpg(child.pid or 0, signal.SIGTERM)
        sys.exit(f'\nInterrupted: {title}. The same command goes on from there.')
    seconds = int(time.monotonic() - started)
    if child.exitcode:
        end = log.read_text(errors='replace').splitlines()[-15:]
        sys.exit('\n'.join([f'{title}: FAILED with exit status {child.exitcode} after {seconds} s. The end of {log}:',
                            *(f'    {line}' for line in end), f'What to do: {advice}.',
                            'Then run the same command again: what is done is kept.']))


def _run_with_log(log: Path, function: Callable[..., Any], args: Any) -> None:
    os.setpgid(0, 0)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with log.open('w') as output:
        for number in (1, 2):
            os.dup2(output.fileno(), number)
    function(*args)


def _show_progress(child: Any, log: Path, started: float) -> None:
    """Wait, on a terminal with a line that is written over again, elsewhere with a line every 20 s."""
    period, begin, end = (0.2, '\r\033[K', '') if sys.stdout.isatty() else (20.0, '', '\n')
    width = shutil.get_terminal_size((120, 24)).columns - 2
    child.join(period)
    while child.is_alive():
        last = log.read_text(errors='replace').rstrip().rpartition('\n')[2] if log.exists() else ''
        line = f'      {time.monotonic() - started:.0f} s  {"".join(filter(str.isprintable, last))}'
        print(f'{begin}{line[:width]}', end=end, flush=True)
        child.join(period)
    print(begin, end='', flush=True)


def handle_signals() -> None:
    """From now on SIGTERM and SIGHUP interrupt as Ctrl-C does, and a closed pipe ends the program."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
