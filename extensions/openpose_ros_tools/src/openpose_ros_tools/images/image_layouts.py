"""Recordings in folders of images: where their files are, and the stamp of each one.

Layouts:

    tum        rgb.txt, depth.txt, masks.txt: a time [s] and a file per line, as the TUM RGB-D benchmark has them
    sequence   rgb/ or color/, depth/, masks/ with the same names in each; camera.yaml, sequence.yaml, stamps.csv
    rendered   rgb/, depth/ with the same names in each; meta.json with K, width, height, fps
    images     a folder of images, or any folders or patterns that are named

The images of a stream get their stamps from a table, from their names, or from the numbers in their names and a rate.
"""
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.calibration import Calibration, calibration_from_values, read_calibration
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.natural_order import natural_key
from openpose_ros_pkg.structured_text import json_value
from openpose_ros_tools.images.frame_stamps import (
    Paths,
    StampedFile,
    Streams,
    some,
    stamps_of_files,
    stamps_of_lists,
)
from openpose_ros_tools.images.image_files import COLOUR_SUFFIXES, DEPTH_SUFFIXES
from openpose_ros_tools.images.stamps import SECOND, STAMP_END, associate, parse_stamp
from skeleton_extract_3d.points.rgbd_sequence import read_sequence_values, sequence_values

LAYOUTS = ('tum', 'sequence', 'rendered', 'images')
STREAMS = ('colour', 'depth', 'mask')
# Names of the folders of each stream; the first one is written.
FOLDERS = {'colour': ('rgb', 'color', 'colour', 'images', 'image'), 'depth': ('depth',), 'mask': ('masks', 'mask')}
# Lists of the files of each stream in the TUM layout.
TUM_LISTS = {'colour': ('rgb.txt',), 'depth': ('depth.txt',), 'mask': ('masks.txt', 'mask.txt')}
STAMPS_FILE = 'stamps.csv'
# TUM RGB-D benchmark, file formats: 5000 units are 1 m; associate.py: pairs differ by up to 0.02 s.
TUM_UNITS_PER_METRE = 5000.0
TUM_MAX_DIFFERENCE = SECOND // 50
_SUFFIXES = {'colour': COLOUR_SUFFIXES, 'depth': DEPTH_SUFFIXES, 'mask': COLOUR_SUFFIXES}
# Number of names of a folder's content in an error.
_LISTED = 10


@dataclass(frozen=True)
class LayoutOptions:
    """What is known of a recording beside its folder; None: as in the folder."""

    layout: Optional[str] = None  # one of LAYOUTS
    # by stream a folder, or a pattern such as 'scene/*.color.png', in place of the layout's
    sources: Dict[str, str] = field(default_factory=dict)
    stamps: Optional[Path] = None  # table of stamps, see `read_stamp_table`
    stamp_unit: Optional[str] = None  # key of UNITS: file names are times in this unit
    rate: Optional[Fraction] = None  # of numbered images [Hz]
    start: Optional[int] = None  # stamp that the first image gets [ns]; the others keep their distances
    max_difference: int = TUM_MAX_DIFFERENCE  # of the stamps of a pair, where names do not tell pairs [ns]


@dataclass(frozen=True)
class Recording:
    """The files of a recording, and the description of the camera in its folder."""

    layout: str  # one of LAYOUTS
    streams: Streams  # by stream its files, in the order of their stamps, which differ
    # by stream ('depth', 'mask') the stamp of the colour image that belongs to each of its stamps [ns]
    pairs: Dict[str, Dict[int, int]]
    calibration: Optional[Calibration]  # of the camera, or None
    frame_id: str  # of the camera, empty if it is not known
    T_world_camera: Optional[np.ndarray]  # (4, 4) from the optical frame to an upright world frame [m], or None
    depth_scale: Optional[float]  # units of integer depth per metre, or None
    timing: str  # origin of the stamps, for the report
    remarks: List[str]  # what is missing or surprising, for the report

    def only_pairs(self) -> 'Recording':
        """Return the recording without the colour and depth images that have no partner, and masks without colour."""
        if 'depth' not in self.pairs:
            return self
        kept = set(self.pairs['depth'].values())
        pairs = {name: {stamp: colour for stamp, colour in of_stream.items() if colour in kept}
                 for name, of_stream in self.pairs.items()}
        streams = {name: [item for item in items if item.stamp in (kept if name == 'colour' else pairs[name])]
                   for name, items in self.streams.items()}
        return replace(self, pairs=pairs, streams={name: items for name, items in streams.items() if items})


