"""RGB-D folders: which images they hold, the stamp of each one, and the description of the camera.

Layout::

    rgb/ or color/        colour images; names end in the number of the frame
    depth/                depth images, aligned to the colour images: 16 bit, or TIFF of float32 [m]; the same numbers
    rgb.txt, depth.txt    stamp [s] and file on each line, as in the TUM RGB-D benchmark; without them the stamps follow
                          from the numbers and fps
    camera.yaml           calibration as camera_calibration writes it
    sequence.yaml         fps [Hz], frame_id, T_world_camera (4 x 4, row by row), depth_scale [units per metre]
    meta.json             in place of the last two: K, width, height, and the keys of sequence.yaml

Either of rgb/ and depth/ and all other files may be missing. `RgbdSequence` reads the same folders, without rgb.txt,
where each frame has both images and depth is in mm.
"""
import re
import statistics
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import yaml

from openpose_ros_pkg.calibration import Calibration, calibration_from_values, calibration_text, read_calibration
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.structured_text import file_values
from openpose_ros_tools.images.image_files import COLOUR_SUFFIXES, DEPTH_SUFFIXES
from openpose_ros_tools.images.stamps import MAX_DIFFERENCE, SECOND, STAMP_END, associate, parse_stamp, seconds_text
from skeleton_extract_3d.points.rgbd_sequence import read_sequence_values, sequence_values

# By stream its folders, of which the first one is written; the list of its files; suffixes of its files.
FOLDERS = {'colour': ('rgb', 'color'), 'depth': ('depth',)}
LISTS = {'colour': 'rgb.txt', 'depth': 'depth.txt'}
_SUFFIXES = {'colour': COLOUR_SUFFIXES, 'depth': DEPTH_SUFFIXES}
# Stamps in a table, as bag_to_images 1.0 wrote them.
OLD_STAMPS = 'stamps.csv'
# TUM RGB-D benchmark, file formats: 5000 units are 1 m.
TUM_UNITS_PER_METRE = 5000.0
# Stamp of the first of numbered images: not 0, which means "no stamp", and early times before it are not negative.
DEFAULT_START = 1000 * SECOND
# A number at the end of a name that is no fraction.
_NUMBER = re.compile(r'(?:^|[^\d.])(\d+)$')
# Number of names in an error or a warning.
_NAMED = 5


class StampedFile(NamedTuple):
    """An image file and its stamp [ns]."""

    stamp: int
    path: Path


Streams = Dict[str, List[StampedFile]]


@dataclass(frozen=True)
class RgbdFolder:
    """The images of an RGB-D folder, and the description of its camera."""

    streams: Streams  # 'colour', 'depth' as far as there: ascending stamps, which differ
    colour_of: Dict[int, int]  # by the stamp of a depth image that of the colour image of its frame [ns]
    calibration: Optional[Calibration]
    frame_id: str  # of the camera, empty if it is not known
    T_world_camera: Optional[np.ndarray]  # (4, 4) from the optical frame to an upright world frame [m], or None
    depth_scale: Optional[float]  # units of 16-bit depth per metre, or None
    timing: str  # origin of the stamps
    remarks: List[str]  # missing images, for the report


def read_rgbd_folder(folder: Path, rate: Optional[Fraction] = None, start: Optional[int] = None) -> RgbdFolder:
    """Find the images of an RGB-D folder and their stamps; no image is read.

    Args:
        rate: of numbered images [Hz], in place of rgb.txt, depth.txt and fps.
        start: stamp of the first image [ns]; the others keep their distances.

    Raises:
        BadInputError: no images, no stamps, two images with one stamp, or no frame has colour and depth.
    """
    if not folder.is_dir():
        raise BadInputError(f'folder {folder} does not exist')
    values, calibration = _description(folder)
    lists = {stream: folder / name for stream, name in LISTS.items() if (folder / name).is_file()}
    remarks: List[str] = []
    if lists and rate is None:
        streams = {stream: _listed(path) for stream, path in lists.items()}
        colour_of = _associated(streams)
        timing = ' and '.join(path.name for path in lists.values())
    else:
        if rate is None and (folder / OLD_STAMPS).is_file():
            raise BadInputError(f'{folder} has its stamps in {OLD_STAMPS}, which is not read any more: write it again '
                                'with bag_to_images, or give --rate')
        rate = rate if rate is not None else None if values['fps'] is None else Fraction(str(values['fps']))
        streams, colour_of, remarks = _numbered(folder, rate)
        timing = f'numbers at {float(rate or 0):g} Hz'
    scale = values['depth_scale'] or (TUM_UNITS_PER_METRE if lists else None)
    streams, shift = _shifted(streams, start)
    return RgbdFolder(streams, {depth + shift: colour + shift for depth, colour in colour_of.items()}, calibration,
                      values['frame_id'], values['T_world_camera'], scale, timing,
                      remarks + _remarks_on_partners(streams, len(colour_of)))


