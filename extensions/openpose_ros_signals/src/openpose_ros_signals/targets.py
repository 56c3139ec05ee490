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
        if not isinstance(values, list):
            raise ValueError(_EXPECTED)
        targets = tuple(_target(value) for value in values)
        names = [target.name for target in targets]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f'it has two targets of the name {twice[0]!r}')
    except ValueError as error:
        raise BadInputError(f'targets {path} can not be read: {error}') from error
    return targets


def _target(value: Any) -> FixedTarget:
    keys = {'name', 'frame_id', 'position'}
    if not isinstance(value, dict) or not {'name', 'frame_id'} <= set(value) <= keys:
        raise ValueError(f'{value!r} is no target; {_EXPECTED}')
    position = np.array(value.get('position', [0.0, 0.0, 0.0]), np.float64)
    texts = (value['name'], value['frame_id'])
    if position.shape != (3,) or not np.isfinite(position).all() or not all(isinstance(t, str) and t for t in texts):
        raise ValueError(f'{value!r} is no target; {_EXPECTED}')
    return FixedTarget(value['name'], frame_name(value['frame_id']), position)
