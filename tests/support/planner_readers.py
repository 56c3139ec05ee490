"""What planners make of people, re-enacted in Python: their packages are not installed everywhere."""
import threading
from typing import Dict, List, NamedTuple, Optional, Tuple, Type

import genpy
import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Pose
from scipy.spatial.transform import Rotation
from sensor_msgs import point_cloud2
from sensor_msgs.msg import LaserScan, PointCloud2

from skeleton_extract_3d.ros.convert import rotation_and_translation

SPHERE, CYLINDER = 2, 3


class Shape(NamedTuple):
    """A primitive of an object: type and dimensions of shape_msgs/SolidPrimitive, and its pose in the object."""

    kind: int
    dimensions: Tuple[float, ...]
    pose: Tuple[Rotation, np.ndarray]


class PlanningScene:
    """The world of a planning scene of MoveIt 1.1.6 to 1.1.16 (BSD), moveit_core/planning_scene/src/planning_scene.cpp.

    setPlanningSceneDiffMsg: what is empty in a diff stays. processCollisionObjectAdd: an object replaces one of its
    name; without shapes it is refused. processCollisionObjectMove: an object that is not known is refused; only its
    pose is read (that those of shapes are read as well is new in 1.1.14). processCollisionObjectRemove: without a name,
    all objects go; one that is not known is refused.

    Attributes:
        objects: poses and shapes by name.
        operations: those that came, by number.
        faults: what MoveIt would warn of.
        touched: a diff was none, or had more than objects.
    """

    def __init__(self, topic: str, kind: Type[genpy.Message], frame: str) -> None:
        self.objects: Dict[str, Tuple[Tuple[Rotation, np.ndarray], List[Shape]]] = {}
        self.operations = [0, 0, 0, 0]
        self.faults: List[str] = []
        self.touched = False
        self.stamp = rospy.Time()
        self._frame, self._lock = frame, threading.Lock()
        self._subscriber = rospy.Subscriber(topic, kind, self._apply, queue_size=100)

    def close(self) -> None:
        """Listen no more."""
        self._subscriber.unregister()

    @property
    def names(self) -> List[str]:
        """Names of the objects."""
        with self._lock:
            return sorted(self.objects)

    def people(self) -> List[str]:
        """Return the names of people, without their parts."""
        return sorted({'_'.join(name.split('_')[:2]) for name in self.names})

    def distances(self, points: np.ndarray) -> Tuple[rospy.Time, np.ndarray]:
        """Return the stamp of the newest diff, and the distance of points (N, 3) to the nearest object; < 0: within."""
        with self._lock:
            return self.stamp, np.min([_distances(points, pose, shape) for pose, shapes in self.objects.values()
                                       for shape in shapes], axis=0)

    def _apply(self, scene: genpy.Message) -> None:
        untouched = type(scene)(is_diff=True)
        untouched.robot_state.is_diff = True
        untouched.world.collision_objects = scene.world.collision_objects
        with self._lock:
            self.touched |= scene != untouched
            for told in scene.world.collision_objects:
                self.operations[told.operation] += 1
                self.stamp = told.header.stamp
                self._apply_object(told)

    def _apply_object(self, told: genpy.Message) -> None:
        known = told.id in self.objects
        if told.header.frame_id != self._frame and told.operation != told.REMOVE:
            self.faults.append(f'unknown frame {told.header.frame_id}')
        if told.operation == told.ADD and told.primitives:
            self.objects[told.id] = _transform(told.pose), [
                Shape(primitive.type, tuple(primitive.dimensions), _transform(pose))
                for primitive, pose in zip(told.primitives, told.primitive_poses)]
        elif told.operation == told.REMOVE and known:
            del self.objects[told.id]
        else:
            self.faults.append(f'operation {told.operation} of {told.id!r}, which is {"" if known else "not "}known')


def _transform(pose: Pose) -> Tuple[Rotation, np.ndarray]:
    turn, place = pose.orientation, pose.position
    return Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]), np.array([place.x, place.y, place.z])


def _distances(points: np.ndarray, pose: Tuple[Rotation, np.ndarray], shape: Shape) -> np.ndarray:
    for turn, place in (pose, shape.pose):
        points = turn.inv().apply(points - place)
    if shape.kind == SPHERE:
        return np.linalg.norm(points, axis=1) - shape.dimensions[0]
    height, radius = shape.dimensions
    return np.maximum(np.linalg.norm(points[:, :2], axis=1) - radius, np.abs(points[:, 2]) - height / 2)


