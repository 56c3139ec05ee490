"""Figures of live runs: the scores of CSV files, latency by stage, rows of tables."""
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

SCORE_COLUMNS = ('sequence', '', 'people found / real', 'visible within 100 mm', 'hidden within 150 mm',
                 'hidden, called MEASURED, wrong', 'id switches', 'frames answered', 'latency median / 95 % [ms]')


class Answers(NamedTuple):
    """What came of the frames of a sequence.

    Attributes:
        played: number of frames.
        latencies: of the answered ones, in the order of their arrival [s].
        misordered: answers that came after one of a later frame.
    """

    played: int
    latencies: Sequence[float]
    misordered: int = 0

    def plus(self, other: 'Answers') -> 'Answers':
        """Return both together."""
        return Answers(self.played + other.played, [*self.latencies, *other.latencies],
                       self.misordered + other.misordered)


def misordered(stamps: Sequence[int]) -> int:
    """Return how many stamps come after a later one."""
    return int((np.array(stamps) < np.maximum.accumulate(stamps)).sum()) if len(stamps) else 0


def score(evaluate: Path, pairs: Sequence[Tuple[Path, Path]], t0: str, report: Path) -> List[Dict[str, Any]]:
    """Return the scores of a script for pairs of sequence folder and CSV: one record each and, of several, of all.

    Args:
        evaluate: script that takes the pairs, --t0 and --json.
        t0: stamp of the first frame of each sequence, as the script takes it.
        report: file for what the script writes.
    """
    items = [str(path) for pair in pairs for path in pair]
    subprocess.run([sys.executable, str(evaluate), *items, '--t0', t0, '--json', str(report)], check=True,
                   stdout=subprocess.DEVNULL)
    return list(json.loads(report.read_text()).values())


def score_row(name: str, way: str, scores: Mapping[str, Any], answers: Answers) -> List[str]:
    """Return a row of SCORE_COLUMNS."""
    def share(value: Any) -> str:
        return '-' if value is None else f'{value:.3f}'

    visible, hidden = scores['visible'], scores['occluded']
    return [name, way, f"{share(scores['person_recall'])} / {share(scores['person_precision'])}",
            share(visible['pck100']), share(hidden['pck150']), share(hidden['lies']), str(scores['id_switches']),
            f'{len(answers.latencies)} of {answers.played}', median_and_95(answers.latencies)]


def median_and_95(seconds: Sequence[float]) -> str:
    """Return median and 95th percentile of times [s] in ms; NaN where nobody waited."""
    if not np.isfinite(seconds).any():
        return '-'
    median, high = 1e3 * np.percentile(seconds, (50, 95))
    return f'{median:.0f} / {high:.0f}'


def by_stage(stages: Mapping[str, float], names: Sequence[str]) -> Tuple[str, float]:
    """Return the means of stages that follow one another as text, and their sum [ms].

    Args:
        stages: means by stage, NaN for one that did not occur [ms].
        names: of the stages that a result passes, in this order.
    """
    known = {name: stages[name] for name in names if np.isfinite(stages.get(name, np.nan))}
    return ', '.join(f'{name} {value:.1f}' for name, value in known.items()), float(sum(known.values()))


def wanted_rate(camera: float, unit: float) -> float:
    """Return the rate that two people should have [Hz]: that of the camera but for one frame, or 1 / 0.6 T.

    Args:
        camera: its rate [Hz].
        unit: T, one f32 pass of mobilenet_thin at 656 x 368 [ms].
    """
    return min(camera * 29 / 30, 1000 / (0.6 * unit))
