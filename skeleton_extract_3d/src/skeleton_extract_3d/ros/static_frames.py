"""Frames that static transforms connect."""
from typing import List, Mapping, Tuple

import numpy as np
from geometry_msgs.msg import TransformStamped

from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.ros.convert import rotation_and_translation


def frames_above(frame: str, links: Mapping[str, TransformStamped]) -> List[Tuple[str, Transform]]:
    """Return the frames above a frame, the nearest first, each with the transform from the frame to it [m].

    Args:
        frame: its name; a leading slash does not matter.
        links: static transforms by their child frames, without slashes.
    """
    frame = frame.strip('/')
    rotation, shift = np.eye(3), np.zeros(3)
    found: List[Tuple[str, Transform]] = []
    while frame in links and len(found) < len(links):  # also where the transforms go round in a circle
        turn, arm = rotation_and_translation(links[frame])
        rotation, shift, frame = turn @ rotation, turn @ shift + arm, links[frame].header.frame_id.strip('/')
        found.append((frame, (rotation, shift)))
    return found
