"""Recordings that are folders of pictures: where their files are, and which stamp each one has.

Layouts:

    tum        rgb.txt, depth.txt, masks.txt: a time [s] and a file per line, as the TUM RGB-D benchmark has them
    sequence   rgb/ or color/, depth/, masks/ with the same names in each; camera.yaml, sequence.yaml, stamps.csv
    rendered   rgb/, depth/ with the same names in each; meta.json with K, width, height, fps
    images     a folder of pictures, or any folders or patterns that are named

The pictures of a stream get their stamps from a table, from their names, or from the numbers in their names and a rate.
"""
import json
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.natural_order import natural_key
from openpose_ros_tools.images.calibration import Calibration, calibration_from_values, read_calibration
from openpose_ros_tools.images.picture_files import COLOUR_SUFFIXES, DEPTH_SUFFIXES
from openpose_ros_tools.images.stamps import (
    SECOND,
    STAMP_END,
    UNITS,
    associate,
    detect_unit,
    number_in_name,
    parse_stamp,
    read_stamp_table,
)
from skeleton_extract_3d.points.rgbd_sequence import read_sequence_values, sequence_values

LAYOUTS = ('tum', 'sequence', 'rendered', 'images')
STREAMS = ('colour', 'depth', 'mask')
# Names of the folders of each stream, the first is the one that is written.
FOLDERS = {'colour': ('rgb', 'color', 'colour', 'images', 'image'), 'depth': ('depth',), 'mask': ('masks', 'mask')}
# Lists of the files of each stream in the TUM layout.
TUM_LISTS = {'colour': ('rgb.txt',), 'depth': ('depth.txt',), 'mask': ('masks.txt', 'mask.txt')}
STAMPS_FILE = 'stamps.csv'
# TUM RGB-D benchmark, file formats: 5000 units are 1 m; associate.py: pairs differ by up to 0.02 s.
TUM_UNITS_PER_METRE = 5000.0
TUM_MAX_DIFFERENCE = SECOND // 50
# Stamp of the first of numbered pictures. Not 0, which means "no stamp", and late enough that what looks back a minute
# meets no negative time.
DEFAULT_START = 1000 * SECOND
_SUFFIXES = {'colour': COLOUR_SUFFIXES, 'depth': DEPTH_SUFFIXES, 'mask': COLOUR_SUFFIXES}
# How many names an error or a warning tells.
_NAMED = 5


@dataclass(frozen=True)
class LayoutOptions:
    """What is known of a recording beside its folder; None: as the folder says.

    Attributes:
        layout: one of LAYOUTS.
        sources: by stream a folder, or a pattern such as 'scene/*.color.png', in place of the layout's.
        stamps: table of stamps, see `read_stamp_table`.
        stamp_unit: key of UNITS: file names are times in this unit.
        rate: of numbered pictures [Hz].
        start: stamp that the first picture gets [ns]; the others keep their distances.
        max_difference: of the stamps of a pair, where names do not tell pairs [ns].
    """

    layout: Optional[str] = None
    sources: Dict[str, str] = field(default_factory=dict)
    stamps: Optional[Path] = None
    stamp_unit: Optional[str] = None
    rate: Optional[Fraction] = None
    start: Optional[int] = None
    max_difference: int = TUM_MAX_DIFFERENCE


class StampedFile(NamedTuple):
    """A picture file.

    Attributes:
        stamp: [ns].
        key: the same for the pictures of one frame; None: the stamps tell.
    """

    stamp: int
    path: Path
    key: Any = None


@dataclass(frozen=True)
class Recording:
    """The files of a recording, and what its folder says of the camera.

    Attributes:
        layout: one of LAYOUTS.
        streams: by stream its files, in the order of their stamps, no two with one stamp.
        pairs: by stream ('depth', 'mask') the files that belong to each colour image, as indices: (colour, other).
        calibration: of the camera, or None.
        frame_id: of the camera, empty if it is not known.
        T_world_camera: (4, 4) from the optical frame to an upright world frame [m], or None.
        depth_scale: units of integer depth per metre, or None.
        timing: where the stamps are from, for the report.
        remarks: what is missing or surprising, for the report.
    """

    layout: str
    streams: Dict[str, List[StampedFile]]
    pairs: Dict[str, List[Tuple[int, int]]]
    calibration: Optional[Calibration]
    frame_id: str
    T_world_camera: Optional[np.ndarray]
    depth_scale: Optional[float]
    timing: str
    remarks: List[str]

    def only_pairs(self) -> 'Recording':
        """Return the recording without the colour and depth images that have no partner, and masks without colour."""
        if 'depth' not in self.pairs:
            return self
        colour = {i for i, _ in self.pairs['depth']}
        kept = {'colour': sorted(colour), 'depth': sorted(j for _, j in self.pairs['depth'])}
        if 'mask' in self.pairs:
            kept['mask'] = sorted(j for i, j in self.pairs['mask'] if i in colour)
        streams = {name: [self.streams[name][i] for i in indices] for name, indices in kept.items() if indices}
        number = {name: {old: new for new, old in enumerate(indices)} for name, indices in kept.items()}
        pairs = {name: [(number['colour'][i], number[name][j]) for i, j in of_stream if i in colour]
                 for name, of_stream in self.pairs.items() if name in streams}
        return replace(self, streams=streams, pairs=pairs)


