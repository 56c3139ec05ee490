"""Pictures of RViz: it gets what was recorded of one frame, so that cloud, image and people have one stamp."""
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np
import rosbag
import rosparam
import rospy
import tf2_ros
from openpose_ros_msgs.msg import PersonDetection_3dArray
from rosgraph_msgs.msg import Clock
from screen import take_screenshot
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_bringup.view import DISTANCE, PITCH, viewpoint
from openpose_ros_pkg.output.draw import person_colour
from session import Session, SessionError
from skeleton_extract_3d.people import MEASURED
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import LEVEL, Transform
from skeleton_extract_3d.ros import convert

SPACE = '/openpose_ros/skeleton_3d'
FRAMES = '/rgbd_player_node/frame'  # stamp and index (seq) of each frame of a sequence, from the player
TOPICS = {'cloud': (f'{SPACE}/input_pointcloud', PointCloud2), 'image': (f'{SPACE}/detected_poses_image', Image),
          'people': (f'{SPACE}/detected_poses_3d', PersonDetection_3dArray)}
WORLD = 'world'
# Values of gt.json: a joint is hidden by another person; it is visible.
HIDDEN, VISIBLE = 3, 2
# With so many visible joints a person is hidden.
FEW = 2
# RViz without a graphics card draws one to four times a second: time to open and draw, and between two looks [s].
OPENING, LOOK = 120.0, 1.0
# Ogre's field of view [rad], and the background of RViz's scene in people.rviz [grey levels, BGR].
FIELD_OF_VIEW, BACKGROUND = np.pi / 4, (34, 30, 30)
# RViz opens small, then fills the screen: it is open when its scene has this share of the screen's height.
OPEN = 0.5
# A joint is drawn where a pixel so near has the hue of its person and is no grey [px, of 180, of 255].
DRAWN, HUE, SATURATED = 4, 8, 100
# The picture is drawn when this share of the measured joints is, and two looks are alike in this share of it.
SHARE, ALIKE = 0.8, 0.999


class Moment(NamedTuple):
    """What is shown, all of one stamp; `frame`: its index in the sequence, -1 unknown."""

    frame: int
    cloud: PointCloud2
    image: Image
    people: PersonDetection_3dArray


def both_in_view(truth: Dict[str, Any]) -> Dict[str, List[int]]:
    """Return the frames for each picture, the best first: before a person is hidden by another one, and while one is.

    A picture without frames is left out. `truth`: the content of gt.json.
    """
    people = [[one['vis'] for one in frame['people']] for frame in truth['frames']]
    first = next((frame for frame, seen in enumerate(people) if any(HIDDEN in one for one in seen)), len(people))
    behind = [frame for frame, seen in enumerate(people) if any(one.count(VISIBLE) <= FEW for one in seen)]
    middle = len(behind) // 2
    pictures = {'rviz.png': list(range(first))[::-1], 'rviz_hidden.png': behind[middle:] + behind[:middle]}
    return {name: frames for name, frames in pictures.items() if frames}


def choose(bag: Path, choices: Dict[str, Optional[List[int]]]) -> Dict[str, rospy.Time]:
    """Return a stamp for each name: of its frames (None: any), that with most people, most measured joints, the first
    in the list.
    """
    with rosbag.Bag(str(bag)) as opened:
        frames = {message.stamp: message.seq for _, message, _ in opened.read_messages([FRAMES])}
        people = {message.header.stamp: convert.people_from_array(message) for _, message, _ in opened.read_messages(
            [TOPICS['people'][0]])}
        images = {message.header.stamp for _, message, _ in opened.read_messages([TOPICS['image'][0]])}
    chosen = {}
    for name, wanted in choices.items():
        answered = [(len(people[stamp]), (people[stamp].status == MEASURED).sum(),
                     0 if wanted is None else -wanted.index(frames[stamp]), stamp)
                    for stamp in images & set(people) if wanted is None or frames.get(stamp) in wanted]
        if answered:
            chosen[name] = max(answered)[-1]
    return chosen


