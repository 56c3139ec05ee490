"""People as obstacles on the floor: for teb_local_planner costmap_converter/ObstacleArrayMsg, for costmap_2d points of
their footprints, now and in the next seconds, and a scan that clears what these marked before.
"""
import dataclasses
from typing import List, Tuple

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point32, Polygon, Quaternion, Twist, TwistWithCovariance, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSignalsArray
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header

from openpose_ros_bridges.capsules import capsules_of
from openpose_ros_bridges.footprints import BODY, Circle, circles_of, points_in, predicted
from openpose_ros_bridges.located import covariance, located
from openpose_ros_bridges.node_params import ObstacleParams, ObstacleSettings
from openpose_ros_bridges.ros.bridge import PEOPLE, SIGNALS, Bridge, Output
from openpose_ros_bridges.ros.planning_frames import PlanningFrames
from openpose_ros_pkg.errors import ForeignPackageError
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_signals.ros.convert import signals_from_array
from skeleton_extract_3d.points.depth import XYZRGB
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros.convert import cloud_to_message, people_from_array

COSTMAP_CONVERTER = ForeignPackage('costmap_converter', 'https://github.com/rst-tu-dortmund/costmap_converter (branch '
                                                        'master)')


class Footprints:
    """Where on the floor people are, in the frame of a planner."""

    def __init__(self, params: ObstacleParams) -> None:
        self.params = params
        self._frames = PlanningFrames(params.tf_timeout, params.planning_frame, params.robot_frame)

    def circles(self, people: PersonDetection_3dArray, signals: PersonSignalsArray, frame: str, shape: str
                ) -> List[Circle]:
        """Return the footprints of a frame; NoTransformError: tf does not know it."""
        in_space = people_from_array(people)
        turn, move = self._frames.to(frame, signals.header)
        persons = [dataclasses.replace(
            person, position=turn @ person.position + move,
            velocity=None if person.velocity is None else turn @ person.velocity)
            for person in located(in_space, signals_from_array(signals))]
        capsules = capsules_of(transform_people(in_space, *self._frames.to(frame, people.header)))
        return circles_of(persons, capsules, shape, self.params.sigmas)


class ObstacleMessages:
    """Makes the obstacles of teb_local_planner.

    Attributes:
        kind: class of costmap_converter/ObstacleArrayMsg.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self, footprints: Footprints) -> None:
        self._footprints, self._frame = footprints, footprints.params.planning_frame
        load = COSTMAP_CONVERTER.message
        self._obstacle = load('ObstacleMsg', {
            'header': 'std_msgs/Header', 'polygon': 'geometry_msgs/Polygon', 'radius': 'float64', 'id': 'int64',
            'orientation': 'geometry_msgs/Quaternion', 'velocities': 'geometry_msgs/TwistWithCovariance'})
        self.kind = load('ObstacleArrayMsg', {'header': 'std_msgs/Header',
                                              'obstacles': 'costmap_converter/ObstacleMsg[]'})

    def convert(self, people: PersonDetection_3dArray, signals: PersonSignalsArray) -> genpy.Message:
        """Return the obstacles of a frame; NoTransformError: tf does not know it."""
        header = _in_frame(signals.header, self._frame)
        return self.kind(header=header, obstacles=[self._of(circle, header) for circle in self._footprints.circles(
            people, signals, self._frame, self._footprints.params.footprint)])

    def end(self, header: Header) -> genpy.Message:
        """Return the message without obstacles."""
        return self.kind(header=header)

    def _of(self, circle: Circle, header: Header) -> genpy.Message:
        velocity = TwistWithCovariance(Twist(linear=Vector3(*circle.velocity, 0.0)),
                                       covariance(circle.velocity_sigma, np.nan))
        return self._obstacle(header=header, id=circle.id, radius=circle.radius, velocities=velocity,
                              polygon=Polygon([Point32(*circle.centre, 0.0)]),
                              orientation=Quaternion(0.0, 0.0, 0.0, 1.0))


class CostmapMessages:
    """Makes what an obstacle layer of costmap_2d reads."""

    def __init__(self, footprints: Footprints) -> None:
        self._footprints = footprints

    def convert(self, people: PersonDetection_3dArray, signals: PersonSignalsArray) -> PointCloud2:
        """Return the points of footprints, of now and predicted; NoTransformError: tf does not know the frame."""
        params = self._footprints.params
        circles = [ahead for circle in self._footprints.circles(people, signals, params.robot_frame, BODY)
                   for ahead in predicted(circle, params.horizon, params.step, params.sigmas)]
        return self._cloud(points_in(circles, params.spacing, params.robot_radius, params.footprint_range),
                           _in_frame(signals.header, params.robot_frame))

    def end(self, header: Header) -> PointCloud2:
        """Return the cloud without points."""
        return self._cloud(np.zeros((0, 2)), header)

    def clearing(self, people: PersonDetection_3dArray) -> LaserScan:
        """Return a scan that meets nothing, all round the robot."""
        params = self._footprints.params
        # costmap_2d frees the cells of a line to the cell where the ray ends. The ends of neighbouring rays are half of
        # `spacing` apart, so in the same cell or in cells that meet: half way their lines are at most a cell apart.
        reach = 2 * params.footprint_range
        number = int(np.ceil(4 * np.pi * reach / params.spacing))
        step = 2 * np.pi / number
        return LaserScan(header=_in_frame(people.header, params.robot_frame), angle_min=-np.pi,
                         angle_max=np.pi - step, angle_increment=step, range_min=0.0, range_max=reach,
                         ranges=[np.inf] * number)

    def _cloud(self, points: np.ndarray, header: Header) -> PointCloud2:
        cloud = np.zeros((1, len(points)), XYZRGB)
        cloud['x'], cloud['y'], cloud['z'] = points[:, 0], points[:, 1], self._footprints.params.height
        return cloud_to_message(cloud, header)


def _in_frame(header: Header, frame: str) -> Header:
    """Return the header of what is in a frame, or, with '', in that of a header."""
    return Header(stamp=header.stamp, frame_id=frame or header.frame_id)


def _teb(footprints: Footprints) -> Tuple[Output, ...]:
    """Return the output for teb_local_planner, if its messages are there."""
    try:
        messages = ObstacleMessages(footprints)
    except ForeignPackageError as error:
        rospy.logwarn('%s has no obstacles for teb_local_planner: %s', rospy.get_name(), error)
        return ()
    return (Output('~obstacles', messages.kind, (PEOPLE, SIGNALS), messages.convert, messages.end,
                   footprints.params.max_rate),)


def main() -> None:
    """Run the bridge to planners on the floor."""
    def make(settings: ObstacleSettings) -> Bridge:
        footprints = Footprints(settings.obstacles)
        costmap, rate = CostmapMessages(footprints), settings.obstacles.max_rate
        return Bridge(settings.demand, *_teb(footprints),
                      Output('~footprints', PointCloud2, (PEOPLE, SIGNALS), costmap.convert, costmap.end, rate),
                      Output('~clearing', LaserScan, (PEOPLE,), costmap.clearing, rate=rate))

    run_node('obstacles_node', ObstacleSettings, make)