def find_recording(folder: Optional[Path], options: LayoutOptions) -> Recording:
    """Find the pictures of a recording and their stamps; no picture is read.

    Args:
        folder: of the recording; None: only what `options.sources` names.

    Raises:
        BadInputError: no pictures, no stamps, two pictures with one stamp, or no colour image has a depth image.
        ParameterError: options contradict each other.
    """
    layout, files = _find_files(folder, options)
    if not files.get('colour') and not files.get('depth'):
        raise BadInputError(f'{folder} holds neither colour nor depth images')
    values, calibration = _description(folder, layout)
    streams, timing, remarks = _stamped(folder, layout, files, values['fps'], options)
    streams = {name: _in_order(items) for name, items in streams.items()}
    streams = _shifted(streams, options.start)
    pairs = {name: _pairs(streams['colour'], streams[name], options.max_difference)
             for name in ('depth', 'mask') if name in streams and 'colour' in streams}
    for name, found in pairs.items():
        remarks += _partner_remarks(name, streams, found)
    scale = values['depth_scale'] or (TUM_UNITS_PER_METRE if layout == 'tum' else None)
    return Recording(layout, streams, pairs, calibration, values['frame_id'], values['T_world_camera'], scale, timing,
                     remarks)


def frame_numbers(paths: Sequence[Path]) -> Optional[List[int]]:
    """Return the numbers of numbered files: the last number in the names that is never twice the same.

    Returns:
        One number per path, or None where the names are not numbered.
    """
    numbers = [[int(text) for text in re.findall(r'\d+', path.stem)] for path in paths]
    count = len(numbers[0]) if numbers else 0
    if any(len(of_path) != count for of_path in numbers):
        return None
    for place in reversed(range(count)):
        column = [of_path[place] for of_path in numbers]
        if len(set(column)) == len(column):
            return column
    return None


# ------------------------------------------------------------------------------------------------------------- files

def _find_files(folder: Optional[Path], options: LayoutOptions) -> Tuple[str, Dict[str, Any]]:
    """Return the layout and by stream its paths; for the TUM layout pairs of time and path."""
    unknown = set(options.sources) - set(STREAMS)
    if unknown:
        raise ParameterError(f"unknown streams {', '.join(sorted(unknown))}, expected {', '.join(STREAMS)}")
    if folder is None and not options.sources:
        raise ParameterError('nothing to read: name a folder, or --colour')
    if folder is not None and not folder.is_dir():
        raise BadInputError(f'folder {folder} does not exist')
    named = {stream: _listed(source, stream) for stream, source in options.sources.items()}
    layout = options.layout or (_detect(folder) if folder is not None and 'colour' not in named else 'images')
    if layout == 'tum':
        return layout, {**_tum_files(folder), **named}
    if layout not in LAYOUTS:
        raise ParameterError(f"layout '{layout}' is unknown, expected one of {', '.join(LAYOUTS)}")
    if 'colour' in named or folder is None:
        return layout, named
    found = {stream: _pictures(place, stream) for stream, names in FOLDERS.items()
             for place in [next((folder / name for name in names if (folder / name).is_dir()), None)] if place}
    if not found and layout == 'images':
        found = {'colour': _pictures(folder, 'colour')}
    if not any(found.values()):
        raise BadInputError(f"{folder} has no pictures in {' or '.join(FOLDERS['colour'])}"
                            f"{', nor any of its own' if layout == 'images' else ''}; it holds: {_content(folder)}")
    return layout, {**{stream: paths for stream, paths in found.items() if paths}, **named}


