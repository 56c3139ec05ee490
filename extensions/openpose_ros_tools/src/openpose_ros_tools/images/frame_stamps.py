"""The stamps of images in files: from lists, tables, the names of the files, or their numbers and a rate."""
import re
from collections import Counter
from fractions import Fraction
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.natural_order import natural_key
from openpose_ros_tools.images.image_files import COLOUR_SUFFIXES
from openpose_ros_tools.images.stamps import (
    SECOND,
    UNITS,
    StampTable,
    detect_unit,
    number_in_name,
    parse_stamp,
    read_stamp_table,
)

# Stamp of the first of numbered images: not 0, which means "no stamp", and late enough that a minute before it is no
# negative time.
DEFAULT_START = 1000 * SECOND
# Number of names in an error or a warning.
_NAMED = 5


class StampedFile(NamedTuple):
    """An image file."""

    stamp: int  # [ns]
    path: Path
    key: Any = None  # equal for the images of one frame; None: the stamps tell


Streams = Dict[str, List[StampedFile]]
Paths = Dict[str, List[Path]]


class Stamped(NamedTuple):
    """The stamped files of each stream, the origin of the stamps, and remarks."""

    streams: Streams
    timing: str
    remarks: List[str]


class _Frames(NamedTuple):
    """What identifies the frames in the names of the files."""

    keys: Dict[str, List[Any]]  # by stream the frame of each file: its number, or its name without suffix
    order: List[Any]  # all frames, in their order
    are_numbers: bool  # whether the keys are numbers


def stamps_of_lists(paths: Paths, lists: Streams) -> Stamped:
    """Return the files of lists with stamps.

    Raises:
        ParameterError: a stream has no list.
    """
    without = sorted(set(paths) - set(lists))
    if without:
        raise ParameterError(f"layout tum has its stamps in lists; {', '.join(without)} images beside them have none: "
                             'give --layout images and --stamps or --stamp-unit')
    return Stamped(lists, 'the lists of the layout tum', [])


def stamps_of_files(paths: Paths, table: Optional[Path], unit: Optional[str], rate: Optional[Fraction],
                    fps: Optional[float]) -> Stamped:
    """Return the files with the stamps of a table, else those in their names, else those of a rate.

    Args:
        table: of stamps; None: there is none.
        unit: of the stamps in the table or in the names; None: detected.
        rate: that is wanted [Hz].
        fps: that the folder names [Hz], for names that are no times.

    Raises:
        BadInputError: names or table do not tell the stamps.
        ParameterError: the rate is not allowed.
    """
    if table is not None:
        return _stamps_of_table(table, paths, unit)
    if unit is not None:
        return _stamps_of_names(paths, unit)
    units = {detect_unit([number_in_name(path.stem) for path in of_stream]) for of_stream in paths.values()}
    if rate is None and None not in units:
        if len(units) > 1:
            raise BadInputError(f"the names of the streams are times in different units, "
                                f"{', '.join(sorted(filter(None, units)))}; give --stamps")
        return _stamps_of_names(paths, next(filter(None, units)))
    rate = rate if rate is not None else None if fps is None else Fraction(str(fps))
    if rate is None:
        first = next(iter(paths.values()))[0].name
        raise BadInputError(f"the names of the images, such as {first}, are not times: give --rate, --stamps, or "
                            f"--stamp-unit {' or '.join(UNITS)}")
    return _stamps_of_rate(paths, rate, None not in units)


def _stamps_of_names(paths: Paths, unit: str) -> Stamped:
    streams = {}
    for stream, of_stream in paths.items():
        texts = [number_in_name(path.stem) for path in of_stream]
        nameless = [path.name for path, text in zip(of_stream, texts) if not text]
        if nameless:
            raise BadInputError(f'{stream} images without a time in their names: {some(nameless)}')
        streams[stream] = [StampedFile(parse_stamp(text, unit), path) for path, text in zip(of_stream, texts)]
    return Stamped(streams, f'file names [{unit}]', [])


