"""The messages that pages get: JSON texts, and binary ones with images; docs/web.md describes them.

Positions are whole millimetres in a frame with z up, so that they are short as JSON and have no NaN.
"""
import json
import struct
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.draw import person_colour
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.skeletons import FACE_70, HAND_21, SKELETONS
from openpose_ros_signals.records import Gesture, Hit, PersonSignals
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.show.markers import DASH, INFERRED_OPACITY, INFERRED_WHITE, LANDMARK_WIDTH, MarkerParams

VERSION = 1
IMAGE = 1
"""First byte of the binary messages."""
WIDTHS = (160, 320, 640, 960)
"""Images are sent in the largest of these widths that is not beyond what a page wants [px]."""
FASTEST_IMAGES = 15.0
"""Images are sent at most this often [Hz]."""
# Markers as people.launch starts them.
_LOOK = MarkerParams(joint_scale=0.06)
_SIGMA_OPACITY = 0.25  # of the spheres of uncertainty
_IMAGE_HEAD = struct.Struct('<BBHId')
# Positions beyond are cut [mm]: JavaScript's numbers are whole up to 2^53.
_FARTHEST = 1e9
_TRUNK = ('neck', 'right_shoulder', 'left_shoulder', 'right_hip', 'left_hip', 'mid_hip')

Message = Dict[str, Any]


class Moment(NamedTuple):
    """When and in which frame a message holds."""

    stamp: float  # of the camera [s]
    age: float  # time from the stamp to now, by the clock of the stamps [s]
    time: float  # now, by the computer's clock [s]
    frame: str  # of all positions, z up

    def fields(self) -> Message:
        """Return what each message has of it."""
        return {'stamp': round(self.stamp, 6), 'age': round(self.age, 3), 'time': round(self.time, 3),
                'frame': self.frame}


class Want(NamedTuple):
    """What a page wants beside people."""

    camera: int = 0  # index of that of the image
    width: int = 0  # of the image [px]; 0: none
    rate: float = FASTEST_IMAGES  # greatest, of images [Hz]


def encode(message: Message) -> str:
    """Return a message as it is sent."""
    return json.dumps(message, separators=(',', ':'), allow_nan=False)


def hello(cameras: Sequence[str], dimensions: int) -> Message:
    """Return the first message of a connection; `dimensions` 2: only images."""
    skeletons = {model.name: {'joints': model.joints, 'limbs': [(model.index[start], model.index[end])
                                                                for start, end in model.drawn_limbs]}
                 for model in (*SKELETONS.values(), HAND_21, FACE_70)}
    opacity = {'joint': 1.0, 'skeleton': 1.0, 'joint_inferred': INFERRED_OPACITY,
               'skeleton_inferred': INFERRED_OPACITY, 'sigma': _SIGMA_OPACITY}
    return {'type': 'hello', 'version': VERSION, 'dimensions': dimensions, 'cameras': list(cameras),
            'widths': WIDTHS, 'image_rate': FASTEST_IMAGES, 'skeletons': skeletons,
            'look': {'joint_diameter': _LOOK.joint_scale, 'limb_width': _LOOK.skeleton_scale,
                     'dash_length': DASH, 'landmark_width': LANDMARK_WIDTH,
                     'inferred_white': INFERRED_WHITE, 'opacity': opacity}}


def people_message(people: People3D, pose: Transform, moment: Moment) -> Message:
    """Return the message of the people of a frame; `pose` takes them to the frame of the moment."""
    trunk = [people.skeleton.index[joint] for joint in _TRUNK if joint in people.skeleton.index]
    return {'type': 'people', **moment.fields(), 'skeleton': people.skeleton.name, 'people': [
        {'id': number, 'rgb': person_colour(number)[::-1], 'xyz': _places(xyz, pose), 'status': status.tolist(),
         'sigma': _millimetres(sigma), 'velocity': _velocity(velocity[trunk], pose[0])}
        for number, xyz, status, sigma, velocity in zip(distinct_ids(people.ids).tolist(), people.xyz, people.status,
                                                        people.sigma, people.velocity)]}


def signals_message(persons: Sequence[PersonSignals], pose: Transform, moment: Moment) -> Message:
    """Return the message of what the people of a frame do."""
    return {'type': 'signals', **moment.fields(),
            'people': [_signals_of(person, pose, moment.stamp) for person in persons]}


def hands_message(hands: Hands3D, pose: Transform, moment: Moment) -> Message:
    """Return the message of the hands of a frame."""
    return {'type': 'hands', **moment.fields(), 'hands': [
        {'id': number, 'side': 'left' if left else 'right', **values}
        for number, left, values in zip(hands.people.tolist(), hands.left.tolist(), _points(hands.points, pose))]}