class ObstacleLayer:
    """An obstacle layer of costmap_2d 1.17.3 (BSD), plugins/obstacle_layer.cpp, with persistence 0.

    updateBounds: first the cells along the rays of the newest scan are free, then those of the points of the newest
    cloud are obstacles; others stay as they were. ObservationBuffer::bufferCloud: the origin of an observation is that
    of its frame. With inf_is_valid, a range that is infinite is the greatest one.

    Attributes:
        obstacles: (N, N) bool, rows along x, of a square round the origin of the global frame.
    """

    size, resolution = 12.0, 0.05  # of the square [m]
    raytrace_range, obstacle_range = 5.0, 4.0  # [m]

    def __init__(self, cloud: str, scan: str, frame: str, buffer: tf2_ros.Buffer) -> None:
        cells = int(self.size / self.resolution)
        self.obstacles = np.zeros((cells, cells), bool)
        self.cloud: Optional[PointCloud2] = None
        self.scan: Optional[LaserScan] = None
        self._frame, self._buffer = frame, buffer
        self._subscribers = (rospy.Subscriber(cloud, PointCloud2, lambda message: setattr(self, 'cloud', message)),
                             rospy.Subscriber(scan, LaserScan, lambda message: setattr(self, 'scan', message)))

    def update(self) -> np.ndarray:
        """Do what an update of the map does; return the places of its obstacles, (N, 2) [m]."""
        cloud, scan = self.cloud, self.scan
        if scan is not None:
            angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
            ranges = np.where(np.isinf(scan.ranges), scan.range_max - 1e-4, scan.ranges)
            points = np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(angles))))
            origin, ends = self._in_map(np.concatenate((np.zeros((1, 3)), points)), scan)
            for end in np.unique(self._cells(self._cut(origin, ends)), axis=0):
                self._clear(self._cells(origin), end)
        if cloud is not None:
            points = np.array(list(point_cloud2.read_points(cloud, ('x', 'y', 'z')))).reshape(-1, 3)
            origin, places = self._in_map(np.concatenate((np.zeros((1, 3)), points)), cloud)
            near = places[np.linalg.norm(places - origin, axis=1) < self.obstacle_range]
            self.obstacles[tuple(self._cells(near).T)] = True
        return (np.argwhere(self.obstacles) + 0.5) * self.resolution - self.size / 2

    def _in_map(self, points: np.ndarray, message: genpy.Message) -> Tuple[np.ndarray, np.ndarray]:
        """Return the first of points (N, 3), and the others, (N - 1, 2), in the global frame."""
        header = message.header
        turn, move = rotation_and_translation(self._buffer.lookup_transform(self._frame, header.frame_id, header.stamp))
        moved = (points @ turn.T + move)[:, :2]
        return moved[0], moved[1:]

    def _cut(self, origin: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return the ends (N, 2) of lines, cut at the edge of the map."""
        ways = ends - origin
        edges = np.where(ways > 0, self.size / 2 - 1e-3, -self.size / 2)
        shares = np.where(ways == 0, np.inf, (edges - origin) / np.where(ways == 0, 1.0, ways))
        return origin + np.minimum(shares.min(axis=1), 1.0)[:, np.newaxis] * ways

    def _cells(self, places: np.ndarray) -> np.ndarray:
        return np.asarray(np.floor((places + self.size / 2) / self.resolution).astype(int))

    def _clear(self, start: np.ndarray, end: np.ndarray) -> None:
        """Free the cells of a line, as Costmap2D::raytraceLine does by Bresenham's algorithm."""
        way = end - start
        longest = int(np.abs(way).argmax())
        number, most = int(abs(way[longest])), int(self.raytrace_range / self.resolution)
        length = max(np.hypot(*way), 1.0)
        steps = np.arange(int(number * min(1.0, most / length)) + 1)
        cells = np.empty((len(steps), 2), int)
        cells[:, longest] = start[longest] + np.sign(way[longest]) * steps
        other = 1 - longest
        minor = (number // 2 + steps * abs(way[other])) // max(number, 1)
        cells[:, other] = start[other] + np.sign(way[other]) * minor
        self.obstacles[tuple(cells.T)] = False
