"""Joint angles of people, from the centres of joints alone.

They follow the recommendations of the ISB (Wu et al., J. Biomech. 35 (2002) 543, hip and ankle; 38 (2005) 981, shoulder
and elbow) as far as joint centres allow: axes are x forward, y up, z to the right; flexion, adduction and dorsiflexion
are positive. Twists of segments are not known, so there is no rotation of hip and shoulder, and the tilt of the pelvis
is that of the trunk.

    hip_flexion, hip_adduction      thigh in the pelvis: z through the hips, y nearest to the trunk; 0: along the trunk
    knee_flexion, elbow_flexion     180 degrees less the angle between the segments; 0: straight
    ankle_dorsiflexion              90 degrees less the angle between the shank and the line from heel to big toe
    shoulder_elevation              upper arm from the downward axis of the trunk (y from hips to neck); 0: hanging
    shoulder_plane                  plane of elevation: 0 sidewards (abduction), 90 forward (flexion), -90 backward; of
                                    an arm that is raised by 20 to 160 degrees
    neck_flexion, neck_bending      neck to the middle of the ears in the trunk: forward, to the right; 0: along it
    neck_rotation                   middle of the ears to the nose in the trunk: to the left; 0: forward
"""
from typing import Dict, Sequence

import numpy as np

SIDED_ANGLES = ('hip_flexion', 'hip_adduction', 'knee_flexion', 'ankle_dorsiflexion', 'shoulder_elevation',
                'shoulder_plane', 'elbow_flexion')
ANGLES = (*(f'{side}_{angle}' for angle in SIDED_ANGLES for side in ('right', 'left')), 'neck_flexion', 'neck_bending',
          'neck_rotation')
"""Names of the angles."""
# The plane in which an arm is raised is not known of one that hangs [deg].
_RAISED = 20.0


def joint_angles(joints: Sequence[str], positions: np.ndarray) -> Dict[str, np.ndarray]:
    """Return the `ANGLES` (N,) [deg] of people; NaN where a joint that takes part is missing.

    Args:
        joints: names of the K joints.
        positions: (N, K, 3).
    """
    nowhere = np.full((len(positions), 3), np.nan)
    at = {joint: positions[:, column].astype(np.float64) for column, joint in enumerate(joints)}

    def to(start: str, end: str) -> np.ndarray:
        return at.get(end, nowhere) - at.get(start, nowhere)

    for part in ('hip', 'ear'):
        at[f'{part}s'] = at.get(f'left_{part}', nowhere) + to(f'left_{part}', f'right_{part}') / 2
    trunk, hips = to('hips', 'neck'), to('left_hip', 'right_hip')
    pelvis = _axes(np.cross(trunk, hips), np.cross(np.cross(hips, trunk), hips))
    thorax = _axes(np.cross(trunk, to('left_shoulder', 'right_shoulder')), trunk)
    angles = {}
    for side, right in (('right', 1), ('left', -1)):
        hip, knee, ankle = (f'{side}_{part}' for part in ('hip', 'knee', 'ankle'))
        shoulder, elbow, wrist = (f'{side}_{part}' for part in ('shoulder', 'elbow', 'wrist'))
        thigh, arm = _in(pelvis, to(hip, knee)), _in(thorax, to(shoulder, elbow))
        elevation = between(arm, np.array([0.0, -1.0, 0.0]))
        angles.update({
            f'{side}_hip_flexion': _turn(thigh[:, 0], -thigh[:, 1]),
            f'{side}_hip_adduction': _turn(-right * thigh[:, 2], np.hypot(thigh[:, 0], thigh[:, 1])),
            f'{side}_knee_flexion': between(to(hip, knee), to(knee, ankle)),
            f'{side}_ankle_dorsiflexion': 90 - between(to(ankle, knee), to(f'{side}_heel', f'{side}_big_toe')),
            f'{side}_shoulder_elevation': elevation,
            f'{side}_shoulder_plane': np.where(np.abs(elevation - 90) < 90 - _RAISED,
                                               _turn(arm[:, 0], right * arm[:, 2]), np.nan),
            f'{side}_elbow_flexion': between(to(shoulder, elbow), to(elbow, wrist))})
    head, face = _in(thorax, to('neck', 'ears')), _in(thorax, to('ears', 'nose'))
    angles.update({'neck_flexion': _turn(head[:, 0], head[:, 1]), 'neck_bending': _turn(head[:, 2], head[:, 1]),
                   'neck_rotation': _turn(-face[:, 2], face[:, 0])})
    return {name: angles[name] for name in ANGLES}


def _axes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return unit axes as rows, (N, 3, 3), of x and y (N, 3) at right angles; NaN where they have no length."""
    with np.errstate(invalid='ignore'):
        rows = [vectors / np.linalg.norm(vectors, axis=1, keepdims=True) for vectors in (x, y)]
    return np.stack([*rows, np.cross(*rows)], axis=1)


def _in(axes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum('nij,nj->ni', axes, vectors)


def _turn(opposite: np.ndarray, along: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan2(opposite, along))


def between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the angles (N,) [deg] between vectors (N, 3); the second may be one, (3,)."""
    across = np.linalg.norm(np.cross(first, second), axis=1)
    return _turn(across, (first * second).sum(axis=1))
