"""OpenPose's 70 points of a face: from the mesh of MediaPipe's network, and with depths, by an average face."""
import numpy as np

from openpose_ros_pkg.landmarks.records import FACE_POINTS
from openpose_ros_pkg.skeletons import WHOLE_BODY_133

# Points 0-67, those of iBUG, are the means of these points of the mesh; all but the brows are one point.
_JAW = (162, 234, 93, 58, 172, 136, 149, 148, 152, 377, 378, 365, 397, 288, 323, 454, 389)
_BROWS = ((70, 63, 105, 66, 107, 336, 296, 334, 293, 300), (46, 53, 52, 65, 55, 285, 295, 282, 283, 276))
_NOSE = (168, 197, 5, 4, 75, 97, 2, 326, 305)
_EYES = (33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380)
_MOUTH = (61, 39, 37, 0, 267, 269, 291, 405, 314, 17, 84, 181, 78, 82, 13, 312, 308, 317, 14, 87)
_FIRST, _SECOND = (np.array(_JAW + brow + _NOSE + _EYES + _MOUTH) for brow in _BROWS)
# Points of the right and of the left eye, whose means are the pupils.
PUPILS = (slice(36, 42), slice(42, 48))
# Right half and middle of the 68 points of iBUG: to the person's left, up, ahead [cm], from the middle of the head.
# Means of vertices, as in `face_points`, of MediaPipe's canonical face model: google-ai-edge/mediapipe,
# mediapipe/modules/face_geometry/data/canonical_face_model.obj (Apache-2.0).
_RIGHT = {
    0: (-7.556, 4.107, -0.992), 1: (-7.664, 0.673, -2.436), 2: (-7.542, -1.049, -2.431), 3: (-6.720, -4.789, -1.745),
    4: (-5.941, -6.224, -0.631), 5: (-5.085, -7.179, 0.715), 6: (-3.211, -8.533, 2.802), 7: (-1.293, -9.296, 4.094),
    8: (0.0, -9.403, 4.264), 17: (-5.487, 4.068, 3.097), 18: (-4.787, 4.552, 3.900), 19: (-3.861, 4.809, 4.508),
    20: (-2.702, 4.813, 4.969), 21: (-1.308, 4.577, 5.211), 27: (0.0, 3.271, 5.236), 28: (0.0, 1.728, 6.317),
    29: (0.0, 0.366, 7.243), 30: (0.0, -0.463, 7.587), 31: (-1.044, -1.465, 5.662), 32: (-0.597, -2.014, 5.866),
    33: (0.0, -2.089, 6.058), 36: (-4.446, 2.664, 3.173), 37: (-3.670, 2.928, 3.724), 38: (-2.724, 2.962, 3.872),
    39: (-1.856, 2.585, 3.758), 40: (-2.724, 2.316, 3.777), 41: (-3.670, 2.360, 3.635), 48: (-2.456, -4.343, 4.284),
    49: (-1.432, -3.501, 5.496), 50: (-0.711, -3.329, 5.877), 51: (0.0, -3.406, 5.980), 57: (0.0, -5.365, 5.535),
    58: (-0.700, -5.292, 5.448), 59: (-1.325, -5.107, 5.205), 60: (-2.153, -4.276, 4.038), 61: (-0.533, -3.993, 5.138),
    62: (0.0, -3.994, 5.219), 66: (0.0, -4.542, 5.405), 67: (-0.583, -4.518, 5.340)}
# The point of the other side of each point, the pupils at the end.
MIRRORED = np.array([*np.subtract(WHOLE_BODY_133.swap[23:91], 23), 69, 68])
# Greatest condition number of the spread of points that tell a direction: no plane of them alone.
_MOST_CONDITION = 1e4


def face_points(mesh: np.ndarray) -> np.ndarray:
    """Return the 70 points of OpenPose, (..., 70, D), of a face mesh, (..., 468, D), or of just these points."""
    if mesh.shape[-2] == FACE_POINTS:
        return mesh
    points = (mesh[..., _FIRST, :] + mesh[..., _SECOND, :]) / 2
    pupils = [points[..., eye, :].mean(axis=-2, keepdims=True) for eye in PUPILS]
    return np.concatenate([points, *pupils], axis=-2)


def _shape() -> np.ndarray:
    points = np.array([_RIGHT[number] if number in _RIGHT else np.multiply(_RIGHT[int(MIRRORED[number])], (-1, 1, 1))
                       for number in range(68)])
    return np.concatenate([points, *(points[eye].mean(axis=0, keepdims=True) for eye in PUPILS)])


# (70, 3) [cm].
SHAPE = _shape()


def with_depth(points: np.ndarray) -> np.ndarray:
    """Return the 70 points of a face with depths, x, y, z [px], z from their middle away from the camera.

    An average face, seen in orthographic projection along the line of sight, is fitted to the points (least squares,
    weighted by the scores). x and y stay; missing points are where that face has them.

    Args:
        points: (70, 3) x, y [px], score; NaN, NaN, 0 where missing. NaN everywhere where they tell no direction.
    """
    there = points[:, 2] > 0
    weight = points[there, 2].astype(np.float64) / max(float(points[there, 2].sum()), 1e-9)
    shape, middle = SHAPE - weight @ SHAPE[there], weight @ points[there, :2]
    known, image = shape[there], points[there, :2] - middle
    spread = (known.T * weight) @ known
    if there.sum() < 4 or np.linalg.cond(spread) > _MOST_CONDITION:
        return np.full((len(points), 3), np.nan)
    affine = np.linalg.solve(spread, (known.T * weight) @ image).T  # (2, 3) [px/cm]
    u, scales, v = np.linalg.svd(affine, full_matrices=False)
    axes = scales.mean() * u @ v
    placed = np.where(there[:, np.newaxis], points[:, :2], middle + shape @ axes.T)
    # the face looks along its third axis, towards the camera
    return np.column_stack([placed, shape @ np.cross(*axes) / scales.mean()])
