"""Nodes that are started wrongly, killed or stopped."""
from typing import Any, Dict

from faults.fault import Scenario


def refused(parameters: Dict[str, Any], *words: str) -> Any:
    """Return what starts a node with these parameters, which has to end with these words."""
    def run(rig: Any) -> None:
        from faults.rig import PEOPLE, Program, says_when_it_ends
        says_when_it_ends(rig, 'refused/people', Program(PEOPLE, parameters), *words)
    return run


FAULTS = [
    Scenario('unknown name of a parameter', refused({'no_such_parameter': 1}, "'no_such_parameter'"), 'people_3d_node',
             'ends with 1 and names it'),
]
