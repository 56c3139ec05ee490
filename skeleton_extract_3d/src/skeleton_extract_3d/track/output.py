"""Output: the people of a frame."""
import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.constants import CorrectionConstants
from skeleton_extract_3d.track.tracks import Observations, Tracks


def report(people: Observations, completion: Completion, hidden: Tracks, stamp: float, settings: EstimatorSettings,
           constants: CorrectionConstants = METHOD.track.correction) -> People3D:
    """Return the people of a frame with the joints of COCO_18, in the frame of the points, and then hidden tracks."""
    tracks, lifted, trusted = completion.tracks, people.lifted, completion.trusted
    read = lifted.measured & trusted
    position = tracks.joints.position
    if settings.smoothing.smoothing and settings.occlusion.occlusion:
        # where the filter does not follow the surface, its position is not a measured one
        read &= ((position - lifted.xyz) ** 2).sum(axis=2) < constants.measured_reach ** 2
    if not settings.smoothing.smoothing:
        position = np.where(trusted[..., None], lifted.xyz, position)
    recent = stamp - hidden.seen <= settings.occlusion.inference_timeout
    status = _joined(np.where(completion.placed, np.where(read, MEASURED, INFERRED), MISSING),
                     np.where(hidden.has & recent, INFERRED, MISSING))
    known = status != MISSING
    scores, velocity = people.observed.scores, _joined(tracks.joints.velocity, hidden.joints.velocity)
    return People3D(
        COCO_18, np.where(known[..., None], _joined(position, hidden.joints.position), np.nan),
        _joined(scores, np.zeros((len(hidden), scores.shape[1]))), status,
        np.where(known, _joined(completion.sigma, hidden.joints.sigmas()), np.nan), _joined(tracks.ids, hidden.ids),
        np.where(known[..., None] & settings.identity.tracking, velocity, np.nan),
        _joined(tracks.existence, hidden.existence))


def _joined(seen: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    return np.concatenate([seen, hidden]) if len(hidden) else seen