def find_recording(folder: Optional[Path], options: LayoutOptions) -> Recording:
    """Find the images of a recording and their stamps; no image is read.

    Args:
        folder: of the recording; None: only what `options.sources` names.

    Raises:
        BadInputError: no images, no stamps, two images with one stamp, or no colour image has a depth image.
        ParameterError: options contradict each other.
    """
    layout, paths, lists = _find_files(folder, options)
    if not paths.get('colour') and not paths.get('depth'):
        raise BadInputError(f'{folder} holds neither colour nor depth images')
    values, calibration = _description(folder, layout)
    if options.rate is not None and (options.stamps is not None or options.stamp_unit is not None):
        raise ParameterError('--rate contradicts --stamps and --stamp-unit; give one of them')
    table, told = options.stamps, any(option is not None for option in (options.stamps, options.rate,
                                                                        options.stamp_unit))
    if not told and folder is not None and (folder / STAMPS_FILE).is_file():
        table = folder / STAMPS_FILE
    if layout == 'tum' and not told:
        stamped = stamps_of_lists(paths, lists)
    else:
        stamped = stamps_of_files(paths, table, options.stamp_unit, options.rate, values['fps'])
    streams = _shifted({name: _in_order(items) for name, items in stamped.streams.items()}, options.start)
    pairs = {name: _pairs(streams['colour'], streams[name], options.max_difference)
             for name in STREAMS[1:] if name in streams and 'colour' in streams}
    remarks = stamped.remarks + [remark for name in pairs for remark in _partner_remarks(name, streams, pairs[name])]
    scale = values['depth_scale'] or (TUM_UNITS_PER_METRE if layout == 'tum' else None)
    return Recording(layout, streams, pairs, calibration, values['frame_id'], values['T_world_camera'], scale,
                     stamped.timing, remarks)


# ------------------------------------------------------------------------------------------------------------- files

def _find_files(folder: Optional[Path], options: LayoutOptions) -> Tuple[str, Paths, Streams]:
    """Return the layout, and by stream the paths and, of the layout tum, the listed files."""
    if folder is None and not options.sources:
        raise ParameterError('nothing to read: name a folder, or --colour')
    if folder is not None and not folder.is_dir():
        raise BadInputError(f'folder {folder} does not exist')
    named = {stream: _images_of(source, stream) for stream, source in options.sources.items()}
    layout = options.layout or (_detect(folder) if folder is not None and 'colour' not in named else 'images')
    if layout == 'tum':
        lists = _tum_lists(folder)
        paths = {**{stream: [item.path for item in items] for stream, items in lists.items()}, **named}
        return layout, paths, {stream: items for stream, items in lists.items() if stream not in named}
    if 'colour' in named or folder is None:
        return layout, named, {}
    found = {stream: _images_in(place, stream) for stream, names in FOLDERS.items()
             for place in [next((folder / name for name in names if (folder / name).is_dir()), None)] if place}
    if not found and layout == 'images':
        found = {'colour': _images_in(folder, 'colour')}
    if not any(found.values()):
        raise BadInputError(f"{folder} has no images in {' or '.join(FOLDERS['colour'])}"
                            f"{', nor any of its own' if layout == 'images' else ''}; it holds: {_content(folder)}")
    return layout, {**{stream: paths for stream, paths in found.items() if paths}, **named}, {}


def _detect(folder: Path) -> str:
    if any((folder / name).is_file() for name in TUM_LISTS['colour']):
        return 'tum'
    if (folder / 'meta.json').is_file() and not (folder / 'camera.yaml').is_file():
        return 'rendered'
    if any((folder / name).is_file() for name in ('sequence.yaml', 'camera.yaml', STAMPS_FILE)):
        return 'sequence'
    return 'images'


def _images_of(source: str, stream: str) -> List[Path]:
    """Return the images of a folder or a pattern."""
    place = Path(source).expanduser()
    if place.is_dir():
        paths = _images_in(place, stream)
    else:
        root = Path(place.anchor)
        found = root.glob(str(place.relative_to(root)))
        paths = sorted((path for path in found if path.is_file()), key=natural_key)
    if not paths:
        raise BadInputError(f"no images in '{source}', which is to hold {stream} images; expected a folder or a "
                            f"pattern of files ending in {', '.join(_SUFFIXES[stream])}")
    return paths


def _images_in(folder: Path, stream: str) -> List[Path]:
    return sorted((path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES[stream]
                   and path.is_file() and not path.name.startswith('.')), key=natural_key)


def _content(folder: Path) -> str:
    return some(sorted(path.name + '/' * path.is_dir() for path in folder.iterdir()), _LISTED) or 'nothing'


