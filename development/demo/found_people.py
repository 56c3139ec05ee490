"""Compare the people that a chain publishes with the true people of a sequence."""
from collections import defaultdict
from typing import Any, DefaultDict, Dict, List, NamedTuple, Sequence, Set

import numpy as np

# A person is visible with so many joints that gt.json calls visible.
VISIBLE_JOINTS, VISIBLE = 9, 2
# Distance of a reported neck from the true one up to which a person is found, and beyond which there is no person [m].
FOUND, NO_PERSON = 0.6, 0.8


class Output(NamedTuple):
    """What is published of a frame: its index in the sequence, stamp [s], and necks [m] in the camera's frame by id."""

    frame: int
    stamp: float
    necks: Dict[int, Sequence[float]]


class Count(NamedTuple):
    """Visible people in all outputs, those found, the longest time that one was not [s], reports where no person is,
    ids reported in each pass through the sequence, and ids that more than one person has had.
    """

    visible: int
    found: int
    longest_gap: float
    no_person: int
    ids: List[Set[int]]
    exchanged: Set[int]


def count_found(outputs: Sequence[Output], truth: Dict[str, Any]) -> Count:
    """Compare outputs, in the order of their stamps, with the content of a gt.json.

    The gap of a person is the time from outputs in which the person is visible and not found to the next output, added
    up until the person is found or the pass ends.
    """
    neck = truth['joints'].index('neck')
    visible, found, longest_gap, no_person = 0, 0, 0.0, 0
    passes: List[Set[int]] = []
    owners: DefaultDict[int, Set[int]] = defaultdict(set)
    gaps: DefaultDict[int, float] = defaultdict(float)  # by person [s]
    missed: Set[int] = set()  # in the output before
    for before, output in zip([*outputs[:1], *outputs], outputs):
        if output.frame <= before.frame:
            passes.append(set())
            gaps.clear()
            missed = set()
        for person in missed:
            gaps[person] += output.stamp - before.stamp
            longest_gap = max(longest_gap, gaps[person])
        passes[-1].update(output.necks)
        people = truth['frames'][output.frame]['people']
        true_necks = np.reshape([person['xyz'][neck] for person in people], (-1, 3))
        reported = set()
        for number, place in output.necks.items():
            distances = np.linalg.norm(true_necks - place, axis=1)
            no_person += int((distances > NO_PERSON).all())
            if (distances <= FOUND).any():
                reported.add(people[distances.argmin()]['id'])
                owners[number].add(people[distances.argmin()]['id'])
        seen = {person['id'] for person in people if person['vis'].count(VISIBLE) >= VISIBLE_JOINTS}
        visible, found, missed = visible + len(seen), found + len(seen & reported), seen - reported
        gaps.update(dict.fromkeys(reported, 0.0))
    return Count(visible, found, longest_gap, no_person, passes, {one for one, had in owners.items() if len(had) > 1})
