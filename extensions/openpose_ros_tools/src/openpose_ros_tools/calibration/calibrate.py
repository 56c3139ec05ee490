"""The poses of cameras by the people that they see: the order of all steps.

1. Two cameras that see the same people have an edge (`edges`, `image_edges`); the best edges make a tree. Where no
   camera has depth, it grows from the best edge by the people that are placed so far.
2. By these poses, people of all cameras are matched at single times (`gathering`); cameras, clocks and joints are
   adjusted together (`bundle`), some rounds.
3. Without depth, people or a distance tell the scale; ankles tell the floor (`floor`).
"""
import itertools
from dataclasses import dataclass, replace
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.rig import Rig, rig_camera
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.calibration.bundle import Adjusted, adjust
from openpose_ros_tools.calibration.edges import CameraPose, Edge, align_in_space, spanning_tree
from openpose_ros_tools.calibration.floor import Floor, find_floor, room_frame
from openpose_ros_tools.calibration.gathering import gather
from openpose_ros_tools.calibration.image_edges import relate_images, resect
from openpose_ros_tools.calibration.quality import EdgeQuality, check_connected, check_spread, doubts, edge_qualities
from openpose_ros_tools.calibration.recording import CameraPaths, CameraRecording, paths_of
from skeleton_extract_3d.body.body import BODY, BodyConstants

# Adjustments at most, each with people gathered anew, and by what cameras and clocks change in the last one [m, s].
_ROUNDS, _SETTLED = 6, 0.0005
# Factor of the gates in the first round, as edges err; it halves in each further one.
_WIDE = 4.0
_ROOT = CameraPose((np.eye(3), np.zeros(3)), 0.0)
# Edges of two images that are tried as the first one.
_FIRST_EDGES = 3
# Standard deviation of the stature of an adult, as a share (McDowell et al., Anthropometric reference data, 2008:
# 0.07 m among women and among men, 0.14 m between them).
_STATURE_ERROR = 0.06


@dataclass(frozen=True)
class CalibrationParams:
    """What is given.

    Attributes:
        fixed_frame: name of the frame of the room.
        clocks_agree: the stamps of all cameras are of one clock, so no offsets are searched for.
        stature: mean stature of the people [m]; counts where no camera has depth.
        distance: names of two cameras and their distance [m]; counts where no camera has depth, instead of the stature.
    """

    fixed_frame: str = 'world'
    clocks_agree: bool = False
    stature: float = BODY.adult_stature
    distance: Optional[Tuple[str, str, float]] = None


class Calibrated(NamedTuple):
    """The result.

    Attributes:
        rig: the cameras in the frame of the room: z up, origin on the floor below the first one, which looks along x.
        std: (C, 3) standard deviations of each camera to the first: angle [degrees], position [m], clock [s].
        edges: pairs of cameras that see joints together.
        floor: None where it was not found: then the frame of the room is that of the first camera.
        people: (N, 18, 3) [m] in the room, each at one time; NaN where not known.
        warnings: what makes the result doubtful.
    """

    rig: Rig
    std: np.ndarray
    edges: List[EdgeQuality]
    floor: Optional[Floor]
    people: np.ndarray
    warnings: List[str]


def calibrate(recordings: Sequence[CameraRecording], params: Optional[CalibrationParams] = None,
              progress: Callable[[Iterable], Iterable] = iter) -> Calibrated:
    """Return the poses of cameras in the room.

    Args:
        recordings: of two cameras or more; joints are those of COCO_18.
        progress: wraps the pairs of cameras.

    Raises:
        BadInputError: the people do not tell it; the text says what lacks.
    """
    params = params or CalibrationParams()
    cameras = paths_of(list(recordings))
    names = [camera.name for camera in cameras]
    has_depth = np.array([camera.has_depth for camera in cameras])
    if params.distance is not None:
        for name in params.distance[:2]:
            if name not in names:
                raise BadInputError(f"there is no camera '{name}', but {', '.join(names)}")
        if has_depth.any():
            raise BadInputError('the distance of two cameras is for rigs without depth; here depth tells the scale')
    poses = _first_poses(cameras, params, progress)
    for number in range(_ROUNDS):
        wide = max(_WIDE / 2 ** number, 1.0)
        adjusted = adjust(gather(cameras, poses, wide), poses, has_depth, params.clocks_agree)
        change = max(max(float(np.abs(new.pose[1] - old.pose[1]).max()), abs(new.clock_offset - old.clock_offset))
                     for new, old in zip(adjusted.poses, poses))
        poses = adjusted.poses
        if wide == 1 and change < _SETTLED:
            break
        if wide > 1 and not has_depth.any():  # the errors of keypoints are lengths
            factor = _scale_of_bones(adjusted.gathered.people(adjusted.joints), params.stature)
            poses = [one.seen_from(poses[0], factor) for one in poses]
    check_connected(names, adjusted.gathered)
    people, std = adjusted.gathered.people(adjusted.joints), adjusted.std
    if not has_depth.any():
        if params.distance is None:
            factor = _scale_of_bones(people, params.stature)
            error = _STATURE_ERROR / np.sqrt(max(len(camera.positions) for camera in cameras))  # people at one time
        else:
            first, second = (poses[names.index(name)].pose[1] for name in params.distance[:2])
            factor, error = float(params.distance[2] / np.linalg.norm(second - first)), 0.0
        people = factor * people
        poses = [one.seen_from(poses[0], factor) for one in poses]
        away = np.linalg.norm([one.pose[1] for one in poses], axis=1)
        std = np.stack([std[:, 0], np.hypot(factor * std[:, 1], error * away), std[:, 2]], axis=1)
    check_spread(people)
    warnings, floor = doubts(names, std), None
    rotation, shift = np.eye(3), np.zeros(3)
    try:
        floor = find_floor(people)
        rotation, shift = room_frame(floor)
    except BadInputError as error:
        warnings.append(f'{error}; {params.fixed_frame} is the optical frame of {names[0]}, z is not up')
    placed = tuple(rig_camera(camera.name, camera.recording.frame_id,
                              (rotation @ one.pose[0], rotation @ one.pose[1] + shift), one.clock_offset)
                   for camera, one in zip(cameras, poses))
    return Calibrated(Rig(params.fixed_frame, placed), std, edge_qualities(cameras, adjusted), floor,
                      people @ rotation.T + shift, warnings)


