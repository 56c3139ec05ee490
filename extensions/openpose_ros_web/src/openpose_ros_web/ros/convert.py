"""Turn messages into what pages get: the only place of this package that knows both."""
from typing import Any, Dict, Tuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import PointCloud2, PointField

from skeleton_extract_3d.ros.convert import cloud_from_message

# Types of the field rgb, blue first, as PCL writes it.
_COLOURS = (PointField.FLOAT32, PointField.UINT32)
_LONGEST_TEXT = 300
_FARTHEST = 1000.0  # [m]
RATE = 'rate [Hz]'
"""Key that the nodes of this project have in their status."""


def points_from_cloud(message: PointCloud2, most: int) -> Tuple[np.ndarray, np.ndarray]:
    """Return at most so many points of an organized cloud and their colours, (N, 3) [m] and (N, 3) uint8 RGB.

    Points farther than a kilometre are left out.

    Raises:
        BadInputError: see `cloud_from_message`.
    """
    cloud = cloud_from_message(message)
    step = int(np.ceil(np.sqrt(cloud.width * cloud.height / most)))
    rows, columns = (each.ravel() for each in np.mgrid[:cloud.height:step, :cloud.width:step])
    points = cloud.window(columns, rows, 1)[:, 0]
    known = np.flatnonzero((np.abs(points) < _FARTHEST).all(axis=1))[:most]  # no NaN
    colours = np.full((len(points), 3), 255, np.uint8)
    for field in message.fields:
        if field.name in ('rgb', 'rgba') and field.datatype in _COLOURS and field.offset + 4 <= message.point_step:
            values = np.ndarray((cloud.height, cloud.width, 4), np.uint8, message.data, field.offset,
                                (message.row_step, message.point_step, 1))[rows, columns]
            colours = values[:, 1:] if message.is_bigendian else values[:, 2::-1]
    return points[known], np.ascontiguousarray(colours[known])


def status_of(status: DiagnosticStatus) -> Dict[str, Any]:
    """Return what a node of this project says of itself; empty: it is another one."""
    if RATE not in [value.key for value in status.values]:
        return {}
    # diagnostic_updater puts the name of the node before its own
    return {'name': status.name.rpartition(': ')[2][:_LONGEST_TEXT],
            'level': int(status.level), 'text': status.message[:_LONGEST_TEXT]}
