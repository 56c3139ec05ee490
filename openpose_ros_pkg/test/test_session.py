"""A benchmark or demo that is ended ends the master and the nodes that it started."""
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from session import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
BENCHMARKS = ROOT / 'development/benchmarks'
PROGRAMS = [path for path in sorted(BENCHMARKS.rglob('*.py')) if path.read_text().startswith('#!')]
BENCHMARK = """
import sys, time
from common import run_live

def measure(session, folder, arguments):
    session.start('node', ['sh', '-c', f'touch {folder}/runs; exec sleep 600'])
    while not (folder / 'runs').exists():  # from then on it ends with its parent
        time.sleep(0.01)
    print('started', flush=True)
    time.sleep(600)

sys.exit(run_live(measure, None))
"""


@pytest.fixture
def start(tmp_path):
    """What starts a program; every process that it leaves is found at the end by its folder for temporary files."""
    environment = {**os.environ, 'TMPDIR': str(tmp_path), 'PYTHONPATH': os.pathsep.join(
        [str(BENCHMARKS), str(ROOT / 'tests/support'), os.environ.get('PYTHONPATH', '')])}
    yield lambda *command, **variables: subprocess.Popen(
        [sys.executable, *command], env={**environment, **variables}, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    left = [process for process in psutil.process_iter(['environ'])
            if (process.info['environ'] or {}).get('TMPDIR') == str(tmp_path)]
    assert psutil.wait_procs(left, PATIENCE)[1] == []


@pytest.mark.parametrize('number, status', [
    (signal.SIGINT, 130), (signal.SIGTERM, 130), (signal.SIGHUP, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_benchmark_that_is_ended(start, number, status, tmp_path):
    benchmark = start('-c', BENCHMARK)
    assert benchmark.stdout.readline() == 'started\n'
    benchmark.send_signal(number)
    assert (benchmark.wait(PATIENCE), 'Traceback' in benchmark.stderr.read()) == (status, False)
    assert number == signal.SIGKILL or list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('program', PROGRAMS, ids=lambda path: f'{path.parent.name}/{path.stem}')
def test_benchmark_finds_what_it_imports(program, monkeypatch):
    for folder in (program.parent, BENCHMARKS):
        monkeypatch.syspath_prepend(folder)
    assert runpy.run_path(str(program), run_name='imported')['__doc__']
