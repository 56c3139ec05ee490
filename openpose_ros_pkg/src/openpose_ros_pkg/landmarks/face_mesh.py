"""From the mesh of MediaPipe's face network to OpenPose's 70 points."""
import numpy as np

from openpose_ros_pkg.landmarks.records import FACE_POINTS

# Points 0-67, those of iBUG, are the means of these points of the mesh; all but the brows are one point.
_JAW = (162, 234, 93, 58, 172, 136, 149, 148, 152, 377, 378, 365, 397, 288, 323, 454, 389)
_BROWS = ((70, 63, 105, 66, 107, 336, 296, 334, 293, 300), (46, 53, 52, 65, 55, 285, 295, 282, 283, 276))
_NOSE = (168, 197, 5, 4, 75, 97, 2, 326, 305)
_EYES = (33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380)
_MOUTH = (61, 39, 37, 0, 267, 269, 291, 405, 314, 17, 84, 181, 78, 82, 13, 312, 308, 317, 14, 87)
_FIRST, _SECOND = (np.array(_JAW + brow + _NOSE + _EYES + _MOUTH) for brow in _BROWS)
# Points of the right and of the left eye, whose means are the pupils.
PUPILS = (slice(36, 42), slice(42, 48))


def face_points(mesh: np.ndarray) -> np.ndarray:
    """Return the 70 points of OpenPose, (..., 70, D), of a face mesh, (..., 468, D), or of just these points."""
    if mesh.shape[-2] == FACE_POINTS:
        return mesh
    points = (mesh[..., _FIRST, :] + mesh[..., _SECOND, :]) / 2
    pupils = [points[..., eye, :].mean(axis=-2, keepdims=True) for eye in PUPILS]
    return np.concatenate([points, *pupils], axis=-2)
