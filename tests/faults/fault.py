"""What a case of the fault suite is. Needs no ROS: development/notes/faults.md is written from the cases."""
import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple, Union


@dataclass(frozen=True)
class Fault:
    """Something that is done to nodes which run, and what has to come of it.

    After it the nodes are the same processes as before, and good frames give the same joints.
    """

    title: str  # what is wrong, as the table shows it
    inject: Callable[[Any], None]  # does it; called with the `rig.Chain` of the node
    node: str = 'cloud/people'  # has to notice it: 'CHAIN/NODE' of `rig.CHAINS`
    event: str = 'bad input'  # the counter in /diagnostics that rises; empty: good frames go on, with nothing to say
    words: Tuple[str, ...] = ()  # parts of the text in /diagnostics, beside the event
    level: str = 'WARN'  # of the status with that text

    @property
    def outcome(self) -> str:
        """What is said of it, for the table."""
        said = ' ... '.join(self.words)
        return f'`{self.event}`{said and f": {said}"} ({self.level})' if self.event else 'nothing is lost'


@dataclass(frozen=True)
class Scenario:
    """A fault that needs processes of its own, or takes a few seconds: as few as possible."""

    title: str  # what is wrong, as the table shows it
    run: Callable[[Any], None]  # does it, and asserts what comes of it; called with the `rig.Rig`
    node: str  # that it is about
    outcome: str  # what comes of it, for the table


Case = Union[Fault, Scenario]


def all_cases() -> Dict[str, List[Case]]:
    """Return the cases of each area: `FAULTS` of the modules in cases/."""
    names = sorted(path.stem for path in (Path(__file__).parent / 'cases').glob('[a-z]*.py'))
    return {name.replace('_', ' '): importlib.import_module(f'faults.cases.{name}').FAULTS for name in names}


def table() -> List[Tuple[str, str, str, str]]:
    """Return the rows of the table in development/notes/faults.md: area, what is wrong, node, outcome."""
    return [(area, case.title, case.node, case.outcome) for area, cases in all_cases().items() for case in cases]
