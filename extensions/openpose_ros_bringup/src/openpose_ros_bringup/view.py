"""The configuration of RViz for a chain: what it shows, and a viewpoint behind the place that the cameras look at.

Frames here have z upwards. The place is looked at from the side of the (first) camera, a little from above.
"""
import copy
from typing import Any, Dict, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from skeleton_extract_3d.points.transform import TURNED, Transform

# The point that a camera looks at, and the distance of the eye from it [m]: people are well in view.
_FOCAL_DISTANCE, DISTANCE = 2.5, 3.5
# Direction of view: turned from that of the camera, so that depth shows, and down [rad].
_TURN, PITCH = 0.4, 0.25
# Width of the image and the displays beside the view, and of an image alone, in a window that is 1440 wide [px].
_WITH_DISPLAYS, _ALONE = 448, 1360
# RViz's window as Qt's QMainWindow::saveState writes it: Image above Displays on the left, whose width is filled in.
_WINDOW = ('000000ff00000000fd0000000100000000{:08x}00000329fc0200000002fb0000000a0049006d006100670065010000003e'
           '0000012b0000001600fffffffb000000100044006900730070006c006100790073010000016f000001f8000000cb00ffffff'
           '000001510000032900000004000000040000000800000008fc0000000100000002000000010000000a0054006f006f006c0073'
           '0100000000ffffffff0000000000000000')
# Orthographic view from above: pixels per metre of a window that is 800 pixels high.
_SCALE = 300.0


class Topics(NamedTuple):
    """What is shown: namespace of the markers (empty: people in the image alone), clouds and images by title."""

    markers: str
    clouds: Mapping[str, str]
    images: Mapping[str, str]


def viewpoint(cameras: Sequence[Transform]) -> Tuple[np.ndarray, float]:
    """Return the point that RViz looks at, (3,) [m], and the direction from there to its eye, about z [rad].

    `cameras` are poses, from the optical frames to the fixed frame; one at least.
    """
    focal = np.mean([translation + _FOCAL_DISTANCE * rotation[:, 2] for rotation, translation in cameras], axis=0)
    towards = cameras[0][1] - focal
    return focal, float(np.arctan2(towards[1], towards[0]) + _TURN) % (2 * np.pi)


def rviz_configuration(template: Mapping[str, Any], frame: str, topics: Topics, cameras: Sequence[Transform]
                       ) -> Dict[str, Any]:
    """Return the values of a configuration file.

    Args:
        template: those of the package's people.rviz, for a single camera.
        frame: the fixed frame; the grid is on its floor, where it has one.
        cameras: see `viewpoint`.
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
    focal, yaw = viewpoint(cameras)
    x, y, z = (round(float(value), 3) for value in focal)
    manager['Views']['Current'].update({'Focal Point': {'X': x, 'Y': y, 'Z': z}, 'Distance': DISTANCE,
                                        'Yaw': round(yaw, 3), 'Pitch': PITCH})
    values['Window Geometry']['QMainWindow State'] = _WINDOW.format(_WITH_DISPLAYS if topics.markers else _ALONE)
    if not topics.markers:
        values['Panels'] = []
    # seen from above, what is away from the camera is up
    manager['Views']['Saved'][0].update(X=x, Y=y, Angle=round(yaw - _TURN + np.pi / 2, 3), Scale=_SCALE)
    return values
