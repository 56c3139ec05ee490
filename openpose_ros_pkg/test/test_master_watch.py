"""Nodes end, and say why, when the ROS master is started again."""
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


@pytest.fixture
def start(tmp_path, monkeypatch):
    """What starts a program on a master of its own; all end with the test."""
    with socket.socket() as probe:
        probe.bind(('localhost', 0))
        port = probe.getsockname()[1]
    monkeypatch.setenv('ROS_MASTER_URI', f'http://localhost:{port}')
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    cv2.imwrite(str(tmp_path / '1.png'), np.zeros((8, 8, 3), np.uint8))
    with ExitStack() as stack:
        def begin(name, **variables):
            command = (['roscore', '-p', str(port)] if name.startswith('roscore') else
                       ['rosrun', 'openpose_ros_pkg', 'camera_node', f'__name:={name}', f'_source:={tmp_path}',
                        '_loop:=true', '_rate:=1'])
            log = stack.enter_context((tmp_path / f'{name}.txt').open('w'))
            process = stack.enter_context(subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT,
                                                           env={**os.environ, **variables}))
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
    def say(text, *names):
        await_true(lambda: all(text in (tmp_path / f'{name}.txt').read_text() for name in names), text)

    master = start('roscore')
    await_true(lambda: registered() is not None, 'the master')
    ending = start('ending')
    # roslaunch would start these again, without their parameters
    resting, ended_at_once = (start(name, OPENPOSE_ROS_RESPAWNS='1') for name in ('resting', 'ended_at_once'))
    names = {'/ending', '/resting', '/ended_at_once'}
    await_true(lambda: names <= registered(), 'all nodes')
    master.terminate()
    master.wait()
    say('does not answer', 'ending', 'resting')
    assert ending.poll() is None and resting.poll() is None
    start('roscore_again')
    say(WHY, 'ended_at_once')
    ended_at_once.terminate()  # before the node rests
    assert ended_at_once.wait(30) == 0
    assert ending.wait(30) == 1
    say(WHY, 'ending', 'resting')
    await_true(lambda: registered() is not None and not names & registered(), 'no node is registered')
    assert resting.poll() is None
