"""The output of process_bag: a bag with the nodes' topics, a table, a JSON file of each frame."""
import re
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Callable, Iterator, NamedTuple, Optional, Union

import genpy
import numpy as np
import rosbag
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.files import naming, numbered_name
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams, scale_keypoints
from openpose_ros_pkg.output.openpose_json import JSON_SUFFIX, Fields, landmark_fields, people_to_json
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.topics import IN_IMAGE, IN_SPACE
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.ros.convert import signals_to_array
from openpose_ros_tools.ros.bag_files import StampedMessage, new_bag
from openpose_ros_tools.ros.keypoints.keypoint_bag import rows_of
from openpose_ros_tools.ros.process_bag.input import RecordedFrame
from openpose_ros_tools.ros.process_bag.job import BagSettings, Input, Outputs
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter
from skeleton_extract_3d.estimator import Estimate
from skeleton_extract_3d.landmarks import Landmarks, Points3D
from skeleton_extract_3d.people import MISSING, People3D
from skeleton_extract_3d.points.transform import LEVEL, TURNED, transform_people
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.show.markers import LIMB_NAMESPACES, ShownMarkers, people_markers


class Ground(NamedTuple):
    """Where the floor is, for signals."""

    up: np.ndarray  # (3,) upwards in the frame of the people
    around: Surroundings  # with the plane of the floor, where that is known
    level: bool = False  # the people are in the optical frame of a level camera; `up` is in the upright one


ON_FLOOR = Ground(np.array([0.0, 0.0, 1.0]), Surroundings(floor=np.array([0.0, 0.0, 1.0, 0.0])))
"""Of a frame of the room: z is upwards, and 0 on the floor."""


class PeopleWriter:
    """Writes people in space, with their markers and signals, as the nodes publish them, and as rows of a table.

    Args:
        bag: to write.
        namespace: of the topics.
        settings: of markers, and whether joints are written as frames.
        table: gets each array of people; None: none.
        markers: whether markers are written.
        ground: to write signals; None: none are written.
    """

    def __init__(self, bag: rosbag.Bag, namespace: str, settings: BagSettings,
                 table: Optional[Callable[[genpy.Message], None]], markers: bool, ground: Optional[Ground] = None
                 ) -> None:
        self._bag, self._namespace, self._table = bag, namespace, table
        self._publish_tf = settings.extractor.publish_tf
        self._markers, self._shown = settings.markers if markers else None, ShownMarkers()
        self._ground, self._signals = ground, SignalReader()

    def write(self, people: People3D, header: Header, time: genpy.Time) -> None:
        """Write the people of a time, with the time of recording."""
        array = convert.people_to_array(people, header)
        self._bag.write(f'{self._namespace}/detected_poses_3d', array, time)
        for person in array.persons:
            self._bag.write(f'{self._namespace}/detected_poses_keypoints_3d', person, time)
        if self._table is not None:
            self._table(array)
        if self._ground is not None:
            self._write_signals(people, header, time, self._ground)
        if self._publish_tf and len(people):
            self._bag.write('/tf', TFMessage(convert.people_to_transforms(people, header)), time)
        if self._markers is not None:
            markers = people_markers(convert.people_from_array(array), self._markers)
            for marker in self._shown.replaced(markers, header.stamp.to_sec(), self._markers.lifetime):
                topic = 'visualization_skeleton' if marker.ns in LIMB_NAMESPACES else 'visualization_markers'
                self._bag.write(f'{self._namespace}/{topic}', convert.marker_to_message(marker, header), time)

    def _write_signals(self, people: People3D, header: Header, time: genpy.Time, ground: Ground) -> None:
        if ground.level:
            self._bag.write('/tf', TFMessage([convert.upright_transform(header)]), time)
            people = transform_people(people, *LEVEL)
            header = Header(header.seq, header.stamp, header.frame_id + TURNED)
        signals = self._signals.update(people, header.stamp.to_sec(), ground.up, ground.around)
        array = signals_to_array(signals, header)
        self._bag.write(f'{self._namespace}/people_signals', array, time)
        for person in array.persons:
            self._bag.write(f'{self._namespace}/person_signals', person, time)


