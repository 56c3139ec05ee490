"""Tables of keypoints with known joints."""
import numpy as np

from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import MEASURED, MISSING


def known_table(stamps, ids, joints, names=COCO_18.joints, confidence=1.0):
    """Return a table of R rows: joints (R, J, D) of these names are MEASURED, sigma 2 cm; NaN and others are MISSING.

    Args:
        stamps, ids: (R,) [ns], and numbers of people.
    """
    positions = np.full((len(joints), len(MESSAGE_JOINTS), np.shape(joints)[2]), np.nan, np.float32)
    positions[:, [MESSAGE_JOINTS.index(name) for name in names]] = joints
    known = np.isfinite(positions).all(axis=2)
    return KeypointTable(np.asarray(stamps), np.full(len(joints), 'camera'), np.asarray(ids), positions,
                         known * confidence, np.where(known, MEASURED, MISSING), np.where(known, 0.02, np.nan))
