"""Threads and processes are spared a Ctrl-C from their first moment on; the thread that starts them is not."""
import signal
import subprocess
import sys
import threading

import pytest

from openpose_ros_tools.parallel.no_interrupts import no_interrupts

BLOCKED = 'import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))'


def blocked_here():
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_what_is_started_is_spared_for_good():
    found, go_on = [], threading.Event()

    def look():
        go_on.wait(60)
        found.append(blocked_here())
        found.append(subprocess.run([sys.executable, '-c', BLOCKED], stdout=subprocess.PIPE, check=True).stdout)

    with no_interrupts():
        thread = threading.Thread(target=look)
        thread.start()
    go_on.set()
    thread.join()
    assert found == [True, b'True\n']
    assert not blocked_here()
    assert subprocess.run([sys.executable, '-c', BLOCKED], stdout=subprocess.PIPE, check=True).stdout == b'False\n'


def test_an_interrupt_comes_after_the_block():
    done = []
    with pytest.raises(KeyboardInterrupt), no_interrupts():
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        done.append(1)
    assert done == [1]
    assert not blocked_here()
