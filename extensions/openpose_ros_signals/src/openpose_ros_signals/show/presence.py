"""Which people are there, since when, and what they did when they were seen last."""
from typing import Dict, Mapping, NamedTuple, Sequence

from openpose_ros_signals.records import PersonSignals


class Present(NamedTuple):
    """A person that is there.

    Attributes:
        since: when the person was seen first [s].
        seen: when the person was seen last [s].
        signals: of then.
    """

    since: float
    seen: float
    signals: PersonSignals


def presence(before: Mapping[int, Present], persons: Sequence[PersonSignals], stamp: float,
             known: Mapping[int, float]) -> Dict[int, Present]:
    """Return the people of a frame at a time [s], and those that were seen shortly before, by id.

    Args:
        before: what this returned for the frame before.
        known: since when the people are there that have not left, by id, see `SignalReader.known`.
    """
    return {**{name: present for name, present in before.items() if name in known},
            **{person.id: Present(known[person.id], stamp, person) for person in persons}}
