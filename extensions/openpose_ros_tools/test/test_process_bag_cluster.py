"""Several bags are spread over workers; none is lost by a worker that dies, and what fails is told."""
import functools
import importlib.util
import json
import os
import signal
import subprocess
import sys

import pytest
from known_recording import known_people, write_recording

from openpose_ros_tools.ros.process_bag.program import main
from session import await_true

ON_A_CLUSTER = pytest.mark.skipif(importlib.util.find_spec('distributed') is None,
                                  reason='Dask distributed, which --scheduler needs, is not installed')


@pytest.fixture
def folder(tmp_path):
    (tmp_path / 'in').mkdir()
    for name in ('a', 'b'):
        write_recording(tmp_path / 'in' / f'{name}.bag')
    return tmp_path


def run(folder, *arguments, create=known_people, output='out', inputs=('in',)):
    return main([*(str(folder / name) for name in inputs), '-o', str(folder / output), '--csv', str(folder / output),
                 '--json', str(folder / output / 'json'), *arguments], create)


def everything(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob('*')
                  if path.is_file() and path.suffix != '.json')


def tables(folder):
    return {path.name: path.read_bytes() for path in folder.glob('*.csv')}


@pytest.mark.parametrize('other, output', [('more/a.bag', 'out/a.bag'), ('more/a.mcap', 'out/a.csv')])
def test_recordings_whose_outputs_have_one_name_are_refused_before_the_work(folder, capsys, other, output):
    (folder / 'more').mkdir()
    (folder / other).write_bytes(b'')
    assert run(folder, inputs=('in/a.bag', 'in/b.bag', other), create=None) == 2
    error = capsys.readouterr().err
    assert f'{folder}/in/a.bag and {folder / other} would both be written to {folder / output}' in error
    assert not (folder / 'out').exists()


def test_only_a_scheduler_needs_dask(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    assert run(folder, '--scheduler', 'tcp://127.0.0.1:9') == 2
    assert 'install python3-distributed' in capsys.readouterr().err


@pytest.mark.parametrize('of', [signal.SIGKILL, signal.SIGTERM])
def test_a_worker_that_dies_loses_nothing_and_what_fails_is_told(folder, capsys, of):
    """Of three bags one has no images; one worker dies in the middle of a bag."""
    write_recording(folder / 'in/c.bag', image=None)
    create = functools.partial(known_people, dies_at=6, died=folder / 'died', of=of)
    assert run(folder, '--workers', '2', create=create) == 1
    assert (folder / 'died').exists()
    output = capsys.readouterr().out
    assert f'FAILED {folder}/in/c.bag: ' in output
    assert 'has no topic of colour images' in output
    assert output.endswith('2 bags done, 1 failed\n')
    assert everything(folder / 'out') == ['a.bag', 'a.csv', 'b.bag', 'b.csv']
    assert len(list((folder / 'out/json/a').iterdir())) == 12
    # undisturbed, on this process
    for name in ('a', 'b'):
        assert main([f'{folder}/in/{name}.bag', '-o', f'{folder}/alone/{name}.bag', '--csv',
                     f'{folder}/alone/{name}.csv'], known_people) == 0
    assert tables(folder / 'alone') == tables(folder / 'out')
    # again: only what failed, and is right now
    made = (folder / 'out/a.bag').stat().st_mtime_ns
    write_recording(folder / 'in/c.bag')
    capsys.readouterr()
    assert run(folder, '--workers', '1') == 0
    output = capsys.readouterr().out
    assert '2 of 3 bags have their results already' in output
    assert output.endswith('1 bags done, 0 failed\n')
    assert (folder / 'out/a.bag').stat().st_mtime_ns == made
    assert tables(folder / 'out').keys() == {'a.csv', 'b.csv', 'c.csv'}
    # a bag beside which the table is missing may be of another program
    (folder / 'out/a.csv').unlink()
    assert run(folder) == 2 and 'out/a.bag is there already' in capsys.readouterr().err


@ON_A_CLUSTER
def test_an_existing_cluster_does_it(folder, capsys):
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    address_file = folder / 'scheduler.json'
    start = [sys.executable, '-m', 'distributed.cli.dask_scheduler'], [sys.executable, '-m',
                                                                       'distributed.cli.dask_worker']
    processes = [subprocess.Popen([*start[0], '--port', '0', '--no-dashboard', '--scheduler-file', str(address_file)],
                                  env=environment, cwd=str(folder), stderr=subprocess.DEVNULL)]
    try:
        await_true(address_file.exists, 'a scheduler')
        processes.append(subprocess.Popen(
            [*start[1], '--scheduler-file', str(address_file), '--nthreads', '1', '--no-dashboard'], env=environment,
            cwd=str(folder), stderr=subprocess.DEVNULL))
        address = json.loads(address_file.read_text())['address']
        assert run(folder, '--scheduler', address) == 0
        assert capsys.readouterr().out.endswith('2 bags done, 0 failed\n')
        assert everything(folder / 'out') == ['a.bag', 'a.csv', 'b.bag', 'b.csv']
        assert [process.poll() for process in processes] == [None, None]
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(60)