def best_pass(bag: Path) -> Dict[int, rospy.Time]:
    """Return, of the pass through a sequence with most measured joints, the stamp of each frame with results."""
    with rosbag.Bag(str(bag)) as opened:
        frames = {message.stamp: message.seq for _, message, _ in opened.read_messages([FRAMES])}
        measured = {message.header.stamp: int((convert.people_from_array(message).status == MEASURED).sum())
                    for _, message, _ in opened.read_messages([TOPICS['people'][0]])}
        images = {message.header.stamp for _, message, _ in opened.read_messages([TOPICS['image'][0]])}
    passes: List[Dict[int, rospy.Time]] = [{}]
    for stamp in sorted(images & set(frames) & set(measured)):
        if frames[stamp] <= max(passes[-1], default=-1):
            passes.append({})
        passes[-1][frames[stamp]] = stamp
    return max(passes, key=lambda one: sum(measured[stamp] for stamp in one.values()))


def recorded(bag: Path, stamp: rospy.Time, cloud_of: Callable[[int, Header], PointCloud2]) -> Moment:
    """Return what was recorded of a stamp."""
    with rosbag.Bag(str(bag)) as opened:
        found = {topic: message for topic, message, _ in opened.read_messages(
            [FRAMES, TOPICS['image'][0], TOPICS['people'][0]])
            if stamp == (message if topic == FRAMES else message.header).stamp}
    image, people = (found[TOPICS[key][0]] for key in ('image', 'people'))
    frame = found[FRAMES].seq if FRAMES in found else -1
    return Moment(frame, cloud_of(frame, people.header), image, people)


def transforms_of(bag: Path) -> List[Any]:
    """Return the newest transform to each frame that was recorded."""
    with rosbag.Bag(str(bag)) as opened:
        newest = {one.child_frame_id: one for _, raw, _ in opened.read_messages(['/tf', '/tf_static'], raw=True)
                  for one in TFMessage().deserialize(raw[1]).transforms}  # tf2 wants the classes of the system
    return list(newest.values())


class Viewer:
    """RViz, which shows a moment at a time: publishes it, and what `view` and the node of the markers need."""

    def __init__(self, session: Session, transforms: Sequence[Any]) -> None:
        rosparam.set_param('/use_sim_time', 'true')
        self._clock = rospy.Publisher('/clock', Clock, queue_size=1, latch=True)
        self._publishers = {key: rospy.Publisher(topic, kind, queue_size=1)
                            for key, (topic, kind) in TOPICS.items()}
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._broadcaster.sendTransform(list(transforms))
        self._buffer = tf2_ros.BufferCore()
        for transform in transforms:
            self._buffer.set_transform_static(transform, 'demo')
        self._fixed = WORLD if any(WORLD in (one.header.frame_id, one.child_frame_id) for one in transforms) else ''
        session.start('markers', ['roslaunch', 'skeleton_extract_3d', 'skeleton_extract_3d_visualization_node.launch',
                                  'look:=people'])
        self._nodes = session.start('rviz', ['roslaunch', 'openpose_ros_bringup', 'people.launch', 'chain:=false',
                                             'signals:=false', 'rviz:=true', f'fixed_frame:={self._fixed}'])

    def show(self, moment: Moment, path: Path) -> np.ndarray:
        """Write a picture as soon as RViz has drawn the joints of a moment that are in its view, and return it."""
        self._clock.publish(Clock(moment.people.header.stamp))
        last = np.zeros(0)
        deadline = time.monotonic() + OPENING
        while time.monotonic() < deadline and self._nodes.poll() is None:
            for key, publisher in self._publishers.items():
                publisher.publish(getattr(moment, key))
            time.sleep(LOOK)
            take_screenshot(path)
            picture = cv2.imread(str(path))
            if not is_open(picture):
                continue
            drawn = drawn_joints(picture, moment, self.pose(moment))
            if (not drawn.size or drawn.mean() >= SHARE) and last.size and (picture == last).mean() >= ALIKE:
                return picture
            last = picture
        if self._nodes.poll() is not None or not last.size:
            raise SessionError(f'RViz has not drawn {path.name}')
        print(f'[demo] {path.name}: RViz has not drawn all joints in {OPENING:.0f} s', flush=True)
        return last

    def pose(self, moment: Moment) -> Transform:
        """Return the transform from the frame of the people to RViz's fixed frame."""
        if not self._fixed:
            return LEVEL
        return convert.rotation_and_translation(self._buffer.lookup_transform_core(
            self._fixed, moment.people.header.frame_id, rospy.Time(0)))


