"""Each fault is noticed, counted and named, and harms nothing: see fault.py."""
from typing import Any, Dict, List

import pytest

from faults.fault import Fault, Scenario, all_cases
from faults.rig import Usage
from session import await_true

# What the allocator keeps of the largest messages [bytes].
MEMORY = 100 << 20
# Connections of rospy that are about to end.
TRANSIENT = 3


def cases(kind: type) -> List[Any]:
    return [pytest.param(case, id=f'{area}: {case.title}')
            for area, each in all_cases().items() for case in each if isinstance(case, kind)]


@pytest.mark.parametrize('fault', cases(Fault))
def test_fault(rig: Any, fault: Fault) -> None:
    rig.done[id(fault)].result()


@pytest.mark.parametrize('scenario', cases(Scenario))
def test_scenario(rig: Any, scenario: Scenario) -> None:
    scenario.run(rig)


def test_nothing_has_grown(rig: Any) -> None:
    def growth() -> Dict[str, Usage]:
        return {node: usage for chain in rig.chains.values() for node, usage in chain.growth().items()}

    assert growth()
    await_true(lambda: all(usage.memory < MEMORY and usage.threads <= TRANSIENT and usage.files <= TRANSIENT
                           for usage in growth().values()), lambda: f'as much as at the start: {growth()}')
