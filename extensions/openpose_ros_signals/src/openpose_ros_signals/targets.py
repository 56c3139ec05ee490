"""What people may point at: a file of known targets."""
from pathlib import Path
from typing import Any, NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.structured_text import file_values

_EXPECTED = 'expected a list of {name: TEXT, frame_id: TEXT, position: [x, y, z]}, where position may be left out'


class FixedTarget(NamedTuple):
    """A target that stands still in a frame; `position` (3,) [m]."""

    name: str
    frame_id: str
    position: np.ndarray


def read_targets(path: Path) -> Tuple[FixedTarget, ...]:
    """Read a file of targets.

    Raises:
        BadInputError: it can not be read or is none; the text names the file and what is expected.
    """
    try:
        values = file_values(path, f'targets {path}')
        return tuple(_target(**value) for value in values)
    except (ValueError, TypeError) as error:
        raise BadInputError(f'targets {path} can not be read: {error}; {_EXPECTED}') from error


def _target(name: Any, frame_id: Any, position: Any = (0.0, 0.0, 0.0)) -> FixedTarget:
    place = np.array(position, np.float64)
    named = all(isinstance(text, str) and text for text in (name, frame_id))
    if not named or place.shape != (3,) or not np.isfinite(place).all():
        raise ValueError(f'{name!r} is no target')
    return FixedTarget(name, frame_name(frame_id), place)