def is_open(picture: np.ndarray) -> bool:
    """Return whether RViz fills the screen."""
    rows = np.flatnonzero((picture == BACKGROUND).all(axis=2).any(axis=1))
    return rows.size > 0 and rows[-1] - rows[0] > OPEN * picture.shape[0]


def project(points: np.ndarray, camera: Transform, picture: np.ndarray) -> np.ndarray:
    """Return where RViz shows points (N, 3) [m] of a camera that has this pose in the fixed frame, (N, 2) [px].

    NaN: outside of its view.
    """
    (left, top), (right, bottom) = _scene(picture)
    focal, yaw = viewpoint([camera])
    back = np.array([np.cos(yaw) * np.cos(PITCH), np.sin(yaw) * np.cos(PITCH), np.sin(PITCH)])
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    axes = np.stack([across, np.cross(across, back), -back])
    scale = (bottom - top) / 2 / np.tan(FIELD_OF_VIEW / 2)
    matrix = np.array([[scale, 0, (left + right) / 2], [0, scale, (top + bottom) / 2], [0, 0, 1]])
    view = CameraModel(picture.shape[1], picture.shape[0], matrix)
    places = view.project((points @ camera[0].T + camera[1] - focal - DISTANCE * back) @ axes.T)
    with np.errstate(invalid='ignore'):
        inside = ((places >= (left, top)) & (places < (right, bottom))).all(axis=1)
    return np.where(inside[:, np.newaxis], places, np.nan)


def _scene(picture: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the corners of RViz's scene in a picture, by the background: left and top, right and bottom [px]."""
    pixels = np.argwhere((picture == BACKGROUND).all(axis=2))[:, ::-1]
    return pixels.min(axis=0), pixels.max(axis=0) + 1


def drawn_joints(picture: np.ndarray, moment: Moment, camera: Transform) -> np.ndarray:
    """Return whether each measured joint in RViz's view is drawn in the colour of its person, (N,) bool."""
    people, drawn = convert.people_from_array(moment.people), [np.zeros(0, bool)]
    for person, xyz, status in zip(people.ids.tolist(), people.xyz, people.status):
        places = project(xyz[status == MEASURED], camera, picture)
        drawn.append(_is_drawn(picture, places[np.isfinite(places).all(axis=1)], person))
    return np.concatenate(drawn)


def _is_drawn(picture: np.ndarray, places: np.ndarray, person: int) -> np.ndarray:
    hues = cv2.cvtColor(np.uint8([[person_colour(person)]]), cv2.COLOR_BGR2HSV)[0, 0, 0]
    hsv = cv2.cvtColor(picture, cv2.COLOR_BGR2HSV).astype(int)
    off = np.abs((hsv[..., 0] - hues + 90) % 180 - 90)
    own = cv2.dilate(((off <= HUE) & (hsv[..., 1] > SATURATED)).astype(np.uint8), np.ones((2 * DRAWN + 1,) * 2))
    u, v = np.clip(places.round().astype(int), 0, np.array(picture.shape[1::-1]) - 1).T
    return own[v, u] > 0


def errors_of(picture: np.ndarray, moment: Moment, camera: Transform, truth: Dict[str, Any]) -> np.ndarray:
    """Return how far each visible true joint in RViz's view is from where its person's is drawn [px], (N,).

    Infinite: not drawn. `truth`: the content of gt.json.
    """
    people, errors = convert.people_from_array(moment.people), [np.zeros(0)]
    joints = [people.skeleton.index[name] for name in truth['joints']]
    for person in truth['frames'][moment.frame]['people']:
        visible, xyz = np.array(person['vis']) == VISIBLE, np.array(person['xyz'], float)
        there = project(xyz[visible], camera, picture)
        off = np.full(len(there), np.inf)
        if len(people):
            found = people.xyz[:, joints]
            one = np.nanmedian(np.linalg.norm(found - xyz, axis=2), axis=1).argmin()
            places = project(found[one][visible], camera, picture)
            known = np.flatnonzero(np.isfinite(places).all(axis=1))
            known = known[_is_drawn(picture, places[known], int(people.ids[one]))]
            off[known] = np.linalg.norm(places - there, axis=1)[known]
        errors.append(off[np.isfinite(there).all(axis=1)])
    return np.concatenate(errors)
