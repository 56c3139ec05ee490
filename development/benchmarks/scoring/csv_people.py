"""People in CSV files as `rostopic echo -p` makes them of the per-person message, also of other software."""
import csv
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

PARTS = ('x', 'y', 'z', 'confidence', 'status', 'sigma')
_STAMPS, _IDS = ('field.header.stamp', '%time'), ('field.person_ID', 'field.person_id')


def write_csv(path: Path, frames: List[Tuple[float, People3D]]) -> None:
    """Write one row per person and frame; the file must not be there."""
    with path.open('x', newline='') as handle:
        writer = csv.writer(handle)
        writer.writerow(['%time', 'field.header.stamp', 'field.num_people_detected', 'field.person_ID',
                         *(f'field.{joint}.{part}' for joint in COCO_18.joints for part in PARTS)])
        for seconds, people in frames:
            stamp = round(seconds * 1e9)
            values = np.concatenate([people.xyz, people.confidence[..., None], people.status[..., None],
                                     people.sigma[..., None]], axis=2)
            for person, row in zip(people.ids.tolist(), values):
                writer.writerow([stamp, stamp, len(people), person, *row.ravel().tolist()])


def read_csv(path: Path, begin: int = 0) -> List[Tuple[float, People3D]]:
    """Return stamp [s] and people of each frame.

    Needed are a stamp [ns], field.person_ID and field.JOINT.x, .y, .z of the joints of COCO_18; a missing joint is nan,
    or has the status or confidence 0. Optional: .status (0 MISSING, 1 MEASURED, 2 INFERRED) or .occluded, .sigma [m].

    Args:
        begin: stamp of the first frame of the scene [ns].

    Raises:
        ValueError: a column is missing.
    """
    with path.open(newline='') as handle:
        rows = list(csv.DictReader(handle))
    names: Dict[str, int] = {}  # ids may be texts
    frames: Dict[int, List[People3D]] = {}
    for row in rows:
        stamp, person = (next((row[name] for name in among if name in row), None) for among in (_STAMPS, _IDS))
        if stamp is None or person is None or f'field.{COCO_18.joints[0]}.x' not in row:
            raise ValueError(f'{path}: needed are {_STAMPS[0]}, {_IDS[0]} and field.JOINT.x, .y, .z')
        frames.setdefault(_nanoseconds(stamp) - begin, []).append(_person(row, names.setdefault(person, len(names))))
    return [(stamp / 1e9, person) for stamp, people in frames.items() for person in people]


def _nanoseconds(text: str) -> int:
    return int(text) if text.strip().lstrip('-').isdigit() else int(float(text))  # a float can not hold an epoch


def _number(text: object) -> float:
    try:
        return float({'true': '1', 'false': '0'}.get(str(text).lower(), str(text)))
    except ValueError:
        return np.nan


def _person(row: Dict[str, str], number: int) -> People3D:
    def column(part: str, default: float) -> np.ndarray:
        return np.array([[_number(row.get(f'field.{joint}.{part}', default)) for joint in COCO_18.joints]])

    xyz = np.stack([column(axis, np.nan) for axis in 'xyz'], axis=2)
    status, confidence = column('status', np.nan), column('confidence', 1.0)
    given = np.isfinite(xyz).all(axis=2)
    if np.isfinite(status).any():
        given &= status > 0
    else:
        given &= confidence > 0
        status = np.where(column('occluded', 0.0) > 0, INFERRED, MEASURED)
    return People3D(COCO_18, np.where(given[..., np.newaxis], xyz, np.nan), np.nan_to_num(confidence),
                    np.where(given, status, MISSING), column('sigma', np.nan), np.array([number]))
