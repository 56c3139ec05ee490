"""People as objects of MoveIt's planning scene, moveit_msgs/PlanningScene, and as markers."""
from functools import partial
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray
from scipy.spatial.transform import Rotation
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from openpose_ros_bridges.capsules import capsules_of
from openpose_ros_bridges.node_params import MoveitParams, MoveitSettings
from openpose_ros_bridges.planning_scene import ADD, MOVE, REMOVE, Change, SceneObjects, Solid, solids_of
from openpose_ros_bridges.robot_links import read_links, without_links
from openpose_ros_bridges.ros.bridge import PEOPLE, Bridge, Output
from openpose_ros_bridges.ros.planning_frames import PlanningFrames
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros.convert import people_from_array

MOVEIT = ForeignPackage('moveit_msgs', 'https://github.com/moveit/moveit_msgs (branch master)')
SHAPES = ForeignPackage('shape_msgs', 'https://github.com/ros/common_msgs (branch noetic-devel)')
# Below it each node has the names of its objects, for the one that starts after it was killed.
_OBJECTS = '/openpose_ros/planning_scene_objects'
_NO_TURN = Quaternion(0.0, 0.0, 0.0, 1.0)
_COLOUR = ColorRGBA(1.0, 0.6, 0.1, 0.35)


class PlanningSceneMessages:
    """Makes diffs of planning scenes; remembers what they have told.

    Attributes:
        kind: class of moveit_msgs/PlanningScene.

    Args:
        left: names of objects that are there from before.
        save: is called with the names of all objects that are there when they change.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
        ParameterError: `robot_links` has a link that is none.
    """

    def __init__(self, params: MoveitParams, left: Sequence[str] = (),
                 save: Callable[[Sequence[str]], None] = lambda names: None) -> None:
        self._params = params
        self._links = read_links(params.robot_links, 'robot_links')
        self._object = MOVEIT.message('CollisionObject', {
            'header': 'std_msgs/Header', 'pose': 'geometry_msgs/Pose', 'id': 'string',
            'primitives': 'shape_msgs/SolidPrimitive[]', 'primitive_poses': 'geometry_msgs/Pose[]',
            'operation': 'byte'})
        self.kind = MOVEIT.message('PlanningScene', {
            'robot_state': 'moveit_msgs/RobotState', 'world': 'moveit_msgs/PlanningSceneWorld', 'is_diff': 'bool'})
        self._primitive = SHAPES.message('SolidPrimitive', {'type': 'uint8', 'dimensions': 'float64[]'})
        self._operations = {ADD: self._object.ADD, MOVE: self._object.MOVE, REMOVE: self._object.REMOVE}
        self._frames = PlanningFrames(params.tf_timeout, params.planning_frame, params.robot_links)
        self._save = save
        self._objects = SceneObjects(left)

    def convert(self, message: PersonDetection_3dArray) -> Optional[genpy.Message]:
        """Return what changes with a frame; None: nothing.

        Raises:
            NoTransformError: tf does not know the frame of the people.
        """
        solids, header = self._solids(message)
        before = self._objects.names
        changes = self._objects.update(solids, header.stamp.to_sec())
        if self._objects.names != before:
            self._save(self._objects.names)
        return self._diff(changes, header)

    def end(self, header: Header) -> Optional[genpy.Message]:
        """Return the message that removes all people."""
        changes = self._objects.clear()
        self._save(())
        return self._diff(changes, header)

    def markers(self, message: PersonDetection_3dArray) -> MarkerArray:
        """Return the parts of people as markers, in the place of all earlier ones."""
        solids, header = self._solids(message)
        markers = self.no_markers(header).markers
        for number, solid in enumerate(solids.values()):
            width = 2 * solid.radius
            for sort, (pose, kind, height) in enumerate(((_pose(solid), Marker.CYLINDER, solid.length),
                                                         *((end, Marker.SPHERE, width) for end in _ends(solid)))):
                markers.append(Marker(header=header, ns='people', id=3 * number + sort, type=kind, pose=pose,
                                      scale=Vector3(width, width, height), color=_COLOUR))
        return MarkerArray(markers)

    @staticmethod
    def no_markers(header: Header) -> MarkerArray:
        """Return the message that deletes all markers."""
        return MarkerArray([Marker(header=header, action=Marker.DELETEALL)])

    def _solids(self, message: PersonDetection_3dArray) -> Tuple[Dict[str, Solid], Header]:
        """Return the parts of people, without those that are the robot's, and the header of their frame."""
        params = self._params
        people = transform_people(people_from_array(message), *self._frames.to(params.planning_frame, message.header))
        header = Header(stamp=message.header.stamp, frame_id=params.planning_frame or message.header.frame_id)
        capsules = capsules_of(people)
        if self._links and len(capsules):
            capsules = without_links(capsules, self._link_ends(header),
                                     [link.radius + params.robot_padding for link in self._links])
        return solids_of(capsules, params.prefix, params.sigmas), header

    def _link_ends(self, header: Header) -> np.ndarray:
        nowhere = np.full(3, np.nan)
        origins = {frame: self._frames.origin_of(frame, header) for frame in {
            frame for link in self._links for frame in (link.start, link.end)}}
        return np.array([[nowhere if origins[frame] is None else origins[frame] for frame in (link.start, link.end)]
                         for link in self._links])

    def _diff(self, changes: Sequence[Change], header: Header) -> Optional[genpy.Message]:
        if not changes:
            return None
        scene = self.kind(is_diff=True)
        scene.robot_state.is_diff = True  # else all attached objects would be taken away
        scene.world.collision_objects = [self._object_of(change, header) for change in changes]
        return scene

    def _object_of(self, change: Change, header: Header) -> genpy.Message:
        solid = change.solid
        told = self._object(header=header, id=change.name, operation=self._operations[change.operation],
                            pose=_pose(solid))
        if change.operation == ADD:
            ball, cylinder = (self._primitive(type=kind, dimensions=dimensions) for kind, dimensions in (
                (self._primitive.SPHERE, [solid.radius]),
                (self._primitive.CYLINDER, [solid.length, solid.radius])))
            told.primitives = [cylinder, ball, ball]
            told.primitive_poses = [Pose(Point(), _NO_TURN), *(
                Pose(Point(0.0, 0.0, side * solid.length / 2), _NO_TURN) for side in (-1, 1))]
        return told


