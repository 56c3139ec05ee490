"""Synthetic RGB-D pictures of people whose joints are known exactly.

People are capsules around their bones and stand on a level floor before a pinhole camera. A picture holds what each
pixel's ray meets first: a person, a box (furniture), the back wall or the floor. Everything is in the camera's optical
frame (x right, y down, z forward), the camera looks level.

The body has the proportions of an adult of 1.75 m, and its joints lie as deep under the surface as those of people do:
hips 10 cm, knees 7, shoulders 6, elbows and wrists 4, nose and eyes 0.
"""
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Dict, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.points.camera import CameraModel

# Labels of joints: whether the camera sees them, and if not, what hides them.
OUTSIDE, HIDDEN_BY_SELF, VISIBLE, HIDDEN_BY_PERSON, HIDDEN_BY_FURNITURE = 0, 1, 2, 3, 4

# A joint counts as visible if its body's surface is at most so far in front of it [m]; more, and another part hides it.
DEPTH_UNDER_SKIN = {'neck': 0.17, 'shoulder': 0.17, 'hip': 0.22, 'wrist': 0.11, 'ankle': 0.11}
DEPTH_UNDER_SKIN_ELSEWHERE = 0.13

# Lengths of an adult [m].
SHOULDER_WIDTH, HIP_WIDTH, TRUNK, UPPER_ARM, FOREARM, THIGH, SHIN, ANKLE_HEIGHT = (
    0.37, 0.19, 0.51, 0.29, 0.25, 0.42, 0.42, 0.08)
# Points of the head, from the neck, in the frame of the body [m].
HEAD_CENTRE = (0.0, -0.205, 0.0)
HEAD = {'nose': (0.0, -0.195, -0.095), 'right_eye': (-0.032, -0.225, -0.09), 'left_eye': (0.032, -0.225, -0.09),
        'right_ear': (-0.072, -0.215, 0.0), 'left_ear': (0.072, -0.215, 0.0)}
# Radii of the head's ellipsoid: across, along, front to back [m].
HEAD_RADII = (0.08, 0.115, 0.1)

# What the owner image holds where no person is.
NOTHING, SCENERY = -1, -2

_SIDES = (('right', -1), ('left', 1))


class Capsule(NamedTuple):
    """What is nearer than a radius to a line from start to end [m]."""

    start: np.ndarray
    end: np.ndarray
    radius: float
    colour: Tuple[int, int, int]  # BGR
    squash: Optional[np.ndarray] = None  # (3, 3) maps space to where the capsule is round


class Box(NamedTuple):
    """A piece of furniture, (3,) least and greatest coordinates [m]."""

    low: Tuple[float, float, float]
    high: Tuple[float, float, float]
    colour: Tuple[int, int, int] = (70, 110, 150)


@dataclass(frozen=True)
class Pose:
    """Directions of the limbs in the frame of the body (x to its left, y down, z to its back); (2, 3): right, left."""

    upper_arms: np.ndarray
    forearms: np.ndarray
    thighs: np.ndarray
    shins: np.ndarray


@dataclass(frozen=True)
class Person:
    """One person; x and z of the middle of the hips [m], colours BGR."""

    id: int
    x: float
    z: float
    pose: Pose
    yaw: float = 0.0  # 0 faces the camera, pi / 2 faces to the right of the picture [rad]
    scale: float = 1.0  # of all lengths; 0.6 is a child, 1 an adult of 1.75 m
    shirt: Tuple[int, int, int] = (60, 60, 200)
    trousers: Tuple[int, int, int] = (110, 60, 40)
    skin: Tuple[int, int, int] = (140, 170, 215)


@dataclass(frozen=True)
class Room:
    """What people stand in."""

    floor: float = 1.2  # its y, which is the height of the camera [m]
    has_floor: bool = True  # whether the camera sees it; people stand on it in any case
    wall: Optional[float] = 5.0  # z of the back wall [m]; None: there is none
    furniture: Tuple[Box, ...] = ()


