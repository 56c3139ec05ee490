"""What people do, from frame to frame."""
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.assignment import match
from openpose_ros_signals.constants import SIGNALS, SignalConstants
from openpose_ros_signals.geometry import joints_of, trunk_place
from openpose_ros_signals.gestures import palm_of
from openpose_ros_signals.person import BodyObservation, Person, Surroundings
from openpose_ros_signals.records import Facing, PersonSignals
from skeleton_extract_3d.body.joint_frames import joint_frames
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.people import People3D

_NOTHING = Surroundings()


class Present(NamedTuple):
    """A person that is there: when it was seen first and last [s], and what it did then."""

    since: float
    seen: float
    signals: PersonSignals


class SignalReader:
    """Tells what the people of successive frames do; not thread-safe, and with no clock but the stamps."""

    def __init__(self, constants: SignalConstants = SIGNALS) -> None:
        self._constants = constants
        self._people: Dict[int, Person] = {}
        self._newest: Dict[int, PersonSignals] = {}
        self._stamp = -np.inf

    @property
    def present(self) -> Tuple[Present, ...]:
        """People of the last frame, and those seen at most `gap` before."""
        return tuple(Present(person.since, person.stamp, self._newest[name]) for name, person in self._people.items())

    def update(self, people: People3D, stamp: float, up: np.ndarray, around: Surroundings = _NOTHING,
               landmarks: Optional[Landmarks3D] = None) -> Tuple[PersonSignals, ...]:
        """Return what each person does, in the order of the people.

        Args:
            people: in a frame of reference in which the room stands still, or walking and falls are not told rightly.
            stamp: [s]; if it is before that of the last frame, all people begin anew.
            up: (3,) upwards, any length.
            around: targets, cloud and floor, in the same frame.
            landmarks: their hands and faces, in the same frame; None: not known.
        """
        if stamp < self._stamp:
            self._people.clear()
        self._stamp = stamp
        up = np.asarray(up, np.float64) / np.linalg.norm(up)
        self._people = {name: person for name, person in self._people.items()
                        if stamp - person.stamp <= self._constants.person.gap}
        joints = joints_of(people)
        self._follow(people.ids.tolist(), joints[0], stamp)
        seen = _observations(people, joints, landmarks or Landmarks3D.empty())
        persons = tuple(self._people[name].read(name, stamp, one, up, around)
                        for name, one in zip(people.ids.tolist(), seen))
        self._newest = {**{name: self._newest[name] for name in self._people if name in self._newest},
                        **{person.id: person for person in persons}}
        return persons

    def _follow(self, names: List[int], joints: np.ndarray, stamp: float) -> None:
        """Give new ids, and those that have jumped, the memory of the nearest person that was lost."""
        with np.errstate(invalid='ignore'):
            places = np.array([trunk_place(row) for row in joints]).reshape(-1, 3)
        new = [row for row, name in enumerate(names)
               if name not in self._people or self._steps(self._people[name], places[row], stamp) > 1]
        kept = {names[row] for row in range(len(names)) if row not in new}
        lost = [name for name in self._people if name not in kept]
        steps = np.array([[self._steps(self._people[name], places[row], stamp) for name in lost]
                          for row in new]).reshape(len(new), len(lost))
        with np.errstate(invalid='ignore'):
            allowed = steps <= 1
        memories = {new[row]: self._people[lost[column]] for row, column in match(steps, allowed)}
        for row in new:
            self._people.pop(names[row], None)
        taken = {id(person) for person in memories.values()}
        self._people = {name: person for name, person in self._people.items() if id(person) not in taken}
        self._people.update({names[row]: memories.get(row) or Person(stamp, self._constants) for row in new})

    def _steps(self, person: Person, place: np.ndarray, stamp: float) -> float:
        """Return how far a place is from where a person was, as a share of how far the person may have gone.

        It is NaN where the place is not known, or that of the person was not for longer than `gap`.
        """
        constants, age = self._constants.person, stamp - person.placed
        reach = (constants.step + constants.stride * age) * person.stature
        return float(np.linalg.norm(place - person.place)) / reach if age <= constants.gap else np.nan


def _observations(people: People3D, joints: Tuple[np.ndarray, ...], landmarks: Landmarks3D) -> List[BodyObservation]:
    """Return the people of a frame one by one."""
    frames, index = joint_frames(people), people.skeleton.index
    neck, nose = (frames[:, index[name]] if name in index else np.full((len(people), 3, 3), np.nan)
                  for name in ('neck', 'nose'))
    seen = []
    for row, name in enumerate(people.ids.tolist()):
        palms = tuple(palm_of(landmarks.hands, name, left) for left in (True, False))
        own = (joints[0][row], joints[1][row], joints[2][row])
        seen.append(BodyObservation(own, neck[row], nose[row], (palms[0], palms[1]), _face_of(landmarks, name)))
    return seen


def _face_of(landmarks: Landmarks3D, name: int) -> Optional[Facing]:
    """Return which way the face of a person looks, None if it was not found."""
    faces = landmarks.faces
    for row in np.flatnonzero((faces.people == name) & np.isfinite(faces.orientations).all(axis=1)):
        forward = Rotation.from_quat(faces.orientations[row]).apply([1.0, 0.0, 0.0])
        return Facing(forward, float(faces.orientation_sigma[row]),
                      np.nanmean(faces.points.xyz[row], axis=0))
    return None
