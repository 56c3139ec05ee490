"""People as obstacles on the floor: for teb_local_planner costmap_converter/ObstacleArrayMsg, for costmap_2d points of
their footprints, now and in the next seconds, and a scan that clears what these marked before.
"""
import dataclasses
from typing import List, Sequence

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point32, Polygon, Quaternion, Twist, TwistWithCovariance, Vector3
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSignalsArray
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header

from openpose_ros_bridges.footprints import Circle, circles_of, points_in, predicted
from openpose_ros_bridges.located import covariance, located
from openpose_ros_bridges.node_params import ObstacleParams
from openpose_ros_bridges.ros.bridge import HEADER, PEOPLE, PLANNER_RATE, SIGNALS, FieldMap, Output, run_bridge
from openpose_ros_pkg.errors import ForeignPackageError
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_signals.capsules import capsules_of
from openpose_ros_signals.ros.convert import signals_from_array
from openpose_ros_signals.ros.frames import Frames
from skeleton_extract_3d.points.depth import XYZRGB
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros.convert import cloud_to_message, people_from_array

COSTMAP_CONVERTER = ForeignPackage('costmap_converter', 'https://github.com/rst-tu-dortmund/costmap_converter (branch '
                                                        'master)')
# Time from one predicted footprint to the next [s].
_STEP = 0.25
# Distance of the points in a footprint, at most the resolution of the costmap, and their height over the floor [m].
_SPACING, _HEIGHT = 0.05, 0.5
# Points farther from the robot are left out. The scan that clears reaches twice as far: nearer its rays miss no cell.
_RANGE = 5.0


class Footprints:
    """Where on the floor people are, in the frames of planners; `circles` raises NoTransformError."""

    def __init__(self, params: ObstacleParams) -> None:
        self._params = params
        self._frames = Frames(params.planning_frame, params.robot_frame)

    def circles(self, people: PersonDetection_3dArray, signals: PersonSignalsArray, frame: str) -> List[Circle]:
        in_space = people_from_array(people)
        turn, move = self._frames.to(frame, signals.header)
        persons = [dataclasses.replace(
            person, position=turn @ person.position + move,
            velocity=None if person.velocity is None else turn @ person.velocity)
            for person in located(in_space, signals_from_array(signals))]
        capsules = capsules_of(transform_people(in_space, *self._frames.to(frame, people.header)))
        return circles_of(persons, capsules, self._params.sigmas)


def teb_output(params: ObstacleParams, footprints: Footprints) -> Output:
    """Return the obstacles of teb_local_planner; raises ForeignPackageError where its messages are not found."""
    obstacle = FieldMap(
        COSTMAP_CONVERTER, 'ObstacleMsg', header=HEADER,
        polygon=('geometry_msgs/Polygon', lambda _, circle: Polygon([Point32(*circle.centre, 0.0)])),
        radius=('float64', lambda _, circle: circle.radius), id=('int64', lambda _, circle: circle.id),
        orientation=('geometry_msgs/Quaternion', lambda *_: Quaternion(0.0, 0.0, 0.0, 1.0)),
        velocities=('geometry_msgs/TwistWithCovariance', lambda _, circle: TwistWithCovariance(
            Twist(linear=Vector3(*circle.velocity, 0.0)), covariance(circle.velocity_sigma, np.nan))))
    obstacles = FieldMap(COSTMAP_CONVERTER, 'ObstacleArrayMsg', header=HEADER,
                         obstacles=('costmap_converter/ObstacleMsg[]', lambda header, circles: [
                             obstacle(header, circle) for circle in circles]))

    def convert(people: PersonDetection_3dArray, signals: PersonSignalsArray) -> genpy.Message:
        return obstacles(_in_frame(signals.header, params.planning_frame),
                         footprints.circles(people, signals, params.planning_frame))

    return Output('~obstacles', obstacles.kind, (PEOPLE, SIGNALS), convert, lambda header: obstacles(header, []),
                  PLANNER_RATE)


def costmap_outputs(params: ObstacleParams, footprints: Footprints) -> Sequence[Output]:
    """Return what an obstacle layer of costmap_2d reads: points of footprints, and a scan that meets nothing."""
    def cloud(points: np.ndarray, header: Header) -> PointCloud2:
        values = np.zeros((1, len(points)), XYZRGB)
        values['x'], values['y'], values['z'] = points[:, 0], points[:, 1], _HEIGHT
        return cloud_to_message(values, header)

    def points(people: PersonDetection_3dArray, signals: PersonSignalsArray) -> PointCloud2:
        circles = [ahead for circle in footprints.circles(people, signals, params.robot_frame)
                   for ahead in predicted(circle, params.horizon, _STEP, params.sigmas)]
        return cloud(points_in(circles, _SPACING, params.robot_radius, _RANGE),
                     _in_frame(signals.header, params.robot_frame))

    # costmap_2d frees the cells of a line to the cell where the ray ends. The ends of neighbouring rays are half of the
    # spacing apart, so in the same cell or in cells that meet: half way their lines are at most a cell apart.
    number = int(np.ceil(4 * np.pi * 2 * _RANGE / _SPACING))
    step = 2 * np.pi / number

    def clearing(people: PersonDetection_3dArray) -> LaserScan:
        return LaserScan(header=_in_frame(people.header, params.robot_frame), angle_min=-np.pi,
                         angle_max=np.pi - step, angle_increment=step, range_min=0.0, range_max=2 * _RANGE,
                         ranges=[np.inf] * number)

    def no_points(header: Header) -> PointCloud2:
        return cloud(np.zeros((0, 2)), header)

    return (Output('~footprints', PointCloud2, (PEOPLE, SIGNALS), points, no_points, PLANNER_RATE),
            Output('~clearing', LaserScan, (PEOPLE,), clearing, rate=PLANNER_RATE))


def _in_frame(header: Header, frame: str) -> Header:
    """Return the header of what is in a frame, or, with '', in that of a header."""
    return Header(stamp=header.stamp, frame_id=frame or header.frame_id)


def outputs(params: ObstacleParams) -> Sequence[Output]:
    """Return the outputs of the node; that for teb_local_planner, if its messages are there."""
    footprints = Footprints(params)
    found = costmap_outputs(params, footprints)
    try:
        return (teb_output(params, footprints), *found)
    except ForeignPackageError as error:
        rospy.logwarn('%s has no obstacles for teb_local_planner: %s', rospy.get_name(), error)
        return found


def main() -> None:
    """Run the bridge to planners on the floor."""
    run_bridge('obstacles_node', ObstacleParams, outputs)
