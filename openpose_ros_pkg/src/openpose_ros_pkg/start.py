"""How every program begins: the scripts import this and nothing else."""
import importlib
import signal
import sys


def run(module: str, function: str = 'main') -> None:
    """Import a module and exit with what its function returns.

    Ctrl-C ends the program without a traceback from its first moment on, even within the imports, which take a second;
    `run_command` and rospy handle it from when there is something to clean up. Where it is ignored it stays so.
    """
    if signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(getattr(importlib.import_module(module), function)())
