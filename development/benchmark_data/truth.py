"""Ground truth of a rendered frame: joints, visibility, gestures, hands and faces."""
from typing import Any, Dict, List, Union

import numpy as np

from .people.body import COCO18
from .people.geometry import unit
from .people.gestures import Gesture, eye_of
from .rendering.camera import Camera
from .rendering.renderer import Frame

OUTSIDE, BEHIND_SELF, VISIBLE, BEHIND_PERSON, BEHIND_FURNITURE = range(5)
# A joint is visible if the person's own surface at its pixel is at most this far in front of it [m].
THICKNESS = {'hip': 0.22, 'shoulder': 0.17, 'neck': 0.17, 'knee': 0.13, 'elbow': 0.13, 'wrist': 0.11, 'ankle': 0.11,
             'nose': 0.13, 'eye': 0.13,
                 'ear': 0.13}
JOINT_THICKNESS = np.array([THICKNESS[name.split('_')[-1]] for name in COCO18])
HAND_THICKNESS, FACE_THICKNESS, FOOT_THICKNESS = 0.022, 0.015, 0.07  # [m]; feet wear shoes


def visibility(points: np.ndarray, pixels: np.ndarray, person: int, frame: Frame, thickness: Union[float, np.ndarray]
               ) -> List[int]:
    """Return the code of each of (N, 3) points in the optical frame, at (N, 2) pixels, of a person (1, 2 ...).

    Beside the own silhouette, with nothing in front, a point is visible.
    """
    (u, v), depth, (height, width) = np.rint(pixels).astype(int).T, points[:, 2], frame.depth.shape
    outside = (depth < 0.1) | (u < 0) | (u >= width) | (v < 0) | (v >= height)
    owner, surface = (image[v.clip(0, height - 1), u.clip(0, width - 1)] for image in (frame.ids, frame.depth))
    own = np.where(depth - surface <= thickness, VISIBLE, BEHIND_SELF)
    codes = np.select([outside, owner == person, (owner == 0) | (surface >= depth), owner < 0],
                      [OUTSIDE, own, VISIBLE, BEHIND_FURNITURE], BEHIND_PERSON)
    return [int(code) for code in codes]


def point_truth(camera: Camera, points: np.ndarray, person: int, frame: Frame, thickness: Union[float, np.ndarray]
                ) -> Dict[str, Any]:
    """Return xyz (optical frame), uv and vis of (N, 3) world points."""
    local = camera.to_camera(points)
    pixels = camera.project(local)
    return {'xyz': np.round(local, 4).tolist(), 'uv': np.round(pixels, 2).tolist(),
            'vis': visibility(local, pixels, person, frame, thickness)}


def signal_truth(camera: Camera, gestures: List[Gesture], joints: np.ndarray) -> Dict[str, Any]:
    """Return labels and their details: the arm; of pointing the target and the true rays, in the optical frame."""
    details = []
    for gesture in gestures:
        detail: Dict[str, Any] = {'label': gesture.label}
        details.append(detail)
        if gesture.label not in ('sit', 'stand', 'arms_crossed'):
            detail['arm'] = {'R': 'right', 'L': 'left'}[gesture.arm]
        if gesture.label == 'point':
            shoulder, wrist = (joints[COCO18.index(f"{detail['arm']}_{name}")] for name in ('shoulder', 'wrist'))
            target = np.array(gesture.target)
            detail.update(target_name=gesture.target_name, style=gesture.style,
                          target_world=np.round(target, 4).tolist())
            for name, origin in (('shoulder_wrist', shoulder), ('eye_wrist', eye_of(joints))):
                direction = unit(wrist - origin)
                off = np.rad2deg(np.arccos(np.clip(direction @ unit(target - origin), -1, 1)))
                detail[name] = {'origin': np.round(camera.to_camera(origin), 4).tolist(),
                                'direction': np.round(camera.rotation @ direction, 5).tolist(),
                                'off_target_deg': round(float(off), 2)}
            detail['target'] = np.round(camera.to_camera(target), 4).tolist()
    return {'labels': [gesture.label for gesture in gestures], 'detail': details}
