"""The robot model of a person: the URDF that hri_rviz and robot_state_publisher read, and the poses of its links.

Names of links and joints, axes and limits are those of urdf/human-tpl.xacro in human_description 1.0.1 (BSD,
https://github.com/ros4hri/human_description). Its lengths follow from a stature alone; here they are the person's own,
so that the limbs reach from joint to joint.
"""
import math
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_bridges.body_model import ARM, LEG, BodyPose, Pose
from skeleton_extract_3d.body.body import BODY, BONES

# Lengths [m] by the kinds of bones in `BONES`.
Lengths = Mapping[str, float]
Vector = Tuple[float, float, float]
Limits = Tuple[float, float]

# Radius of limbs, as human_description has it [m]; of the head, as a share of the distance from the neck to the ears.
_LIMB_RADIUS, _HEAD_RADIUS = 0.03, 0.5
_COLOUR = '1 0.7 0 1'
_SIDES = (('l', 1), ('r', -1))
_ORIGIN = (0.0, 0.0, 0.0)
# Bones, and the links between which they are measured: left and right are alike.
_MEASURED = (('shoulders', ('l_shoulder', 'r_shoulder')), ('hips', ('l_hip', 'r_hip')), ('trunk', ('body', 'torso')),
             ('head', ('torso', 'head')), *(
    (bone, (f'{side}_{start}', f'{side}_{end}')) for side, _ in _SIDES for bone, start, end in (
        ('upper_arm', *ARM[:2]), ('forearm', *ARM[1:]), ('thigh', *LEG[:2]), ('shin', *LEG[1:]))))


class Joint(NamedTuple):
    """A joint of the model."""

    name: str
    parent: str
    child: str
    origin: Vector = _ORIGIN  # of the child in the parent [m], whose axes are parallel at the angle 0
    axis: Optional[Vector] = None  # about which it turns; None: fixed
    limits: Limits = (0.0, 0.0)  # of the angle [rad]


# What is drawn of a link: the kind of a shape, its sizes [m], its middle [m], and its turn about x [rad].
_Shape = Tuple[str, Dict[str, float], Vector, float]


def lengths_of(body: BodyPose) -> Lengths:
    """Return the lengths of the bones; those that are not seen have an adult's proportions to the trunk."""
    places = {'body': np.zeros(3), **{link: pose.position for link, pose in body.links.items()}}
    seen: Dict[str, List[float]] = {}
    for bone, (start, end) in _MEASURED:
        if start in places and end in places:
            seen.setdefault(bone, []).append(float(np.linalg.norm(places[end] - places[start])))
    adult = dict(zip(BONES, BODY.bone_lengths.tolist()))
    scale = seen['trunk'][0] / adult['trunk']
    return {bone: float(np.mean(seen.get(bone, scale * length))) for bone, length in adult.items()}


def joints_of(lengths: Lengths) -> List[Joint]:
    """Return the joints of the model, those of parents first."""
    to_head = (0.0, 0.0, lengths['head'] / 2)
    joints = [Joint('waist', 'body', 'waist', axis=(0, 1, 0), limits=(-0.2, 1.0)),
              Joint('torso', 'waist', 'torso', (0.0, 0.0, lengths['trunk'])),
              Joint('r_head', 'torso', 'r_head', to_head, (1, 0, 0), (-1.0, 1.0)),
              Joint('y_head', 'r_head', 'y_head', axis=(0, 0, 1), limits=(-1.4, 1.4)),
              Joint('p_head', 'y_head', 'p_head', axis=(0, -1, 0), limits=(-1.5, 1.5)),
              Joint('head', 'p_head', 'head', to_head)]
    for side, sign in _SIDES:
        joints += _limb(side, 'torso', (0.0, sign * lengths['shoulders'] / 2, 0.0), ARM, [
            ((0, 0, -sign), (-1.1, 1.9)), ((sign, 0, 0), (-0.4, 3.3)), ((0, 0, sign), (-1.7, 1.5)),
            ((0, -1, 0), (0.0, 2.5))], (lengths['upper_arm'], lengths['forearm']))
        joints += _limb(side, 'body', (0.0, sign * lengths['hips'] / 2, 0.0), LEG, [
            ((0, 0, -1), (-0.1, 0.6)), ((sign, 0, 0), (-0.4, 3.3)), ((0, -1, 0), (-0.4, 0.7)),
            ((0, -1, 0), (-2.5, 0.0))], (lengths['thigh'], lengths['shin']))
    return joints


