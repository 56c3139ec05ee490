"""Constants of a method as frozen dataclasses: value, unit, source and one plain sentence each.

A step of a method declares its constants once::

    @dataclass(frozen=True)
    class PairingConstants:
        \"""Which image belongs to which cloud.\"""

        max_backstep: float = constant(0.5, 'Stamps that go back by more than this start a new recording.', unit='s')

The step takes an instance as an argument. `./run docs` prints the tables of the docs from these classes.
"""
import dataclasses
from typing import Any

import numpy as np

# Source of a constant that names none.
DEFAULT_SOURCE = 'chosen on rendered sequences'


def constant(value: Any, doc: str, *, unit: str = '', source: str = DEFAULT_SOURCE) -> Any:
    """Declare one constant of a frozen dataclass.

    Args:
        value: number, tuple or array; an array is made read-only and shared by all instances.
        doc: one sentence.
        unit: '' if it has none.
        source: paper, equation, file, or how the value was found.
    """
    metadata = {'doc': doc, 'unit': unit, 'source': source}
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
        return dataclasses.field(default_factory=lambda: value, metadata=metadata)
    return dataclasses.field(default=value, metadata=metadata)
