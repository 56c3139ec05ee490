"""People become messages of planners, value by value. The packages of these messages are written by the test."""
import numpy as np
import pytest
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray
from sensor_msgs import point_cloud2
from std_msgs.msg import Header

from animated_skeleton import SIGMA, STANDING, people_of, without
from foreign_packages import DEFINITIONS, forget_packages, write_packages
from openpose_ros_bridges.node_params import MoveitParams, ObstacleParams
from openpose_ros_bridges.ros import bridge
from openpose_ros_bridges.ros.bridge import Output, _Publisher
from openpose_ros_bridges.ros.moveit_node import PlanningSceneMessages
from openpose_ros_bridges.ros.obstacles_node import Footprints, costmap_outputs, teb_output
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import PARTS
from openpose_ros_signals.records import FloorPose, PersonSignals, Walk
from openpose_ros_signals.ros.convert import signals_to_array
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.ros import convert

ROOM = Header(stamp=rospy.Time(12, 500000000), frame_id='room')
NOT_KNOWN = 999999.0
# As in messages that others generated of moveit_msgs 0.11, in Lisp and JavaScript, and of costmap_converter, in C++.
MD5SUMS = {'moveit_msgs/PlanningScene': 'acfc50bcfd6c7b978066bfa7c786002c',
           'moveit_msgs/CollisionObject': 'dbba710596087da521c07564160dfccb',
           'shape_msgs/SolidPrimitive': 'd8f8cbc74c5ff283fca29569ccefb45d',
           'costmap_converter/ObstacleMsg': 'a37f90c2e2437cb2b570855e1c703488',
           'costmap_converter/ObstacleArrayMsg': '8a1bdcde72c65ca7d3ce8ebf52d43516'}
PACKAGES = ('moveit_msgs', 'shape_msgs', 'object_recognition_msgs', 'octomap_msgs', 'trajectory_msgs',
            'costmap_converter')
# Parameters with which no tf is needed.
OWN_FRAME = {'planning_frame': '', 'robot_frame': ''}


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """The packages as they are, and what writes others in their place."""
    def write(**others):
        forget_packages()
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        write_packages(folder, {name: {**DEFINITIONS[name], **others.get(name, {})} for name in PACKAGES})
        monkeypatch.syspath_prepend(str(folder))
    write()
    yield write
    forget_packages()


def checked(message):
    """Return a message whose types are right."""
    message._check_types()
    assert MD5SUMS.get(message._type, message._md5sum) == message._md5sum
    return message


def people(*ids):
    return convert.people_to_array(
        people_of([STANDING] * len(ids), ids, np.random.RandomState(0)) if ids else People3D.empty(COCO_18), ROOM)


