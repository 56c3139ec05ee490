"""BVH files, for Blender and game engines: a skeleton of bones with constant lengths, its place and its rotations.

Joints have the names of the BVH files of the CMU Graphics Lab's motions. At rest the person stands with the arms to the
sides and faces z, y up. Each bone turns from its direction at rest to where its joints are by the shortest way: joints
do not tell how it is twisted. What is not known at a time is interpolated between the times before and after.
"""
from typing import Dict, List, NamedTuple, Sequence

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.mocap.files import MarkerRecording

_X, _Y, _Z = np.eye(3)
_ROOT, _CENTIMETRES = 'Hips', 100
# Bones that are shorter than this have no direction [m].
_SHORTEST = 0.01
# Names of the order in which rotations are given: R = Rz Rx Ry.
_ROTATION = 'Zrotation Xrotation Yrotation'


class _Bone(NamedTuple):
    """A joint of the file, and the bone that it turns."""

    name: str
    parent: str
    start: str  # points of the person
    end: str
    rest: np.ndarray  # direction at rest


def _side(side: str, hip: str, outwards: np.ndarray) -> List[_Bone]:
    low = side.lower()
    return [_Bone(hip, _ROOT, 'hips', f'{low}_hip', outwards),
            _Bone(f'{side}UpLeg', hip, f'{low}_hip', f'{low}_knee', -_Y),
            _Bone(f'{side}Leg', f'{side}UpLeg', f'{low}_knee', f'{low}_ankle', -_Y),
            _Bone(f'{side}Foot', f'{side}Leg', f'{low}_ankle', f'{low}_big_toe', _Z),
            _Bone(f'{side}Shoulder', 'Spine', 'neck', f'{low}_shoulder', outwards),
            _Bone(f'{side}Arm', f'{side}Shoulder', f'{low}_shoulder', f'{low}_elbow', outwards),
            _Bone(f'{side}ForeArm', f'{side}Arm', f'{low}_elbow', f'{low}_wrist', outwards)]


_BONES = (_Bone('Spine', _ROOT, 'hips', 'neck', _Y), _Bone('Neck', 'Spine', 'neck', 'head', _Y),
          _Bone('Head', 'Neck', 'head', 'nose', _Z), *_side('Left', 'LHipJoint', _X), *_side('Right', 'RHipJoint', -_X))


def bvh_text(person: MarkerRecording) -> str:
    """Return the file of a person's joints with y up [cm, deg]; before the first it is at rest, from 0 s on.

    Raises:
        BadInputError: its hips or its neck are never known.
    """
    points = _points(person)
    known: Dict[str, np.ndarray] = {}
    for bone in _BONES:
        vectors = points.get(bone.end, np.nan) - points.get(bone.start, np.full((len(person), 3), np.nan))
        if np.isfinite(vectors).all(axis=1).any() and _median_length(vectors) > _SHORTEST:
            known[bone.name] = vectors
    if not {'LHipJoint', 'RHipJoint', 'Spine'} <= set(known):
        raise BadInputError('no hips or no neck at any time')
    turns = {_ROOT: _pelvis(_filled(known['LHipJoint'] - known['RHipJoint']), _filled(known['Spine']))}
    local = dict(turns)  # in the frame of the parent
    bones = []
    for bone in _BONES:  # parents come first
        if bone.name in known and bone.parent in turns:
            parent = turns[bone.parent]
            local[bone.name] = _shortest_turn(bone.rest, np.einsum('tji,tj->ti', parent, _filled(known[bone.name])))
            turns[bone.name] = parent @ local[bone.name]
            bones.append(bone)
    ends = {_ROOT: np.zeros(3), **{bone.name: _median_length(known[bone.name]) * bone.rest for bone in bones}}
    order: List[str] = []
    lines = ['HIERARCHY', *_joint(_ROOT, np.zeros(3), bones, ends, order)]
    rows = np.concatenate([_CENTIMETRES * _filled(points['hips']), *(_degrees(local[name]) for name in order)], axis=1)
    rest = np.concatenate([rows[0, :3], np.zeros(rows.shape[1] - 3)])
    rows = np.concatenate([np.tile(rest, (int(np.rint(person.times[0] * person.rate)), 1)), rows])
    lines += ['MOTION', f'Frames: {len(rows)}', f'Frame Time: {1 / person.rate:.7f}']
    lines += [' '.join(f'{value:.5f}' for value in row) for row in rows.tolist()]
    return '\n'.join(lines) + '\n'


