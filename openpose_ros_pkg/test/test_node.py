"""Signals end a node, and not the processes that a library forks from it."""
import subprocess
import sys

FORKS = """
import os, signal, threading
from openpose_ros_pkg.ros import node
node._end_on_signals(threading.Event())
ready, tell = os.pipe()
child = os.fork()
if child == 0:
    os.write(tell, b'.')
    signal.pause()
    os._exit(0)
os.read(ready, 1)
os.kill(child, signal.SIGTERM)
print(os.WIFSIGNALED(os.waitpid(child, 0)[1]))
"""


def test_a_fork_of_a_node_does_not_end_the_node():
    """The node's own way to end, in the fork, would unregister the node at the master."""
    done = subprocess.run([sys.executable, '-c', FORKS], check=True, stdout=subprocess.PIPE, text=True, timeout=60)
    assert done.stdout.strip() == 'True'
