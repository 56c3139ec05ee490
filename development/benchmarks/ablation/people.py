#!/usr/bin/python3
"""Ablation: each constant of detection and of the 3D method at half and at twice its value, and each mechanism off.

Each scene is read once; what the networks compute is remembered, so that a variant takes milliseconds per frame. The
counts of each scene go into the folder --out, one file per scene and part, and are computed once; --table writes what
they show: paired differences over scenes with 95 % bootstrap intervals.

Parts: `estimator` (the detections of a full search are the same for all variants), `floor` (known floor), `detection`
(full search), `following` (people count before the search; half a full search of work per frame), `images` (people
without points), and `lives` (long sequences in virtual time, see `./run bench virtual`).

    ./run bench ablation people --out FOLDER --part estimator SCENE [SCENE ...]
    ./run bench ablation people --out FOLDER --table development/notes/ablation.md
"""
import json
import sys
from pathlib import Path
from typing import Any, Dict, Optional, Set, Union

from ablation_tools import table
from ablation_tools.parts import MECHANISMS, PARTS, paths_of
from ablation_tools.scenes import BUDGET, Lives, Runner, Scene, lifted
from ablation_tools.variants import Variant, text_of, variants
from common import Parser
from results.machine import commit
from virtual import moments_of, passes

BASE = Variant(table.BASE, {})


def sums_of(folder: Path, part: str, runner: Union[Runner, Lives], some: Optional[Set[str]] = None) -> Dict[str, Any]:
    """Return the sums of a scene by variant; `some`: paths of constants that are varied, all if None."""
    everything = [BASE, *(one for one in variants(paths_of(part)) if some is None or set(one.constants) <= some),
                  *MECHANISMS[part]]
    if isinstance(runner, Lives):
        moments = passes(moments_of(folder), 15.0, 1)
        return {one.name: runner.sums(moments, one) for one in everything}
    scene = Scene.read(folder)
    if part in ('estimator', 'floor'):
        frames = scene.on_floor if part == 'floor' else scene.frames
        people = [found.detections for found in runner.found(scene, BASE)]
        return {one.name: scene.score(lifted(frames, people, one)) for one in everything}
    seen = scene.without_points if part == 'images' else scene
    return {one.name: scene.score_results(runner.found(seen, one, BUDGET if part == 'following' else 0.0))
            for one in everything}


def values_of(part: str) -> Dict[str, Any]:
    """Return the constants of a part as text by path, and under '' the names of its mechanisms."""
    texts = {path: text_of(value) for path, (value, _) in paths_of(part)}
    return {**texts, '': [one.name for one in MECHANISMS[part]]}


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('scenes', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--out', type=Path, required=True, help='folder of the counts')
    parser.add_argument('--part', choices=PARTS, default='estimator')
    parser.add_argument('--unsettled', action='store_true', help='only constants that moved nothing so far')
    parser.add_argument('--table', type=Path, help='write the tables of all counts')
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    runner = Lives() if arguments.part == 'lives' else Runner()
    some = table.unsettled(arguments.out, arguments.part) if arguments.unsettled else None
    for folder in arguments.scenes:
        path = arguments.out / f'{folder.name}.{arguments.part}.json'
        if not path.exists():
            found = sums_of(folder, arguments.part, runner, some)
            path.write_text(json.dumps({'commit': commit(), 'values': values_of(arguments.part), 'sums': found}))
            runner.forget()
            print(path, flush=True)
    if arguments.table:
        arguments.table.write_text(table.report(arguments.out))
    return 0


if __name__ == '__main__':
    sys.exit(main())
