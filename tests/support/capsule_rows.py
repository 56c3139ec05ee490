"""The capsules of `Capsules` one by one."""
from types import SimpleNamespace
from typing import List

from openpose_ros_signals.capsules import PARTS, Capsules


def rows(capsules: Capsules) -> List[SimpleNamespace]:
    return [SimpleNamespace(part=PARTS[capsules.parts[row]], ends=capsules.ends[row], radius=float(capsules.radii[row]),
                            sigma=capsules.sigma[row], velocity=capsules.velocity[row],
                            measured=bool(capsules.measured[row])) for row in range(len(capsules))]