@contextmanager
def people_table(path: Path, layout: str, dimensions: int) -> Iterator[Callable[[genpy.Message], None]]:
    """Yield what writes the people of an array message into a table, see `KeypointCsvWriter`.

    Raises:
        OSError: with the name of the file.
    """
    with naming(path):
        handle = path.open('w', newline='')
    writer = KeypointCsvWriter(handle, layout, dimensions)

    def write(array: genpy.Message) -> None:
        with naming(path):
            writer.write(list(rows_of(array, dimensions)))

    try:
        yield write
    finally:
        with naming(path):
            handle.close()


class Results:
    """Writes the people of frames, in their order, as the nodes would publish them; OSError: a file can not be written.

    header.seq of what is written is the number of the frame, from 0.

    Args:
        camera: JSON files are named after its bag.
        outputs: what to write, and where.
        settings: of markers, of the units of detected_poses_keypoints in 2D, and whether joints are written as frames.
        in_space: whether there are people in space.
        stack: closes the files.

    Raises:
        ParameterError: this compression is not available.
    """

    def __init__(self, camera: Input, outputs: Outputs, settings: BagSettings, in_space: bool, stack: ExitStack
                 ) -> None:
        self._namespace = f'/{camera.camera}'.rstrip('/') + f'/{IN_SPACE if in_space else IN_IMAGE}'
        self._name, self._outputs, self._in_space = camera.bag.stem, outputs, in_space
        self._landmarks, self._scale = settings.landmarks, settings.keypoint_scale
        self._bag = stack.enter_context(new_bag(outputs.bag, outputs.compression))
        self._table = None if outputs.csv is None else stack.enter_context(
            people_table(outputs.csv, outputs.csv_layout, 3 if in_space else 2))
        self._people = PeopleWriter(self._bag, self._namespace, settings, self._table, outputs.markers,
                                    _ground(settings) if outputs.signals else None)

    def copy(self, message: StampedMessage) -> None:
        """Write a message of the input as it was."""
        self._bag.write(message.topic, message.raw, genpy.Time(0, message.time), raw=True,
                        connection_header=message.connection)

    def write_2d(self, frame: RecordedFrame, number: int, people: People2D, landmarks: Landmarks2D) -> None:
        """Write the people in the image of a frame that has no points, with their hands and faces."""
        self._write_image_people(frame, number, people, self._scale)
        self._write_image_landmarks(frame, number, landmarks)
        self._write_json(number, people, None, landmark_fields(landmarks))

    def write_estimate(self, frame: RecordedFrame, number: int, estimate: Estimate,
                       transform: Optional[TransformStamped]) -> None:
        """Write the people in the image of a frame that has points: always in pixels, with the ids in space.

        Args:
            transform: of its time, for /tf.
        """
        self._write_image_people(frame, number, estimate.in_image, KeypointScaleParams())
        if transform is not None:
            self._bag.write('/tf', TFMessage([transform]), frame.time)

    def write_3d(self, frame: RecordedFrame, number: int, estimate: Estimate, people: People3D, landmarks: Landmarks,
                 header: Header) -> None:
        """Write the people in space, and their hands and faces, also those in the image.

        Args:
            people, landmarks: in the frame of reference in which they are published, that of `header`.
        """
        header.seq = number
        self._people.write(people, header, frame.time)
        self._write_image_landmarks(frame, number, landmarks.in_image)
        if self._landmarks.hands:
            self._write('detected_hands_3d', convert.hands_to_array(landmarks.in_space.hands, header), frame)
        if self._landmarks.face:
            self._write('detected_faces_3d', convert.faces_to_array(landmarks.in_space.faces, header), frame)
        self._write_json(number, _with_hidden(estimate.people_2d, people), _in_space(people), _fields(landmarks))

    def _write_image_people(self, frame: RecordedFrame, number: int, people: People2D, scale: KeypointScaleParams
                            ) -> None:
        header = Header(seq=number, stamp=frame.header.stamp, frame_id=frame.header.frame_id)
        array = convert_2d.people_to_array(people, header)
        self._write('detected_poses', array, frame)
        size = (frame.bgr.shape[1], frame.bgr.shape[0])
        for message in array.persons if scale.keypoint_scale == 0 else convert_2d.people_to_messages(
                people, header, scale_keypoints(people.keypoints, size, scale)):
            self._write('detected_poses_keypoints', message, frame)
        if self._table is not None and not self._in_space:
            self._table(array)

    def _write_image_landmarks(self, frame: RecordedFrame, number: int, landmarks: Landmarks2D) -> None:
        header = Header(seq=number, stamp=frame.header.stamp, frame_id=frame.header.frame_id)
        if self._landmarks.hands:
            self._write('detected_hands', convert_2d.hands_to_array(landmarks.hands, header), frame)
        if self._landmarks.face:
            self._write('detected_faces', convert_2d.faces_to_array(landmarks.faces, header), frame)

    def _write_json(self, number: int, people: People2D, in_space: Optional[np.ndarray], fields: Fields) -> None:
        if self._outputs.json is not None:
            path = self._outputs.json / (numbered_name(self._name, number) + JSON_SUFFIX)
            with naming(path):
                path.write_text(people_to_json(people, in_space, fields))

    def _write(self, topic: str, message: genpy.Message, frame: RecordedFrame) -> None:
        self._bag.write(f'{self._namespace}/{topic}', message, frame.time)


