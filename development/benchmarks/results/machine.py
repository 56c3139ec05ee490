"""What figures depend on: processor, commit, date, and T, the unit of time."""
import datetime
import os
import statistics
import subprocess
import timeit
from pathlib import Path
from typing import Any, Dict

from chain_runs import open_sequence
from common import DEMO, ROOT
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.views import prepare_views
from openpose_ros_pkg.params.parameters import build

_PASSES = 15
# Of the instructions, those that set the pace of networks.
_FLAGS = {'avx2': 'AVX2', 'avx512f': 'AVX-512', 'avx512_bf16': 'bf16', 'amx_tile': 'AMX'}


class Unit:
    """T: one pass of mobilenet_thin at 656 x 368 in f32 on two threads, to compare machines by."""

    def __init__(self) -> None:
        detector = create_detector(build(DetectorSettings, {
            'pose_model': 'mobilenet_thin', 'net_input_width': 656, 'net_input_height': 368, 'threads': 2}))
        self._network = detector.setup.networks['mobilenet_thin']
        self._view, = prepare_views(open_sequence(DEMO).frame(0).bgr, detector.recipe.passes[0])
        self.milliseconds()

    def milliseconds(self) -> float:
        """Return the median of some passes [ms]; nothing else should be at work."""
        return 1e3 * statistics.median(timeit.repeat(lambda: self._view.compute(self._network), number=1,
                                                     repeat=_PASSES))


def processor() -> str:
    """Return number of cores, model and instruction sets of this machine."""
    lines = dict(line.split(':', 1) for line in Path('/proc/cpuinfo').read_text().splitlines() if ':' in line)
    fields = {key.strip(): value.strip() for key, value in lines.items()}
    flags = [name for flag, name in _FLAGS.items() if flag in fields.get('flags', '').split()]
    return f"{len(os.sched_getaffinity(0))} cores of {fields.get('model name', 'unknown')} ({', '.join(flags)})"


def commit() -> str:
    """Return the commit of this checkout, with + where tracked files differ from it."""
    git = ['git', '-C', str(ROOT)]
    name = subprocess.run([*git, 'rev-parse', '--short=10', 'HEAD'], stdout=subprocess.PIPE, text=True, check=False)
    changed = subprocess.run([*git, 'diff', '--quiet', 'HEAD', '--', '*.py', '*.cpp', '*.hpp', '*.h'],
                             check=False).returncode
    return (name.stdout.strip() or 'unknown') + ('+' if changed else '')


def made(milliseconds: float) -> Dict[str, Any]:
    """Return what a section is made by; T [ms] as measured."""
    return {'commit': commit(), 'processor': processor(), 'T_ms': round(milliseconds, 1),
            'date': datetime.datetime.now(datetime.timezone.utc).date().isoformat()}
