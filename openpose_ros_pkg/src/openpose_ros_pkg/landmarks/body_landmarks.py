"""Landmarks of whole bodies by MediaPipe's BlazePose: 33 points in the image, with heels and toes, and in space.

The network sees a person of known joints in a rotated square round the middle of the hips, so that the shoulders are
above these. mediapipe/modules/pose_landmark of the project: pose_landmark_by_roi_cpu.pbtxt,
tensors_to_pose_landmarks_and_segmentation.pbtxt, pose_landmarks_to_roi.pbtxt.
"""
from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Sequence

import numpy as np

from openpose_ros_pkg.detect.occlusion_masks import bodies_of_others, in_mean_colour
from openpose_ros_pkg.landmarks.regions import Region, upward_angle
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.model_registry import POSE_LANDMARK
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, SkeletonModel

_POINTS = len(BLAZEPOSE_33.joints)
# Points that the network gives, and numbers of each: x, y, z [px of the input], logits of visibility and presence.
_GIVEN, _NUMBERS = 39, 5
BODY_CROP = 256, 256  # width and height of its input [px]


@dataclass(frozen=True)
class BodyLandmarkConstants:
    """Where the network looks, and which results count."""

    reach: float = constant(1.14, 'Radius of the circle of a whole body per distance of the joint that is the farthest '
                                  'from the middle of the hips.')
    side: float = constant(2.5, 'Side of the region per radius of that circle.', source='pose_landmarks_to_roi.pbtxt')
    least_side: float = constant(16.0, 'Side of a region; below, there is nothing to see.', unit='px')
    score: float = constant(0.5, 'Score of a person from which on the landmarks count.',
                            source='tensors_to_pose_landmarks_and_segmentation.pbtxt')
    kernel: int = constant(7, 'Side of the window of a heat map in which a point is refined.', unit='cells',
                           source='tensors_to_pose_landmarks_and_segmentation.pbtxt')
    refined: float = constant(0.5, 'Greatest confidence in that window from which on it is.',
                              source='refine_landmarks_from_heatmap_calculator.proto')


BODY_LANDMARK_CONSTANTS = BodyLandmarkConstants()


@dataclass(frozen=True, eq=False)
class BodyLandmarks:
    """The landmarks of a person, in the order of `skeletons.BLAZEPOSE_33`."""

    points: np.ndarray  # (33, 2) float64 [px of the image]
    visibility: np.ndarray  # (33,) float64 [0..1]: in the region, and hidden by nothing
    score: float  # of the person [0..1]
    # (33, 3) float64 [m] from the middle of the hips, axes as those of the image: x right, y down, z away from the
    # camera
    world: np.ndarray


class BodyLandmarkNetwork:
    """A loaded network for landmarks of bodies; see `create_body_landmarks`. Not thread-safe."""

    def __init__(self, network: Backend, constants: BodyLandmarkConstants = BODY_LANDMARK_CONSTANTS) -> None:
        self._network, self._constants = network, constants

    def observe(self, bgr: np.ndarray, keypoints: np.ndarray, skeleton: SkeletonModel,
                chosen: Optional[Sequence[int]] = None) -> List[Optional[BodyLandmarks]]:
        """Return the landmarks of N people, all computed side by side; None: without hips and shoulders, or not seen.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.
            keypoints: (P, K, 3) float: x, y [px of the image], score of the joints of a skeleton; NaN where missing.
            chosen: of which people, the others are covered in their crops; None: of all.
        """
        numbers = range(len(keypoints)) if chosen is None else chosen
        regions = {i: region for i in numbers
                   if (region := region_of_body(keypoints[i], skeleton, self._constants)) is not None}
        crops = [_crop(bgr, region, i, keypoints, skeleton) for i, region in regions.items()]
        outputs = self._network.infer_many([crop[np.newaxis] for crop in crops])
        found = {i: decoded(output, region, self._constants) for (i, region), output in zip(regions.items(), outputs)}
        return [one if (one := found.get(i)) and one.score >= self._constants.score else None for i in numbers]