def _detect(folder: Path) -> str:
    if any((folder / name).is_file() for name in TUM_LISTS['colour']):
        return 'tum'
    if (folder / 'meta.json').is_file() and not (folder / 'camera.yaml').is_file():
        return 'rendered'
    # sequence.yaml or camera.yaml is what makes a folder of pictures one of this project
    if any((folder / name).is_file() for name in ('sequence.yaml', 'camera.yaml', STAMPS_FILE)):
        return 'sequence'
    return 'images'


def _listed(source: str, stream: str) -> List[Path]:
    """Return the pictures of a folder or a pattern."""
    place = Path(source).expanduser()
    if place.is_dir():
        paths = _pictures(place, stream)
    else:
        root = Path(place.anchor)
        found = root.glob(str(place.relative_to(root)))
        paths = sorted((path for path in found if path.is_file()), key=natural_key)
    if not paths:
        raise BadInputError(f"no pictures in '{source}', which is to hold {stream} images; expected a folder or a "
                            f"pattern of files ending in {', '.join(_SUFFIXES[stream])}")
    return paths


def _pictures(folder: Path, stream: str) -> List[Path]:
    return sorted((path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES[stream]
                   and path.is_file() and not path.name.startswith('.')), key=natural_key)


def _content(folder: Path) -> str:
    names = sorted(path.name + '/' * path.is_dir() for path in folder.iterdir())
    return ', '.join(names[:_NAMED * 2]) + (', ...' if len(names) > _NAMED * 2 else '') or 'nothing'


def _tum_files(folder: Optional[Path]) -> Dict[str, List[Tuple[int, Path]]]:
    if folder is None:
        raise ParameterError('layout tum needs a folder with rgb.txt')
    files = {}
    for stream, names in TUM_LISTS.items():
        path = next((folder / name for name in names if (folder / name).is_file()), None)
        if path is not None:
            files[stream] = list(_read_tum_list(path))
    if 'colour' not in files:
        raise BadInputError(f'{folder} has no rgb.txt, which is what the layout tum begins with; it holds: '
                            f'{_content(folder)}')
    return files


def _read_tum_list(path: Path) -> Iterator[Tuple[int, Path]]:
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f'{path} can not be read: {error}') from error
    for number, line in enumerate(lines, 1):
        cells = line.split(None, 1)
        if not cells or cells[0].startswith('#'):
            continue
        try:
            stamp, name = parse_stamp(cells[0], 's'), cells[1].strip()
        except (ValueError, IndexError):
            raise BadInputError(f"{path}, line {number}: expected a time [s] and a file, got '{line}'") from None
        yield stamp, path.parent / name


def _description(folder: Optional[Path], layout: str) -> Tuple[Dict[str, Any], Optional[Calibration]]:
    """Return fps, frame_id, T_world_camera and depth_scale, and the calibration."""
    if folder is None:
        return sequence_values(Path(), {}), None
    if layout == 'rendered':
        path = folder / 'meta.json'
        try:
            meta = json.loads(path.read_text())
        except (OSError, ValueError) as error:
            raise BadInputError(f'{path} can not be read: {error}') from error
        if not isinstance(meta, dict):
            raise BadInputError(f'{path}: expected keys with values, got {type(meta).__name__}')
        known = {key: meta[key] for key in ('fps', 'frame_id', 'T_world_camera', 'depth_scale') if key in meta}
        return sequence_values(path, known), calibration_from_values(meta, str(path))
    calibration = folder / 'camera.yaml'
    return read_sequence_values(folder), read_calibration(calibration) if calibration.is_file() else None


# ------------------------------------------------------------------------------------------------------------ stamps

