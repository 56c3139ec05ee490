"""RGB-D folders: which images they hold, the stamp of each one, and the description of the camera.

`images_to_bag --help` describes their files.
"""
import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.calibration import Calibration, calibration_from_values, read_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.structured_text import file_values
from skeleton_extract_3d.points.stamps import SECOND, STAMP_END, associate, parse_stamp, seconds_text

# By stream its folders, of which the first one is written; the list of its files; suffixes of its files.
FOLDERS = {'colour': ('rgb', 'color'), 'depth': ('depth',)}
LISTS = {'colour': 'rgb.txt', 'depth': 'depth.txt'}
_SUFFIXES = {'colour': ('.jpg', '.jpeg', '.png', '.bmp', '.tif', '.tiff', '.webp', '.ppm', '.pgm'),
             'depth': ('.png', '.tif', '.tiff', '.pgm')}
_SEQUENCE_KEYS = ('fps', 'frame_id', 'T_world_camera', 'depth_scale')
_MOST_FPS, _MOST_UNITS = 1000, 1e6  # more than any file has: Hz, micrometres
# A rotation matrix that was written with four digits still counts as one.
_ROTATION_TOLERANCE = 1e-3
# TUM RGB-D benchmark, file formats: 5000 units are 1 m.
TUM_UNITS_PER_METRE = 5000.0
# Stamp of the first of numbered images: not 0, which means "no stamp", and early times before it are not negative.
DEFAULT_START = 1000 * SECOND
# A number at the end of a name that is no fraction.
_NUMBER = re.compile(r'(?:^|[^\d.])(\d+)$')


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
    fps: Optional[float]  # [Hz], or None
    timing: str  # origin of the stamps
    remarks: List[str]  # missing partners, for the report


def read_rgbd_folder(folder: Path, rate: Optional[Fraction] = None, default_rate: Optional[Fraction] = None
                     ) -> RgbdFolder:
    """Find the images of an RGB-D folder and their stamps; no image is read.

    Args:
        rate: of numbered images [Hz], in place of rgb.txt, depth.txt and fps.
        default_rate: of numbered images where nothing else is known [Hz].

    Raises:
        BadInputError: no images, no stamps, two images with one stamp, or no frame has colour and depth.
    """
    if not folder.is_dir():
        raise BadInputError(f'folder {folder} does not exist')
    values, calibration = read_description(folder)
    lists = {stream: folder / name for stream, name in LISTS.items() if (folder / name).is_file()}
    if lists and rate is None:
        streams = {stream: _listed(path) for stream, path in lists.items()}
        colour, depth = ([file.stamp for file in streams.get(stream, [])] for stream in LISTS)
        colour_of = {depth[j]: colour[i] for i, j in associate(colour, depth)}
        timing = ' and '.join(path.name for path in lists.values())
    else:
        known = rate if rate is not None else values['fps'] and Fraction(str(values['fps']))
        values['fps'], rate = known and float(known), known or default_rate
        streams = _numbered(folder, rate)
        colour_of = {stamp: stamp for stamp in set.intersection(*(
            {file.stamp for file in streams.get(stream, [])} for stream in LISTS))}
        timing = f'numbers at {float(rate or 0):g} Hz'
    stamps = sorted(file.stamp for files in streams.values() for file in files)
    if stamps[0] == 0 or stamps[-1] >= STAMP_END:
        raise BadInputError(f'stamps go from {seconds_text(stamps[0])} to {seconds_text(stamps[-1])} s, expected more '
                            f'than 0 (which means "no stamp" in ROS) and less than {STAMP_END // SECOND}')
    scale = values['depth_scale'] or (TUM_UNITS_PER_METRE if lists else None)
    return RgbdFolder(streams, colour_of, calibration, values['frame_id'], values['T_world_camera'], scale,
                      values['fps'], timing, _remarks_on_partners(streams, len(colour_of)))


def read_description(folder: Path) -> Tuple[Dict[str, Any], Optional[Calibration]]:
    """Return fps, frame_id, T_world_camera and depth_scale, None (frame_id: empty) where unknown, and the calibration.

    Raises:
        BadInputError: a file can not be read, has an unknown key or a wrong value.
    """
    calibration, sequence, meta = (folder / name for name in ('camera.yaml', 'sequence.yaml', 'meta.json'))
    if meta.is_file() and not calibration.is_file():
        values = _values_in(meta)
        known = {key: values[key] for key in _SEQUENCE_KEYS if key in values}
        return _sequence_values(meta, known), calibration_from_values(values, str(meta))
    return (_sequence_values(sequence, _values_in(sequence) if sequence.is_file() else {}),
            read_calibration(calibration) if calibration.is_file() else None)


