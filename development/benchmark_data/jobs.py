"""Rendering in the environment that has Anny and embree; `./run bench render` starts it.

Several scenes are rendered side by side, each by one process on one core.
"""
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import List, NamedTuple, Optional

import cv2

from .render import PEOPLE_SCENES, parse_arguments
from .scenarios import by_hand, held, long
from .scenarios.plan import SETS, plan_scene
from .scenarios.random_scenes import ArrangementError, build_scene
from .sequence import Scene, write_scene

SIGNAL_SCENES, STAGE_SCENES = 6, 2  # of a set
DRAWS = 10  # most sub-seeds of a scene; 3 of 200 scenes needed a second
COMMITTED = (10, 11, 23)  # numbers of the committed scenes: one of each sensor; occlusion, sitting, lying
GROUPS = {'long': long.SCENARIOS, 'held': held.SCENARIOS, 'by_hand': by_hand.SCENARIOS}
SCENARIOS = {name: build for group in GROUPS.values() for name, build in group.items()}
HERE = Path(__file__).resolve().parent
SCENES, RENDERED = HERE / 'scenes', HERE / 'rendered'  # where scenes go without --out


class Job(NamedTuple):
    """A scene to render: number `index` of a set, of a special kind (signals, stage) or not; or a scenario by hand."""

    kind: str
    folder: Path
    people_set: str = ''
    index: int = 0
    frames: Optional[int] = None  # only so many, spread over the sequence


def jobs_of(name: str, out: Optional[Path], count: int) -> List[Job]:
    """Return the scenes of a set, all its kinds if it is whole; or a scenario by hand.

    Raises:
        ValueError: there is no such set or scenario.
    """
    folder = out or RENDERED
    if name in {*GROUPS, *SCENARIOS}:
        return [Job(each, folder / group) for group, scenes in GROUPS.items() for each in scenes
                if name in (group, each)]
    if name not in SETS:
        raise ValueError(f"there is no set or scenario '{name}'; sets: {', '.join([*SETS, *GROUPS])}; "
                         f"scenarios: {', '.join(SCENARIOS)}")
    if name == 'committed':
        return [Job('', out or SCENES, name, index) for index in COMMITTED[:count]]
    special = [('signals', i) for i in range(SIGNAL_SCENES)] + [('stage', i) for i in range(STAGE_SCENES)]
    scenes = [('', i) for i in range(count)] + (special if count >= PEOPLE_SCENES else [])
    return [Job(kind, folder / name, name, index) for kind, index in scenes]


def render(job: Job) -> str:
    """Render a job; return a line about it."""
    name = plan_scene(job.people_set, job.index, job.kind).name if job.people_set else job.kind
    if (job.folder / name).is_dir():
        return f'{job.folder / name}: is there'
    cv2.setNumThreads(1)
    started, used = time.monotonic(), time.process_time()
    scene = drawn(job) if job.people_set else SCENARIOS[job.kind]()
    count = scene.frames if job.frames is None else job.frames
    numbers = sorted({round(k * (scene.frames - 1) / max(count - 1, 1)) for k in range(count)})
    folder = write_scene(scene, job.folder, numbers)
    size = sum(path.stat().st_size for path in folder.rglob('*') if path.is_file()) / 1e6
    return (f'{folder}: {len(scene.cameras) * len(numbers)} frames, {len(scene.rigs)} people, {scene.sensor}, '
            f'{size:.1f} MB, {time.monotonic() - started:.0f} s, {time.process_time() - used:.0f} s of a core')


def drawn(job: Job) -> Scene:
    """Return a random scene; one without an arrangement is drawn anew from its next sub-seed, and says so."""
    for again in range(DRAWS - 1):
        try:
            return build_scene(plan_scene(job.people_set, job.index, job.kind, again))
        except ArrangementError as error:
            print(f'{error}; it is drawn anew, from sub-seed {again + 1}', flush=True)
    return build_scene(plan_scene(job.people_set, job.index, job.kind, DRAWS - 1))


def main() -> None:
    options = parse_arguments()
    if options.what == ['list']:
        print('sets:', *SETS, 'long', '\nscenarios by hand:', *SCENARIOS)
        return
    try:
        jobs = [job._replace(frames=options.frames) for name in options.what
                for job in jobs_of(name, options.out, options.scenes)]
    except ValueError as error:
        sys.exit(f'run: {error}')
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context('spawn')) as pool:
        for line in pool.map(render, jobs):
            print(line, flush=True)


if __name__ == '__main__':
    main()
