"""What the commands of this project share: exit statuses, ends, messages above a progress bar, parameters."""
import argparse
import errno
import logging
import os
import signal
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, Optional, Sequence

from tqdm import tqdm

from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.output.files import naming
from openpose_ros_pkg.structured_text import yaml_value

# Exit statuses. REFUSED: nothing was done: the command line, a parameter or an input is wrong. PIPE_CLOSED: the reader
# of stdout ended first, as a shell has it for programs that SIGPIPE ends.
DONE, SOME_FAILED, REFUSED, INTERRUPTED, PIPE_CLOSED = 0, 1, 2, 130, 141
_STDOUT = 1  # file descriptor
# A second interrupt within this time is ignored; a later one ends the program at once [s].
_CLEANING_UP = 3.0
_PACKAGES = ('openpose_ros_pkg', 'skeleton_extract_3d', 'openpose_ros_fusion', 'openpose_ros_tools',
             'openpose_ros_signals', 'openpose_ros_bridges', 'openpose_ros_bringup')


def run_command(name: str, work: Callable[[], int]) -> int:
    """Run the work of a command and return the exit status.

    SIGTERM and SIGHUP raise KeyboardInterrupt in `work`, as Ctrl-C does; its OpenposeRosError or OSError is printed in
    one line. Log messages of this project's packages go to stderr, above a progress bar.
    """
    handler = _AboveTheBar()
    handler.setFormatter(logging.Formatter('%(levelname)s: %(message)s'))
    logs = [logging.getLogger(package) for package in _PACKAGES]
    for log in logs:
        log.addHandler(handler)
    try:
        with all_ends_are_interrupts():
            status = work()
            with naming(Path('stdout')):
                sys.stdout.flush()  # a full disk shows here
            return status
    except OpenposeRosError as error:
        sys.stderr.write(f'{name}: {error}\n')
        return REFUSED
    except KeyboardInterrupt:
        sys.stderr.write(f'{name}: interrupted\n')
        return INTERRUPTED
    except BrokenPipeError:
        _close_stdout()
        return PIPE_CLOSED
    except OSError as error:
        # all other writing names its file
        where = error.filename or ('stdout' if error.errno == errno.ENOSPC else '')
        sys.stderr.write(f'{name}: {where}: {error.strerror}\n' if where else f'{name}: {error}\n')
        _close_stdout()
        return REFUSED
    finally:
        for log in logs:
            log.removeHandler(handler)


def add_settings(parser: argparse._ActionsContainer, owner: str) -> None:
    """Add the option --set KEY=VALUE, read by `setting_values`; `owner` of the parameters: 'of the detector'."""
    parser.add_argument('--set', metavar='KEY=VALUE', action='append', default=[], dest='settings',
                        help=f'a parameter {owner}; may be repeated')


def setting_values(parser: argparse.ArgumentParser, settings: Sequence[str]) -> Dict[str, Any]:
    """Return the mapping of KEY=VALUE texts, values read as YAML; ends the program if one can not be read."""
    values: Dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition('=')
        if not equals:
            parser.error(f"--set '{setting}': expected KEY=VALUE")
        try:
            values[key] = yaml_value(text) if text else ''
        except ValueError:
            parser.error(f"--set '{setting}': the value can not be read")
    return values


@contextmanager
def all_ends_are_interrupts() -> Iterator[None]:
    """Turn SIGINT, SIGTERM, and SIGHUP of a closed terminal, into one KeyboardInterrupt: files are completed.

    Further ones within `_CLEANING_UP` are ignored. An ignored signal, as SIGHUP under `nohup`, stays ignored.
    """
    first: Optional[float] = None

    def interrupt(number: int, _: object) -> None:
        nonlocal first
        if first is None:
            first = time.monotonic()
            raise KeyboardInterrupt
        if time.monotonic() - first > _CLEANING_UP:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
              if signal.getsignal(number) != signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _close_stdout() -> None:
    """Flush stdout, or drop what can not be written: Python would report it when it ends."""
    with suppress(OSError):
        sys.stdout.flush()
    with suppress(OSError), Path(os.devnull).open('w') as nowhere:
        os.dup2(nowhere.fileno(), _STDOUT)


class Progress(tqdm):  # type: ignore[misc]  # it has no types
    """A progress bar, where stderr is a terminal."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **{'disable': None, **options})


class _AboveTheBar(logging.Handler):
    """Writes log lines to stderr, above the progress bar."""

    def emit(self, record: logging.LogRecord) -> None:
        tqdm.write(self.format(record), file=sys.stderr)