def faces_message(faces: Faces3D, pose: Transform, moment: Moment) -> Message:
    """Return the message of the faces of a frame."""
    return {'type': 'faces', **moment.fields(), 'faces': [
        {'id': number, **values} for number, values in zip(faces.people.tolist(), _points(faces.points, pose))]}


def cameras_message(cameras: Sequence[Tuple[int, CameraModel, Transform]], frame: str) -> Message:
    """Return the message of where the cameras are that are known: index, camera, and pose of the optical frame."""
    return {'type': 'cameras', 'frame': frame, 'cameras': [
        {'camera': index, 'size': [camera.width, camera.height],
         'K': [round(float(camera.matrix[place]), 3) for place in ((0, 0), (1, 1), (0, 2), (1, 2))],
         'position': _millimetres(translation), 'rotation': np.round(rotation, 6).ravel().tolist()}
        for index, camera, (rotation, translation) in cameras]}


def image_message(camera: int, stamp: float, jpeg: bytes) -> bytes:
    """Return the message of an image."""
    return _IMAGE_HEAD.pack(IMAGE, camera, 0, 0, stamp) + jpeg


def read_want(text: Any, cameras: int) -> Want:
    """Return what a page asks for.

    Raises:
        BadInputError: it is no such message.
    """
    try:
        want = json.loads(text)['want']
        image = want.get('image') or {}
        camera, width = int(image.get('camera', 0)), int(image.get('width', 0))
        rate = float(image.get('rate', FASTEST_IMAGES))
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        raise BadInputError(f'no such request: {error!r}') from error
    if not (0 <= camera < max(cameras, 1) and 0 <= width <= 10000 and 0 < rate <= 1000):
        raise BadInputError('no such request: a value is not allowed')
    return Want(camera, max((each for each in WIDTHS if each <= width), default=WIDTHS[0] if width else 0),
                min(rate, FASTEST_IMAGES))


def _signals_of(person: PersonSignals, pose: Transform, stamp: float) -> Message:
    walk, posture = person.walk, person.posture
    return {'id': person.id, 'position': _place(person.place, pose), 'posture': posture.name,
            'posture_seconds': _rounded(stamp - posture.since), 'fallen': person.fall is not None,
            'speed': None if walk is None else _rounded(walk.speed), 'moving': walk is not None and bool(walk.moving),
            'body_facing': None if person.body is None else _direction(person.body.direction, pose),
            'head_facing': None if person.head is None else _direction(person.head.direction, pose),
            'gestures': [_gesture_of(gesture, pose, stamp) for gesture in person.gestures]}


def _gesture_of(gesture: Gesture, pose: Transform, stamp: float) -> Message:
    values: Message = {'name': gesture.name, 'arm': gesture.arm, 'seconds': _rounded(stamp - gesture.since)}
    ray = gesture.pointing
    if ray is not None:
        hit = ray.hit or Hit(np.full(3, np.nan), '', np.nan)
        values['pointing'] = {'origin': _place(ray.origin, pose), 'direction': _direction(ray.direction, pose),
                              'sigma': _rounded(ray.sigma), 'hit': _place(hit.position, pose), 'target': hit.name}
    return values


def _points(points: Points3D, pose: Transform) -> List[Message]:
    return [{'xyz': _places(xyz, pose), 'status': status.tolist()} for xyz, status in zip(points.xyz, points.status)]


def _places(xyz: np.ndarray, pose: Transform) -> List[int]:
    return _millimetres(xyz @ pose[0].T + pose[1])


def _place(position: np.ndarray, pose: Transform) -> Optional[List[int]]:
    return _places(position, pose) if np.isfinite(position).all() else None


def _direction(direction: np.ndarray, pose: Transform) -> Optional[List[float]]:
    return np.round(pose[0] @ direction, 4).tolist() if np.isfinite(direction).all() else None


def _velocity(velocities: np.ndarray, rotation: np.ndarray) -> Optional[List[int]]:
    """Return the mean velocity of the joints that have one [mm/s]; None: none has."""
    known = velocities[np.isfinite(velocities).all(axis=1)]
    return _millimetres(rotation @ known.mean(axis=0)) if len(known) else None


def _millimetres(metres: np.ndarray) -> List[int]:
    """Return whole millimetres, row after row; 0 where there is no number."""
    cut = np.clip(np.nan_to_num(np.asarray(metres, np.float64) * 1000), -_FARTHEST, _FARTHEST)
    return np.rint(cut).astype(int).ravel().tolist()


def _rounded(value: float) -> Optional[float]:
    return round(float(value), 3) if np.isfinite(value) else None
