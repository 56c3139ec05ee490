#!/usr/bin/python3
"""Measure how soon the running nodes publish a person who has just come into view.

A camera driver plays a sequence in which two people walk and a third one appears as a whole, for 45 frames each time,
in another place, and is gone again for about as long: people of the shipped sequence, cut out and pasted. Measured is
the time from the stamp of the first image that shows the third person to the arrival of the first message that has a
person there, within 0.4 m by the median of the joints. People too many: published beyond the true number.

    ./run bench newcomer --rates 15 30 --passes 3 mode:=balanced
"""
import argparse
import sys
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
import rospy

from accuracy.live import Player
from chain_runs import Frames, read_truth
from common import DEMO, Parser, markdown, run_live
from crowd import FIRST_COPY, Copy, write_crowd
from nodes import median_and_95
from results.machine import Unit
from scoring.people import OUTSIDE, Found, nearest, pair
from session import Session

# Frame in which a person appears, and which: one that is never hidden, at places where no other person covers the copy.
NEWCOMERS: Sequence[Tuple[int, Copy]] = (
    (50, (1, 52, -1.9, 1.3)), (148, (1, 14, 1.5, 0.7)), (240, (1, 14, -1.7, 0.9)), (338, (1, 20, 1.8, 2.2)),
    (430, (1, 25, -2.2, 1.6)), (528, (1, 76, 1.3, 0.7)))
STAY = 45  # frames
SAME_PLACE = 0.4  # maximum median distance of the joints [m]


class Seen(NamedTuple):
    """What was published: seconds until each newcomer was (inf: never), latencies [s], people too many by frame."""

    seconds: np.ndarray
    latencies: np.ndarray
    beyond: np.ndarray


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--rates', type=float, nargs='+', default=[30.0], help='of the camera [Hz]')
    parser.add_argument('--passes', type=int, default=3, help=f'of {len(NEWCOMERS)} newcomers (default %(default)s)')
    return parser.parse_live()


def casts() -> List[Tuple[int, Sequence[Copy]]]:
    """Return who is in each frame, for `write_crowd`."""
    return [(2, [copy for begin, copy in NEWCOMERS if begin <= number < begin + STAY])
            for number in range(NEWCOMERS[-1][0] + STAY)]


def compare(folder: Path, played: Tuple[Frames, Sequence[float]], rate: float) -> Seen:
    """Compare what `Player.play` returned with the truth."""
    frames, latencies = played
    truth, order = read_truth(folder)
    times = [frame['t'] for frame in truth['frames']]
    found = nearest(times, frames)[0]
    late = {int(np.argmin(np.abs(np.array(times) - seconds))): one for (seconds, _), one in zip(frames, latencies)}
    seconds = []
    for name, (begin, _) in enumerate(NEWCOMERS, FIRST_COPY):
        first = next((number for number in range(begin, begin + STAY)
                      if name in _there(truth['frames'][number]['people'], found[number], order)), None)
        seconds.append(np.inf if first is None else (first - begin) / rate + late[first])
    beyond = [len(people.ids) - len(frame['people']) for people, frame in zip(found, truth['frames'])]
    return Seen(np.array(seconds), np.array(latencies), np.maximum(beyond, 0))


def _there(people: Sequence[Dict[str, Any]], found: Found, order: Sequence[int]) -> List[int]:
    """Return the ids of the true people who are among those found."""
    xyz = np.array([person['xyz'] for person in people])[:, order]
    in_image = np.array([person['vis'] for person in people])[:, order] != OUTSIDE
    return [people[row]['id'] for row in pair(xyz, in_image, found, SAME_PLACE)]


def measure_rate(session: Session, folder: Path, rate: float, arguments: argparse.Namespace) -> Seen:
    """Run the nodes before a camera; `folder` holds the sequence."""
    player = Player(session, folder.parent, argparse.Namespace(
        rate=rate, points='depth_image', launch=[f'target_rate:={rate}', *arguments.launch]))
    player.lead_in(DEMO)
    passes = [compare(folder, player.play(folder), rate) for _ in range(arguments.passes)]
    session.stop(player.nodes)
    return Seen(*map(np.concatenate, zip(*passes)))


def measure_all(session: Session, folder: Path, arguments: argparse.Namespace
                ) -> List[Tuple[Dict[str, object], Seen]]:
    """Measure each rate; return the cells of its row and what was seen."""
    rospy.init_node('newcomer', disable_signals=True)
    unit, measured = Unit(), []
    write_crowd(folder / 'newcomers', casts())
    for rate in arguments.rates:
        before = unit.milliseconds()
        seen = measure_rate(session, folder / 'newcomers', rate, arguments)
        after = unit.milliseconds()
        published = seen.seconds[np.isfinite(seen.seconds)]
        measured.append(({
            'camera [Hz]': rate, 'T [ms]': f'{before:.0f} - {after:.0f}', 'newcomers': len(seen.seconds),
            'published after, median / 95 % [ms]': median_and_95(seen.seconds),
            'never': len(seen.seconds) - len(published), 'frames': len(seen.beyond), 'answered': len(seen.latencies),
            'latency median / 95 % [ms]': median_and_95(seen.latencies),
            'people too many, mean': round(float(seen.beyond.mean()), 3)}, seen))
    return measured


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> List[str]:
    """Measure all rates and print the table."""
    rows = [row for row, _ in measure_all(session, folder, arguments)]
    print(markdown([[*rows[0]], *(row.values() for row in rows)]), flush=True)
    return []


if __name__ == '__main__':
    sys.exit(run_live(measure, parse_arguments()))
