"""Where cameras stand to one another, from the people that they see: the order of all steps.

1. Two cameras that see the same people have an edge (`edges`, `image_edges`); the best edges make a tree.
2. By where the cameras stand, it is known who is who at single times (`gathering`); cameras, clocks and joints are
   adjusted together (`bundle`), some rounds.
3. Without depth, people or a distance tell the scale (`scale`); ankles tell the floor (`floor`).
"""
import itertools
from dataclasses import dataclass
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.rig import Rig, rig_camera
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.calibration.bundle import Adjusted, adjust
from openpose_ros_tools.calibration.constants import CALIBRATION
from openpose_ros_tools.calibration.edges import Edge, Standing, align_in_space, check_motion, spanning_tree
from openpose_ros_tools.calibration.floor import Floor, find_floor, room_frame, up_of_tilt
from openpose_ros_tools.calibration.gathering import gather
from openpose_ros_tools.calibration.image_edges import relate_images, resect
from openpose_ros_tools.calibration.quality import EdgeQuality, doubts, edge_qualities
from openpose_ros_tools.calibration.recording import CameraPaths, CameraRecording, paths_of
from openpose_ros_tools.calibration.scale import scale_of_bones, scaled
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.points.transform import Transform

# Camera whose frame and clock count: the first one.
_ROOT = 0


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
    stature: float = METHOD.body.adult_stature
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
              progress: Callable[[Iterable], Iterable] = iter) -> Calibrated:
    """Return where the cameras stand.

    Args:
        recordings: of two cameras or more; joints are those of COCO_18.
        progress: wraps the pairs of cameras.

    Raises:
        BadInputError: the people do not tell it; the text says what lacks.
    """
    params = params or CalibrationParams()
    cameras = paths_of(list(recordings))
    names = [camera.name for camera in cameras]
    for name in (*(params.distance or ())[:2], *(params.tilt or ())[:1]):
        if name not in names:
            raise BadInputError(f"there is no camera '{name}', but {', '.join(names)}")
    has_depth = np.array([camera.has_depth for camera in cameras])
    if params.distance is not None and has_depth.any():
        raise BadInputError('the distance of two cameras is for rigs without depth; here depth tells the scale')
    standing = _first_standing(cameras, params, progress)
    for _ in range(CALIBRATION.bundle.rounds):
        adjusted = adjust(gather(cameras, standing), standing, _ROOT, has_depth, params.clocks_agree)
        change = max(max(float(np.abs(new.pose[1] - old.pose[1]).max()), abs(new.clock_offset - old.clock_offset))
                     for new, old in zip(adjusted.standing, standing))
        standing = adjusted.standing
        if change < CALIBRATION.bundle.settled:
            break
    joints = adjusted.joints
    if not has_depth.any():
        factor = _scale(adjusted, names, params)
        standing, joints = scaled(standing, factor, _ROOT), factor * joints
    people = adjusted.gathered.people(joints)
    _check_spread(people)
    return _in_the_room(cameras, standing, adjusted, people, params)


def _first_standing(cameras: Sequence[CameraPaths], params: CalibrationParams,
                    progress: Callable[[Iterable], Iterable]) -> List[Standing]:
    """Return where the cameras stand by the best edges.

    Two cameras without depth are related only where others leave a gap.
    """
    pairs = list(itertools.combinations(range(len(cameras)), 2))
    images = [pair for pair in pairs if not any(cameras[camera].has_depth for camera in pair)]
    edges: List[Edge] = []
    reasons: Dict[Tuple[int, int], str] = {}
    names = [camera.name for camera in cameras]
    for some in ([pair for pair in pairs if pair not in images], images):
        for first, second in progress(some):
            try:
                edges.append(_edge(cameras, (first, second), params))
            except BadInputError as error:
                reasons[first, second] = str(error)
        try:
            return spanning_tree(names, edges, reasons, _ROOT)
        except BadInputError:
            if some is images:
                raise
    raise AssertionError


def _edge(cameras: Sequence[CameraPaths], pair: Tuple[int, int], params: CalibrationParams) -> Edge:
    first, second = sorted(pair, key=lambda camera: not cameras[camera].has_depth)
    one, other = cameras[first], cameras[second]
    given = 0.0 if params.clocks_agree else None
    for camera in (one, other):
        if camera.has_depth:
            check_motion(camera)
    if not one.has_depth:
        (rotation, shift), clock, cost = relate_images(one, other, given)
        unit = Edge(0, 1, rotation, shift, clock, cost)
        there = [Standing((np.eye(3), np.zeros(3)), 0.0), Standing((rotation.T, -rotation.T @ shift), -clock)]
        gathered = gather([one, other], there)
        return Edge(first, second, rotation, scale_of_bones(gathered.people(gathered.joints), params.stature) * shift,
                    clock, unit.cost)
    find = align_in_space if other.has_depth else resect
    (rotation, shift), clock, cost = find(one, other, given)
    return Edge(first, second, rotation, shift, clock, cost)


def _scale(adjusted: Adjusted, names: Sequence[str], params: CalibrationParams) -> float:
    if params.distance is None:
        return scale_of_bones(adjusted.gathered.people(adjusted.joints), params.stature)
    first, second, distance = params.distance
    centres = [adjusted.standing[names.index(name)].pose[1] for name in (first, second)]
    return float(distance / np.linalg.norm(centres[1] - centres[0]))


def _check_spread(people: np.ndarray) -> None:
    """Raise where people do not tell where cameras stand: all joints in a plane, or all in one place."""
    edges = CALIBRATION.edges
    joints = people[np.isfinite(people).all(axis=2)]
    middles = np.nanmedian(people[np.isfinite(people).any(axis=(1, 2))], axis=1)
    thickness = float(np.linalg.svd(joints - joints.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(joints)))
    way = float(np.linalg.norm(middles - middles.mean(axis=0), axis=1).std() if len(middles) < 2 else
                np.linalg.svd(middles - middles.mean(axis=0), compute_uv=False)[0] / np.sqrt(len(middles)))
    if thickness < edges.least_spread:
        raise BadInputError(f'all joints that cameras share lie in a plane: they spread by {1e3 * thickness:.0f} mm '
                            f'across it, expected {1e3 * edges.least_spread:.0f} or more; let people walk to and fro')
    if way < edges.least_walk:
        raise BadInputError(f'people stay in one place where cameras see them together: they spread by {way:.2f} m, '
                            f'expected {edges.least_walk:g} m or more; let somebody walk through the room')


def _in_the_room(cameras: Sequence[CameraPaths], standing: Sequence[Standing], adjusted: Adjusted, people: np.ndarray,
                 params: CalibrationParams) -> Calibrated:
    names = [camera.name for camera in cameras]
    up = None
    if params.tilt is not None:
        up = standing[names.index(params.tilt[0])].pose[0] @ up_of_tilt(params.tilt[1])
    warnings = doubts(names, adjusted.std)
    floor: Optional[Floor] = None
    room: Transform = (np.eye(3), np.zeros(3))
    try:
        floor = find_floor(people, up)
        room = room_frame(floor)
    except BadInputError as error:
        warnings.append(f'{error}; {params.fixed_frame} is the optical frame of {names[_ROOT]}, z is not up')
    rotation, shift = room
    placed = tuple(rig_camera(camera.name, camera.recording.frame_id,
                              (rotation @ one.pose[0], rotation @ one.pose[1] + shift), one.clock_offset)
                   for camera, one in zip(cameras, standing))
    return Calibrated(Rig(params.fixed_frame, placed), adjusted.std, edge_qualities(cameras, adjusted), floor,
                      people @ rotation.T + shift, warnings)