def _pose(solid: Solid) -> Pose:
    return Pose(Point(*solid.centre.tolist()), Quaternion(*solid.orientation.tolist()))


def _ends(solid: Solid) -> List[Pose]:
    """Return where the axis of a capsule ends."""
    along = Rotation.from_quat(solid.orientation).apply((0.0, 0.0, solid.length / 2))
    return [Pose(Point(*(solid.centre + side * along).tolist()), _NO_TURN) for side in (-1, 1)]


def saver(key: str) -> Callable[[Sequence[str]], None]:
    """Return what saves names as a parameter, and does not wait for it: the master may be gone."""
    def failed(error: Exception) -> None:
        rospy.logwarn_throttle(60.0, f'the names of the objects are not saved: {error}')

    worker = NewestWinsWorker(partial(rospy.set_param, key), failed, 'names of objects')
    return lambda names: worker.submit(list(names))


def main() -> None:
    """Run the bridge to MoveIt."""
    def make(settings: MoveitSettings) -> Bridge:
        saved = _OBJECTS + rospy.get_name()
        messages = PlanningSceneMessages(settings.moveit, rospy.get_param(saved, []), saver(saved))
        return Bridge(settings.demand,
                      Output('planning_scene', messages.kind, (PEOPLE,), messages.convert, messages.end,
                             settings.moveit.max_rate),
                      Output('~markers', MarkerArray, (PEOPLE,), messages.markers, messages.no_markers,
                             settings.moveit.max_rate))

    run_node('moveit_node', MoveitSettings, make)
