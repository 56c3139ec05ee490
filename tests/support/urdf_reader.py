"""Read a URDF as urdfdom does, which rviz and robot_state_publisher parse it with, and refuse what it refuses.

Source: urdfdom 3.0.1 (BSD), urdf_parser/src/model.cpp, parseURDF (lines 91-270) with initTree and initRoot of
urdfdom_headers' ModelInterface, link.cpp and joint.cpp. What models of people do without is not read: inertias, meshes,
mimics, safety.
"""
from typing import Dict, List, NamedTuple, Tuple
from xml.etree import ElementTree

Vector = Tuple[float, ...]
Drawn = Tuple[str, Vector, Dict[str, float]]
"""What is drawn of a link: its kind, the origin of its middle [m], and its sizes [m]."""


class UrdfJoint(NamedTuple):
    """A joint between two links."""

    kind: str
    parent: str
    child: str
    origin: Vector


class UrdfModel(NamedTuple):
    """A robot model: the link that has no parent, what is drawn of each link, and the joints."""

    root: str
    links: Dict[str, List[Drawn]]
    joints: Dict[str, UrdfJoint]


def parsed_urdf(text: str) -> UrdfModel:
    """Return the model; ValueError or ParseError: urdfdom would refuse it, or not draw all of it."""
    robot = ElementTree.fromstring(text)
    _need(robot.tag == 'robot' and robot.get('name'), 'no robot with a name')
    materials = {_attribute(material, 'name') for material in robot.iterfind('material')}
    _need(all(len(_numbers(colour, 'rgba')) == 4 for colour in robot.iterfind('material/color')), 'no colour')
    links: Dict[str, List[Drawn]] = {}
    for link in robot.iterfind('link'):
        _need(_attribute(link, 'name') not in links, f"two links {link.get('name')}")
        links[_attribute(link, 'name')] = [_drawn(visual, materials) for visual in link.iterfind('visual')]
    joints: Dict[str, UrdfJoint] = {}
    for joint in robot.iterfind('joint'):
        _need(_attribute(joint, 'name') not in joints, f"two joints {joint.get('name')}")
        joints[_attribute(joint, 'name')] = _joint(joint)
    children = [joint.child for joint in joints.values()]
    _need({joint.parent for joint in joints.values()} | set(children) <= set(links), 'a joint without a link')
    _need(len(set(children)) == len(children), 'a link with two parents')
    roots = set(links) - set(children)
    _need(len(roots) == 1, f'{len(roots)} roots')
    return UrdfModel(roots.pop(), links, joints)


def _drawn(visual: ElementTree.Element, materials: 'set[str]') -> Drawn:
    (shape,) = visual.iterfind('geometry/*')
    sizes = {'sphere': ['radius'], 'cylinder': ['radius', 'length']}[shape.tag]
    # a material that is not defined is white
    _need(all(_attribute(material, 'name') in materials for material in visual.iterfind('material')), 'no material')
    return shape.tag, _numbers(visual.find('origin'), 'xyz'), {name: float(_attribute(shape, name)) for name in sizes}


def _joint(joint: ElementTree.Element) -> UrdfJoint:
    kind, axis = _attribute(joint, 'type'), joint.find('axis')
    _need(kind in ('fixed', 'revolute'), f'a joint of type {kind}')
    if kind == 'revolute':
        limits = [float(_attribute(joint.find('limit'), name)) for name in ('lower', 'upper', 'effort', 'velocity')]
        _need(limits[0] < limits[1] and len(_numbers(axis, 'xyz')) == 3, 'no limits or no axis')
    return UrdfJoint(kind, _attribute(joint.find('parent'), 'link'), _attribute(joint.find('child'), 'link'),
                     _numbers(joint.find('origin'), 'xyz'))


def _attribute(element: 'ElementTree.Element | None', name: str) -> str:
    value = None if element is None else element.get(name)
    _need(value, f'no {name}')
    return str(value)


def _numbers(element: 'ElementTree.Element | None', name: str) -> Vector:
    return tuple(float(number) for number in _attribute(element, name).split())


def _need(condition: object, fault: str) -> None:
    if not condition:
        raise ValueError(fault)