def _points(person: MarkerRecording) -> Dict[str, np.ndarray]:
    """Return the joints (T, 3), the middle of the hips, and the head: the middle of the ears, or its top."""
    nowhere = np.full((len(person), 3), np.nan)
    points = {joint: person.positions[:, column] for column, joint in enumerate(person.names)}
    points['hips'], ears = ((points.get(f'left_{part}', nowhere) + points.get(f'right_{part}', nowhere)) / 2
                            for part in ('hip', 'ear'))
    points['head'] = ears if np.isfinite(ears).any() else points.get('head_top', points.get('nose', nowhere))
    return points


def _median_length(vectors: np.ndarray) -> float:
    return float(np.nanmedian(np.linalg.norm(vectors, axis=1)))


def _filled(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (T, 3) with those between that are missing interpolated, those before and after held."""
    known = np.flatnonzero(np.isfinite(vectors).all(axis=1))
    times = np.arange(len(vectors))
    return np.stack([np.interp(times, known, vectors[known, axis]) for axis in range(3)], axis=1)


def _pelvis(left: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return rotations (T, 3, 3) of a pelvis whose x is to the left, y nearest to up."""
    x, z = _unit(left), _unit(np.cross(left, up))
    return np.stack([x, np.cross(z, x), z], axis=2)


def _shortest_turn(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the rotations (T, 3, 3) of least angle that turn a unit vector (3,) to directions (T, 3)."""
    end = _unit(end)
    axis, cosine = np.cross(start, end), end @ start
    backwards = cosine < -1 + 1e-9  # any axis across
    cross = np.cross(np.eye(3), axis[:, np.newaxis])
    turns: np.ndarray = np.eye(3) + cross + cross @ cross / np.where(backwards, 1, 1 + cosine)[:, None, None]
    across = np.roll(start, 1)
    turns[backwards] = 2 * np.outer(across, across) - np.eye(3)
    return turns


def _degrees(turns: np.ndarray) -> np.ndarray:
    """Return the angles z, x, y [deg] of R = Rz Rx Ry, (T, 3), without jumps of 360 degrees."""
    x = np.arcsin(np.clip(turns[:, 2, 1], -1, 1))
    z, y = np.arctan2(-turns[:, 0, 1], turns[:, 1, 1]), np.arctan2(-turns[:, 2, 0], turns[:, 2, 2])
    return np.degrees(np.unwrap(np.stack([z, x, y], axis=1), axis=0))


def _joint(name: str, offset: np.ndarray, bones: Sequence[_Bone], ends: Dict[str, np.ndarray], order: List[str]
           ) -> List[str]:
    """Return the lines of a joint and those below it; add their names to `order`, that of the columns."""
    order.append(name)
    kind, channels = (('ROOT', f'6 Xposition Yposition Zposition {_ROTATION}') if name == _ROOT else
                      ('JOINT', f'3 {_ROTATION}'))
    below = [line for bone in bones if bone.parent == name
             for line in _joint(bone.name, ends[name], bones, ends, order)]
    below = below or ['End Site', '{', f'\t{_offset(ends[name])}', '}']
    return [f'{kind} {name}', '{', f'\t{_offset(offset)}', f'\tCHANNELS {channels}',
            *(f'\t{line}' for line in below), '}']


def _offset(vector: np.ndarray) -> str:
    return 'OFFSET ' + ' '.join(f'{value:.5f}' for value in (_CENTIMETRES * vector + 0.0).tolist())


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
