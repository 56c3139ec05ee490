"""Who is there, since when, and whether that changed."""
from typing import Dict, List, NamedTuple, Sequence, Set, Tuple

from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.records import PersonSignals

# What changes a summary: posture, walking, fallen, gestures with arm and target.
_State = Tuple[str, bool, bool, Tuple[Tuple[str, str, str], ...]]


class Present(NamedTuple):
    """Somebody who is there.

    Attributes:
        since: when the person was seen first [s].
        signals: of the newest frame.
    """

    since: float
    signals: PersonSignals


class Summary:
    """Remembers who is there.

    Attributes:
        people: of the newest frame.
    """

    def __init__(self) -> None:
        self.people: List[Present] = []
        self._first: Dict[int, float] = {}
        self._last: Dict[int, float] = {}
        self._told: Set[Tuple[int, _State]] = set()
        self._begun = False

    def update(self, persons: Sequence[PersonSignals], stamp: float) -> bool:
        """Take the people of a frame at a time [s]; return whether somebody came, left, or does something else.

        Who is back within a second has not left.
        """
        gone = [name for name, last in self._last.items() if not 0 <= stamp - last <= SIGNALS.person.gap]
        for name in gone:
            del self._first[name], self._last[name]
        for person in persons:
            self._first.setdefault(person.id, stamp)
            self._last[person.id] = stamp
        self.people = [Present(self._first[person.id], person) for person in persons]
        told = {(person.id, _state(person)) for person in persons}
        changed = told != self._told or not self._begun
        self._told, self._begun = told, True
        return changed


def _state(person: PersonSignals) -> _State:
    gestures = tuple((gesture.name, gesture.arm, gesture.pointing.hit.name if gesture.pointing and gesture.pointing.hit
                      else '') for gesture in person.gestures)
    return person.posture.name, person.walk is not None and person.walk.moving, person.fall is not None, gestures