def _stamped(folder: Optional[Path], layout: str, files: Dict[str, Any], fps: Optional[float], options: LayoutOptions
             ) -> Tuple[Dict[str, List[StampedFile]], str, List[str]]:
    """Return the stamped files of each stream, where the stamps are from, and remarks."""
    if options.rate is not None and (options.stamps is not None or options.stamp_unit is not None):
        raise ParameterError('--rate contradicts --stamps and --stamp-unit; give one of them')
    table = options.stamps
    told = not (table is None and options.rate is None and options.stamp_unit is None)
    if layout == 'tum':
        # a stream that was named has no list
        lists = {stream: [item[1] if isinstance(item, tuple) else item for item in items]
                 for stream, items in files.items()}
        if not told:
            plain = sorted(stream for stream in lists if not isinstance(files[stream][0], tuple))
            if plain:
                raise ParameterError(f"layout tum has its stamps in lists; {', '.join(plain)} images beside them have "
                                     'none: give --layout images and --stamps or --stamp-unit')
            return ({stream: [StampedFile(*item) for item in items] for stream, items in files.items()},
                    'the lists of the layout tum', [])
        files = lists
    if not told and folder is not None and (folder / STAMPS_FILE).is_file():
        table = folder / STAMPS_FILE
    if table is not None:
        return _stamps_of_table(table, files, options.stamp_unit)
    if options.stamp_unit is not None:
        return _stamps_of_names(files, options.stamp_unit), f'file names [{options.stamp_unit}]', []
    units = {detect_unit([number_in_name(path.stem) for path in paths]) for paths in files.values()}
    if options.rate is None and None not in units:
        if len(units) > 1:
            raise BadInputError(f"the names of the streams are times in different units, {', '.join(sorted(units))}; "
                                'give --stamps')
        unit = units.pop()
        return _stamps_of_names(files, unit), f'file names [{unit}]', []
    rate = options.rate if options.rate is not None else None if fps is None else Fraction(str(fps))
    if rate is None:
        first = next(iter(files.values()))[0].name
        raise BadInputError(f"the names of the pictures, such as {first}, are not times: give --rate, --stamps, or "
                            f"--stamp-unit {' or '.join(UNITS)}")
    return _stamps_of_rate(files, rate, None not in units)


def _stamps_of_names(files: Dict[str, List[Path]], unit: str) -> Dict[str, List[StampedFile]]:
    streams = {}
    for stream, paths in files.items():
        texts = [number_in_name(path.stem) for path in paths]
        nameless = [path.name for path, text in zip(paths, texts) if not text]
        if nameless:
            raise BadInputError(f'{stream} images without a time in their names: {_some(nameless)}')
        streams[stream] = [StampedFile(parse_stamp(text, unit), path) for path, text in zip(paths, texts)]
    return streams


def _stamps_of_rate(files: Dict[str, List[Path]], rate: Fraction, by_order: bool
                    ) -> Tuple[Dict[str, List[StampedFile]], str, List[str]]:
    """Return stamps at equal distances.

    Args:
        by_order: do not look for numbers in the names; the order of the frames counts.
    """
    if not 0 < rate <= 1000:
        raise ParameterError(f'rate {float(rate):g}, expected more than 0 and up to 1000 [Hz]')
    keys, are_numbers = _frame_keys(files, by_order)
    frames = sorted({key for of_stream in keys.values() for key in of_stream}, key=_order_of(files, keys, are_numbers))
    place = {key: key - frames[0] if are_numbers else i for i, key in enumerate(frames)}
    streams = {stream: [StampedFile(DEFAULT_START + round(place[key] * SECOND / rate), path, key)
                        for path, key in zip(files[stream], keys[stream])] for stream in files}
    remarks = []
    missing = frames[-1] - frames[0] + 1 - len(frames) if are_numbers else 0
    if missing:
        remarks.append(f'{missing} of the numbers {frames[0]} .. {frames[-1]} are missing; the times of the others are '
                       'as if they were there')
    return streams, f"{'numbers' if are_numbers else 'order of the names'} at {float(rate):g} Hz", remarks


def _frame_keys(files: Dict[str, List[Path]], by_order: bool = False) -> Tuple[Dict[str, List[Any]], bool]:
    """Return by stream what is the same in the names of a frame's pictures, and whether that is the number."""
    numbers = {stream: None if by_order else frame_numbers(paths) for stream, paths in files.items()}
    if all(of_stream is not None for of_stream in numbers.values()):
        return numbers, True
    stems = {stream: [path.stem for path in paths] for stream, paths in files.items()}
    for stream, of_stream in stems.items():
        twice = [stem for stem, count in Counter(of_stream).items() if count > 1]
        if twice:
            raise BadInputError(f'{stream} images with one name twice: {_some(twice)}')
    return stems, False


def _order_of(files: Dict[str, List[Path]], keys: Dict[str, List[Any]], are_numbers: bool) -> Any:
    """Return the key that sorts frames."""
    if are_numbers:
        return int
    naturals = {key: natural_key(Path(path.stem)) for stream in files for path, key in zip(files[stream], keys[stream])}
    return naturals.get


