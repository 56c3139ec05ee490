"""Links of a robot, as text in a parameter, and which parts of people are in truth these links."""
import re
from typing import NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_signals.capsules import Capsules

# A frame or two, and a radius: tool0:0.08 or elbow_link>wrist_link:0.1.
_LINK = re.compile(r'([^\s:>]+)(?:>([^\s:>]+))?:(\d*\.?\d+)')
# Points of the axis of a capsule that are looked at, as shares of its length.
_ALONG = np.linspace(0.0, 1.0, 5)


class RobotLink(NamedTuple):
    """A capsule of a robot, between the origins of two frames of tf; of the same frame twice, a sphere; radius [m]."""

    start: str
    end: str
    radius: float


def read_links(text: str, key: str) -> Tuple[RobotLink, ...]:
    """Return the links of a parameter such as `shoulder_link>elbow_link:0.1 tool0:0.08`.

    Raises:
        ParameterError: it is written otherwise.
    """
    links = []
    for word in text.split():
        found = _LINK.fullmatch(word)
        if found is None:
            raise ParameterError(f"{key}: {word!r} is no link, expected FRAME:RADIUS or FRAME>FRAME:RADIUS with the "
                                 'radius in metres, such as tool0:0.08', key)
        links.append(RobotLink(frame_name(found[1]), frame_name(found[2] or found[1]), float(found[3])))
    return tuple(links)


def without_links(capsules: Capsules, ends: np.ndarray, radii: Sequence[float]) -> Capsules:
    """Return the capsules without those that are taken for the robot's, as their axes lie within its links.

    Ends (L, 2, 3) of the links are in the frame of the capsules [m], NaN: not known; radii with their padding [m].
    """
    starts, axes = capsules.ends[:, 0], capsules.ends[:, 1] - capsules.ends[:, 0]
    points = starts[:, np.newaxis] + _ALONG[:, np.newaxis] * axes[:, np.newaxis]
    within = np.zeros(points.shape[:2], bool)
    for (start, end), radius in zip(ends, radii):
        axis = end - start
        share = np.clip((points - start) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
        within |= np.linalg.norm(points - start - share[..., np.newaxis] * axis, axis=-1) <= radius
    return capsules.where(~within.all(axis=1))
