"""The figures of validation studies of depth cameras: errors of trajectories by body region and axis, and joint angles.

The form is that of Bertram et al., PLoS ONE 18 (2023) e0279697 (Azure Kinect: RMSE 20-89 mm by region, axis and task),
and, for angles, of Ma et al., APSIPA 2020 (two Azure Kinects in gait: knee 11.9, hip 15.1 degrees).
"""
from typing import Any, Dict, Iterator, Tuple

import numpy as np
import pandas as pd

from openpose_ros_tools.mocap.evaluation import Comparison
from openpose_ros_tools.mocap.figures import Figures, number_or_none
from openpose_ros_tools.motion.angles import between
from openpose_ros_tools.tables.keypoint_selection import upright_axis
from skeleton_extract_3d.people import MEASURED

# Regions in which Bertram et al. compare landmarks, by the ends of the joints' names.
REGIONS = {'head': ('nose', 'eye', 'ear', 'head_top'), 'trunk': ('neck', 'chest', 'shoulder', 'hip'),
           'elbows and wrists': ('elbow', 'wrist'), 'knees': ('knee',), 'ankles and feet': ('ankle', 'toe', 'heel')}
AXES = ('medio-lateral', 'vertical', 'antero-posterior')
# Angles between the two segments that meet in the second joint, 180 degrees where they are in line (the included angle
# of Winter, Biomechanics and Motor Control of Human Movement, 2009); flexion is 180 degrees less it.
ANGLES = {'knee': ('hip', 'knee', 'ankle'), 'hip': ('shoulder', 'hip', 'knee'),
          'elbow': ('shoulder', 'elbow', 'wrist'), 'shoulder': ('hip', 'shoulder', 'elbow')}
# A correlation of fewer samples tells nothing.
_LEAST_SAMPLES = 10
# Sine of the angle from the vertical below which the camera's view has no horizontal direction.
_LEVEL = 0.1


def anatomical_axes(comparison: Comparison, rotation: np.ndarray) -> np.ndarray:
    """Return the unit vectors of `AXES` in the frame of the reference, (3, 3), one per row.

    They are anatomical for people who face the camera: vertical is the axis of the reference that is nearest to the
    people's trunks, antero-posterior the horizontal direction of the camera's view, medio-lateral across it, to the
    right in the image.

    Args:
        rotation: (3, 3) from the camera's optical frame to the reference's.
    """
    axis, sign = upright_axis(comparison.joints, comparison.truth) or (int(np.argmax(np.abs(rotation[:, 1]))), 0)
    up = np.eye(3)[axis] * (sign or -np.sign(rotation[axis, 1]))
    away = rotation[:, 2] - (rotation[:, 2] @ up) * up
    if np.linalg.norm(away) < _LEVEL:  # the camera looks straight up or down
        away = -rotation[:, 1] + (rotation[:, 1] @ up) * up
    away /= np.linalg.norm(away)
    return np.stack([np.cross(away, up), up, away])


def trajectories(comparison: Comparison, axes: np.ndarray, measured: bool = False) -> pd.DataFrame:
    """Return a row for each subject, joint and axis [m], and for each angle [deg].

    Columns: part (region, or angle), axis (of `AXES`, or angle), samples, square (mean square of the error), variance
    (of the error about its mean), r (Pearson's, NaN of few samples), motion (standard deviation of the reference).

    Args:
        axes: (3, 3) unit vectors of `AXES` in the frame of the reference, one per row.
        measured: leave out joints that are inferred.
    """
    used = comparison.status == MEASURED if measured else np.ones(comparison.status.shape, bool)
    ours = np.where(used[..., None], comparison.estimate, np.nan) @ axes.T
    rows = []
    for part, axis, estimate, truth in _series(comparison.joints, ours, comparison.truth @ axes.T):
        both = np.isfinite(estimate) & np.isfinite(truth)
        for subject in np.unique(comparison.subject[both]):
            a, b = (values[both & (comparison.subject == subject)] for values in (estimate, truth))
            spread = a.std() * b.std() if len(a) >= _LEAST_SAMPLES else 0.0
            rows.append((part, axis, len(a), np.mean((a - b) ** 2), np.var(a - b),
                         np.mean((a - a.mean()) * (b - b.mean())) / spread if spread > 0 else np.nan, b.std()))
    return pd.DataFrame(rows, columns=['part', 'axis', 'samples', 'square', 'variance', 'r', 'motion'])


def study(comparison: Comparison, rotation: np.ndarray) -> Dict[str, Any]:
    """Return the figures of all answered joints and of the measured ones alone, as `study_figures`."""
    axes = anatomical_axes(comparison, rotation)
    return {'axes': {name: np.round(axis, 4).tolist() for name, axis in zip(AXES, axes)},
            'answered': study_figures(trajectories(comparison, axes)),
            'measured': study_figures(trajectories(comparison, axes, measured=True))}


def study_figures(table: pd.DataFrame) -> Dict[str, Dict[str, Figures]]:
    """Return the figures of `trajectories` by part and axis, ready for JSON: [mm], of angles [deg].

    Root mean squares are over all samples; r and motion are means over the trajectories.
    """
    figures: Dict[str, Dict[str, Figures]] = {}
    for (part, axis), rows in table.groupby(['part', 'axis'], sort=False):
        scale = 1e3 if part in REGIONS else 1.0
        square, variance = (np.average(rows[name], weights=rows.samples) for name in ('square', 'variance'))
        figures.setdefault(part, {})[axis] = {
            'samples': int(rows.samples.sum()), 'rmse': number_or_none(scale * np.sqrt(square)),
            'rmse_without_offset': number_or_none(scale * np.sqrt(variance)),
            'r': number_or_none(rows.r.mean()), 'motion': number_or_none(scale * rows.motion.mean())}
    return {part: figures[part] for part in (*REGIONS, *ANGLES) if part in figures}


def _series(joints: Tuple[str, ...], ours: np.ndarray, theirs: np.ndarray
            ) -> Iterator[Tuple[str, str, np.ndarray, np.ndarray]]:
    """Yield part, axis, and the values (N,) of both, for each joint and axis and for each angle."""
    for number, joint in enumerate(joints):
        region = next(name for name, ends in REGIONS.items() if joint.endswith(ends))
        for column, axis in enumerate(AXES):
            yield region, axis, ours[:, number, column], theirs[:, number, column]
    for angle, ends in ANGLES.items():
        for side in ('left', 'right'):
            names = [f'{side}_{end}' for end in ends]
            if set(names) <= set(joints):
                first, middle, last = (joints.index(name) for name in names)
                estimate, truth = (between(points[:, first] - points[:, middle], points[:, last] - points[:, middle])
                                   for points in (ours, theirs))
                yield angle, 'angle', estimate, truth
