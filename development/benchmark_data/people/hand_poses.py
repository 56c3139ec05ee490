"""Finger poses, and the names of the key points of hands and faces."""
from typing import Dict, Tuple

import numpy as np

HAND21 = ['wrist', *(f'{finger}{k}' for finger in ('thumb', 'index', 'middle', 'ring', 'little') for k in (1, 2, 3, 4))]
FACE_POINTS = ['nose_tip', 'chin', 'right_eye_outer', 'right_eye_inner', 'left_eye_inner', 'left_eye_outer',
               'mouth_right', 'mouth_left']
# In Anny's mesh, found by geometry, checked in pictures.
FACE_VERTICES = [5054, 5171, 1089, 1103, 7795, 7781, 361, 7122]

Angles = Tuple[float, float, float, float]
_FIST: Angles = (78, 95, 60, 0)
_THUMB_FIST: Angles = (42, 14, 38, 40)
_THUMB_IN: Angles = (40, 25, 45, 45)
# Thumb: palmar lift, bend towards the little finger at CMC, MCP and IP; the other fingers: flexion of the three joints
# and spread [deg].
_POSES: Dict[str, Tuple[Angles, ...]] = {
    'open': ((5, -8, 0, 0), (2, 3, 2, 7), (2, 3, 2, 1), (2, 3, 2, -5), (4, 3, 2, -12)),
    'flat': ((10, 8, 5, 5), *[(0.0, 2.0, 1.0, 0.0)] * 4),
    'relax': ((20, 8, 12, 12), (18, 22, 12, 2), (22, 26, 14, 0), (26, 28, 16, -1), (28, 30, 16, -3)),
    'fist': (_THUMB_FIST, *[_FIST] * 4),
    'point': (_THUMB_FIST, (0, 2, 2, 0), *[_FIST] * 3),
    'count1': (_THUMB_IN, (0, 2, 2, 0), *[_FIST] * 3),
    'count2': (_THUMB_IN, (0, 2, 2, 8), (0, 2, 2, -6), _FIST, _FIST),
    'count3': (_THUMB_IN, (0, 2, 2, 8), (0, 2, 2, 0), (2, 3, 2, -8), _FIST),
    'count4': (_THUMB_IN, (0, 2, 2, 8), (0, 2, 2, 2), (0, 2, 2, -5), (2, 2, 2, -12)),
    'count5': ((0, -14, -4, 0), (0, 2, 2, 9), (0, 2, 2, 2), (0, 2, 2, -6), (2, 2, 2, -14)),
    'thumb_up': ((8, -28, -12, -10), *[_FIST] * 4),
    'pinch': ((33, 2, 18, 32), (49, 43, 23, 0), (24, 28, 14, 0), (18, 24, 12, -2), (14, 20, 10, -6)),
    'hook': ((20, 5, 10, 10), (38, 55, 35, 0), (42, 58, 36, 0), (44, 58, 36, 0), (46, 58, 36, 0)),
}


def hand_angles(name: str) -> np.ndarray:
    """Return the (5, 4) angles [deg] of a pose, thumb first."""
    return np.array(_POSES[name], float)