def _limb(side: str, parent: str, origin: Vector, parts: Sequence[str], turns: Sequence[Tuple[Vector, Limits]],
          lengths: Tuple[float, float]) -> List[Joint]:
    """Return the joints of a limb: three at its root, the one in its middle, and the fixed one at its end."""
    root, middle, end = (f'{side}_{part}' for part in parts)
    yaw, pitch, roll = (f'{side}_{letter}_{parts[0]}' for letter in 'ypr')
    return [Joint(yaw, parent, yaw, origin, *turns[0]), Joint(pitch, yaw, pitch, _ORIGIN, *turns[1]),
            Joint(roll, pitch, root, _ORIGIN, *turns[2]),
            Joint(middle, root, middle, (0.0, 0.0, -lengths[0]), *turns[3]),
            Joint(end, middle, end, (0.0, 0.0, -lengths[1]))]


def links_of(body: BodyPose, lengths: Lengths) -> Dict[str, Pose]:
    """Return the poses of all links of the model but its root, in that of the root.

    A link that was not seen is where its joint has it, at the angle 0 if that is not known.
    """
    joints, poses = joints_of(lengths), {'body': Pose(np.zeros(3), np.eye(3))}
    for joint in joints:
        parent, turn = poses[joint.parent], np.multiply(joint.axis or _ORIGIN, body.joints.get(joint.name, 0.0))
        poses[joint.child] = body.links.get(joint.child) or Pose(
            parent.position + parent.rotation @ joint.origin,
            parent.rotation @ Rotation.from_rotvec(turn).apply(np.eye(3)).T)
    for side, _ in _SIDES:
        for root in (ARM[0], LEG[0]):
            for letter in 'yp':  # begin where the limb was seen to begin
                link = f'{side}_{letter}_{root}'
                poses[link] = poses[link]._replace(position=poses[f'{side}_{root}'].position)
    return {joint.child: poses[joint.child] for joint in joints}


def urdf_of(name: str, lengths: Lengths) -> str:
    """Return the URDF of a body with an id; the names of its links and joints end with the id."""
    robot = ElementTree.Element('robot', name='human')
    material = ElementTree.SubElement(robot, 'material', name='skin')
    ElementTree.SubElement(material, 'color', rgba=_COLOUR)
    joints, shapes = joints_of(lengths), _shapes(lengths)
    for link in ('body', *(joint.child for joint in joints)):
        element = ElementTree.SubElement(robot, 'link', name=f'{link}_{name}')
        for kind, sizes, middle, turn in shapes.get(link, ()):
            visual = ElementTree.SubElement(element, 'visual')
            ElementTree.SubElement(visual, 'origin', xyz=_text(middle), rpy=_text((turn, 0.0, 0.0)))
            geometry = ElementTree.SubElement(visual, 'geometry')
            ElementTree.SubElement(geometry, kind, {name: str(size) for name, size in sizes.items()})
            ElementTree.SubElement(visual, 'material', name='skin')
    for joint in joints:
        element = ElementTree.SubElement(robot, 'joint', name=f'{joint.name}_{name}',
                                         type='fixed' if joint.axis is None else 'revolute')
        ElementTree.SubElement(element, 'parent', link=f'{joint.parent}_{name}')
        ElementTree.SubElement(element, 'child', link=f'{joint.child}_{name}')
        ElementTree.SubElement(element, 'origin', xyz=_text(joint.origin))
        if joint.axis is not None:
            ElementTree.SubElement(element, 'axis', xyz=_text(joint.axis))
            ElementTree.SubElement(element, 'limit', lower=str(joint.limits[0]), upper=str(joint.limits[1]),
                                   effort='1000', velocity='0.5')
    return ElementTree.tostring(robot, encoding='unicode')


def _shapes(lengths: Lengths) -> Dict[str, List[_Shape]]:
    """Return what is drawn of each link: sticks between joints, balls at joints, a ball for the head with its nose."""
    head = _HEAD_RADIUS * lengths['head']

    def ball(radius: float = _LIMB_RADIUS, middle: Vector = _ORIGIN) -> _Shape:
        return 'sphere', {'radius': radius}, middle, 0.0

    def stick(length: float) -> List[_Shape]:
        return [('cylinder', {'radius': _LIMB_RADIUS, 'length': length}, (0.0, 0.0, -length / 2), 0.0), ball()]

    def across(length: float) -> _Shape:
        return 'cylinder', {'radius': _LIMB_RADIUS, 'length': length}, _ORIGIN, math.pi / 2

    shapes = {'body': [across(lengths['hips'])], 'torso': [*stick(lengths['trunk']), across(lengths['shoulders'])],
              'head': [ball(head), ball(head / 5, (head, 0.0, 0.0))]}
    for side, _ in _SIDES:
        for (root, middle, end), upper, lower in ((ARM, 'upper_arm', 'forearm'), (LEG, 'thigh', 'shin')):
            shapes.update({f'{side}_{root}': stick(lengths[upper]), f'{side}_{middle}': stick(lengths[lower]),
                           f'{side}_{end}': [ball()]})
    return shapes


def _text(vector: Sequence[float]) -> str:
    return ' '.join(map(str, vector))
