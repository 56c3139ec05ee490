"""The poses of cameras by the people that they see: the order of all steps.

1. Two cameras that see the same people have an edge (`edges`, `image_edges`); the best edges make a tree.
2. By these poses, people of all cameras are matched at single times (`gathering`); cameras, clocks and joints are
   adjusted together (`bundle`), some rounds.
3. Without depth, people or a distance tell the scale; ankles tell the floor (`floor`).
"""
import itertools
from dataclasses import dataclass
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.rig import Rig, rig_camera
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.calibration.bundle import Adjusted, Given, adjust
from openpose_ros_tools.calibration.constants import CALIBRATION, CalibrationConstants, EdgeConstants
from openpose_ros_tools.calibration.edges import CameraPose, Edge, align_in_space, scaled, spanning_tree
from openpose_ros_tools.calibration.floor import Floor, find_floor, room_frame, up_of_tilt
from openpose_ros_tools.calibration.gathering import gather
from openpose_ros_tools.calibration.image_edges import relate_images, resect
from openpose_ros_tools.calibration.quality import EdgeQuality, check_connected, check_known, doubts, edge_qualities
from openpose_ros_tools.calibration.recording import CameraPaths, CameraRecording, paths_of
from skeleton_extract_3d.body.body import BODY, BodyConstants
from skeleton_extract_3d.points.transform import Transform


@dataclass(frozen=True)
class CalibrationParams:
    """What is given.

    Attributes:
        fixed_frame: name of the frame of the room.
        clocks_agree: the stamps of all cameras are of one clock, so no offsets are searched for.
        stature: mean stature of the people [m]; counts where no camera has depth.
        distance: names of two cameras and their distance [m]; counts where no camera has depth, instead of the stature.
        tilt: name of a level camera, and by how much it looks down [degrees]: what is up, in place of what ankles say.
    """

    fixed_frame: str = 'world'
    clocks_agree: bool = False
    stature: float = BODY.adult_stature
    distance: Optional[Tuple[str, str, float]] = None
    tilt: Optional[Tuple[str, float]] = None


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
              progress: Callable[[Iterable], Iterable] = iter, constants: CalibrationConstants = CALIBRATION
              ) -> Calibrated:
    """Return the poses of cameras in the room.

    Args:
        recordings: of two cameras or more; joints are those of COCO_18.
        progress: wraps the pairs of cameras.

    Raises:
        BadInputError: the people do not tell it; the text says what lacks.
    """
    params = params or CalibrationParams()
    cameras = paths_of(list(recordings), constants.bundle)
    names = [camera.name for camera in cameras]
    for name in (*(params.distance or ())[:2], *(params.tilt or ())[:1]):
        if name not in names:
            raise BadInputError(f"there is no camera '{name}', but {', '.join(names)}")
    has_depth = np.array([camera.has_depth for camera in cameras])
    if params.distance is not None and has_depth.any():
        raise BadInputError('the distance of two cameras is for rigs without depth; here depth tells the scale')
    poses = _first_poses(cameras, params, progress, constants)
    for number in range(constants.bundle.rounds):
        given = Given(poses, has_depth, params.clocks_agree)
        wide = max(constants.gather.wide / 2 ** number, 1.0)
        adjusted = adjust(gather(cameras, poses, constants.gather, wide), given, constants.bundle)
        change = max(max(float(np.abs(new.pose[1] - old.pose[1]).max()), abs(new.clock_offset - old.clock_offset))
                     for new, old in zip(adjusted.poses, poses))
        poses = adjusted.poses
        if wide == 1 and change < constants.bundle.settled:
            break
    check_connected(names, adjusted.gathered, constants.edges.least_joints)
    joints, std = adjusted.joints, adjusted.std
    if not has_depth.any():
        factor, error = _scale(adjusted, cameras, params, constants)
        poses, joints = scaled(poses, factor), factor * joints
        away = [float(np.linalg.norm(one.pose[1] - poses[0].pose[1])) for one in poses]
        std = np.stack([std[:, 0], np.hypot(factor * std[:, 1], error * np.array(away)), std[:, 2]], axis=1)
    people = adjusted.gathered.people(joints)
    _check_spread(people, constants.edges)
    check_known(names, std, constants.bundle.least_known)
    (rotation, shift), floor, warnings = _room(names, poses, people, params, constants)
    placed = tuple(rig_camera(camera.name, camera.recording.frame_id,
                              (rotation @ one.pose[0], rotation @ one.pose[1] + shift), one.clock_offset)
                   for camera, one in zip(cameras, poses))
    return Calibrated(Rig(params.fixed_frame, placed), std, edge_qualities(cameras, adjusted), floor,
                      people @ rotation.T + shift, [*doubts(names, std), *warnings])