def some(names: Sequence[str]) -> str:
    """Return the first names for an error or a warning."""
    return ', '.join(names[:_NAMED]) + (', ...' if len(names) > _NAMED else '')


def _description(folder: Path) -> Tuple[Dict[str, Any], Optional[Calibration]]:
    """Return fps, frame_id, T_world_camera and depth_scale, and the calibration."""
    calibration, path = folder / 'camera.yaml', folder / 'meta.json'
    if calibration.is_file() or not path.is_file():
        return read_sequence_values(folder), read_calibration(calibration) if calibration.is_file() else None
    meta = file_values(path, str(path))
    if not isinstance(meta, dict):
        raise BadInputError(f'{path}: expected keys with values, got {type(meta).__name__}')
    known = {key: meta[key] for key in ('fps', 'frame_id', 'T_world_camera', 'depth_scale') if key in meta}
    return sequence_values(path, known), calibration_from_values(meta, str(path))


# ------------------------------------------------------------------------------------------------------------- stamps

def _listed(path: Path) -> List[StampedFile]:
    """Return the files of a list, in the order of their stamps."""
    try:
        lines = path.read_text(encoding='utf-8').splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f'{path} can not be read: {error}') from error
    files = []
    for number, line in enumerate(lines, 1):
        cells = line.split(None, 1)
        if not cells or cells[0].startswith('#'):
            continue
        try:
            files.append(StampedFile(parse_stamp(cells[0]), path.parent / cells[1].strip()))
        except (ValueError, IndexError):
            raise BadInputError(f"{path}, line {number}: expected a time [s] and a file, got '{line}'") from None
    if not files:
        raise BadInputError(f'{path} names no images')
    files.sort()
    for before, after in zip(files, files[1:]):
        if before.stamp == after.stamp:
            raise BadInputError(f'{before.path} and {after.path} have one stamp, {seconds_text(before.stamp)} s')
    return files


def _associated(streams: Streams) -> Dict[int, int]:
    colour, depth = ([file.stamp for file in streams.get(stream, [])] for stream in LISTS)
    return {depth[j]: colour[i] for i, j in associate(colour, depth)}


def _numbered(folder: Path, rate: Optional[Fraction]) -> Tuple[Streams, Dict[int, int], List[str]]:
    """Return the images with stamps at equal distances, the pairs by stamp, and remarks."""
    places = {stream: next((folder / name for name in names if (folder / name).is_dir()), None)
              for stream, names in FOLDERS.items()}
    numbered = {stream: files for stream, place in places.items() if place is not None
                for files in [_by_number(place, _SUFFIXES[stream])] if files}
    if not numbered:
        content = sorted(path.name + '/' * path.is_dir() for path in folder.iterdir())
        raise BadInputError(f"{folder} has no images in rgb/, color/ or depth/; it holds: {some(content) or 'nothing'}")
    if rate is None:
        raise BadInputError(f"{folder} has neither rgb.txt or depth.txt with stamps nor fps in sequence.yaml or "
                            'meta.json: give --rate')
    if not 0 < rate <= 1000:
        raise BadInputError(f'rate {float(rate):g}, expected more than 0 and up to 1000 [Hz]')
    numbers = sorted(set().union(*numbered.values()))
    stamps = {number: DEFAULT_START + round((number - numbers[0]) * SECOND / rate) for number in numbers}
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    remarks = [f'{missing} of the numbers {numbers[0]} .. {numbers[-1]} are missing; the times of the others are as if '
               'they were there'] * (missing > 0)
    streams = {stream: [StampedFile(stamps[number], files[number]) for number in sorted(files)]
               for stream, files in numbered.items()}
    both = set(numbered.get('colour', ())) & set(numbered.get('depth', ()))
    return streams, {stamps[number]: stamps[number] for number in both}, remarks


def _by_number(place: Path, suffixes: Sequence[str]) -> Dict[int, Path]:
    """Return the images of a folder by the numbers at the end of their names."""
    files: Dict[int, Path] = {}
    for path in sorted(place.iterdir()):
        if path.suffix.lower() not in suffixes or path.name.startswith('.') or not path.is_file():
            continue
        number = _NUMBER.search(path.stem)
        if number is None:
            raise BadInputError(f"{path}: expected a name that ends in the number of the frame, as 'frame_0012'; "
                                'stamps belong into rgb.txt and depth.txt')
        if files.setdefault(int(number[1]), path) != path:
            raise BadInputError(f'{files[int(number[1])]} and {path} have one number')
    return files


