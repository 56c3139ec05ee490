#!/usr/bin/python3
"""Validate the chain on RGB-D sequences with known joints, with the commands of docs/validate_on_a_database.md.

Images become a bag, the bag keypoints, the true joints a motion capture file at 120 Hz with 1 mm of noise, a clock
and a place of its own; both are compared. Told is what `evaluate_mocap` finds of clock and place against the truth, and
the errors. Reports and images stay in --out.

    ./run bench validation SEQUENCE [SEQUENCE ...] --out FOLDER
    ./run bench validation SEQUENCE --out FOLDER --set mode=fast
"""
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence

import numpy as np

import truth_as_mocap
from common import Parser, errors_end_the_program, markdown, new_path
from openpose_ros_tools.ros import evaluate_mocap, images_to_bag
from openpose_ros_tools.ros.process_bag import program as process_bag

# What the reference differs by: its clock [s], its frame [degrees, m].
CLOCK_OFFSET, DEGREES, PLACE = 3.7, (90.0, 0.0, 30.0), (1.0, 2.0, 1.5)
# The first stamp of numbered images in a bag [s], as images_to_bag sets it.
FIRST_STAMP = 1000.0
COLUMNS = ('sequence', 'clock [ms]', 'place [mm]', 'turned [deg]', 'people found', 'median [mm]', 'mean [mm]',
           'PCK 100', 'answered', 'measured', 'median [mm]', 'PCK 100 of answered', 'inferred', 'median [mm]')


def command(main: Callable[[Sequence[str]], int], *arguments: object) -> None:
    """Run a command quietly; end the program where it fails."""
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        status = main([str(argument) for argument in arguments])
    if status:
        raise SystemExit(f'{main.__module__} ended with status {status}\n{output.getvalue()}')


def validate(sequence: Path, folder: Path, settings: List[str]) -> Dict[str, Any]:
    """Return the summary of a sequence's report."""
    folder.mkdir(parents=True)  # sequences of one name would share it
    people, poses, mocap = (folder / name for name in ('people.bag', 'poses.csv', 'mocap.trc'))
    with tempfile.TemporaryDirectory(prefix='openpose_ros_bench_') as temporary:
        bag = Path(temporary, 'camera.bag')
        command(images_to_bag.main, sequence, '-o', bag)
        command(process_bag.main, bag, '-o', people, '--csv', poses, '--csv-layout', 'extended',
                *(part for setting in settings for part in ('--set', setting)))
    command(truth_as_mocap.main, sequence, mocap, '--noise', 1, '--clock-offset', CLOCK_OFFSET,
            '--rotate-degrees', *DEGREES, '--move', *PLACE)
    command(evaluate_mocap.main, poses, mocap, '-o', folder / 'report')
    return json.loads((folder / 'report' / 'summary.json').read_text())


def row(name: str, summary: Dict[str, Any]) -> List[str]:
    """Return the cells of a sequence."""
    place, overall = summary['transform'], summary['overall']
    true = truth_as_mocap.rigid_transform(DEGREES, PLACE)
    turned = np.array(place['matrix'])[:3, :3] @ true[:3, :3].T
    angle = np.degrees(np.arccos(np.clip((np.trace(turned) - 1) / 2, -1, 1)))
    off = np.linalg.norm(np.array(place['translation_m']) - true[:3, 3])
    clock = summary['clock']['offset_s'] - (CLOCK_OFFSET - FIRST_STAMP)
    measured, inferred = overall['measured'], overall['inferred']
    return [name, f'{1e3 * clock:+.1f}', f'{1e3 * off:.0f}', f'{angle:.2f}',
            f'{summary["compared"]["share_found"]:.3f}', f'{overall["median_mm"]:.1f}', f'{overall["mean_mm"]:.1f}',
            f'{overall["pck_100"]:.3f}', f'{overall["share_answered"]:.3f}', f'{measured["share_of_reference"]:.3f}',
            f'{measured["median_mm"]:.1f}', f'{measured["pck_100_of_answered"]:.3f}',
            f'{inferred["share_of_reference"]:.3f}', f'{inferred["median_mm"]:.1f}']


def main() -> None:
    """Run the benchmark from the command line; print a Markdown table."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders with gt.json')
    parser.add_argument('--out', type=new_path, required=True, help='folder for tables, bags of people and reports')
    parser.add_settings('of process_bag')
    options = parser.parse_args()
    rows: List[Sequence[str]] = [COLUMNS]
    with errors_end_the_program():
        for sequence in options.sequences:
            name = sequence.resolve().name
            rows.append(row(name, validate(sequence, options.out / name, options.set)))
    print(markdown(rows))


if __name__ == '__main__':
    main()