def _stamps_of_table(path: Path, files: Dict[str, List[Path]], unit: Optional[str]
                     ) -> Tuple[Dict[str, List[StampedFile]], str, List[str]]:
    table = read_stamp_table(path, unit)
    timing = f'table {path.name}'
    keys, are_numbers = _frame_keys(files)
    frames = sorted({key for of_stream in keys.values() for key in of_stream}, key=_order_of(files, keys, are_numbers))
    if table.names is None:
        if len(table.stamps) != len(frames):
            raise BadInputError(f'stamps {path} has {len(table.stamps)} stamps for {len(frames)} frames; give a table '
                                'with names and stamps')
        rows = dict(zip(frames, table.stamps))
        return {stream: [_table_item(path, rows[key], stream, picture, key)
                         for picture, key in zip(files[stream], keys[stream])] for stream in files}, timing, []
    rows = {}
    for name, stamps in zip(table.names, table.stamps):
        stem = Path(name).stem if Path(name).suffix.lower() in COLOUR_SUFFIXES else Path(name).name
        if stem in rows:
            raise BadInputError(f"stamps {path}: name '{name}' is there twice")
        rows[stem] = stamps
    by_number = {int(stem): stamps for stem, stamps in rows.items() if stem.isdigit()} if are_numbers else {}
    streams = {}
    for stream in files:
        found = [(rows.get(picture.stem, by_number.get(key)), picture, key)
                 for picture, key in zip(files[stream], keys[stream])]
        without = [picture.name for stamps, picture, _ in found if stamps is None]
        if without:
            raise BadInputError(f'stamps {path} has no line for {len(without)} {stream} images: {_some(without)}')
        streams[stream] = [_table_item(path, stamps, stream, picture, key) for stamps, picture, key in found]
    spare = len(rows) - len(frames)
    return streams, timing, [f'{path.name} has {spare} lines without a picture'] * (spare > 0)


def _table_item(path: Path, stamps: Dict[str, int], stream: str, picture: Path, key: Any) -> StampedFile:
    stamp = stamps.get(stream, stamps.get(''))
    if stamp is None:
        raise BadInputError(f'stamps {path} has no {stream} stamp for {picture.name}')
    return StampedFile(stamp, picture, key)


def _in_order(items: List[StampedFile]) -> List[StampedFile]:
    items = sorted(items, key=lambda item: (item.stamp, natural_key(item.path)))
    for before, after in zip(items, items[1:]):
        if before.stamp == after.stamp:
            raise BadInputError(f'{before.path} and {after.path} have one stamp, {before.stamp / SECOND:.9f} s; '
                                'expected different ones')
    return items


def _shifted(streams: Dict[str, List[StampedFile]], start: Optional[int]) -> Dict[str, List[StampedFile]]:
    first = min(items[0].stamp for items in streams.values() if items)
    last = max(items[-1].stamp for items in streams.values() if items)
    shift = 0 if start is None else start - first
    if first + shift <= 0 or last + shift >= STAMP_END:
        raise BadInputError(f'stamps go from {(first + shift) / SECOND:.9f} to {(last + shift) / SECOND:.9f} s, '
                            'expected more than 0 (which means "no stamp" in ROS) and less than '
                            f'{STAMP_END // SECOND}; give --start, or the right --stamp-unit')
    return {stream: [item._replace(stamp=item.stamp + shift) for item in items] for stream, items in streams.items()}


# ------------------------------------------------------------------------------------------------------------- pairs

def _pairs(colour: List[StampedFile], other: List[StampedFile], max_difference: int) -> List[Tuple[int, int]]:
    if all(item.key is not None for item in (*colour, *other)):
        place = {item.key: j for j, item in enumerate(other)}
        return [(i, place[item.key]) for i, item in enumerate(colour) if item.key in place]
    return associate([item.stamp for item in colour], [item.stamp for item in other], max_difference)


def _partner_remarks(name: str, streams: Dict[str, List[StampedFile]], pairs: List[Tuple[int, int]]) -> List[str]:
    """Return what to say of images without a partner.

    Raises:
        BadInputError: nobody has one.
    """
    colour, other = streams['colour'], streams[name]
    if not pairs:
        raise BadInputError(f'no colour image has a {name} image: the first ones are {colour[0].path.name} at '
                            f'{colour[0].stamp / SECOND:.6f} s and {other[0].path.name} at '
                            f'{other[0].stamp / SECOND:.6f} s; see --max-difference, --stamps')
    paired = {i for i, _ in pairs}, {j for _, j in pairs}
    remarks = []
    for items, found, text in ((colour, paired[0], f'colour images have no {name} image'),
                               (other, paired[1], f'{name} images have no colour image')):
        alone = [item.path.name for i, item in enumerate(items) if i not in found]
        if alone:
            remarks.append(f'{len(alone)} of {len(items)} {text}: {_some(alone)}')
    return remarks


def _some(names: Sequence[str]) -> str:
    return ', '.join(names[:_NAMED]) + (', ...' if len(names) > _NAMED else '')