def _values_in(path: Path) -> Dict[str, Any]:
    values = file_values(path, str(path))
    if not isinstance(values, dict):
        raise BadInputError(f'{path}: expected keys with values, got {type(values).__name__}')
    return values


def _sequence_values(path: Path, values: Dict[str, Any]) -> Dict[str, Any]:
    unknown = [str(key) for key in values if key not in _SEQUENCE_KEYS]  # YAML has keys of any type
    if unknown:
        raise BadInputError(f"{path} has unknown keys {', '.join(unknown)}; allowed: {', '.join(_SEQUENCE_KEYS)}")
    for name, most, unit in (('fps', _MOST_FPS, 'Hz'), ('depth_scale', _MOST_UNITS, 'units per metre')):
        value = values.get(name)
        if value is not None and not (isinstance(value, (int, float)) and 0 < value <= most):
            raise BadInputError(f'{path}: {name} = {value!r}, expected a number above 0, up to {most:g} [{unit}]')
    pose = values.get('T_world_camera')
    return {'fps': values.get('fps'), 'frame_id': frame_name(str(values.get('frame_id', ''))),
            'depth_scale': values.get('depth_scale'),
            'T_world_camera': None if pose is None else _rigid_transform(path, pose)}


def _rigid_transform(path: Path, values: Any) -> np.ndarray:
    try:
        matrix = np.array(values, np.float64).reshape(4, 4)
    except (TypeError, ValueError, OverflowError):
        raise BadInputError(f'{path}: T_world_camera = {values!r}, expected 4 x 4 numbers') from None
    rotation = matrix[:3, :3]
    upright = np.allclose(rotation @ rotation.T, np.eye(3), atol=_ROTATION_TOLERANCE) and np.linalg.det(rotation) > 0
    if not upright or not np.isfinite(matrix).all() or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise BadInputError(f'{path}: T_world_camera is no rotation and translation: {matrix.tolist()}')
    return matrix


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


def _numbered(folder: Path, rate: Optional[Fraction]) -> Streams:
    """Return the images by the numbers at the end of their names, with stamps at equal distances."""
    numbered: Dict[str, Dict[int, Path]] = {}
    for stream, names in FOLDERS.items():
        place = next((folder / name for name in names if (folder / name).is_dir()), None)
        for path in sorted(place.iterdir()) if place is not None else []:
            if path.suffix.lower() not in _SUFFIXES[stream] or path.name.startswith('.') or not path.is_file():
                continue
            number = _NUMBER.search(path.stem)
            if number is None:
                raise BadInputError(f"{path}: expected a name that ends in the number of the frame, as 'frame_0012'; "
                                    'stamps belong into rgb.txt and depth.txt')
            former = numbered.setdefault(stream, {}).setdefault(int(number[1]), path)
            if former != path:
                raise BadInputError(f'{former} and {path} have one number')
    if not numbered:
        raise BadInputError(f'{folder} has no images in rgb/, color/ or depth/')
    if rate is None:
        raise BadInputError(f"{folder} has neither rgb.txt or depth.txt with stamps nor fps in sequence.yaml or "
                            'meta.json: give --rate')
    if not 0 < rate <= _MOST_FPS:
        raise BadInputError(f'rate {float(rate):g}, expected more than 0 and up to {_MOST_FPS} [Hz]')
    first = min(min(files) for files in numbered.values())
    return {stream: [StampedFile(DEFAULT_START + round((number - first) * SECOND / rate), files[number])
                     for number in sorted(files)] for stream, files in numbered.items()}


def _remarks_on_partners(streams: Streams, pairs: int) -> List[str]:
    """Return how many images have no partner.

    Raises:
        BadInputError: no image has one.
    """
    if len(streams) < 2:
        return []
    if not pairs:
        colour, depth = (streams[stream][0] for stream in LISTS)
        raise BadInputError(f'no colour image has a depth image: the first ones are {colour.path.name} at '
                            f'{seconds_text(colour.stamp)} s and {depth.path.name} at {seconds_text(depth.stamp)} s')
    return [f'{len(files) - pairs} of {len(files)} {stream} images have no partner'
            for stream, files in streams.items() if len(files) > pairs]
