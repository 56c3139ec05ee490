"""The ten checks in their order, and their findings in words."""
import re
import textwrap
from typing import Callable, Dict, Iterator, List, Mapping

from openpose_ros_bringup.doctor.chain import check_load, check_subscribers
from openpose_ros_bringup.doctor.content import check_encodings, check_registration, check_stamps
from openpose_ros_bringup.doctor.findings import UNKNOWN, WRONG, Finding, unknown
from openpose_ros_bringup.doctor.frames import check_frames, check_tf
from openpose_ros_bringup.doctor.snapshot import Snapshot
from openpose_ros_bringup.doctor.topics import check_master, check_rates, check_topics

CHECKS: Dict[str, Callable[[Snapshot], Iterator[Finding]]] = {
    'master': check_master, 'topics': check_topics, 'rates': check_rates, 'encodings': check_encodings,
    'stamps': check_stamps, 'registration': check_registration, 'tf': check_tf, 'frames': check_frames,
    'load': check_load, 'subscribers': check_subscribers}
Findings = Mapping[str, List[Finding]]
_COMMAND_OF_ROS = re.compile(r'(^|[&|:] )(?=ros)')
_WIDTH, _INDENT = 120, ' ' * 25


def diagnose(seen: Snapshot) -> Findings:
    """Return the findings of each check."""
    if not seen.master.is_online:
        return {name: list(check(seen)) if name == 'master' else [unknown('the master does not answer')]
                for name, check in CHECKS.items()}
    return {name: list(check(seen)) or [unknown('no camera is known')] for name, check in CHECKS.items()}


def faults(findings: Findings) -> int:
    """Return how many findings say that something is wrong."""
    return sum(finding.state == WRONG for found in findings.values() for finding in found)


def report(findings: Findings, prefix: str = '') -> str:
    """Return the findings as lines; `prefix` comes before commands of ROS, as './run shell '."""
    lines: List[str] = []
    for number, (name, found) in enumerate(findings.items(), 1):
        title = f'{number:2d} {name}'
        for finding in dict.fromkeys(found):  # each once
            state = '-' if finding.state == UNKNOWN else finding.state
            lines += textwrap.wrap(finding.text, _WIDTH, initial_indent=f'{title:<17}{state:<8}',
                                   subsequent_indent=_INDENT, break_long_words=False, break_on_hyphens=False)
            title = ''
            if finding.line:
                lines.append(_INDENT + '-> ' + _COMMAND_OF_ROS.sub(lambda begin: begin[1] + prefix, finding.line))
    wrong = faults(findings)
    lines.append(f'{wrong} wrong: docs/nothing_in_rviz.md' if wrong else 'nothing is wrong')
    return '\n'.join(lines) + '\n'
