"""Posing of a body: spine, arms and legs by directions, feet and wrists at places, hands and fingers."""
from typing import Dict, Mapping, NamedTuple, Optional, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from .body import Body, anny_model, skin
from .geometry import align, frame_of, rotation, rotation_about, two_bones, unit
from .hand_poses import FACE_VERTICES

SIDES = (('L', 1.0), ('R', -1.0))
COLLAR_BONE = 18.0  # [deg] that the collar bone follows an arm that is raised straight up
SPINE = (('spine05', 0.4), ('spine03', 0.35), ('spine02', 0.25))
NECK = (('neck01', 0.4), ('head', 0.6))
FLOOR_TOLERANCE = 0.002  # [m]


class Foot(NamedTuple):
    """An ankle at a place (world), the knee towards pole (person frame), pitch and yaw of the foot [deg].

    follows 0..1: how far the foot hangs on the shin, bent down by `bend` [deg], instead of lying on the floor.
    """

    ankle: np.ndarray
    pole: np.ndarray
    pitch: float = 0.0
    yaw: float = 9.0
    follows: float = 0.0
    bend: float = 0.0


class Pose(NamedTuple):
    """A pose. Directions are (outward, forward, up) in the person frame, angles in degrees, positions in the world.

    hip_z: height of the middle between the hip joints [m]; None: the lowest vertex stands on the floor.
    root: (3, 3) rotation of the whole body in its yaw frame. legs: upper, lower, foot pitch; not used with feet.
    wrists: place, pole of the elbow, weight 0..1. hands: finger direction, palm normal (world), weight.
    """

    x: float
    y: float
    yaw: float
    arms: Dict[str, Tuple[np.ndarray, np.ndarray]]
    legs: Dict[str, Tuple[np.ndarray, np.ndarray, float]]
    lean: float = 0.0
    twist: float = 0.0
    side: float = 0.0
    head_yaw: float = 0.0
    head_pitch: float = 0.0
    hip_z: Optional[float] = None
    root: np.ndarray = np.eye(3)
    feet: Mapping[str, Foot] = {}
    wrists: Mapping[str, Tuple[np.ndarray, np.ndarray, float]] = {}
    hands: Mapping[str, Tuple[np.ndarray, np.ndarray, float]] = {}
    fingers: Mapping[str, np.ndarray] = {}


class Posed(NamedTuple):
    """A posed body in the world frame [m]."""

    joints: np.ndarray  # (18, 3) COCO_18
    feet: np.ndarray  # (6, 3) in the order of body.FEET
    shoulders: Dict[str, np.ndarray]  # (3,) joint of the upper arm
    bones: np.ndarray  # (bones, 4, 4) transforms of rest vertices to the world