def _shifted(streams: Streams, start: Optional[int]) -> Tuple[Streams, int]:
    """Return the files with the first stamp at `start`, and the difference [ns]."""
    stamps = [file.stamp for files in streams.values() for file in files]
    shift = 0 if start is None else start - min(stamps)
    first, last = min(stamps) + shift, max(stamps) + shift
    if first <= 0 or last >= STAMP_END:
        raise BadInputError(f'stamps go from {seconds_text(first)} to {seconds_text(last)} s, expected more than 0 '
                            f'(which means "no stamp" in ROS) and less than {STAMP_END // SECOND}; give --start')
    return {stream: [StampedFile(file.stamp + shift, file.path) for file in files]
            for stream, files in streams.items()}, shift


def _remarks_on_partners(streams: Streams, pairs: int) -> List[str]:
    """Return how many images have no partner.

    Raises:
        BadInputError: no image has one.
    """
    if len(streams) < 2:
        return []
    if not pairs:
        colour, depth = streams['colour'][0], streams['depth'][0]
        raise BadInputError(f'no colour image has a depth image: the first ones are {colour.path.name} at '
                            f'{seconds_text(colour.stamp)} s and {depth.path.name} at {seconds_text(depth.stamp)} s')
    return [f'{len(files) - pairs} of {len(files)} {stream} images have no partner'
            for stream, files in streams.items() if len(files) > pairs]


# ------------------------------------------------------------------------------------------------------------ writing

class WrittenFile(NamedTuple):
    """An image that was written."""

    stream: str
    stamp: int  # [ns]
    path: Path  # in the folder


def number_files(folder: Path, files: Sequence[WrittenFile], only_pairs: bool
                 ) -> Tuple[List[WrittenFile], List[str]]:
    """Rename the images of a folder to the numbers of their frames.

    Args:
        only_pairs: delete images without a partner.

    Returns:
        The files under their new names, and remarks on images without a partner.

    Raises:
        ParameterError: no image would be left.
    """
    colour, depth = (sorted((file for file in files if file.stream == stream), key=lambda file: file.stamp)
                     for stream in LISTS)
    pairs = associate([file.stamp for file in colour], [file.stamp for file in depth])
    frames = [[colour[i], depth[j]] for i, j in pairs]
    alone = sorted({*colour, *depth} - {file for frame in frames for file in frame})
    remarks = [f'{len(of_stream) - len(pairs)} of {len(of_stream)} {of_stream[0].stream} images have no partner within '
               f'{MAX_DIFFERENCE / SECOND:g} s' for of_stream in (colour, depth)
               if colour and depth and len(of_stream) > len(pairs)]
    if not only_pairs:
        frames += [[file] for file in alone]
    elif not frames:
        raise ParameterError('no image has a partner, so --only-pairs leaves nothing')
    else:
        for file in alone:
            (folder / file.path).unlink()
    numbered = []
    for number, frame in enumerate(sorted(frames, key=lambda frame: min(file.stamp for file in frame))):
        for file in frame:
            path = file.path.with_name(f'{number:06d}{file.path.suffix}')
            (folder / file.path).rename(folder / path)
            numbered.append(file._replace(path=path))
    return numbered, remarks


def write_lists(folder: Path, files: Sequence[WrittenFile]) -> None:
    """Write rgb.txt and depth.txt."""
    for stream, name in LISTS.items():
        of_stream = sorted(file for file in files if file.stream == stream)
        if of_stream:
            lines = [f'{seconds_text(file.stamp)} {file.path.as_posix()}\n' for file in of_stream]
            (folder / name).write_text(f'# {stream} images\n# timestamp filename\n' + ''.join(lines))


def write_description(folder: Path, calibration: Optional[Calibration], files: Sequence[WrittenFile], **known: Any
                      ) -> None:
    """Write camera.yaml and sequence.yaml.

    Args:
        files: their stamps give the rate.
        known: values of sequence.yaml; None: left out.
    """
    if calibration is not None:
        (folder / 'camera.yaml').write_text(calibration_text(calibration))
    values: Dict[str, Any] = {}
    stamps = sorted(file.stamp for file in files if file.stream == files[0].stream)
    if len(stamps) > 1:
        rate = round(SECOND / statistics.median(np.diff(np.array(stamps, np.int64)).tolist()), 3)
        if 0 < rate <= 1000:
            values['fps'] = rate
    values.update((key, value) for key, value in known.items() if value is not None)
    (folder / 'sequence.yaml').write_text(yaml.safe_dump(values, default_flow_style=None, sort_keys=False))