@dataclass(frozen=True)
class Frame:
    """A picture and the truth about the P people with a joint in it."""

    camera: CameraModel
    depth: np.ndarray  # (H, W) uint16 [mm], 0 = missing
    bgr: np.ndarray
    owner: np.ndarray  # (H, W) int32, which row of the people a pixel shows, or NOTHING or SCENERY
    people: People2D  # exact pixels with score 1, missing outside the picture; hidden joints are there; ids are -1
    xyz: np.ndarray  # (P, K, 3) float64 [m]
    vis: np.ndarray  # (P, K) int labels
    ids: np.ndarray  # (P,) int64 of the `Person`

    @property
    def size(self) -> Tuple[int, int]:
        """Width and height [px]."""
        return self.camera.width, self.camera.height


def pinhole(width: int = 480, height: int = 270, focal: float = 0.5625) -> CameraModel:
    """Return a camera like that of a Kinect v2; focal length in widths of the picture."""
    return CameraModel(width, height, [focal * width, 0, width / 2 - 0.5, 0, focal * width, height / 2 - 0.5, 0, 0, 1])


def pointing(forwards: float, outwards: float, side: int) -> np.ndarray:
    """Return (3,) the direction of a limb that is swung from hanging down [deg]; side is -1 right, 1 left."""
    forwards, outwards = np.radians(forwards), np.radians(outwards)
    return np.array([side * np.sin(outwards), np.cos(outwards) * np.cos(forwards),
                     -np.cos(outwards) * np.sin(forwards)])


def _pair(forwards: np.ndarray, outwards: float) -> np.ndarray:
    """Return (2, 3) the directions of the right and the left limb, see `pointing`."""
    return np.stack([pointing(angle, outwards, side) for angle, (_, side) in zip(np.broadcast_to(forwards, 2), _SIDES)])


def standing(arms_out: float = 10.0) -> Pose:
    """Return a pose with straight legs and arms, these `arms_out` [deg] off the trunk."""
    return Pose(_pair(0, arms_out), _pair(0, arms_out), _pair(0, 3), _pair(0, 3))


def walking(phase: float) -> Pose:
    """Return a pose of a stride; phase runs over 2 pi in two steps [rad], the right leg is in front at pi / 2."""
    swing = np.array([np.sin(phase), -np.sin(phase)])
    # a leg bends most while it swings forwards
    bend = 8 + 22 * (1 + np.array([np.cos(phase), -np.cos(phase)])) / 2
    return Pose(_pair(-22 * swing, 9), _pair(-22 * swing + 20, 9), _pair(24 * swing, 2), _pair(24 * swing - bend, 2))


def seated() -> Pose:
    """Return a pose on a chair: thighs forward, shins down, hands above the thighs."""
    return Pose(_pair(15, 12), _pair(70, 5), _pair(85, 8), _pair(0, 4))


def waving(phase: float) -> Pose:
    """Return a pose with the right hand up, which swings once in 2 pi [rad]."""
    rest = standing()
    upper, fore = rest.upper_arms.copy(), rest.forearms.copy()
    upper[0], fore[0] = pointing(0, 85, -1), pointing(0, 165 + 25 * np.sin(phase), -1)
    return replace(rest, upper_arms=upper, forearms=fore)


def joints_of(person: Person, floor: float) -> Dict[str, np.ndarray]:
    """Return (3,) [m] of each joint, in the optical frame."""
    pose, joints = person.pose, {}
    legs = THIGH * pose.thighs + SHIN * pose.shins
    # the lower one of the feet stands on the floor
    hips = np.array([0.0, -legs[:, 1].max() - ANKLE_HEIGHT, 0.0])
    neck = hips - np.array([0, TRUNK, 0])
    joints['neck'] = neck
    for name, offset in HEAD.items():
        joints[name] = neck + offset
    for i, (name, side) in enumerate(_SIDES):
        joints[f'{name}_shoulder'] = neck + np.array([side * SHOULDER_WIDTH / 2, 0, 0])
        joints[f'{name}_elbow'] = joints[f'{name}_shoulder'] + UPPER_ARM * pose.upper_arms[i]
        joints[f'{name}_wrist'] = joints[f'{name}_elbow'] + FOREARM * pose.forearms[i]
        joints[f'{name}_hip'] = hips + np.array([side * HIP_WIDTH / 2, 0, 0])
        joints[f'{name}_knee'] = joints[f'{name}_hip'] + THIGH * pose.thighs[i]
        joints[f'{name}_ankle'] = joints[f'{name}_knee'] + SHIN * pose.shins[i]
    rotation, place = _rotation(person.yaw), np.array([person.x, floor, person.z])
    return {name: place + person.scale * (rotation @ point) for name, point in joints.items()}