class Rig:
    """Bones of a body without a pose (`reference`), and what their rotations do to them.

    The rotation of a bone against its reference is the product of the rotations from the root down to it, in the axes
    of the body.
    """

    def __init__(self, body: Body) -> None:
        anny = anny_model()
        self.body, self.bones, self.parents = body, anny.bones, anny.parents
        self.heads, self.rest_heads = body.reference[:, :3, 3].copy(), np.linalg.inv(body.rest_inverse)[:, :, 3]
        self.hip = 0.5 * (self._head('upperleg01.L') + self._head('upperleg01.R'))
        self.segments = {
            side: {name: self._head(f'{end}.{side}') - self._head(f'{start}.{side}') for name, start, end in (
                ('upper_arm', 'upperarm01', 'lowerarm01'), ('forearm', 'lowerarm01', 'wrist'),
                ('thigh', 'upperleg01', 'lowerleg01'), ('shin', 'lowerleg01', 'foot'))} for side, _ in SIDES}
        self.lengths = {side: {name: float(np.linalg.norm(value)) for name, value in segments.items()}
                        for side, segments in self.segments.items()}
        self.leg = self.lengths['L']['thigh'] + self.lengths['L']['shin']
        self.hands = {side: self._hand_axes(side) for side, _ in SIDES}
        self.tips: Dict[Tuple[int, str], np.ndarray] = {}
        surface = skin(body.reference @ body.rest_inverse, body.skinning, body.rest)
        self.sole = float(self._head('foot.L')[2] - surface[:, 2].min())  # ankle above the sole
        self.standing_hip = float(self.hip[2] - self._head('foot.L')[2]) * 0.985 + 0.085  # with shoes

    def _head(self, bone: str) -> np.ndarray:
        return self.heads[self.bones[bone]]

    def _hand_axes(self, side: str) -> Tuple[np.ndarray, np.ndarray]:
        """Return finger direction and palm normal; the palm looks where the fingers curl in the reference pose."""
        wrist = self._head(f'wrist.{side}')
        fingers = unit(self._head(f'finger3-1.{side}') - wrist)
        normal = unit(np.cross(self._head(f'finger2-1.{side}') - wrist, self._head(f'finger5-1.{side}') - wrist))
        curl = self._head(f'finger3-3.{side}') - self._head(f'finger3-1.{side}')
        normal = normal * np.sign(normal @ (curl - fingers * (curl @ fingers)))
        return fingers, unit(normal - fingers * (normal @ fingers))

    # ---- forward kinematics ---------------------------------------------------------------------------------

    def _forward(self, turns: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the rotations (bones, 3, 3) against the reference, and the heads (bones, 3), for the turns of all."""
        rotations, heads = np.empty_like(turns), np.empty_like(self.heads)
        for i, parent in enumerate(self.parents):
            if parent < 0:
                rotations[i], heads[i] = turns[i], self.heads[i]
            else:
                rotations[i] = rotations[parent] @ turns[i]
                heads[i] = heads[parent] + rotations[parent] @ (self.heads[i] - self.heads[parent])
        return rotations, heads

    def pose(self, pose: Pose) -> Posed:
        """Return the body in a pose. Nothing sinks into the floor."""
        turns = np.tile(np.eye(3), (len(self.parents), 1, 1))
        for bones, angles in ((SPINE, (pose.twist, pose.side, pose.lean)),
                              (NECK, (pose.head_yaw, 0.0, pose.head_pitch))):
            for bone, share in bones:
                z, y, x = (share * angle for angle in angles)
                turns[self.bones[bone]] = rotation('z', z) @ rotation('y', y) @ rotation('x', x)
        for side, sign in SIDES:
            self._turn_arm(turns, side, sign, pose)
            if side in pose.fingers:
                self._turn_fingers(turns, side, pose.fingers[side])
            if side not in pose.feet:
                self._turn_leg(turns, side, sign, pose)
        to_world = rotation('z', pose.yaw) @ pose.root
        pivot = np.zeros(3) if pose.hip_z is None else self.hip
        offset = np.array([pose.x, pose.y, pose.hip_z or 0.0])
        for attempt in range(3):
            self._reach(turns, pose, (to_world, pivot, offset))
            bones = self._to_world(turns, (to_world, pivot, offset))
            rows = self.body.skinning @ bones[:, 2]
            lowest = float(((rows[:, :3] * self.body.rest).sum(1) + rows[:, 3]).min())
            if (pose.hip_z is not None and lowest > -FLOOR_TOLERANCE) or attempt == 2:
                break
            offset = offset - [0, 0, lowest]
            if pose.hip_z is None:
                bones[:, 2, 3] -= lowest
                break
        return self._posed(bones)

    def _to_world(self, turns: np.ndarray, frame: Tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
        """Return the (bones, 4, 4) transforms from the rest pose to the world, for the turns of all bones."""
        to_world, pivot, offset = frame
        rotations, heads = self._forward(turns)
        bones = np.tile(np.eye(4), (len(heads), 1, 1))
        bones[:, :3, :3] = to_world @ rotations @ self.body.reference[:, :3, :3]
        bones[:, :3, 3] = (heads - pivot) @ to_world.T + offset
        return bones @ self.body.rest_inverse

    def _posed(self, bones: np.ndarray) -> Posed:
        body = self.body
        joints = body.regressor @ skin(bones, body.regressed_skinning, body.regressed_rest)
        shoulders = {side: (bones[i] @ self.rest_heads[i])[:3] for side, i in (
            (side, self.bones[f'upperarm01.{side}']) for side, _ in SIDES)}
        return Posed(joints[:18], joints[18:], shoulders, bones)

    # ---- limbs ----------------------------------------------------------------------------------------------

    def _turn_arm(self, turns: np.ndarray, side: str, sign: float, pose: Pose) -> None:
        upper, fore = (_local(direction, sign) for direction in pose.arms[side])
        collar = rotation('y', -sign * max(0.0, upper[2] / np.linalg.norm(upper)) * COLLAR_BONE)
        segments = self.segments[side]
        arm = align(segments['upper_arm'], collar.T @ upper)
        turns[self.bones[f'clavicle.{side}']], turns[self.bones[f'upperarm01.{side}']] = collar, arm
        turns[self.bones[f'lowerarm01.{side}']] = align(segments['forearm'], arm.T @ collar.T @ fore)

    def _turn_leg(self, turns: np.ndarray, side: str, sign: float, pose: Pose) -> None:
        upper, lower, pitch = pose.legs[side]
        thigh = align(self.segments[side]['thigh'], _local(upper, sign))
        shin = align(self.segments[side]['shin'], thigh.T @ _local(lower, sign))
        turns[self.bones[f'upperleg01.{side}']], turns[self.bones[f'lowerleg01.{side}']] = thigh, shin
        turns[self.bones[f'foot.{side}']] = (thigh @ shin).T @ rotation('z', sign * 7) @ rotation('x', pitch)

    def _reach(self, turns: np.ndarray, pose: Pose, frame: Tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
        to_world, pivot, offset = frame

        def to_body(point: np.ndarray) -> np.ndarray:
            return to_world.T @ (np.asarray(point, float) - offset) + pivot

        for side, sign in SIDES:
            if side in pose.feet:
                self._place_foot(turns, side, sign, pose, to_body(pose.feet[side].ankle))
            if side in pose.wrists:
                place, pole, weight = pose.wrists[side]
                self._place_wrist(turns, side, (to_body(place), pose.root.T @ _local(pole, sign), weight))
            if side in pose.hands:
                fingers, normal, weight = pose.hands[side]
                self._turn_hand(turns, side, frame_of(to_world.T @ fingers, to_world.T @ normal), weight)

    def _place_foot(self, turns: np.ndarray, side: str, sign: float, pose: Pose, ankle: np.ndarray) -> None:
        foot, lengths, segments = pose.feet[side], self.lengths[side], self.segments[side]
        pole = pose.root.T @ _local(foot.pole, sign)
        upper, lower = two_bones(self._head(f'upperleg01.{side}'), ankle, (lengths['thigh'], lengths['shin']), pole)
        thigh = _thigh(segments['thigh'], upper, pole)
        shin = align(segments['shin'], thigh.T @ lower)
        turns[self.bones[f'upperleg01.{side}']], turns[self.bones[f'lowerleg01.{side}']] = thigh, shin
        turn = (thigh @ shin).T @ pose.root.T @ rotation('z', sign * foot.yaw) @ rotation('x', foot.pitch)
        if foot.follows > 0:
            hanging = Rotation.from_matrix(turn.T @ rotation('x', foot.bend)).as_rotvec()
            turn = turn @ Rotation.from_rotvec(min(foot.follows, 1) * hanging).as_matrix()
        turns[self.bones[f'foot.{side}']] = turn

    def _place_wrist(self, turns: np.ndarray, side: str, target: Tuple[np.ndarray, np.ndarray, float]) -> None:
        place, pole, weight = target
        lengths, segments = self.lengths[side], self.segments[side]
        rotations, heads = self._forward(turns)
        collar, arm, forearm = (self.bones[f'{bone}.{side}'] for bone in ('clavicle', 'upperarm01', 'lowerarm01'))
        upper, fore = two_bones(heads[arm], place, (lengths['upper_arm'], lengths['forearm']), pole)
        upper = unit(weight * upper + (1 - weight) * unit(rotations[arm] @ segments['upper_arm']))
        fore = unit(weight * fore + (1 - weight) * unit(rotations[forearm] @ segments['forearm']))
        turns[arm] = align(segments['upper_arm'], rotations[collar].T @ upper)
        turns[forearm] = align(segments['forearm'], turns[arm].T @ rotations[collar].T @ fore)

    def _turn_hand(self, turns: np.ndarray, side: str, wanted: np.ndarray, weight: float) -> None:
        """Turn the hand; the forearm takes 0.6 of the twist."""
        forearm, wrist = self.bones[f'lowerarm02.{side}'], self.bones[f'wrist.{side}']
        turns[forearm] = turns[wrist] = np.eye(3)
        elbow = self._forward(turns)[0][self.bones[f'lowerarm01.{side}']]
        turn = Rotation.from_matrix(elbow.T @ wanted @ frame_of(*self.hands[side]).T)
        turn = Rotation.from_rotvec(weight * turn.as_rotvec())
        axis, quaternion = unit(self.segments[side]['forearm']), turn.as_quat()
        twist = 2 * np.arctan2(quaternion[:3] @ axis, quaternion[3])
        twist = (twist + np.pi) % (2 * np.pi) - np.pi
        shared = Rotation.from_rotvec(0.6 * twist * axis)
        turns[forearm], turns[wrist] = shared.as_matrix(), (shared.inv() * turn).as_matrix()

    def _turn_fingers(self, turns: np.ndarray, side: str, angles: np.ndarray) -> None:
        """Set the (5, 4) finger angles [deg] of hand_poses."""
        normal = self.hands[side][1]
        for k in range(2, 6):
            bones = [self.bones[f'finger{k}-{j}.{side}'] for j in (1, 2, 3)]
            flexion = np.cross(unit(self.heads[bones[2]] - self.heads[bones[0]]), normal)
            bend = [rotation_about(flexion, angle) for angle in angles[k - 1, :3]]
            turns[bones[0]] = rotation_about(normal, angles[k - 1, 3] * (1 if side == 'L' else -1)) @ bend[0]
            turns[bones[1]], turns[bones[2]] = bend[1:]
        thumb = [self.bones[f'finger1-{j}.{side}'] for j in (1, 2, 3)]
        direction = unit(self.heads[thumb[2]] - self.heads[thumb[0]])
        across = unit(self._head(f'finger5-1.{side}') - self.heads[thumb[1]])
        lift, bend_axis = np.cross(direction, normal), np.cross(direction, across)
        turns[thumb[0]] = rotation_about(lift, angles[0, 0]) @ rotation_about(bend_axis, angles[0, 1])
        turns[thumb[1]], turns[thumb[2]] = (rotation_about(bend_axis, angle) for angle in angles[0, 2:])

    # ---- what is read from a posed body -----------------------------------------------------------------------

    def vertices(self, posed: Posed) -> np.ndarray:
        """Return the (V, 3) vertices of the surface [m], world."""
        return skin(posed.bones, self.body.skinning, self.body.rest)

    def hand_points(self, posed: Posed) -> np.ndarray:
        """Return the (2, 21, 3) points of right and left hand [m], world: joint centres, tips inside the finger end."""
        heads = np.einsum('nij,nj->ni', posed.bones, self.rest_heads)[:, :3]
        points = np.zeros((2, 21, 3))
        for hand, side in enumerate('RL'):
            points[hand, 0] = heads[self.bones[f'wrist.{side}']]
            for k in range(1, 6):
                for j in (1, 2, 3):
                    points[hand, 4 * (k - 1) + j] = heads[self.bones[f'finger{k}-{j}.{side}']]
                rows = self._tip_vertices(k, side)
                points[hand, 4 * k] = skin(posed.bones, self.body.skin_skinning[rows],
                                           self.body.skin_rest[rows]).mean(0)
        return points

    def _tip_vertices(self, finger: int, side: str) -> np.ndarray:
        """Return the 14 outermost skin vertices of a finger."""
        if (finger, side) in self.tips:
            return self.tips[finger, side]
        last, body = self.bones[f'finger{finger}-3.{side}'], self.body
        rows = np.flatnonzero((np.asarray(body.skin_skinning.argmax(axis=1)).ravel() == last) & body.is_skin)
        rest = skin(body.reference @ body.rest_inverse, body.skin_skinning[rows], body.skin_rest[rows])
        along = unit(self.heads[last] - self._head(f'finger{finger}-2.{side}'))
        self.tips[finger, side] = rows[np.argsort(-(rest @ along), kind='stable')[:14]]
        return self.tips[finger, side]

    def face_points(self, posed: Posed) -> np.ndarray:
        """Return the (8, 3) points of the face [m], world."""
        return skin(posed.bones, self.body.skin_skinning[FACE_VERTICES], self.body.skin_rest[FACE_VERTICES])


def _local(direction: np.ndarray, sign: float) -> np.ndarray:
    """Return an (outward, forward, up) direction in the axes of the body."""
    return np.array([sign * direction[0], -direction[1], direction[2]], float)


def _thigh(segment: np.ndarray, direction: np.ndarray, pole: np.ndarray) -> np.ndarray:
    """Return the rotation of a thigh: its direction, then a twist so that the knee points to the pole."""
    turn = align(segment, direction)
    knee = turn @ np.array([0, -1.0, 0])
    now, wanted = (vector - direction * (vector @ direction) for vector in (knee, pole))
    if min(np.linalg.norm(now), np.linalg.norm(wanted)) < 0.2:
        return turn
    now, wanted = unit(now), unit(wanted)
    return rotation_about(direction, np.rad2deg(np.arctan2(np.cross(now, wanted) @ direction, now @ wanted))) @ turn