def signals(walk):
    floor = FloorPose(np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
    return signals_to_array([PersonSignals(5, np.array([0.0, 0.0, 1.1]), walk=walk, floor=floor)], ROOM)


NO_SIGNALS = signals_to_array([], ROOM)
WALKS = signals(Walk(True, 1.5, np.array([0.0, 1.0, 0.0])))


def teb(**params):
    settings = ObstacleParams(**params, **OWN_FRAME)
    return teb_output(settings, Footprints(settings))


def numbers(message):
    return [getattr(message, name) for name in message.__slots__]


def points_of(cloud):
    return np.array(list(point_cloud2.read_points(cloud, ('x', 'y', 'z')))).reshape(-1, 3)


def test_a_scene_changes_by_diffs(packages):
    messages = PlanningSceneMessages(MoveitParams())
    assert messages.convert(people()) is None
    scene = checked(messages.convert(people(5)))
    parts = {told.id: told for told in scene.world.collision_objects}
    assert set(parts) <= {f'person_5_{part}' for part in PARTS}
    assert len(parts) == 17  # feet need a network with toes
    for told in parts.values():
        checked(told)
        assert (told.operation, told.header) == (told.ADD, ROOM)
        assert [primitive.type for primitive in told.primitives] == [3, 2, 2]
        (length, radius), (ball,), (other,) = (checked(primitive).dimensions for primitive in told.primitives)
        assert radius == ball == other
        assert [pose.position.z for pose in told.primitive_poses] == [0.0, -length / 2, length / 2]
    again = checked(messages.convert(people(5)))  # in the place of the first ones
    assert again.world.collision_objects == scene.world.collision_objects
    fewer = messages.convert(convert.people_to_array(without(
        people_of([STANDING], [5], np.random.RandomState(0)), ['left_wrist']), ROOM)).world.collision_objects
    assert {told.id for told in fewer if told.operation == told.REMOVE} == {
        f'person_5_left_{part}' for part in ('forearm', 'hand')}
    messages.convert(people(5))
    gone = checked(messages.convert(people()))
    assert {(told.operation, told.id) for told in gone.world.collision_objects} == {(1, name) for name in parts}
    assert messages.end(ROOM) is None
    for each in (scene, again, gone):  # nothing else is touched: an empty field of a diff is no change in MoveIt
        untouched = type(each)(is_diff=True)
        untouched.robot_state.is_diff = True
        untouched.world.collision_objects = each.world.collision_objects
        assert each == untouched


def test_obstacles(packages):
    output = teb()
    for none in (checked(output.convert(people(), NO_SIGNALS)), checked(output.end(ROOM))):
        assert (none.header, none.obstacles) == (ROOM, [])
    (one,) = checked(output.convert(people(5), WALKS)).obstacles
    checked(one)
    assert (one.id, one.header, len(one.polygon.points)) == (5, ROOM, 1)
    assert numbers(one.polygon.points[0]) == [0.0, 0.0, 0.0]
    assert 0.3 < one.radius < 0.6
    assert numbers(one.orientation) == [0.0, 0.0, 0.0, 1.0]
    assert numbers(one.velocities.twist.linear) == [0.0, 1.5, 0.0]
    along = (np.sqrt(2) * SIGMA / 0.4) ** 2 / 3
    np.testing.assert_allclose(np.reshape(one.velocities.covariance, (6, 6)),
                               np.diag([along] * 3 + [NOT_KNOWN] * 3), rtol=1e-6)
    (unknown,) = output.convert(people(5), signals(None)).obstacles
    assert numbers(unknown.velocities.twist.linear) == [0.0] * 3
    assert unknown.velocities.covariance[0] == NOT_KNOWN


def test_points_for_a_costmap_and_the_scan_that_clears():
    settings = ObstacleParams(**OWN_FRAME)
    marking, clearing = costmap_outputs(settings, Footprints(settings))
    for none in (marking.convert(people(), NO_SIGNALS), marking.end(ROOM)):
        assert (checked(none).header, len(points_of(none))) == (ROOM, 0)
    points = points_of(checked(marking.convert(people(5), WALKS)))
    assert set(points[:, 2]) == {0.5}
    # 1.5 m/s for 2 s, and the robot of 0.5 m at the origin
    assert 3.2 < points[:, 1].max() < 4.0
    assert np.linalg.norm(points[:, :2], axis=1).min() >= 0.5
    stands = marking.convert(people(5), signals(Walk(False, 0.0, np.zeros(3))))
    assert len(points_of(stands)) < len(points) / 4
    scan = checked(clearing.convert(people(5)))
    assert scan.header == ROOM
    assert set(scan.ranges) == {np.inf}
    assert scan.range_max == 10.0
    assert scan.angle_max == pytest.approx(scan.angle_min + (len(scan.ranges) - 1) * scan.angle_increment)
    assert scan.angle_increment * scan.range_max <= 0.025 + 1e-9


class Topic(list):
    """Takes what is published, in place of a topic and of the node's health."""

    publish, connections = list.append, 1

    def frame_done(self, stamp):
        pass

    def get_num_connections(self):
        return self.connections


@pytest.mark.parametrize(('rate', 'expected'), [(0.0, 30), (10.0, 10), (30.0, 30)])
def test_a_rate_is_kept(monkeypatch, rate, expected):
    topic, output = Topic(), Output('people', PersonDetection_3dArray, (), lambda message: message, rate=rate)
    publisher = _Publisher(output, topic, topic)
    for frame in range(30):
        monkeypatch.setattr(bridge.time, 'monotonic', lambda frame=frame: 100 + frame / 30)
        publisher.publish((PersonDetection_3dArray(header=Header(seq=frame)),))
    assert abs(len(topic) - expected) <= 1
    assert topic[0].header.seq == 0
    assert np.diff([message.header.seq for message in topic]).max() <= 3


def test_people_end_with_the_node_and_stay_known_while_no_planner_reads(packages, monkeypatch):
    monkeypatch.setattr(rospy, 'get_rostime', lambda: ROOM.stamp)
    messages, topic = PlanningSceneMessages(MoveitParams()), Topic()
    publisher = _Publisher(Output('scene', messages.kind, (), messages.convert, messages.end), topic, topic)
    publisher._end()
    assert topic == []  # there were no people
    publisher.publish((people(5),))
    topic.connections = 0
    publisher._end()
    topic.connections = 1
    publisher.publish((people(),))  # after the planner has come back
    added, removed = topic
    assert {told.operation for told in removed.world.collision_objects} == {1}
    assert len(removed.world.collision_objects) == len(added.world.collision_objects)
    publisher.publish((people(5),))
    publisher._end(shut_down=True)
    publisher.publish((people(5),))
    assert [scene.world.collision_objects[0].operation for scene in topic] == [0, 1, 0, 1]