def _tum_lists(folder: Optional[Path]) -> Streams:
    if folder is None:
        raise ParameterError('layout tum needs a folder with rgb.txt')
    lists = {stream: next((folder / name for name in names if (folder / name).is_file()), None)
             for stream, names in TUM_LISTS.items()}
    if lists['colour'] is None:
        raise BadInputError(f'{folder} has no rgb.txt, which is what the layout tum begins with; it holds: '
                            f'{_content(folder)}')
    return {stream: _read_tum_list(path) for stream, path in lists.items() if path is not None}


def _read_tum_list(path: Path) -> List[StampedFile]:
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f'{path} can not be read: {error}') from error
    items = []
    for number, line in enumerate(lines, 1):
        cells = line.split(None, 1)
        if not cells or cells[0].startswith('#'):
            continue
        try:
            items.append(StampedFile(parse_stamp(cells[0], 's'), path.parent / cells[1].strip()))
        except (ValueError, IndexError):
            raise BadInputError(f"{path}, line {number}: expected a time [s] and a file, got '{line}'") from None
    return items


def _description(folder: Optional[Path], layout: str) -> Tuple[Dict[str, Any], Optional[Calibration]]:
    """Return fps, frame_id, T_world_camera and depth_scale, and the calibration."""
    if folder is None:
        return sequence_values(Path(), {}), None
    if layout == 'rendered':
        path = folder / 'meta.json'
        try:
            meta = json_value(path.read_text())
        except (OSError, ValueError) as error:
            raise BadInputError(f'{path} can not be read: {error}') from error
        if not isinstance(meta, dict):
            raise BadInputError(f'{path}: expected keys with values, got {type(meta).__name__}')
        known = {key: meta[key] for key in ('fps', 'frame_id', 'T_world_camera', 'depth_scale') if key in meta}
        return sequence_values(path, known), calibration_from_values(meta, str(path))
    calibration = folder / 'camera.yaml'
    return read_sequence_values(folder), read_calibration(calibration) if calibration.is_file() else None


def _in_order(items: List[StampedFile]) -> List[StampedFile]:
    items = sorted(items, key=lambda item: (item.stamp, natural_key(item.path)))
    for before, after in zip(items, items[1:]):
        if before.stamp == after.stamp:
            raise BadInputError(f'{before.path} and {after.path} have one stamp, {before.stamp / SECOND:.9f} s; '
                                'expected different ones')
    return items


def _shifted(streams: Streams, start: Optional[int]) -> Streams:
    first = min(items[0].stamp for items in streams.values() if items)
    last = max(items[-1].stamp for items in streams.values() if items)
    shift = 0 if start is None else start - first
    if first + shift <= 0 or last + shift >= STAMP_END:
        raise BadInputError(f'stamps go from {(first + shift) / SECOND:.9f} to {(last + shift) / SECOND:.9f} s, '
                            'expected more than 0 (which means "no stamp" in ROS) and less than '
                            f'{STAMP_END // SECOND}; give --start, or the right --stamp-unit')
    return {stream: [item._replace(stamp=item.stamp + shift) for item in items] for stream, items in streams.items()}


# ------------------------------------------------------------------------------------------------------------- pairs

def _pairs(colour: List[StampedFile], other: List[StampedFile], max_difference: int) -> Dict[int, int]:
    if all(item.key is not None for item in (*colour, *other)):
        stamps = {item.key: item.stamp for item in colour}
        return {item.stamp: stamps[item.key] for item in other if item.key in stamps}
    pairs = associate([item.stamp for item in colour], [item.stamp for item in other], max_difference)
    return {other[j].stamp: colour[i].stamp for i, j in pairs}


def _partner_remarks(name: str, streams: Streams, pairs: Dict[int, int]) -> List[str]:
    """Return remarks on images without a partner.

    Raises:
        BadInputError: no image has one.
    """
    colour, other = streams['colour'], streams[name]
    if not pairs:
        raise BadInputError(f'no colour image has a {name} image: the first ones are {colour[0].path.name} at '
                            f'{colour[0].stamp / SECOND:.6f} s and {other[0].path.name} at '
                            f'{other[0].stamp / SECOND:.6f} s; see --max-difference, --stamps')
    remarks = []
    for items, paired, text in ((colour, {*pairs.values()}, f'colour images have no {name} image'),
                                (other, {*pairs}, f'{name} images have no colour image')):
        alone = [item.path.name for item in items if item.stamp not in paired]
        if alone:
            remarks.append(f'{len(alone)} of {len(items)} {text}: {some(alone)}')
    return remarks