def capsules_of(person: Person, floor: float) -> Tuple[Capsule, ...]:
    """Return the parts of a person's surface, in the optical frame."""
    joints, scale, rotation = joints_of(person, floor), person.scale, _rotation(person.yaw)

    def shifted(joint: str, *offset: float) -> np.ndarray:
        return joints[joint] + scale * (rotation @ np.array(offset))

    round_head = np.diag(np.array(HEAD_RADII[0]) / HEAD_RADII) @ rotation.T
    head = shifted('neck', *HEAD_CENTRE)
    parts = [(head, head, HEAD_RADII[0], person.skin, round_head),
             (joints['neck'], head, 0.055, person.skin, None),
             (joints['right_hip'], joints['left_hip'], 0.1, person.trousers, None),
             (shifted('right_shoulder', 0.09, 0.08, 0), shifted('left_shoulder', -0.09, 0.08, 0), 0.1, person.shirt,
              None)]
    for name, side in _SIDES:
        elbow, wrist, knee, ankle = (joints[f'{name}_{part}'] for part in ('elbow', 'wrist', 'knee', 'ankle'))
        inwards = -side
        parts += [
            (shifted(f'{name}_shoulder', inwards * 0.09, 0.08, 0), shifted(f'{name}_hip', 0, -0.1, 0), 0.1,
             person.shirt, None),
            (joints[f'{name}_shoulder'], shifted(f'{name}_shoulder', inwards * 0.05, 0.02, 0), 0.06, person.shirt,
             None),
            (joints[f'{name}_shoulder'], elbow, 0.045, person.shirt, None),
            (elbow, wrist, 0.035, person.skin, None),
            (wrist, wrist + (wrist - elbow) * (0.09 / FOREARM), 0.035, person.skin, None),
            (joints[f'{name}_hip'], knee, 0.07, person.trousers, None),
            (knee, ankle, 0.05, person.trousers, None),
            (ankle, shifted(f'{name}_ankle', 0, 0.035, -0.13), 0.04, (30, 30, 30), None)]
    return tuple(Capsule(start, end, scale * radius, colour, squash)
                 for start, end, radius, colour, squash in parts)


def render(camera: CameraModel, people: Sequence[Person], room: Optional[Room] = None, seed: int = 0) -> Frame:
    """Return the picture of people in a room by an undistorted camera; the seed is that of the noise of the colours."""
    room = room or Room()
    rays, *empty = _empty_room(camera, room)
    depth, owner, bgr = (image.copy() for image in empty)
    all_xyz = np.zeros((len(people), len(COCO_18.joints), 3))
    for i, person in enumerate(people):
        joints = joints_of(person, room.floor)
        all_xyz[i] = [joints[name] for name in COCO_18.joints]
    uv = camera.project(all_xyz).reshape(*all_xyz.shape[:2], 2)
    inside = ((uv > -0.5) & (uv < np.array([camera.width, camera.height]) - 0.5)).all(axis=2)
    seen = inside.any(axis=1)
    for row, person in zip(np.where(seen, np.cumsum(seen) - 1, NOTHING), people):
        for capsule in capsules_of(person, room.floor):
            _paint_capsule(capsule, camera, rays, depth, owner, bgr, row)
    noise = np.random.default_rng(seed).integers(-8, 9, bgr.shape, np.int8)
    bgr = np.clip(bgr.astype(np.int16) + noise, 0, 255).astype(np.uint8)
    xyz, uv, inside = all_xyz[seen], uv[seen], inside[seen]
    keypoints = np.concatenate([np.where(inside[..., None], uv, np.nan), inside[..., None]], axis=2)
    ids = np.array([person.id for person, kept in zip(people, seen) if kept], np.int64)
    return Frame(camera, np.round(1000 * np.where(np.isfinite(depth) & (depth < 65), depth, 0)).astype(np.uint16), bgr,
                 owner, People2D(COCO_18, keypoints, np.ones(len(xyz)), np.full(len(xyz), -1)), xyz,
                 _labels(xyz, uv, inside, depth, owner), ids)