def create_body_landmarks(backend: BackendParams, model_folder: str = '') -> BodyLandmarkNetwork:
    """Return the network, loaded from a model folder; an empty one is the default.

    Raises:
        MissingWeightsError: it was not fetched.
        ModelError, ParameterError: it can not be computed.
    """
    weights = weights_path(POSE_LANDMARK, model_folder)
    return BodyLandmarkNetwork(create_backend(POSE_LANDMARK, weights, exact(backend)))


def exact(backend: BackendParams) -> BackendParams:
    """Return f32: with bf16 places in space move by 95 mm, and points in the image by 3 px of the input."""
    return replace(backend, precision='f32')


def region_of_body(pose: np.ndarray, skeleton: SkeletonModel,
                   constants: BodyLandmarkConstants = BODY_LANDMARK_CONSTANTS) -> Optional[Region]:
    """Return the region of a body with joints, (K, 3); None: without hip or shoulder, or too small."""
    joints: Dict[str, np.ndarray] = {name: pose[k, :2].astype(np.float64) for name, k in skeleton.index.items()
                                     if np.isfinite(pose[k]).all() and pose[k, 2] > 0}
    hips, shoulders = (_middle(joints, part) for part in ('hip', 'shoulder'))
    if hips is None or shoulders is None:
        return None
    radius = constants.reach * max(float(np.linalg.norm(xy - hips)) for xy in joints.values())
    if constants.side * radius < constants.least_side:
        return None
    return Region(float(hips[0]), float(hips[1]), constants.side * radius, upward_angle(shoulders - hips))


def _crop(bgr: np.ndarray, region: Region, number: int, people: np.ndarray, skeleton: SkeletonModel) -> np.ndarray:
    """Return the input of the network for one of the people, (P, K, 3), with the others covered."""
    side, crop = BODY_CROP[0], region.crop(bgr, BODY_CROP[0])
    seen = np.concatenate([region.to_crop(people[..., :2], side), people[..., 2:]], axis=2)
    covered = bodies_of_others(seen[number], np.delete(seen, number, axis=0), skeleton, (side, side))
    return in_mean_colour(crop, covered) if covered.any() else crop


def decoded(output: Sequence[np.ndarray], region: Region, constants: BodyLandmarkConstants = BODY_LANDMARK_CONSTANTS
            ) -> BodyLandmarks:
    """Return the landmarks of the outputs for a crop of a region: points, score, heat maps, and places in space."""
    side = BODY_CROP[0]
    points, score, maps = output[0].reshape(_GIVEN, _NUMBERS)[:_POINTS].astype(np.float64), output[1], output[2][0]
    visibility = _logistic(points[:, 3])
    xy = refined(points[:, :2] / side, maps[..., :_POINTS], constants) * side
    world = output[3].reshape(_GIVEN, 3)[:_POINTS].astype(np.float64)
    world[:, :2] = world[:, :2] @ region.axes
    return BodyLandmarks(region.to_image(xy - 0.5, side), visibility, float(score.reshape(())), world)


def refined(xy: np.ndarray, maps: np.ndarray, constants: BodyLandmarkConstants = BODY_LANDMARK_CONSTANTS) -> np.ndarray:
    """Return points, (N, 2) as shares of the input's side, at the mean of their heat maps near them.

    MediaPipe's RefineLandmarksFromHeatmapCalculator; points beyond the input, or without confidence, stay.

    Args:
        maps: (height, width, N) logits.
    """
    size, half, result = np.array(maps.shape[1::-1]), (constants.kernel - 1) // 2, xy.copy()
    for k, (column, row) in enumerate((xy * size).astype(np.int64)):
        if not ((xy[k] >= 0) & (xy[k] < 1)).all():
            continue
        top, left = max(row - half, 0), max(column - half, 0)
        window = _logistic(maps[top:row + half + 1, left:column + half + 1, k].astype(np.float64))
        if window.max() >= constants.refined:
            rows, columns = np.indices(window.shape)
            result[k] = np.array([((columns + left) * window).sum(), ((rows + top) * window).sum()]) / (
                window.sum() * size)
    return result


def _logistic(logits: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-logits))


def _middle(joints: Dict[str, np.ndarray], part: str) -> Optional[np.ndarray]:
    """Return the middle of a left and a right joint, or the one that is there; None: neither is."""
    there = [joints[name] for name in (f'left_{part}', f'right_{part}') if name in joints]
    return np.mean(there, axis=0) if there else None
