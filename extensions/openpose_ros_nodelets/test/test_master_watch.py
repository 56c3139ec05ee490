"""Nodes in Python and in C++ end, and say why, when the ROS master is started again."""
import os
import socket
import subprocess
from contextlib import ExitStack

import cv2
import numpy as np
import pytest
import rosgraph

from session import await_true

WHY = 'the ROS master was started again: the parameters that roslaunch had set are gone with the one before, so the ' \
      'launch has to be started again'
NODES = {'camera': ('openpose_ros_pkg', 'camera_node'), 'floor': ('openpose_ros_nodelets', 'floor_node')}


@pytest.fixture
def start(tmp_path, monkeypatch):
    """What starts a program on a master of its own; all end with the test."""
    with socket.socket() as probe:
        probe.bind(('localhost', 0))
        port = probe.getsockname()[1]
    monkeypatch.setenv('ROS_MASTER_URI', f'http://localhost:{port}')
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    with ExitStack() as stack:
        def begin(name, *command, **variables):
            log = stack.enter_context((tmp_path / f'{name}.txt').open('w'))
            process = stack.enter_context(subprocess.Popen(
                [*command, *([f'__name:={name}'] if command[0] == 'rosrun' else ['-p', str(port)])], stdout=log,
                stderr=subprocess.STDOUT, env={**os.environ, **variables}))
            stack.callback(process.terminate)
            return process
        yield begin


def registered():
    """Return the names of the nodes that publish, as the master knows them; None: it does not answer."""
    try:
        return {node for _, nodes in rosgraph.Master('/test').getSystemState()[0] for node in nodes}
    except OSError:
        return None


def test_nodes_end_with_their_master(start, tmp_path):
    cv2.imwrite(str(tmp_path / '1.png'), np.zeros((8, 8, 3), np.uint8))
    source = (f'_source:={tmp_path}', '_loop:=true', '_rate:=1')
    master = start('roscore', 'roscore')
    await_true(lambda: registered() is not None, 'the master')
    ended = {name: start(name, 'rosrun', *program, *source[:3 * (name == 'camera')])
             for name, program in NODES.items()}
    # roslaunch would start these again, without their parameters
    resting = {f'{name}_respawned': start(f'{name}_respawned', 'rosrun', *program, *source[:3 * (name == 'camera')],
                                          OPENPOSE_ROS_RESPAWNS='1') for name, program in NODES.items()}
    at_once = start('at_once', 'rosrun', *NODES['camera'], *source, OPENPOSE_ROS_RESPAWNS='1')
    names = {f'/{name}' for name in (*ended, *resting, 'at_once')}
    await_true(lambda: names <= registered(), 'all nodes')

    master.terminate()
    master.wait()
    await_true(lambda: all('does not answer' in (tmp_path / f'{name}.txt').read_text() for name in (*ended, *resting)),
               'each node says that the master is gone')
    assert all(node.poll() is None for node in (*ended.values(), *resting.values()))

    start('roscore_again', 'roscore')
    await_true(lambda: WHY in (tmp_path / 'at_once.txt').read_text(), WHY)
    at_once.terminate()  # before the node rests
    assert at_once.wait(30) == 0
    assert [node.wait(30) for node in ended.values()] == [1, 1]
    await_true(lambda: all(WHY in (tmp_path / f'{name}.txt').read_text() for name in (*ended, *resting)), WHY)
    await_true(lambda: registered() is not None and not names & registered(), 'no node is registered')
    assert all(node.poll() is None for node in resting.values())
    for node in resting.values():
        node.terminate()
        node.wait(30)
