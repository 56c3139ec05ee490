"""What the commands of this project share: exit statuses, ends, messages above a progress bar, parameters."""
import argparse
import logging
import signal
import sys
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, Sequence

import yaml
from tqdm import tqdm

from openpose_ros_pkg.errors import OpenposeRosError

# Exit statuses. REFUSED: nothing was done, as the command line, a parameter or an input is wrong.
DONE, SOME_FAILED, REFUSED, INTERRUPTED = 0, 1, 2, 130
_PACKAGES = ('openpose_ros_pkg', 'skeleton_extract_3d', 'openpose_ros_tools', 'openpose_ros_mocap')


def run_command(name: str, work: Callable[[], int]) -> int:
    """Run the work of a command and return the exit status.

    SIGTERM and SIGHUP end it as Ctrl-C does, so that `work` may clean up on KeyboardInterrupt; what the packages of
    this project log is written to stderr, above a progress bar.

    Args:
        name: of the command, for its error messages.
        work: returns the exit status; an OpenposeRosError that it raises is told in one line.
    """
    handler = _AboveTheBar()
    handler.setFormatter(logging.Formatter('%(levelname)s: %(message)s'))
    logs = [logging.getLogger(package) for package in _PACKAGES]
    for log in logs:
        log.addHandler(handler)
    try:
        with all_ends_are_interrupts():
            return work()
    except OpenposeRosError as error:
        sys.stderr.write(f'{name}: {error}\n')
        return REFUSED
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        for log in logs:
            log.removeHandler(handler)


def add_settings(parser: argparse._ActionsContainer, whose: str) -> None:
    """Add the option --set KEY=VALUE; `setting_values` reads it.

    Args:
        whose: parameters these are, for the help.
    """
    parser.add_argument('--set', metavar='KEY=VALUE', action='append', default=[], dest='settings',
                        help=f'a parameter {whose}; may be repeated')


def setting_values(parser: argparse.ArgumentParser, settings: Sequence[str]) -> Dict[str, Any]:
    """Return the mapping of KEY=VALUE texts, values read as YAML; ends the program where one can not be read."""
    values: Dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition('=')
        if not equals:
            parser.error(f"--set '{setting}': expected KEY=VALUE")
        try:
            values[key] = yaml.safe_load(text) if text else ''
        except yaml.YAMLError:
            parser.error(f"--set '{setting}': the value can not be read")
    return values


@contextmanager
def all_ends_are_interrupts() -> Iterator[None]:
    """Turn SIGTERM, and SIGHUP of a closed terminal, into KeyboardInterrupt as SIGINT is: files get completed.

    What is ignored, as `nohup` has SIGHUP, stays so.
    """
    before = {number: signal.signal(number, signal.default_int_handler) for number in (signal.SIGTERM, signal.SIGHUP)
              if signal.getsignal(number) != signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _AboveTheBar(logging.Handler):
    """Writes log lines to stderr, above the progress bar."""

    def emit(self, record: logging.LogRecord) -> None:
        tqdm.write(self.format(record), file=sys.stderr)