def _first_poses(cameras: Sequence[CameraPaths], params: CalibrationParams, progress: Callable[[Iterable], Iterable]
                 ) -> List[CameraPose]:
    """Return the poses of the cameras by the best edges; those of two cameras without depth only fill gaps."""
    pairs = list(itertools.combinations(range(len(cameras)), 2))
    images = [pair for pair in pairs if not any(cameras[camera].has_depth for camera in pair)]
    edges: List[Edge] = []
    reasons: Dict[Tuple[int, int], str] = {}
    for some in ([pair for pair in pairs if pair not in images], images):
        for first, second in progress(some):
            try:
                edges.append(_edge(cameras, (first, second), params))
            except BadInputError as error:
                reasons[first, second] = str(error)
        try:
            tree = spanning_tree([camera.name for camera in cameras], edges, reasons)
            has_depth = any(camera.has_depth for camera in cameras)
            return tree if has_depth else _grown(cameras, edges, params) or tree
        except BadInputError:
            if some is images:
                raise
    raise AssertionError


def _grown(cameras: Sequence[CameraPaths], edges: Sequence[Edge], params: CalibrationParams
           ) -> Optional[List[CameraPose]]:
    """Return the poses of cameras without depth, each by the people that those before have placed; None: not of all.

    Two images of people who hardly move relate cameras badly, so each of the best edges is tried as the first one.
    """
    best, found = -1.0, None
    for edge in sorted(edges, key=lambda one: one.cost)[:_FIRST_EDGES]:
        placed = {edge.first: _ROOT, edge.second: edge.second_pose}
        nexts: List[Edge] = [edge]
        while nexts:
            chosen = sorted(placed)
            poses = [placed[camera] for camera in chosen]
            adjusted = adjust(gather([cameras[camera] for camera in chosen], poses, _WIDE), poses,
                              np.zeros(len(chosen), bool), params.clocks_agree)
            placed = dict(zip(chosen, adjusted.poses))
            resected = (_resected(cameras, one, adjusted, params) for one in range(len(cameras)) if one not in placed)
            nexts = sorted((each for each in resected if each is not None), key=lambda one: one.cost)[:1]
            placed.update((each.second, each.second_pose) for each in nexts)
        if len(placed) == len(cameras) and adjusted.merit > best:
            best, found = adjusted.merit, [one.seen_from(placed[0]) for _, one in sorted(placed.items())]
    return found


def _resected(cameras: Sequence[CameraPaths], camera: int, adjusted: Adjusted, params: CalibrationParams
              ) -> Optional[Edge]:
    """Return the edge from the adjusted people to one more camera; None where it sees others."""
    data = adjusted.gathered
    people = data.people(adjusted.joints)
    times = np.zeros(len(people))
    times[data.person] = data.times
    order = np.argsort(times, kind='stable')
    stamps = np.round(1e9 * times[order]).astype(np.int64)
    ids = np.arange(len(stamps)) - np.searchsorted(stamps, stamps)  # people of one time, in any order
    try:
        paths = CameraPaths(CameraRecording('people', '', stamps, ids, people[order], np.full(people.shape[:2], np.nan),
                                            True), 0)
        return Edge(-1, camera, *resect(paths, cameras[camera], 0.0 if params.clocks_agree else None))
    except BadInputError:
        return None


def _edge(cameras: Sequence[CameraPaths], pair: Tuple[int, int], params: CalibrationParams) -> Edge:
    """Return the relative pose of two cameras; one with depth is the first."""
    first, second = sorted(pair, key=lambda camera: not cameras[camera].has_depth)
    one, other = cameras[first], cameras[second]
    find = relate_images if not one.has_depth else align_in_space if other.has_depth else resect
    edge = Edge(first, second, *find(one, other, 0.0 if params.clocks_agree else None))
    if one.has_depth:
        return edge
    gathered = gather([one, other], [_ROOT, edge.second_pose])
    rotation, shift = edge.transform
    factor = _scale_of_bones(gathered.people(gathered.joints), params.stature)
    return replace(edge, transform=(rotation, factor * shift))


def _scale_of_bones(people: np.ndarray, stature: float, constants: BodyConstants = BODY) -> float:
    """Return by which factor people (N, 18, 3) must grow so that their bones are those of a mean stature [m]."""
    found = expected = 0.0
    for start, end, length in constants.sized_bones:
        bone = np.linalg.norm(people[:, COCO_18.index[start]] - people[:, COCO_18.index[end]], axis=1)
        if np.isfinite(bone).any():
            found += float(np.median(bone[np.isfinite(bone)]))
            expected += length * stature / constants.adult_stature
    if not found:
        raise BadInputError('no bones are seen, so that the scale can not be found; give the distance of two cameras')
    return expected / found
