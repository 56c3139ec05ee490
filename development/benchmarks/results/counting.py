"""Counts of many scenes: side by side in processes, kept in build/report for the same code, settings and scene."""
import hashlib
import json
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional

import numpy as np

import chain_runs
from common import ROOT
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from results import Options
from scoring.counts import SAME_TIME, Counts, load
from scoring.people import found_of, score_people
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.people import People3D

KEPT = ROOT / 'build/report'
# Frames of a scene, and scenes, of --quick.
QUICK_FRAMES, QUICK_SCENES = 8, 2
# Files that decide what is found and how it is counted.
_SOURCES = ('openpose_ros_pkg/src', 'skeleton_extract_3d/src', 'development/benchmarks/scoring')
# One row for each person that was found in a frame, at its time [s].
PERSON = np.dtype([('time', 'f8'), ('xyz', 'f4', (18, 3)), ('confidence', 'f4', 18), ('status', 'u1', 18),
                   ('sigma', 'f4', 18), ('ids', 'i8'), ('velocity', 'f4', (18, 3))])


class Job(NamedTuple):
    """A scene for the chain: parameters as JSON; the others as for `count`; `limit`: number of frames, None: all."""

    folder: Path
    settings: str
    exact: bool
    budget: float
    limit: Optional[int]

    @property
    def path(self) -> Path:
        """The file of its counts."""
        truth = (self.folder / 'gt.json').stat()
        key = hashlib.sha256(repr((_code_digest(), str(self.folder.resolve()), truth.st_size, truth.st_mtime_ns,
                                    self[1:])).encode()).hexdigest()
        return KEPT / f'{self.folder.name}_{key[:16]}.npz'


def count(options: Options, settings: Dict[str, Any], exact: bool = False, budget: float = 0.0, every: int = 1
          ) -> List[Counts]:
    """Run the chain on scenes and return their counts; a scene that was counted before is read.

    Args:
        settings: parameters of the chain.
        exact: give the true pixels instead of those that networks find.
        budget: work of the networks per frame, see `chain_runs.Budget`; 0: each image is searched in full.
        every: take every so many-th scene, for slow settings.
    """
    values = json.dumps({**settings, **options.settings}, sort_keys=True)
    folders = list(options.scenes)[:QUICK_SCENES] if options.quick else list(options.scenes)[::every]
    jobs = [Job(folder, values, exact, budget, QUICK_FRAMES if options.quick else None) for folder in folders]
    missing = [(job, job.path) for job in jobs if not job.path.is_file()]
    cores = min(len(os.sched_getaffinity(0)), len(missing))
    if cores > 1:
        # a process with the networks of one thread each: decoding and lifting of one scene fill the waits of another
        with ProcessPoolExecutor(cores, multiprocessing.get_context('spawn')) as pool:
            for number, _ in enumerate(pool.map(_run, *zip(*missing)), 1):
                print(f'{number} of {len(missing)} scenes', flush=True)
    else:
        for job, path in missing:
            _run(job, path)
    return [load(job.path) for job in jobs]


@lru_cache(maxsize=1)
def _code_digest() -> str:
    """Return a digest of the sources that decide what is counted."""
    digest = hashlib.sha256()
    for path in sorted(path for folder in _SOURCES for path in (ROOT / folder).rglob('*')
                       if path.suffix in ('.py', '.cpp', '.hpp', '.h')):
        digest.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _finder(settings: str, exact: bool, budget: float) -> chain_runs.Finder:
    return chain_runs.Finder(build(ChainSettings, {'threads': 1, **json.loads(settings)}), budget, exact=exact)


def _run(job: Job, path: Path) -> None:
    run = _finder(job.settings, job.exact, job.budget).run(job.folder, limit=job.limit)
    counts = score_people(job.folder, run.frames, slice(job.limit))
    rows = [np.zeros(0, PERSON)]
    for seconds, people in run.frames:
        found = found_of(people)
        rows.append(np.zeros(len(found), PERSON))
        rows[-1]['time'] = seconds
        for name in PERSON.names[1:]:
            rows[-1][name] = getattr(found, name)
    replace(counts, rows={**counts.rows, 'people': np.concatenate(rows)}).save(path)


def people_of(folder: Path, counts: Counts) -> chain_runs.Frames:
    """Return the people that were found in a scene that was counted, at the true times of its frames [s]."""
    rows, frames = counts.rows['people'], json.loads((folder / 'gt.json').read_text())['frames']
    return [(frame['t'], People3D(COCO_18, *(rows[np.abs(rows['time'] - frame['t']) < SAME_TIME][name]
                                             for name in PERSON.names[1:])))
            for frame in frames[:int(counts.sums['frames'])]]
