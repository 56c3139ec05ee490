"""Parts of the command lines that the programs share."""
import argparse
import math
from pathlib import Path
from typing import Any, Callable, Optional

# Stamps of ROS have 32-bit unsigned seconds.
_MOST_SECONDS = 2.0 ** 32


def command_parser(name: str, description: Optional[str]) -> argparse.ArgumentParser:
    """Return the parser of a program; its description is printed as it is."""
    return argparse.ArgumentParser(prog=name, description=description,
                                   formatter_class=argparse.RawDescriptionHelpFormatter)


def add_output(parser: argparse.ArgumentParser, kind: str) -> None:
    """Add --output and --overwrite, for `output_file` or `output_folder`; `kind`: 'bag', 'folder'."""
    parser.add_argument('-o', '--output', type=Path, required=True, metavar=kind.upper(), help=f'{kind} to write')
    parser.add_argument('--overwrite', action='store_true', help=f'write the {kind} again if it is there'
                        + ' and contains nothing else' * (kind == 'folder'))


def add_time_span(parser: argparse._ActionsContainer, since: str) -> None:
    """Add --start and --end; `check_time_span` checks them. `since`: what begins at 0, such as 'the first frame'."""
    parser.add_argument('--start', type=seconds, metavar='S', help=f'leave out what is before: [s] since {since}')
    parser.add_argument('--end', type=seconds, metavar='S', help='leave out what is after')


def check_time_span(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """End the program if --start is not less than --end."""
    if None not in (options.start, options.end) and options.start >= options.end:
        parser.error('--start must be less than --end')


def add_up(parser: argparse.ArgumentParser) -> None:
    """Add --up, the direction for computing signals; `check_up` checks it."""
    parser.add_argument('--up', type=float, nargs=3, metavar=('X', 'Y', 'Z'),
                        help='compute what people do, with this upwards in the frame of the people (default: what the '
                             'recording has; where it has nothing, the axis along which people are most of the time)')


def check_up(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """End the program if --up is no direction."""
    if options.up is not None and not 1e-6 < sum(value * value for value in options.up) < float('inf'):
        parser.error('--up must be three numbers that are not all 0')


def seconds(text: str) -> float:
    """Return a time [s] that ROS can have, as `type` of an option."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < _MOST_SECONDS:
        raise argparse.ArgumentTypeError(f"'{text[:40]}': expected a number of seconds below 2^32")
    return value


def positive_number(kind: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return the reader of an option that is a finite number above 0.

    Args:
        kind: makes the number of the text.
    """
    def number(text: str) -> Any:
        try:
            value = kind(text)
        except (ValueError, ZeroDivisionError):
            raise argparse.ArgumentTypeError(f"'{text}' is no number") from None
        if not 0 < value < float('inf'):
            raise argparse.ArgumentTypeError(f"'{text}': expected a number above 0")
        return value
    return number


def whole_number(least: int) -> Callable[[str], int]:
    """Return the reader of an option that is a whole number from `least`."""
    def number(text: str) -> int:
        if not text.isdigit() or int(text) < least:
            raise argparse.ArgumentTypeError(f'expected a whole number from {least}, got {text!r}')
        return int(text)
    return number
