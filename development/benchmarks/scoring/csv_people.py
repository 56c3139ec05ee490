"""People in CSV files as `rostopic echo -p` makes them of the per-person message."""
import csv
from pathlib import Path
from typing import List, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import People3D

PARTS = ('x', 'y', 'z', 'confidence', 'status', 'sigma')


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
