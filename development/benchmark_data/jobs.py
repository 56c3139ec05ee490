"""Rendering in the environment that has Anny and embree: sets of random scenes and scenarios by hand.

`./run bench render` starts it; several scenes are rendered side by side, each by one process on one core.
"""
import argparse
import multiprocessing
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import List, NamedTuple, Optional, Sequence

import cv2

from .scenarios.plan import plan_scene
from .scenarios.random_scenes import build_scene
from .scenarios.random_signals import build_signals, build_stage, plan_special
from .sequence import Scene, write_scene

PEOPLE_SCENES, SIGNAL_SCENES, STAGE_SCENES = 40, 6, 2  # of a set


class Job(NamedTuple):
    """A scene to render: of a set with its number, or a scenario by hand (set '')."""

    people_set: str
    kind: str  # people, signals, stage, or the scenario's name
    index: int
    folder: str
    frames: Optional[int] = None  # render only so many, spread over the sequence


def set_jobs(people_set: str, folder: Path, count: int, frames: Optional[int] = None) -> List[Job]:
    """Return the scenes of a set: `count` with people, and all signals and stages if it is the full number."""
    special = [('signals', i) for i in range(SIGNAL_SCENES)] + [('stage', i) for i in range(STAGE_SCENES)]
    scenes = [('people', i) for i in range(count)] + (special if count >= PEOPLE_SCENES else [])
    return [Job(people_set, kind, index, str(folder), frames) for kind, index in scenes]


def scene_of(job: Job) -> Scene:
    if job.kind == 'people':
        return build_scene(plan_scene(job.people_set, job.index))
    if job.kind == 'signals':
        return build_signals(plan_special(job.people_set, job.index, 'signals', (2, 2)))
    return build_stage(plan_special(job.people_set, job.index, 'stage', (3, 4)))


def render(job: Job) -> str:
    """Render a job; return a line about it."""
    cv2.setNumThreads(1)
    started, used = time.monotonic(), time.process_time()
    scene = scene_of(job)
    numbers = None if job.frames is None else sorted({round(k * (scene.frames - 1) / max(job.frames - 1, 1))
                                                      for k in range(job.frames)})
    folder = write_scene(scene, Path(job.folder), numbers)
    images = len(scene.cameras) * (scene.frames if numbers is None else len(numbers))
    size = sum(path.stat().st_size for path in folder.rglob('*') if path.is_file()) / 1e6
    return (f'{folder}: {images} frames, {len(scene.rigs)} people, {scene.sensor}, {size:.1f} MB, '
            f'{time.monotonic() - started:.0f} s, {time.process_time() - used:.0f} s of a core')


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog='./run bench render')
    parser.add_argument('what', nargs='+')
    parser.add_argument('--out', type=Path, required=True)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--scenes', type=int, default=PEOPLE_SCENES)
    parser.add_argument('--frames', type=int)
    options = parser.parse_args(arguments)
    jobs = [job for name in options.what for job in set_jobs(name, options.out / name, options.scenes, options.frames)]
    os.environ['OMP_NUM_THREADS'] = '1'
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context('spawn')) as pool:
        for line in pool.map(render, jobs):
            print(line, flush=True)


if __name__ == '__main__':
    main(sys.argv[1:])
