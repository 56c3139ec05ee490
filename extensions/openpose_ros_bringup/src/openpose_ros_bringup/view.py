"""The configuration of RViz for a chain: what it shows, and a viewpoint from which people fill the view.

Frames here have z upwards. The people are looked at from the side of the (first) camera, a little from above.
"""
import copy
import math
from typing import Any, Dict, Mapping, NamedTuple, Sequence

import numpy as np

from skeleton_extract_3d.points.transform import TURNED, Transform

# Without people: the point that a camera looks at, and the radius of what is shown around it [m].
_FOCAL_DISTANCE, _RADIUS = 2.5, 1.2
# RViz sees 45 degrees from top to bottom: a sphere of radius 1 fills that from this far, and a tenth is for the border.
_DISTANCE = 1.1 / math.sin(math.radians(22.5))
_NEAREST, _FARTHEST = 2.0, 12.0  # [m]
# Direction of view: turned from that of the camera, so that depth shows, and down [rad].
_TURN, _PITCH = 0.4, 0.25
# Width of the image and the displays beside the view, and of an image alone, in a window that is 1440 wide [px].
_WITH_DISPLAYS, _ALONE = 448, 1360
# RViz's window as Qt's QMainWindow::saveState writes it: Image above Displays on the left, whose width is filled in.
_WINDOW = ('000000ff00000000fd0000000100000000{:08x}00000329fc0200000002fb0000000a0049006d006100670065010000003e'
           '0000012b0000001600fffffffb000000100044006900730070006c006100790073010000016f000001f8000000cb00ffffff'
           '000001510000032900000004000000040000000800000008fc0000000100000002000000010000000a0054006f006f006c0073'
           '0100000000ffffffff0000000000000000')
# Orthographic view from above: pixels per metre of a window that is 800 pixels high.
_SCALE = 300.0


class Viewpoint(NamedTuple):
    """Where RViz looks from."""

    focal: np.ndarray  # (3,) [m], the point that is looked at
    distance: float  # of the eye to it [m]
    yaw: float  # direction from the point to the eye, about z [rad]
    pitch: float = _PITCH  # of the eye above the horizon of the point [rad]


class Topics(NamedTuple):
    """What is shown: namespace of the markers (empty: people in the image alone), clouds and images by title."""

    markers: str
    clouds: Mapping[str, str]
    images: Mapping[str, str]


def viewpoint(joints: np.ndarray, cameras: Sequence[Transform]) -> Viewpoint:
    """Return a viewpoint.

    Args:
        joints: (N, 3) [m] of all people, may be empty and have NaN.
        cameras: poses, from the optical frames to that of the joints; one at least.
    """
    joints = joints[np.isfinite(joints).all(axis=1)]
    if len(joints):
        low, high = joints.min(axis=0), joints.max(axis=0)
        focal, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    else:
        focal = np.mean([translation + _FOCAL_DISTANCE * rotation[:, 2] for rotation, translation in cameras], axis=0)
        radius = _RADIUS
    towards = cameras[0][1] - focal
    return Viewpoint(focal, float(np.clip(_DISTANCE * radius, _NEAREST, _FARTHEST)),
                     float(np.arctan2(towards[1], towards[0]) + _TURN) % (2 * np.pi))


def rviz_configuration(template: Mapping[str, Any], frame: str, topics: Topics, view: Viewpoint) -> Dict[str, Any]:
    """Return the values of a configuration file.

    Args:
        template: those of the package's people.rviz, for a single camera.
        frame: the fixed frame; the grid is on its floor, where it has one.
    """
    values = copy.deepcopy(dict(template))
    manager = values['Visualization Manager']
    displays = []
    for display in manager['Displays']:
        kind = display['Class']
        if kind == 'rviz/PointCloud2':
            displays += [{**display, 'Name': title, 'Topic': topic} for title, topic in topics.clouds.items()]
        elif kind == 'rviz/Image':
            displays += [{**display, 'Name': title, 'Image Topic': topic} for title, topic in topics.images.items()]
        elif kind == 'rviz/Grid':
            displays.append({**display, 'Enabled': not frame.endswith(TURNED)})
        elif topics.markers:
            name = display['Marker Topic'].rpartition('/')[2]
            displays.append({**display, 'Marker Topic': f'{topics.markers}/{name}'})
    manager['Displays'] = displays
    manager['Global Options']['Fixed Frame'] = frame
    x, y, z = (round(float(value), 3) for value in view.focal)
    manager['Views']['Current'].update({'Focal Point': {'X': x, 'Y': y, 'Z': z}, 'Distance': round(view.distance, 3),
                                        'Yaw': round(view.yaw, 3), 'Pitch': view.pitch})
    values['Window Geometry']['QMainWindow State'] = _WINDOW.format(_WITH_DISPLAYS if topics.markers else _ALONE)
    if not topics.markers:
        values['Panels'] = []
    # seen from above, what is away from the camera is up
    manager['Views']['Saved'][0].update(X=x, Y=y, Angle=round(view.yaw - _TURN + np.pi / 2, 3),
                                        Scale=round(_SCALE / max(view.distance / _DISTANCE, 1.0), 1))
    return values
