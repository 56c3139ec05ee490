"""The start of every program: scripts import this module alone."""
import importlib
import signal
import sys


def run(module: str, function: str = 'main') -> None:
    """Import a module and exit with what its function returns.

    Ctrl-C ends the program without a traceback already during the imports, which take a second; `run_command` and rospy
    handle it later. Where it is ignored it stays so.
    """
    if signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(getattr(importlib.import_module(module), function)())