def moved_pixels(people: People2D, rng: np.random.Generator, sigma: float = 0.0, dropped: float = 0.0) -> People2D:
    """Return people with noise of each coordinate [px], without a share of the joints."""
    keypoints = people.keypoints.copy()
    keypoints[..., :2] += rng.normal(0, sigma, people.xy.shape)
    keypoints[rng.random(people.present.shape) < dropped] = (np.nan, np.nan, 0)
    return replace(people, keypoints=keypoints)


def without_joints(people: People2D, missing: np.ndarray) -> People2D:
    """Return people without the joints of a (P, K) mask."""
    keypoints = people.keypoints.copy()
    keypoints[missing] = (np.nan, np.nan, 0)
    return replace(people, keypoints=keypoints)


def without_people(frame: Frame, gone: np.ndarray) -> People2D:
    """Return the people of a frame but for those rows of a (P,) mask."""
    people, kept = frame.people, ~np.asarray(gone, bool)
    return People2D(people.skeleton, people.keypoints[kept], people.scores[kept], people.ids[kept])


def with_noise(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return depth with the noise of a time-of-flight camera, a few mm at 2 m that grow with the square [mm]."""
    sigma = 1.5 + 1.8 * (depth / 2000) ** 2
    return np.where(depth > 0, np.maximum(np.round(depth + rng.normal(0, 1, depth.shape) * sigma), 1), 0
                    ).astype(np.uint16)


def with_holes(depth: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Return depth of which a share of the pixels is missing."""
    return np.where(rng.random(depth.shape) < share, 0, depth).astype(np.uint16)


def with_flying_pixels(depth: np.ndarray, rng: np.random.Generator, step: int = 100) -> np.ndarray:
    """Return depth whose edges, of a step [mm], are half missing, half anywhere between near and far side."""
    padded = np.pad(depth, 1, mode='edge')
    height, width = depth.shape
    around = np.stack([padded[1 + dv:1 + dv + height, 1 + du:1 + du + width]
                       for dv, du in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))]).astype(np.int64)
    near, far = around.min(axis=0), around.max(axis=0)
    mixed = np.where(rng.random(depth.shape) < 0.5, 0, near + (far - near) * rng.random(depth.shape))
    return np.where(far - near > step, mixed, depth).astype(np.uint16)


def _rotation(yaw: float) -> np.ndarray:
    """Return (3, 3) from the frame of the body to the optical one."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])


@lru_cache(maxsize=32)
def _empty_room(camera: CameraModel, room: Room) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the rays, and depth [m], owner and colour of wall, floor and furniture."""
    rays = camera.ray_grid()
    depth, owner = np.full(rays.shape[:2], np.inf), np.full(rays.shape[:2], NOTHING, np.int32)
    bgr = np.zeros(rays.shape, np.uint8)
    if room.wall is not None:
        _paint(depth, owner, bgr, np.full(depth.shape, room.wall), SCENERY, (175, 185, 190))
    if room.has_floor:
        with np.errstate(divide='ignore'):
            floor = room.floor / rays[..., 1]
        _paint(depth, owner, bgr, np.where(rays[..., 1] > 0, floor, np.inf), SCENERY, (90, 100, 105))
    for box in room.furniture:
        # by slabs: the ray is inside where it is between all three pairs of sides
        with np.errstate(divide='ignore', invalid='ignore'):
            sides = np.stack([np.array(box.low) / rays, np.array(box.high) / rays])
        enter, leave = np.nanmax(sides.min(axis=0), axis=-1), np.nanmin(sides.max(axis=0), axis=-1)
        _paint(depth, owner, bgr, np.where((enter > 0) & (enter <= leave), enter, np.inf), SCENERY, box.colour)
    return rays, depth, owner, bgr


