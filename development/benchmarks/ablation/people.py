#!/usr/bin/python3
"""Ablation: each constant of detection and of the 3D method at half and at twice its value, and each mechanism off.

Each scene is read once; what the networks compute is remembered, so that a variant takes milliseconds per frame. The
counts of each scene go into the folder --out, one file per scene and part, and are computed once; --table writes what
they show: paired differences over scenes with 95 % bootstrap intervals.

Parts: `estimator` (searched in full; the 2D result is the same for all variants), `floor` (known floor), `detection`,
and `following` (people followed, half a full search of work per frame).

    ./run bench ablation people --out FOLDER --part estimator SCENE [SCENE ...]
    ./run bench ablation people --out FOLDER --table development/notes/ablation.md
"""
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, Optional, Set

import numpy as np

from ablations import mechanisms, table, variants
from ablations.effects import Sums
from ablations.scenes import Runner, Scene, lifted
from ablations.variants import Variant
from common import ROOT, Parser

BASE = Variant(table.BASE, {})

def sums_of(scene: Scene, part: str, runner: Runner, some: Optional[Set[str]] = None) -> Dict[str, Sums]:
    """Return the sums of a scene by variant; `some`: paths of constants that are varied, all if None."""
    everything = [BASE, *(one for one in variants.of_part(part) if some is None or set(one.constants) <= some),
                  *mechanisms.OF_PART[part]]
    if part == 'following':
        runs = ((one.name, *runner.followed(scene, one)) for one in everything)
        return {name: {**scene.score(in_space), **scene.score_image(people)} for name, people, in_space in runs}
    people = runner.found(scene, BASE)
    frames = scene.on_floor if part == 'floor' else scene.frames
    if part != 'detection':
        return {one.name: scene.score(lifted(frames, people, one)) for one in everything}
    sums = {}
    for one in everything:
        found = runner.found(scene, one)
        sums[one.name] = {**scene.score(lifted(frames, found, BASE)), **scene.score_image(found)}
    return sums


def values_of(part: str) -> Dict[str, Any]:
    """Return the constants of a part as text by path, and under '' the names of its mechanisms."""
    texts = {path: text_of(value) for path, (value, _) in variants.all_paths(part)}
    return {**texts, '': [one.name for one in mechanisms.OF_PART[part]]}


def text_of(value: Any) -> str:
    """Return a value as text; of many numbers the first ones."""
    if isinstance(value, (tuple, np.ndarray)):
        text = ', '.join(str(one) for one in np.asarray(value, object).ravel())
        return text if len(text) < 40 else f'{text[:30].rpartition(",")[0]}, ...'
    return f'{value:g}'


def commit() -> str:
    """Return the commit of the code."""
    return subprocess.run(['git', 'rev-parse', '--short=8', 'HEAD'], cwd=str(ROOT), check=True,
                          stdout=subprocess.PIPE).stdout.decode().strip()


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('scenes', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--out', type=Path, required=True, help='folder of the counts')
    parser.add_argument('--part', choices=variants.PARTS, default='estimator')
    parser.add_argument('--unsettled', action='store_true', help='only constants that moved nothing so far')
    parser.add_argument('--table', type=Path, help='write the tables of all counts')
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    runner = Runner()
    some = table.unsettled(arguments.out, arguments.part) if arguments.unsettled else None
    for folder in arguments.scenes:
        path = arguments.out / f'{folder.name}.{arguments.part}.json'
        if not path.exists():
            found = sums_of(Scene.read(folder), arguments.part, runner, some)
            path.write_text(json.dumps({'commit': commit(), 'values': values_of(arguments.part), 'sums': found}))
            runner.forget()
            print(path, flush=True)
    if arguments.table:
        present = {path for part in variants.PARTS for path, _ in variants.all_paths(part)}
        arguments.table.write_text(table.report(arguments.out, present))
    return 0


if __name__ == '__main__':
    sys.exit(main())