def _first_poses(cameras: Sequence[CameraPaths], params: CalibrationParams,
                 progress: Callable[[Iterable], Iterable], constants: CalibrationConstants) -> List[CameraPose]:
    """Return the poses of the cameras by the best edges.

    Two cameras without depth are related only where others leave a gap.
    """
    pairs = list(itertools.combinations(range(len(cameras)), 2))
    images = [pair for pair in pairs if not any(cameras[camera].has_depth for camera in pair)]
    edges: List[Edge] = []
    reasons: Dict[Tuple[int, int], str] = {}
    for some in ([pair for pair in pairs if pair not in images], images):
        for first, second in progress(some):
            try:
                edges.append(_edge(cameras, (first, second), params, constants))
            except BadInputError as error:
                reasons[first, second] = str(error)
        try:
            return spanning_tree([camera.name for camera in cameras], edges, reasons)
        except BadInputError:
            if some is images:
                raise
    raise AssertionError


def _edge(cameras: Sequence[CameraPaths], pair: Tuple[int, int], params: CalibrationParams,
          constants: CalibrationConstants) -> Edge:
    """Return the relative pose of two cameras; one with depth is the first."""
    first, second = sorted(pair, key=lambda camera: not cameras[camera].has_depth)
    one, other = cameras[first], cameras[second]
    given = 0.0 if params.clocks_agree else None
    for camera in (one, other):
        if camera.has_depth:
            camera.check_motion(constants.edges.least_walk)
    find = relate_images if not one.has_depth else align_in_space if other.has_depth else resect
    (rotation, shift), clock, cost = find(one, other, given, constants.edges)
    if not one.has_depth:
        there = [CameraPose((np.eye(3), np.zeros(3)), 0.0), CameraPose((rotation.T, -rotation.T @ shift), -clock)]
        gathered = gather([one, other], there, constants.gather)
        shift = _scale_of_bones(gathered.people(gathered.joints), params.stature) * shift
    return Edge(first, second, rotation, shift, clock, cost)


def _scale(adjusted: Adjusted, cameras: Sequence[CameraPaths], params: CalibrationParams,
           constants: CalibrationConstants) -> Tuple[float, float]:
    """Return by which factor a rig without depth must grow, and the standard deviation of that, as a share."""
    if params.distance is None:
        people = max(len(camera.positions) for camera in cameras)  # at one time
        return (_scale_of_bones(adjusted.gathered.people(adjusted.joints), params.stature),
                constants.bundle.stature_error / np.sqrt(people))
    first, second, distance = params.distance
    names = [camera.name for camera in cameras]
    centres = [adjusted.poses[names.index(name)].pose[1] for name in (first, second)]
    return float(distance / np.linalg.norm(centres[1] - centres[0])), 0.0


def _scale_of_bones(people: np.ndarray, stature: float, constants: BodyConstants = BODY) -> float:
    """Return by which factor people must grow so that their bones are those of bodies of a stature.

    Args:
        people: (N, 18, 3), each at one time; NaN where not known.
        stature: mean of the people [m].

    Raises:
        BadInputError: no bone of `BodyConstants.sized_bones` is visible.
    """
    found = expected = 0.0
    for start, end, length in constants.sized_bones:
        bone = np.linalg.norm(people[:, COCO_18.index[start]] - people[:, COCO_18.index[end]], axis=1)
        if np.isfinite(bone).any():
            found += float(np.median(bone[np.isfinite(bone)]))
            expected += length * stature / constants.adult_stature
    if not found:
        raise BadInputError('no bones are seen, so that the scale can not be found; give the distance of two cameras')
    return expected / found


def _check_spread(people: np.ndarray, constants: EdgeConstants) -> None:
    """Raise where people do not tell the poses of cameras: all joints in a plane, or all in one place."""
    joints = people[np.isfinite(people).all(axis=2)]
    middles = np.nanmedian(people[np.isfinite(people).any(axis=(1, 2))], axis=1)
    thickness = float(np.linalg.svd(joints - joints.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(joints)))
    extent = float(np.linalg.norm(middles - middles.mean(axis=0), axis=1).std() if len(middles) < 2 else
                   np.linalg.svd(middles - middles.mean(axis=0), compute_uv=False)[0] / np.sqrt(len(middles)))
    if thickness < constants.least_spread:
        raise BadInputError(f'all joints that cameras share lie in a plane: they spread by {1e3 * thickness:.0f} mm '
                            f'across it, expected {1e3 * constants.least_spread:.0f} or more; let people walk to and '
                            'fro')
    if extent < constants.least_walk:
        raise BadInputError(f'people stay in one place where cameras see them together: they spread by {extent:.2f} m, '
                            f'expected {constants.least_walk:g} m or more; let a person walk through the room')


def _room(names: Sequence[str], poses: Sequence[CameraPose], people: np.ndarray, params: CalibrationParams,
          constants: CalibrationConstants) -> Tuple[Transform, Optional[Floor], List[str]]:
    """Return the transform from the frame of the root to that of the room, the floor, and warnings.

    Without a floor, the room has the frame of the root.
    """
    up = None
    if params.tilt is not None:
        up = poses[names.index(params.tilt[0])].pose[0] @ up_of_tilt(params.tilt[1])
    try:
        floor = find_floor(people, up, constants)
    except BadInputError as error:
        warning = f'{error}; {params.fixed_frame} is the optical frame of {names[0]}, z is not up'
        return (np.eye(3), np.zeros(3)), None, [warning]
    return room_frame(floor), floor, []
