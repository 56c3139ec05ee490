"""Bodies as REP-155 has them: points of the 2D skeleton, links and joints of the kinematic model.

Sources: REP-155, "Kinematic Model of the Human" and "Body Frames"; hri_msgs/Skeleton2D; the axes and signs of the
joints are those of urdf/human-tpl.xacro in https://github.com/ros4hri/human_description.
"""
import warnings
from dataclasses import dataclass
from typing import Dict, NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from skeleton_extract_3d.body.joint_frames import joint_frames, pelvis_frames
from skeleton_extract_3d.people import MISSING, People3D
from skeleton_extract_3d.points.transform import rotation_of

# hri_msgs/Skeleton2D counts as OpenPose does, but for the face, where its left is first.
_LEFT_FIRST = {'right_eye': 'left_eye', 'left_eye': 'right_eye', 'right_ear': 'left_ear', 'left_ear': 'right_ear'}
SKELETON_2D = tuple(_LEFT_FIRST.get(joint, joint) for joint in COCO_18.joints)
"""Joints of hri_msgs/Skeleton2D in its order."""

ARM, LEG = ('shoulder', 'elbow', 'wrist'), ('hip', 'knee', 'ankle')
"""Joints of a limb from its root to its end, and names of the links that begin there, without the side."""
_LIMBS = tuple(tuple(f'{side}_{joint}' for joint in limb) for limb in (ARM, LEG) for side in ('left', 'right'))
# Limbs of the URDF go along -z, those of `joint_frames` along x: columns x, y, z of the former in the latter.
_OF_LIMB = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
_EARS, _HIPS = ('left_ear', 'right_ear'), ('left_hip', 'right_hip')


class Pose(NamedTuple):
    """Where a link is."""

    position: np.ndarray  # (3,) [m]
    rotation: np.ndarray  # (3, 3), columns are its axes


@dataclass(frozen=True)
class BodyPose:
    """A person in space."""

    root: Pose  # of link `body` in the frame of the people: in the middle of the hips, x out of the body, z to the head
    links: Dict[str, Pose]  # of the other links whose joints are known, in that of the root, by their names without id
    joints: Dict[str, float]  # angles of the joints that are known [rad], by their names without id
    velocity: np.ndarray  # (3,) of the root [m/s]; NaN: not estimated


class _Chain(NamedTuple):
    """Joints in a row that turn one link against another."""

    parent: str
    child: str
    known: Tuple[str, ...]  # joints of the child that have to be known
    axes: str  # as `Rotation.as_euler` has them, intrinsic
    names: Tuple[str, ...]  # of the angles
    signs: Tuple[int, int, int]  # of the angles


_CHAINS = (_Chain('torso', 'head', ('nose',), 'XZY', ('r_head', 'y_head', 'p_head'), (1, 1, -1)), *(
    _Chain(parent, f'{side[0]}_{part}', (f'{side}_{part}', f'{side}_{further}'), axes,
           tuple(f'{side[0]}_{letter}_{part}' for letter in 'ypr'), signs)
    for side, sign in (('left', 1), ('right', -1)) for parent, part, further, axes, signs in (
        ('torso', 'shoulder', 'elbow', 'ZXZ', (-sign, sign, sign)), ('body', 'hip', 'knee', 'ZXY', (-1, sign, -1)))))
# Elbows bend forwards, knees backwards.
_HINGES = {f'{side[0]}_{limb[1]}': (tuple(f'{side}_{part}' for part in limb), sign) for side in ('left', 'right')
           for limb, sign in ((ARM, 1), (LEG, -1))}


def skeleton_2d(keypoints: np.ndarray, skeleton: SkeletonModel, size: Tuple[int, int]) -> np.ndarray:
    """Return the points of hri_msgs/Skeleton2D, (18, 3): x, y as shares of the image, confidence; 0 what is missing.

    Keypoints (K, 3) are x, y [px] and score, the size is width and height of the image [px].
    """
    points = np.zeros((len(SKELETON_2D), 3))
    for row, joint in enumerate(SKELETON_2D):
        if joint in skeleton.index and keypoints[skeleton.index[joint], 2] > 0:
            points[row] = keypoints[skeleton.index[joint]] / (*size, 1.0)
    return np.asarray(np.clip(points, 0.0, 1.0))


def body_poses(people: People3D) -> Dict[int, BodyPose]:
    """Return the bodies of the people whose hips are known, by their ids."""
    frames, pelvises, index = joint_frames(people), pelvis_frames(people), people.skeleton.index
    bodies = {}
    for row, name in enumerate(distinct_ids(people.ids).tolist()):
        known = {joint: (people.xyz[row, column].astype(np.float64), frames[row, column])
                 for joint, column in index.items() if people.status[row, column] != MISSING}
        if set(_HIPS) <= set(known) and 'neck' in known:
            bodies[name] = _body(known, pelvises[row], people.velocity[row, [index[hip] for hip in _HIPS]])
    return bodies


def _body(known: Dict[str, Tuple[np.ndarray, np.ndarray]], pelvis: np.ndarray, velocities: np.ndarray) -> BodyPose:
    places = {joint: place for joint, (place, _) in known.items()}
    root = Pose((places[_HIPS[0]] + places[_HIPS[1]]) / 2, pelvis)
    links = {'body': root, 'torso': Pose(*known['neck'])}
    for limb in _LIMBS:
        # without a bone, the frames of the joints are those of the trunk
        has_bone = limb[1] in known and len(known.keys() & set(limb)) > 1
        links.update({f"{joint[0]}_{joint.partition('_')[2]}": Pose(
            known[joint][0], known[joint][1] @ (_OF_LIMB if has_bone else np.eye(3)))
            for joint in limb if joint in known})
    if 'nose' in known and any(ear in known for ear in _EARS):
        links['head'] = Pose(np.mean([places[ear] for ear in _EARS if ear in known], axis=0), known['nose'][1])
    within = {link: Pose(pelvis.T @ (pose.position - root.position), pelvis.T @ pose.rotation)
              for link, pose in links.items() if link != 'body'}
    return BodyPose(root, within, _angles(places, links), velocities.astype(np.float64).mean(axis=0))


def _angles(places: Dict[str, np.ndarray], links: Dict[str, Pose]) -> Dict[str, float]:
    """Return the angles of the joints that are known, by their names [rad]."""
    angles = {'waist': 0.0}  # the line from the hips to the neck is straight
    for chain in _CHAINS:
        if chain.child in links and set(chain.known) <= set(places):
            turn = links[chain.parent].rotation.T @ links[chain.child].rotation
            angles.update(zip(chain.names, _euler(turn, chain)))
    for name, (joints, sign) in _HINGES.items():
        if set(joints) <= set(places):
            first, middle, last = (places[joint] for joint in joints)
            upper, lower = middle - first, last - middle
            angles[name] = sign * float(np.arctan2(np.linalg.norm(np.cross(upper, lower)), upper @ lower))
    return angles


def _euler(turn: np.ndarray, chain: _Chain) -> np.ndarray:
    with warnings.catch_warnings():
        # of an arm that hangs straight down, the sum of the first and third angle is known; the third is 0 then
        warnings.simplefilter('ignore')
        angles = rotation_of(turn).as_euler(chain.axes)
    if chain.axes == 'ZXZ' and chain.signs[1] < 0:  # the same turn, with the second angle as the URDF's limits have it
        angles = angles * (1, -1, 1) + (np.pi, 0, np.pi)
    return np.asarray(chain.signs * ((angles + np.pi) % (2 * np.pi) - np.pi))
