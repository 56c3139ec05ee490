"""What people do, from frame to frame."""
from dataclasses import replace
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.people import distinct_ids
from openpose_ros_signals.constants import SIGNALS, SignalConstants
from openpose_ros_signals.geometry import told_joints, unit
from openpose_ros_signals.gestures import palm_of
from openpose_ros_signals.person import BodyObservation, Person, Surroundings
from openpose_ros_signals.records import Facing, PersonSignals
from skeleton_extract_3d.body.joint_frames import joint_frames
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.transform import UPRIGHT, Transform

_NOTHING = Surroundings()
# The cosine between z of a camera's frame and upwards is greater where the frame is not optical.
_IS_UP = 0.7


class Present(NamedTuple):
    """A person that is there."""

    since: float  # when it was seen first [s]
    signals: PersonSignals
    distance: float = np.nan  # level, to below its trunk [m]
    bearing: float = np.nan  # of that, to the left of forwards [rad]


class SignalReader:
    """Tells what the people of successive frames do; not thread-safe, and with no clock but the stamps.

    An id is a person (`distinct_ids`): a new one begins anew wherever it is, and nothing is told of one that is gone.
    `present` are the people of the last frame, in their order.
    """

    def __init__(self, constants: SignalConstants = SIGNALS) -> None:
        self._constants = constants
        self._people: Dict[int, Person] = {}
        self._stamp = -np.inf
        self.present: Tuple[Present, ...] = ()

    def update(self, people: People3D, stamp: float, up: np.ndarray, around: Surroundings = _NOTHING,
               landmarks: Optional[Landmarks3D] = None) -> Tuple[PersonSignals, ...]:
        """Return what each person does, in the order of the people.

        Args:
            people: in a frame in which the room stands still, or walking and falls are not told rightly.
            stamp: [s]; if it is before that of the last frame, all people begin anew.
            up: (3,) upwards, any length.
            around, landmarks: what is around, and hands and faces, in the same frame; None: not known.
        """
        if stamp < self._stamp:
            self._people.clear()
        self._stamp = stamp
        up = np.asarray(up, np.float64) / np.linalg.norm(up)
        self._people = {name: person for name, person in self._people.items()
                        if stamp - person.stamp <= self._constants.person.gap}
        people = replace(people, ids=distinct_ids(people.ids))
        present = []
        joints = told_joints(people, self._constants.person)
        for name, seen in zip(people.ids.tolist(), _observations(people, joints, landmarks or Landmarks3D())):
            if name not in self._people:
                self._people[name] = Person(stamp, self._constants)
            person = self._people[name]
            present.append(Present(person.since, person.read(name, stamp, seen, up, around)))
        self.present = tuple(present)
        return tuple(person.signals for person in present)


def forward_view(camera: Transform, up: np.ndarray) -> Transform:
    """Return the transform from axes x forwards, y left, z up at the origin of the frame of a camera.

    Its own axes are these if its z is about upwards, (3,) after the transform `camera`; else they are optical.
    """
    rotation, translation = camera
    return rotation if up @ rotation[:, 2] > _IS_UP else rotation @ UPRIGHT, translation


def nearest_first(present: Sequence[Present], robot: Optional[Transform], up: np.ndarray) -> Tuple[Present, ...]:
    """Return people with their distances and bearings, the nearest first, those without a known place last.

    Args:
        robot: takes points of the robot, x forwards, to the frame of the people; None: not known, nor is the order.
        up: (3,) unit vector.
    """
    if robot is None:
        return tuple(present)
    forward = robot[0][:, 0] - (robot[0][:, 0] @ up) * up
    left = np.cross(up, unit(forward))
    found = []
    for person in present:
        offset = np.full(3, np.nan) if person.signals.floor is None else person.signals.floor.position - robot[1]
        away = float(np.linalg.norm(offset - (offset @ up) * up))
        bearing = float(np.arctan2(offset @ left, offset @ unit(forward)))
        found.append(person._replace(distance=away, bearing=bearing))
    return tuple(sorted(found, key=lambda each: np.nan_to_num(each.distance, nan=np.inf)))


def _observations(people: People3D, joints: Tuple[np.ndarray, ...], landmarks: Landmarks3D) -> List[BodyObservation]:
    """Return the people of a frame one by one."""
    frames, index = joint_frames(people), people.skeleton.index
    neck, nose = (frames[:, index[name]] if name in index else np.full((len(people), 3, 3), np.nan)
                  for name in ('neck', 'nose'))
    return [BodyObservation((joints[0][row], joints[1][row], joints[2][row]), neck[row], nose[row],
                            (palm_of(landmarks.hands, name, True), palm_of(landmarks.hands, name, False)),
                            _face_of(landmarks, name)) for row, name in enumerate(people.ids.tolist())]


def _face_of(landmarks: Landmarks3D, name: int) -> Optional[Facing]:
    """Return which way the face of a person looks, None if it was not found."""
    faces = landmarks.faces
    for row in np.flatnonzero((faces.people == name) & np.isfinite(faces.orientations).all(axis=1)):
        forward = Rotation.from_quat(faces.orientations[row]).apply([1.0, 0.0, 0.0])
        return Facing(forward, float(faces.orientation_sigma[row]), np.nanmean(faces.points.xyz[row], axis=0))
    return None
