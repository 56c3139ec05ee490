"""Parts of the command lines that the programs share."""
import argparse
from contextlib import suppress
from pathlib import Path
from typing import Any, Callable, Optional, Tuple

# Stamps of ROS have 32-bit unsigned seconds.
_MOST_SECONDS = 2.0 ** 32


def command_parser(name: str, description: Optional[str], **options: Any) -> argparse.ArgumentParser:
    """Return the parser of a program; its description is printed as it is."""
    return argparse.ArgumentParser(prog=name, description=description,
                                   formatter_class=argparse.RawDescriptionHelpFormatter, **options)


def add_output(parser: argparse.ArgumentParser, kind: str) -> None:
    """Add --output and --overwrite, for `output_file` or `output_folder`; `kind`: 'bag', 'folder'."""
    parser.add_argument('-o', '--output', type=plain_path, required=True, metavar=kind.upper(), help=f'{kind} to write')
    parser.add_argument('--overwrite', action='store_true', help=f'write the {kind} again if it is there'
                        + ' and contains nothing else' * (kind == 'folder'))


class _Direction(argparse.Action):
    """Takes three numbers that are not all 0."""

    def __call__(self, parser: Any, options: Any, values: Any, option: Any = None) -> None:
        if sum(value * value for value in values) < 1e-6:
            parser.error(f'{option} must be three numbers that are not all 0')
        setattr(options, self.dest, values)


def add_up(parser: argparse.ArgumentParser) -> None:
    """Add --up, the direction for computing signals."""
    parser.add_argument('--up', type=number(-1e9, 1e9), nargs=3, metavar=('X', 'Y', 'Z'), action=_Direction,
                        help='compute what people do, with this upwards in the frame of the people (default: what the '
                             'recording has; where it has nothing, the axis along which people are most of the time)')


def checked(kind: Callable[[str], Any], is_allowed: Callable[[Any], bool], expected: str) -> Callable[[str], Any]:
    """Return the reader of an option, as `type` of argparse: `kind` makes the value; `expected` is for the error."""
    def read(text: str) -> Any:
        with suppress(OSError, ValueError, ZeroDivisionError):
            value = kind(text)
            if is_allowed(value):
                return value
        raise argparse.ArgumentTypeError(f"'{text[:40]}': expected {expected}")
    return read


def number(least: float, most: float, kind: Callable[[str], Any] = float) -> Callable[[str], Any]:
    """Return the reader of an option that is a number in this range; `kind` makes the number of the text."""
    return checked(kind, lambda value: least <= value <= most, f'a number from {least:g} to {most:g}')


def whole_number(least: int, most: int = 1_000_000) -> Callable[[str], int]:
    """Return the reader of an option that is a whole number in this range."""
    return checked(int, lambda value: least <= value <= most, f'a whole number from {least} to {most}')


def named_value(kind: Callable[[str], Any], example: str) -> Callable[[str], Tuple[str, Any]]:
    """Return the reader of an option that is NAME=VALUE; `kind` makes the value of its text, as in `checked`."""
    def pair(text: str) -> Tuple[str, Any]:
        name, _, value = text.rpartition('=')
        return name.strip('/'), kind(value)
    return checked(pair, lambda value: bool(value[0]), f'a camera and its value, such as {example}')


seconds = checked(float, lambda value: abs(value) < _MOST_SECONDS, 'a number of seconds below 2^32')
"""Reader of an option that is a time [s] that ROS can have."""
plain_path = checked(Path, lambda path: not path.exists() or path.is_file() or path.is_dir(),
                     'a file or folder, not a device, pipe or socket')
"""Reader of an option that is a path: reading or writing a device or a pipe need not end."""
