"""Keypoints of a whole recording: the one type that passes between tables, comparison and pictures."""
from dataclasses import dataclass, fields
from typing import Tuple

import numpy as np

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS


@dataclass(frozen=True)
class KeypointTable:
    """The joints of people over time, one row per person and frame, in the order of the recording.

    The K joints are `MESSAGE_JOINTS`, whatever the network's joint set. In space D is 3 [m], in the image 2 [px].

    Attributes:
        stamps: (R,) int64 [ns], of the image or cloud; rows of one frame have one stamp.
        sequence: (R,) int64, header.seq.
        frame_ids: (R,) str, frame of reference.
        numbers: (R,) int64, people in the frame of that row.
        ids: (R,) int64, track ids.
        positions: (R, K, D) float32; NaN where missing.
        confidence: (R, K) float32 [0..1] of the 2D detection.
        status: (R, K) uint8: MISSING, MEASURED or INFERRED of `skeleton_extract_3d.people`. Where the recording does
            not tell, as in 2D and with the original's columns, a joint with a position is MEASURED.
        sigma: (R, K) float32 [m], NaN where MISSING or not told.

    Raises:
        ValueError: an array has the wrong shape.
    """

    stamps: np.ndarray
    sequence: np.ndarray
    frame_ids: np.ndarray
    numbers: np.ndarray
    ids: np.ndarray
    positions: np.ndarray
    confidence: np.ndarray
    status: np.ndarray
    sigma: np.ndarray

    def __post_init__(self) -> None:
        rows, joints = len(self.stamps), len(MESSAGE_JOINTS)
        kinds = {'stamps': np.int64, 'sequence': np.int64, 'frame_ids': np.str_, 'numbers': np.int64, 'ids': np.int64,
                 'positions': np.float32, 'confidence': np.float32, 'status': np.uint8, 'sigma': np.float32}
        for name, kind in kinds.items():
            value = np.asarray(getattr(self, name), kind)
            expected = {'positions': (rows, joints, value.shape[-1]), 'confidence': (rows, joints),
                        'status': (rows, joints), 'sigma': (rows, joints)}.get(name, (rows,))
            if value.shape != expected or (name == 'positions' and value.shape[-1] not in (2, 3)):
                raise ValueError(f'{name}: expected {expected}, got {value.shape}')
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def joints(self) -> Tuple[str, ...]:
        """Names of the K joints."""
        return MESSAGE_JOINTS

    @property
    def dimensions(self) -> int:
        """Return 3 in space, 2 in the image."""
        return self.positions.shape[-1]

    def select(self, rows: np.ndarray) -> 'KeypointTable':
        """Return the table of some rows.

        Args:
            rows: (R,) bool, or indices.
        """
        return KeypointTable(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def of_person(self, person: int) -> 'KeypointTable':
        """Return the rows of one track id."""
        return self.select(self.ids == person)