def _paint_capsule(capsule: Capsule, camera: CameraModel, rays: np.ndarray, depth: np.ndarray, owner: np.ndarray,
                   bgr: np.ndarray, row: int) -> None:
    """Draw a part of a person, looking only at the pixels where it may be."""
    ends = np.stack([capsule.start, capsule.end])
    # squashed capsules are longest by the head's proportions
    reach = capsule.radius * (1 if capsule.squash is None else max(HEAD_RADII) / HEAD_RADII[0])
    nearest = ends[:, 2].min() - reach
    if nearest <= 0:
        raise ValueError(f'a part of a person is behind the camera: {ends.tolist()}')
    focal, centre = camera.matrix[[0, 1], [0, 1]], camera.matrix[:2, 2]
    # a ball in front of the camera is within its radius, seen at the nearest depth, of where both ends project
    farthest = ends[:, 2].max() + reach
    low, high = ends[:, :2].min(axis=0) - reach, ends[:, :2].max(axis=0) + reach
    low, high = np.minimum(low / nearest, low / farthest), np.maximum(high / nearest, high / farthest)
    low = np.maximum(np.floor(low * focal + centre).astype(int), 0)
    high = np.minimum(np.ceil(high * focal + centre).astype(int) + 1, [camera.width, camera.height])
    if (high <= low).any():
        return
    part = np.s_[low[1]:high[1], low[0]:high[0]]
    _paint(depth[part], owner[part], bgr[part], _capsule_depth(capsule, rays[part]), row, capsule.colour)


def _paint(depth: np.ndarray, owner: np.ndarray, bgr: np.ndarray, z: np.ndarray, row: int,
           colour: Tuple[int, int, int]) -> None:
    nearer = z < depth
    depth[nearer], owner[nearer], bgr[nearer] = z[nearer], row, colour


def _capsule_depth(capsule: Capsule, rays: np.ndarray) -> np.ndarray:
    """Return z where rays from the origin enter a capsule, infinite where they pass it.

    Rays have z = 1, so the factor of the ray is the depth. After https://iquilezles.org/articles/intersectors.
    """
    start, end, squared = capsule.start, capsule.end, capsule.radius ** 2
    if capsule.squash is not None:
        start, end, rays = capsule.squash @ start, capsule.squash @ end, rays @ capsule.squash.T
    axis = end - start
    length, axis_start, depth = axis @ axis, axis @ start, np.full(rays.shape[:2], np.inf)
    if length == 0:
        _enter_ball(depth, np.ones(depth.shape, bool), rays, start, squared)
        return depth
    # the cylinder without ends, then what of it is beyond an end: there the ball counts
    ray_axis = rays @ axis
    a = length * (rays * rays).sum(-1) - ray_axis ** 2
    b = length * (rays @ start) - axis_start * ray_axis
    root = b ** 2 - a * (length * (start @ start - squared) - axis_start ** 2)
    hit = (root >= 0) & (a > 0)
    side = (b[hit] - np.sqrt(root[hit])) / a[hit]
    along = side * ray_axis[hit] - axis_start
    depth[hit] = side
    for ball, beyond in ((start, along <= 0), (end, along >= length)):
        rounded = hit.copy()
        rounded[hit] = beyond
        _enter_ball(depth, rounded, rays, ball, squared)
    return depth


def _enter_ball(depth: np.ndarray, mask: np.ndarray, rays: np.ndarray, centre: np.ndarray, squared: float) -> None:
    """Write the depth at which rays enter a ball, infinite where they pass it, to the pixels of a mask."""
    rays = rays[mask]
    ray_ray, ray_centre = (rays * rays).sum(-1), rays @ centre
    root = ray_centre ** 2 - ray_ray * (centre @ centre - squared)
    depth[mask] = np.where(root >= 0, (ray_centre - np.sqrt(np.maximum(root, 0))) / ray_ray, np.inf)


def _labels(xyz: np.ndarray, uv: np.ndarray, inside: np.ndarray, depth: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Return (P, K) what is seen of each joint, from the surface at its pixel."""
    u, v = np.moveaxis(np.floor(np.where(inside[..., None], uv, 0) + 0.5).astype(int), -1, 0)
    shown, in_front = owner[v, u], xyz[..., 2] - depth[v, u]
    own = shown == np.arange(len(xyz))[:, None]
    under_skin = np.array([DEPTH_UNDER_SKIN.get(name.split('_')[-1], DEPTH_UNDER_SKIN_ELSEWHERE)
                           for name in COCO_18.joints])
    labels = np.select([~inside, own & (in_front > under_skin), own | (in_front <= 0), shown == SCENERY],
                       [OUTSIDE, HIDDEN_BY_SELF, VISIBLE, HIDDEN_BY_FURNITURE], HIDDEN_BY_PERSON)
    return labels.astype(np.int64)
