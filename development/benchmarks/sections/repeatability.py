"""Repeatability: the same recording computed in other ways.

`process_bag` runs in processes of its own on a recording of the shipped sequence; each table of people is compared with
that of another run. With `--data emulator=/usr/bin/qemu-x86_64` (package qemu-user) it also runs on an emulated
processor, which has no AVX-512; three frames take it three minutes of processor time.
"""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from common import DEMO, ROOT
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from results import Options, Section, Table
from scoring.figures import Figure

PROGRAM = ROOT / 'extensions/openpose_ros_tools/scripts/process_bag'
# Frames that are emulated: one takes a minute.
EMULATED_FRAMES = 3
# NumPy, OpenCV and OpenBLAS choose their code by the processor too.
NO_AVX_512 = {'ONEDNN_MAX_CPU_ISA': 'AVX2', 'OPENBLAS_CORETYPE': 'Haswell',
              'OPENCV_CPU_DISABLE': 'AVX512-COMMON,AVX512-SKX,AVX512-CLX,AVX512-ICL',
              'NPY_DISABLE_CPU_FEATURES': 'AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL'}


class Way(NamedTuple):
    """A way to compute the recording, and the one it is compared with."""

    name: str
    text: str
    arguments: Sequence[str] = ()
    environment: Mapping[str, str] = MappingProxyType({})
    reference: str = 'first'
    emulated: bool = False


AUTO = ('--set', 'precision=auto')
WAYS = (Way('first', 'f32'), Way('again', 'the same again'),
        Way('threads_1', 'one thread', ('--set', 'threads=1')),
        Way('threads_3', 'three threads', ('--set', 'threads=3')),
        Way('avx2', 'AVX-512 switched off', (), NO_AVX_512),
        Way('emulated', 'emulated processor without AVX-512', emulated=True),
        Way('bf16', 'bf16', AUTO), Way('bf16_again', 'bf16 again', AUTO, reference='bf16'),
        Way('bf16_threads_1', 'bf16, one thread', (*AUTO, '--set', 'threads=1'), reference='bf16'),
        Way('avx2_auto', 'precision auto, AVX-512 switched off', AUTO, NO_AVX_512, reference='avx2'))
TEXT = '''`process_bag` on the shipped sequence: 40 frames, two people, one hidden for a while. Each table of people is
compared with another, joint by joint. AVX-512 is switched off by ONEDNN_MAX_CPU_ISA=AVX2 for the networks and by
variables of their own for NumPy, OpenCV and OpenBLAS; with it OpenVINO can not compute in bf16, and the package falls
back to f32 by itself. QEMU emulates a whole processor without AVX-512, for the first three frames. bf16 (`precision:
auto`) is what nodes use where the processor has it; recordings are computed in f32.'''
QUICK = ('first', 'again', 'threads_1')


class Difference(NamedTuple):
    """How a table of people differs from another.

    Attributes:
        same: to the byte.
        people: in frames, that only one of the tables has; of so many.
        status: joints with another status, of so many.
        errors: (N,) distances of the joints of people that both have [mm].
    """

    same: bool
    people: Tuple[int, int]
    status: Tuple[int, int]
    errors: np.ndarray


def measure(options: Options) -> Section:
    """Compute the recording in each way, and compare the tables."""
    from live import make_bag  # needs ROS, as nothing else here does
    with tempfile.TemporaryDirectory(prefix='openpose_ros_bench_') as name:
        folder = Path(name)
        bag, short = make_bag(DEMO, folder / 'cross.bag', cloud=False), folder / 'short.bag'
        make_bag(first_frames(DEMO, folder / 'short', EMULATED_FRAMES), short, cloud=False)
        ways = [way for way in WAYS if (way.name in QUICK if options.quick else
                                        not way.emulated or 'emulator' in options.data)]
        for way in ways:
            print(way.text, flush=True)
            prefix = [str(options.folder('emulator')), '-cpu', 'max'] if way.emulated else []
            compute(short if way.emulated else bag, folder / f'{way.name}.csv', way, prefix)
        found = [(way, difference(folder / f'{way.reference}.csv', folder / f'{way.name}.csv')) for way in ways[1:]]
    figures: Dict[str, Figure] = {}
    rows: List[List[Any]] = [['computed', 'compared with', 'people of one only', 'other status', 'median [mm]',
                              '99 % [mm]', 'maximum [mm]', 'same to the byte']]
    for way, each in found:
        figures.update(figures_of(way, each))
        rows.append([way.text, next(one.text for one in WAYS if one.name == way.reference),
                     *(figures[f'{way.name}_{part}'] for part in ('people', 'status', 'median', 'p99', 'maximum')),
                     'yes' if each.same else 'no'])
    return Section(TEXT, figures, [Table('', rows)])


def first_frames(sequence: Path, folder: Path, frames: int) -> Path:
    """Copy the first frames of a sequence into a new folder; return it."""
    for part in ('rgb', 'depth'):
        (folder / part).mkdir(parents=True)
        for path in sorted((sequence / part).iterdir())[:frames]:
            shutil.copy(str(path), str(folder / part))
    for path in sequence.glob('*.yaml'):
        shutil.copy(str(path), str(folder))
    return folder


def compute(bag: Path, table: Path, way: Way, prefix: Sequence[str] = ()) -> None:
    """Make the table of people of a recording, in a process of its own; `prefix`: of its command."""
    settings = ['--csv', str(table), '--set', 'compiled_cache=off']
    environment = {**os.environ, **way.environment, 'PYTHONPATH': os.pathsep.join(sys.path)}
    program = [*prefix, sys.executable, str(PROGRAM)]
    subprocess.run([*program, str(bag), '-o', str(table.with_suffix('.bag')), *settings, *way.arguments],
                   env=environment, cwd=str(ROOT), stdout=subprocess.DEVNULL, check=True)


def difference(one: Path, other: Path) -> Difference:
    """Compare two tables, as long as the second lasts: people by stamp and track id."""
    tables = [read_keypoint_csv(path) for path in (one, other)]
    tables[0] = tables[0].select(tables[0].stamps <= tables[1].stamps.max())
    rows = [{key: row for row, key in enumerate(zip(table.stamps.tolist(), table.ids.tolist()))} for table in tables]
    both = sorted(rows[0].keys() & rows[1].keys())
    first, second = (table.select(np.array([places[key] for key in both], int)) for table, places in zip(tables, rows))
    errors = 1e3 * np.linalg.norm(first.positions.astype(float) - second.positions, axis=2)
    return Difference(one.read_bytes().startswith(other.read_bytes()),
                      (len(rows[0].keys() ^ rows[1].keys()), len(rows[0].keys() | rows[1].keys())),
                      (int((first.status != second.status).sum()), first.status.size), errors[np.isfinite(errors)])


def figures_of(way: Way, found: Difference) -> Dict[str, Figure]:
    """Return the figures of a way by name."""
    errors, count = found.errors, len(found.errors)
    values = {'people': Figure(found.people[0], n=found.people[1], digits=0, text='people in frames that one has'),
              'status': Figure(found.status[0], n=found.status[1], digits=0, text='joints with another status')}
    for name, share in (('median', 0.5), ('p99', 0.99), ('maximum', 1.0)):
        value = float(np.quantile(errors, share)) if count else None
        values[name] = Figure(value, n=count, unit='mm', digits=3, text=f'{name} difference of joints')
    return {f'{way.name}_{name}': figure._replace(text=f'{way.text}: {figure.text}') for name, figure in values.items()}