def _stamps_of_rate(paths: Paths, rate: Fraction, by_order: bool) -> Stamped:
    """Return stamps at equal distances; `by_order`: of the frames in their order, whatever their numbers are."""
    if not 0 < rate <= 1000:
        raise ParameterError(f'rate {float(rate):g}, expected more than 0 and up to 1000 [Hz]')
    keys, order, are_numbers = _frames(paths, by_order)
    place = {key: key - order[0] if are_numbers else i for i, key in enumerate(order)}
    streams = {stream: [StampedFile(DEFAULT_START + round(place[key] * SECOND / rate), path, key)
                        for path, key in zip(paths[stream], keys[stream])] for stream in paths}
    missing = order[-1] - order[0] + 1 - len(order) if are_numbers else 0
    remarks = [f'{missing} of the numbers {order[0]} .. {order[-1]} are missing; the times of the others are as if '
               'they were there'] * (missing > 0)
    return Stamped(streams, f"{'numbers' if are_numbers else 'order of the names'} at {float(rate):g} Hz", remarks)


def _stamps_of_table(path: Path, paths: Paths, unit: Optional[str]) -> Stamped:
    table = read_stamp_table(path, unit)
    keys, order, are_numbers = _frames(paths, False)
    if table.names is None:
        if len(table.stamps) != len(order):
            raise BadInputError(f'stamps {path} has {len(table.stamps)} stamps for {len(order)} frames; give a table '
                                'with names and stamps')
        by_name: Dict[Any, Dict[str, int]] = {}
        by_key = dict(zip(order, table.stamps))
    else:
        by_name = _by_stem(path, table)
        by_key = {int(stem): row for stem, row in by_name.items() if stem.isdigit()} if are_numbers else {}
    streams: Streams = {}
    for stream, images in paths.items():
        rows = [by_name.get(image.stem, by_key.get(key)) for image, key in zip(images, keys[stream])]
        without = [image.name for image, row in zip(images, rows) if row is None]
        if without:
            raise BadInputError(f'stamps {path} has no line for {len(without)} {stream} images: {some(without)}')
        streams[stream] = []
        for image, key, row in zip(images, keys[stream], rows):
            stamp = (row or {}).get(stream, (row or {}).get(''))
            if stamp is None:
                raise BadInputError(f'stamps {path} has no {stream} stamp for {image.name}')
            streams[stream].append(StampedFile(stamp, image, key))
    spare = len(by_name) - len(order)
    return Stamped(streams, f'table {path.name}', [f'{path.name} has {spare} lines without an image'] * (spare > 0))


def _by_stem(path: Path, table: StampTable) -> Dict[Any, Dict[str, int]]:
    """Return the rows of a table with names, by the name without the suffix of an image."""
    rows: Dict[Any, Dict[str, int]] = {}
    for name, stamps in zip(table.names or (), table.stamps):
        stem = Path(name).stem if Path(name).suffix.lower() in COLOUR_SUFFIXES else Path(name).name
        if stem in rows:
            raise BadInputError(f"stamps {path}: name '{name}' is there twice")
        rows[stem] = stamps
    return rows


def _frames(paths: Paths, by_order: bool) -> _Frames:
    """Return the frames of the files; `by_order`: do not look for numbers in the names."""
    keys: Dict[str, Any] = {stream: None if by_order else frame_numbers(images) for stream, images in paths.items()}
    are_numbers = None not in keys.values()
    if not are_numbers:
        keys = {stream: [path.stem for path in images] for stream, images in paths.items()}
        for stream, stems in keys.items():
            twice = [stem for stem, count in Counter(stems).items() if count > 1]
            if twice:
                raise BadInputError(f'{stream} images with one name twice: {some(twice)}')
    different = {key for of_stream in keys.values() for key in of_stream}
    return _Frames(keys, sorted(different, key=None if are_numbers else lambda stem: natural_key(Path(stem))),
                   are_numbers)


def frame_numbers(paths: Sequence[Path]) -> Optional[List[int]]:
    """Return the numbers of numbered files: the last number in the names that differs in all of them.

    Returns:
        One number per path, or None where the names are not numbered.
    """
    numbers = [[int(text) for text in re.findall(r'\d+', path.stem)] for path in paths]
    if len({len(of_path) for of_path in numbers}) != 1:
        return None
    for column in reversed(list(zip(*numbers))):
        if len(set(column)) == len(column):
            return list(column)
    return None


def some(names: Sequence[str], most: int = _NAMED) -> str:
    """Return the first names for an error or a warning."""
    return ', '.join(names[:most]) + (', ...' if len(names) > most else '')
