#!/usr/bin/python3
"""Ablation: each constant of detection and of the 3D method at half and at twice its value, and each mechanism off.

Each scene is read once; what the networks compute is remembered, so that a variant takes milliseconds per frame. The
counts of each scene go into the folder --out, one file per scene and part, and are computed once; --table writes what
they show: paired differences over scenes with 95 % bootstrap intervals.

Parts: `estimator` (searched in full; the 2D result is the same for all variants), `floor` (known floor), `detection`,
and `following` (people followed, half a full search of work per frame).

    ./run bench ablation --out FOLDER --part estimator SCENE [SCENE ...]
    ./run bench ablation --out FOLDER --table development/notes/ablation.md
"""
import json
import sys
from pathlib import Path
from typing import Callable, Dict, List, Sequence, Tuple

from common import Parser  # first: it makes the packages known
from ablations import mechanisms, variants
from ablations.scenes import Counts, Runner, Scene, lifted
from ablations.variants import Variant

BASE = Variant('as it is', {})
PARTS: Dict[str, Tuple[Callable[[], List[Variant]], Sequence[Variant]]] = {
    'estimator': (variants.of_method, mechanisms.METHOD),
    'floor': (variants.of_floor, mechanisms.FLOOR),
    'detection': (lambda: variants.of_instances(variants.DETECTION), mechanisms.DETECTION),
    'following': (lambda: variants.of_instances(variants.FOLLOWING), mechanisms.FOLLOWING)}


def counts_of(scene: Scene, part: str, runner: Runner) -> Dict[str, Counts]:
    """Return the counts of a scene by variant."""
    constants, off = PARTS[part]
    everything = [BASE, *constants(), *off]
    if part == 'following':
        runs = {one.name: runner.followed(scene, one) for one in everything}
        return {name: {**scene.score(in_space), **scene.score_image(people)} for name, (people, in_space) in runs.items()}
    people = runner.found(scene, BASE)
    frames = scene.on_floor if part == 'floor' else scene.frames
    if part != 'detection':
        return {one.name: scene.score(lifted(frames, people, one)) for one in everything}
    counts = {}
    for one in everything:
        found = runner.found(scene, one)
        counts[one.name] = {**scene.score(lifted(frames, found, BASE)), **scene.score_image(found)}
    return counts


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('scenes', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--out', type=Path, required=True, help='folder of the counts')
    parser.add_argument('--part', choices=sorted(PARTS), default='estimator')
    parser.add_argument('--table', type=Path, help='write the tables of all counts')
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    runner = Runner()
    for folder in arguments.scenes:
        path = arguments.out / f'{folder.name}.{arguments.part}.json'
        if not path.exists():
            path.write_text(json.dumps(counts_of(Scene.read(folder), arguments.part, runner)))
            runner.forget()
            print(path, flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
