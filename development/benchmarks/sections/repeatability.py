"""Repeatability: the same recording computed in other ways.

`process_bag` runs in processes of its own on a recording of the shipped sequence; each table of people is compared with
that of another run.
"""
import os
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


AUTO = ('--set', 'precision=auto')
WAYS = (Way('first', 'f32'), Way('again', 'the same again'),
        Way('threads_1', 'one thread', ('--set', 'threads=1')),
        Way('threads_3', 'three threads', ('--set', 'threads=3')),
        Way('avx2', 'AVX-512 switched off', (), NO_AVX_512),
        Way('bf16', 'bf16', AUTO), Way('bf16_again', 'bf16 again', AUTO, reference='bf16'),
        Way('bf16_threads_1', 'bf16, one thread', (*AUTO, '--set', 'threads=1'), reference='bf16'),
        Way('avx2_auto', 'precision auto, AVX-512 switched off', AUTO, NO_AVX_512, reference='avx2'))
TEXT = '''`process_bag` on the shipped sequence: 40 frames, two people, one hidden for a while. Each table of people is
compared with another, joint by joint. AVX-512 is switched off by ONEDNN_MAX_CPU_ISA=AVX2 for the networks and by
variables of their own for NumPy, OpenCV and OpenBLAS; with it OpenVINO can not compute in bf16, and the package falls
back to f32 by itself. bf16 (`precision: auto`) is what nodes use where the processor has it; recordings are computed in
f32.'''
QUICK = ('first', 'again', 'threads_1')


def measure(options: Options) -> Section:
    """Compute the recording in each way, and compare the tables."""
    from live import make_bag  # needs ROS, as nothing else here does
    with tempfile.TemporaryDirectory(prefix='openpose_ros_bench_') as name:
        folder = Path(name)
        bag = make_bag(DEMO, folder / 'cross.bag', cloud=False)
        ways = [way for way in WAYS if not options.quick or way.name in QUICK]
        for way in ways:
            print(way.text, flush=True)
            command = [sys.executable, str(PROGRAM), str(bag), '-o', str(folder / f'{way.name}.bag'), '--csv',
                       str(folder / f'{way.name}.csv'), '--set', 'compiled_cache=off', *way.arguments]
            subprocess.run(command, env={**os.environ, **way.environment, 'PYTHONPATH': os.pathsep.join(sys.path)},
                           cwd=str(ROOT), stdout=subprocess.DEVNULL, check=True)
        found = [(way, *difference(folder / f'{way.reference}.csv', folder / f'{way.name}.csv')) for way in ways[1:]]
    figures: Dict[str, Figure] = {}
    rows: List[List[Any]] = [['computed', 'compared with', 'people of one only', 'other status', 'median [mm]',
                              '99 % [mm]', 'maximum [mm]', 'same to the byte']]
    for way, same, each in found:
        figures.update({f'{way.name}_{name}': figure._replace(text=f'{way.text}: {figure.text}')
                        for name, figure in each.items()})
        rows.append([way.text, next(one.text for one in WAYS if one.name == way.reference), *each.values(),
                     'yes' if same else 'no'])
    return Section(TEXT, figures, [Table('', rows)])


def difference(one: Path, other: Path) -> Tuple[bool, Dict[str, Figure]]:
    """Return whether two tables are the same to the byte, and how they differ: people by stamp and track id."""
    tables = [read_keypoint_csv(path) for path in (one, other)]
    rows = [{key: row for row, key in enumerate(zip(table.stamps.tolist(), table.ids.tolist()))} for table in tables]
    both = sorted(rows[0].keys() & rows[1].keys())
    first, second = (table.select(np.array([places[key] for key in both], int)) for table, places in zip(tables, rows))
    errors = 1e3 * np.linalg.norm(first.positions.astype(float) - second.positions, axis=2)
    errors = errors[np.isfinite(errors)]
    figures = {'people': Figure(len(rows[0].keys() ^ rows[1].keys()), n=len(rows[0].keys() | rows[1].keys()), digits=0,
                                text='people in frames that one has'),
               'status': Figure(int((first.status != second.status).sum()), n=first.status.size, digits=0,
                                text='joints with another status')}
    for name, share in (('median', 0.5), ('p99', 0.99), ('maximum', 1.0)):
        value = float(np.quantile(errors, share)) if len(errors) else None
        figures[name] = Figure(value, n=len(errors), unit='mm', digits=3, text=f'{name} difference of joints')
    return one.read_bytes() == other.read_bytes(), figures
