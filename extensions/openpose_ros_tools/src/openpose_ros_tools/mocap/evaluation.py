"""Errors of people against aligned motion capture: the subject of each track, and the distances of its joints."""
from dataclasses import dataclass
from typing import Any, Dict, Tuple

import numpy as np
import pandas as pd

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.alignment.clock import MAX_GAP, SAME_TIME, JointPaths
from openpose_ros_tools.alignment.people import pair_people
from openpose_ros_tools.mocap.joints import JointRecording
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import MISSING

# Largest median distance of a person's joints from those of its subject [m].
_GATE = 0.5


@dataclass(frozen=True)
class Comparison:
    """Subjects of the reference and the estimate of each; N rows, one per subject and frame.

    All positions are in the frame of the reference [m], NaN where missing.
    """

    joints: Tuple[str, ...]  # names of the K joints
    subjects: Tuple[str, ...]  # names of the S subjects
    times: np.ndarray  # (N,) [s] since the first frame of the estimate
    subject: np.ndarray  # (N,) number of the subject
    found: np.ndarray  # (N,) bool, whether the estimate has the subject. The next four are missing where it has not.
    track: np.ndarray  # (N,) track id, -1 where missing
    estimate: np.ndarray  # (N, K, 3)
    status: np.ndarray  # (N, K) uint8 of the estimate
    sigma: np.ndarray  # (N, K) [m]
    truth: np.ndarray  # (N, K, 3)
    compared: Dict[str, Any]  # numbers of frames and people, and joints, by their names in summary.json

    @property
    def errors(self) -> np.ndarray:
        """Distances (N, K) of the estimate from the reference [m], NaN where one of both is missing."""
        return np.linalg.norm(self.estimate - self.truth, axis=2)

    def table(self) -> pd.DataFrame:
        """Return one row per subject, frame and joint that the reference has [s, m].

        Columns: time, subject (category), person_ID, joint (category), found, status, error (NaN where the estimate
        has no answer), sigma, and x, y, z of the estimate and of the reference.
        """
        row, joint = np.nonzero(np.isfinite(self.truth).all(axis=2))
        values = {'time': self.times[row], 'subject': pd.Categorical.from_codes(self.subject[row], self.subjects),
                  'person_ID': self.track[row], 'joint': pd.Categorical.from_codes(joint, self.joints),
                  'found': self.found[row], 'status': self.status[row, joint], 'error': self.errors[row, joint],
                  'sigma': self.sigma[row, joint]}
        for name, positions in (('', self.estimate), ('_reference', self.truth)):
            values.update({f'{axis}{name}': positions[row, joint, number] for number, axis in enumerate('xyz')})
        return pd.DataFrame(values)


def compare(estimate: KeypointTable, reference: JointRecording, alignment: Alignment) -> Comparison:
    """Pair people and subjects in each frame by the least sum of distances, and return the joints of both.

    Raises:
        BadInputError: the recordings have no joint or no time in common, or no person is near a subject.
    """
    theirs = np.isfinite(reference.positions).all(axis=3).any(axis=(0, 1))
    ours = np.isfinite(estimate.positions).all(axis=2).any(axis=0)
    joints = np.flatnonzero(ours & theirs)
    if not len(joints):
        raise BadInputError('estimate and reference have no joint in common')
    begin = estimate.stamps.min()
    stamps, frame_of = np.unique((estimate.stamps - begin) * 1e-9, return_inverse=True)
    paths = JointPaths(reference.times - reference.times[0], reference.positions[:, :, joints], MAX_GAP)
    lag = alignment.clock_offset - (reference.times[0] - begin * 1e-9)
    inside = (stamps + lag > -SAME_TIME) & (stamps + lag < paths.times[-1] + SAME_TIME)
    if not inside.any():
        raise BadInputError('estimate and reference have no time in common with this clock offset')
    truth, positions = paths.at(stamps + lag), alignment.apply(estimate.positions[:, joints])
    frame, row, subject = _matches(np.flatnonzero(inside), frame_of, positions, truth)
    found = row >= 0
    if not found.any():
        raise BadInputError(f'no person of the estimate is within {_GATE:g} m of a subject of the reference')
    positions = np.where(found[:, None, None], positions[row], np.nan)
    steps, names, truth = np.diff(stamps[inside]), np.array(MESSAGE_JOINTS), truth[subject, frame]
    # frames without people do not count: a table of people does not tell them from dropped frames
    empty = int(np.maximum(np.rint(steps / np.median(steps)) - 1, 0).sum()) if len(steps) else 0
    tracks = pd.Series(estimate.ids[row][found]).groupby(subject[found])
    return Comparison(
        joints=tuple(names[joints].tolist()), subjects=tuple(reference.subjects), times=stamps[frame], subject=subject,
        found=found, track=np.where(found, estimate.ids[row], -1), estimate=positions, truth=truth,
        status=np.where(np.isfinite(positions).all(axis=2), estimate.status[row][:, joints], MISSING),
        sigma=np.where(found[:, None], estimate.sigma[row][:, joints], np.nan).astype(np.float64),
        compared={
            'frames': int(inside.sum()), 'frames_outside_reference': int((~inside).sum()),
            'frames_without_people_or_dropped': empty, 'people_found': int(found.sum()),
            'people_missed': int((~found).sum()), 'share_found': round(float(found.mean()), 5),
            'people_without_reference': int(inside[frame_of].sum() - found.sum()),
            'id_switches': sum(int((np.diff(ids) != 0).sum()) for _, ids in tracks),
            'joint_samples': int(np.isfinite(positions - truth).all(axis=2).sum()), 'joints': names[joints].tolist(),
            'joints_only_in_reference': names[theirs & ~ours].tolist(),
            'joints_only_in_estimate': names[ours & ~theirs].tolist()})


def _matches(frames: np.ndarray, frame_of: np.ndarray, positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return frame, row of the estimate (-1: not found) and number of each subject that is there, (3, N)."""
    rows_of, matches = pd.Series(frame_of).groupby(frame_of).indices, []
    for frame in frames.tolist():
        rows = rows_of[frame]
        subjects = np.flatnonzero(np.isfinite(truth[:, frame]).all(axis=2).any(axis=1))
        found: Dict[int, int] = {subject: int(rows[person]) for person, subject
                                 in pair_people(positions[rows], truth[subjects, frame], _GATE)}
        matches += sorted((frame, found.get(number, -1), subject) for number, subject in enumerate(subjects.tolist()))
    return np.array(matches, int).reshape(-1, 3).T
