"""Who is there, since when, and whether that changed."""
from typing import Dict, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from openpose_ros_signals.records import PersonSignals

# What changes a summary: posture, walking, fallen, gestures with arm and target.
_State = Tuple[str, bool, bool, Tuple[Tuple[str, str, str], ...]]


class Present(NamedTuple):
    """A person in the summary.

    Attributes:
        since: when the person was seen first [s].
        seen: when the person was seen last [s].
        signals: of then.
    """

    since: float
    seen: float
    signals: PersonSignals


class Summary:
    """Remembers who is there."""

    def __init__(self) -> None:
        self._present: Dict[int, Present] = {}
        self._told: Optional[Set[Tuple[int, _State]]] = None

    @property
    def people(self) -> Tuple[Present, ...]:
        """The people of the newest frame, and those who were seen shortly before."""
        return tuple(self._present.values())

    def update(self, persons: Sequence[PersonSignals], stamp: float, known: Mapping[int, float]) -> bool:
        """Take the people of a frame at a time [s]; return whether a person came, left, or does something else.

        Args:
            known: since when the people are there who have not left, by id, see `SignalReader.known`.
        """
        self._present = {name: present for name, present in self._present.items() if name in known}
        self._present.update({person.id: Present(known[person.id], stamp, person) for person in persons})
        return self._changed()

    def clear(self) -> bool:
        """Forget all people, as the input has ended; return whether there were any."""
        self._present.clear()
        return self._changed()

    def _changed(self) -> bool:
        told = {(name, _state(present.signals)) for name, present in self._present.items()}
        changed, self._told = told != self._told, told
        return changed


def _state(person: PersonSignals) -> _State:
    gestures = tuple((gesture.name, gesture.arm, gesture.pointing.hit.name if gesture.pointing and gesture.pointing.hit
                      else '') for gesture in person.gestures)
    return person.posture.name, person.walk is not None and person.walk.moving, person.fall is not None, gestures
