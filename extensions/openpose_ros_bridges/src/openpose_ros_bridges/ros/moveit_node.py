"""People as objects of MoveIt's planning scene, moveit_msgs/PlanningScene, and as markers."""
from typing import Dict, List, Optional, Sequence, Tuple

import genpy
import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from openpose_ros_bridges.node_params import MoveitParams
from openpose_ros_bridges.planning_scene import Solid, solids_of
from openpose_ros_bridges.robot_links import read_links, without_links
from openpose_ros_bridges.ros.bridge import HEADER, PEOPLE, PLANNER_RATE, FieldMap, Output, run_bridge
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_signals.capsules import capsules_of
from openpose_ros_signals.ros.frames import Frames
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros.convert import people_from_array

MOVEIT = ForeignPackage('moveit_msgs', 'https://github.com/moveit/moveit_msgs (branch master)')
SHAPES = ForeignPackage('shape_msgs', 'https://github.com/ros/common_msgs (branch noetic-devel)')
# Links of the robot are wider by this, on each side [m].
_PADDING = 0.05
_NO_TURN = Quaternion(0.0, 0.0, 0.0, 1.0)
_COLOUR = ColorRGBA(1.0, 0.6, 0.1, 0.35)


class PlanningSceneMessages:
    """Makes diffs of planning scenes; remembers which objects are there.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
        ParameterError: `robot_links` has a link that is none.
    """

    def __init__(self, params: MoveitParams) -> None:
        self._params = params
        self._known: Sequence[str] = ()  # objects that the planner knows
        self._links = read_links(params.robot_links, 'robot_links')
        self._frames = Frames(params.planning_frame, params.robot_links)
        self.kind = MOVEIT.message('PlanningScene', {
            'robot_state': 'moveit_msgs/RobotState', 'world': 'moveit_msgs/PlanningSceneWorld', 'is_diff': 'bool'})
        primitive = FieldMap(SHAPES, 'SolidPrimitive', type=('uint8', lambda kind, *_: kind),
                             dimensions=('float64[]', lambda _, *sizes: list(sizes)))

        def primitives(solid: Solid) -> List[genpy.Message]:
            ball = primitive(primitive.kind.SPHERE, solid.radius)
            return [primitive(primitive.kind.CYLINDER, solid.length, solid.radius), ball, ball]

        self._object = FieldMap(
            MOVEIT, 'CollisionObject', header=HEADER, id=('string', lambda _, name, solid: name),
            operation=('byte', lambda _, name, solid: self._object.kind.ADD if solid else self._object.kind.REMOVE),
            pose=('geometry_msgs/Pose', lambda _, name, solid: _pose(solid) if solid else Pose(Point(), _NO_TURN)),
            primitives=('shape_msgs/SolidPrimitive[]', lambda _, name, solid: primitives(solid) if solid else []),
            primitive_poses=('geometry_msgs/Pose[]', lambda _, name, solid: (
                [Pose(Point(0.0, 0.0, height), _NO_TURN) for height in (0.0, -solid.length / 2, solid.length / 2)]
                if solid else [])))

    def convert(self, message: PersonDetection_3dArray) -> Optional[genpy.Message]:
        """Return the scene of a frame, None: no person is or was there; raises NoTransformError."""
        return self._diff(*self._solids(message))

    def end(self, header: Header) -> Optional[genpy.Message]:
        """Return the message that removes all people."""
        return self._diff({}, header)

    def markers(self, message: PersonDetection_3dArray) -> MarkerArray:
        """Return the parts of people as markers, in the place of all earlier ones."""
        solids, header = self._solids(message)
        markers = self.no_markers(header).markers
        for number, solid in enumerate(solids.values()):
            width = 2 * solid.radius
            balls = ((Pose(Point(*end), _NO_TURN), Marker.SPHERE, width) for end in solid.ends.tolist())
            for sort, (pose, kind, height) in enumerate(((_pose(solid), Marker.CYLINDER, solid.length), *balls)):
                markers.append(Marker(header=header, ns='people', id=3 * number + sort, type=kind, pose=pose,
                                      scale=Vector3(width, width, height), color=_COLOUR))
        return MarkerArray(markers)

    @staticmethod
    def no_markers(header: Header) -> MarkerArray:
        """Return the message that deletes all markers."""
        return MarkerArray([Marker(header=header, action=Marker.DELETEALL)])

    def _solids(self, message: PersonDetection_3dArray) -> Tuple[Dict[str, Solid], Header]:
        """Return the parts of people, without those that are the robot's, and the header of their frame."""
        frame = self._params.planning_frame
        people = transform_people(people_from_array(message), *self._frames.to(frame, message.header))
        header = Header(stamp=message.header.stamp, frame_id=frame or message.header.frame_id)
        capsules = capsules_of(people)
        if self._links and len(capsules):
            poses = {name: self._frames.known(name, header) for link in self._links
                     for name in (link.start, link.end)}
            origins = {name: np.full(3, np.nan) if pose is None else pose[1] for name, pose in poses.items()}
            ends = np.array([(origins[link.start], origins[link.end]) for link in self._links])
            capsules = without_links(capsules, ends, [link.radius + _PADDING for link in self._links])
        return solids_of(capsules, self._params.sigmas), header

    def _diff(self, solids: Dict[str, Solid], header: Header) -> Optional[genpy.Message]:
        """Return what adds all parts, in the place of those of their names, and removes those that are gone."""
        gone, self._known = [name for name in self._known if name not in solids], list(solids)
        if not gone and not solids:
            return None
        scene = self.kind(is_diff=True)
        scene.robot_state.is_diff = True  # else all attached objects would be taken away
        scene.world.collision_objects = [
            *(self._object(header, name, None) for name in gone),
            *(self._object(header, name, solid) for name, solid in solids.items())]
        return scene


def _pose(solid: Solid) -> Pose:
    return Pose(Point(*solid.centre.tolist()), Quaternion(*solid.orientation.tolist()))


def outputs(params: MoveitParams) -> Sequence[Output]:
    """Return the outputs of the node."""
    messages = PlanningSceneMessages(params)
    return (Output('planning_scene', messages.kind, (PEOPLE,), messages.convert, messages.end, PLANNER_RATE),
            Output('~markers', MarkerArray, (PEOPLE,), messages.markers, messages.no_markers, PLANNER_RATE))


def main() -> None:
    """Run the bridge to MoveIt."""
    run_bridge('moveit_node', MoveitParams, outputs)