def _ground(settings: BagSettings) -> Ground:
    """Return where the floor is in the frame in which people are published: below z of a frame that is named."""
    if settings.extractor.target_frame:
        return ON_FLOOR
    level = settings.upright.level
    return Ground(ON_FLOOR.up if level else settings.upright.upwards, Surroundings(), level)


def json_names(camera: Input) -> Callable[[str], bool]:
    """Return what tells whether a file's name is that of a JSON file of a camera; others may be beside it."""
    pattern = re.compile(re.escape(camera.bag.stem) + r'_\d+' + re.escape(JSON_SUFFIX))
    return lambda name: bool(pattern.fullmatch(name))


def _with_hidden(people_2d: People2D, people: People3D) -> People2D:
    """Return the people in the image and, with no joint, the tracked people that it does not show."""
    hidden = len(people) - len(people_2d)
    joints = len(people_2d.skeleton.joints)
    without_joints = np.full((hidden, joints, 3), (np.nan, np.nan, 0), np.float32)
    return People2D(people_2d.skeleton, np.concatenate([people_2d.keypoints, without_joints]),
                    np.concatenate([people_2d.scores, np.zeros(hidden, np.float32)]), people.ids,
                    existence=people.existence)


def _fields(landmarks: Landmarks) -> Fields:
    """Return the points of hands and faces, in the image and in space, as `people_to_json` takes them."""
    fields = landmark_fields(landmarks.in_image)
    hands, faces = landmarks.in_space.hands, landmarks.in_space.faces
    for person, left, points in zip(hands.people.tolist(), hands.left.tolist(), _in_space(hands.points)):
        fields.setdefault(person, {})[f'hand_{"left" if left else "right"}_keypoints_3d'] = points
    for person, points in zip(faces.people.tolist(), _in_space(faces.points)):
        fields.setdefault(person, {})['face_keypoints_3d'] = points
    return fields


def _in_space(people: Union[People3D, Points3D]) -> np.ndarray:
    """Return x, y, z [m] and score of all joints, (P, K, 4) float32; 0 where MISSING."""
    values = np.concatenate([people.xyz, people.confidence[..., np.newaxis]], axis=2)
    return np.where((people.status != MISSING)[..., np.newaxis], values, np.float32(0))
