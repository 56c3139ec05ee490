"""Start a node, and end it with a clear message when its configuration is wrong."""
import logging
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from typing import Any, Callable, Dict, Iterable, List, NoReturn, Sequence, TextIO, Tuple, Type, cast

import rosgraph.names
import rospy
from rosgraph.names import load_mappings
from rospy.core import is_shutdown_requested
from rospy.impl import registration

from openpose_ros_pkg.allocator import give_back_free_memory, keep_large_blocks
from openpose_ros_pkg.errors import ForeignPackageError, ModelError, OpenposeRosError, ParameterError, StoppedError
from openpose_ros_pkg.params.flags import read_flags
from openpose_ros_pkg.params.parameters import Settings, build, build_known, to_yaml
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.master.calls import is_running

# Variable that the launch files set for nodes that are started again when they end.
RESPAWNS = 'OPENPOSE_ROS_RESPAWNS'
# Last parts of the names of topics and services of rospy, dynamic_reconfigure and diagnostics.
_OF_EVERY_NODE = ('rosout', 'diagnostics', 'get_loggers', 'set_logger_level', 'parameter_descriptions',
                  'parameter_updates', 'set_parameters')
_END = threading.Event()  # set: a signal has come that ends this process


def run_node(name: str, kind: Type[Settings], make: Callable[[Settings], Any],
             failed: Callable[[Any], bool] = lambda node: False, *, yields: bool = False) -> int:
    """Initialise the node, build it of its parameters and serve until shutdown.

    Exits with 1 when it can not be built. Arguments of the command line, --NAME=VALUE (see `read_flags`), win over the
    parameter server. With --help it prints its module's docstring and its parameters.

    Args:
        name: default node name.
        kind: parameter class or record of the private parameters.
        make: builds the node of them and returns it; raises OpenposeRosError for what the user has to mend.
        failed: tells at the end whether the node could not do all of its work.
        yields: wait as long as a node of this name runs. A second one would end the first, which roslaunch starts
            again, which would end the second, without end.

    Returns:
        The exit status: 1 where it failed.
    """
    if {'-h', '-help', '--help'} & set(sys.argv[1:]):
        sys.stdout.write(f'{sys.modules[make.__module__].__doc__}\n'
                         'Private parameters, in a launch file, as _NAME:=VALUE or --NAME=VALUE (bools: --NAME, '
                         f'--noNAME):\n\n{to_yaml(kind)}')
        return 0
    flags, others = _read_arguments(name, kind)
    keep_large_blocks()
    is_serving = threading.Event()
    _end_on_signals(is_serving)
    if yields:
        _wait_for_other(name)
    try:
        node = _start(name, kind, make, flags, others)
    except rospy.ROSException:
        if not is_shutdown_requested():
            raise
        _wait()  # for the end, which was asked for
    is_serving.set()
    give_back_free_memory()
    rospy.spin()
    return int(failed(node))  # the node lives until here: its publishers and threads serve while spinning


def _start(name: str, kind: Type[Settings], make: Callable[[Settings], Any], flags: Dict[str, Any],
           others: List[str]) -> Any:
    """Initialise the node, return what `make` builds; end with 1 where the user has to mend something."""
    # before rospy takes them for its log
    sys.stdout, sys.stderr = cast(TextIO, _Unfailing(sys.stdout)), cast(TextIO, _Unfailing(sys.stderr))
    rospy.init_node(name, disable_signals=True)
    for key, value in flags.items():
        rospy.set_param(f'~{key}', value)
    for key in others:
        rospy.logwarn('--%s is without effect: %s has no such parameter', key, rospy.get_name())
    # messages that the core logs go to /rosout like those of the node
    logging.getLogger('openpose_ros_pkg').setLevel(logging.INFO)
    core_log = _RosLogHandler()
    logging.getLogger('openpose_ros_pkg').addHandler(core_log)
    logging.getLogger('skeleton_extract_3d').addHandler(core_log)
    try:
        return make(build(kind, rospy.get_param('~', {})))
    except StoppedError as error:
        raise rospy.ROSInterruptException(str(error)) from error
    except OpenposeRosError as error:
        rospy.logfatal('%s: %s%s', rospy.get_name(), error, _how_to_delete(error))
        if os.environ.get(RESPAWNS) and isinstance(error, (ParameterError, ModelError, ForeignPackageError)):
            # started again, it would end for the same reason, without end
            rospy.logfatal('%s rests until it is ended; set it right and launch it again', rospy.get_name())
            rospy.signal_shutdown('wrong configuration')
            _wait()
        sys.exit(1)


def _wait_for_other(name: str) -> None:
    own_name = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), load_mappings(sys.argv).get('__name', name))
    if is_running(own_name):
        sys.stdout.write(f'{own_name} runs already: this one waits for its end\n')
        sys.stdout.flush()
    while is_running(own_name):
        time.sleep(1.0)


def _end_on_signals(is_serving: threading.Event) -> None:
    """Let SIGINT and SIGTERM end the node: without a traceback, and at once while it is not serving.

    rospy would do it within the main thread, which may hold a lock that ending needs.
    """
    def end() -> None:
        rospy.signal_shutdown('signal')
        _END.set()
        if not is_serving.is_set():
            os._exit(0)

    def handle(*_: Any) -> None:
        threading.Thread(target=end, name='end').start()

    def handle_by(handler: Any) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, handler)

    handle_by(handle)
    # the end of a process that a library has forked would unregister the node at the master
    os.register_at_fork(after_in_child=lambda: handle_by(signal.SIG_DFL))


def _wait() -> NoReturn:
    """Wait for a signal, which may have come already: `signal.pause` would wait for another one then."""
    _END.wait()
    os._exit(0)


def _read_arguments(name: str, kind: Type[Settings]) -> Tuple[Dict[str, Any], List[str]]:
    """Do `read_flags`, or end the program with 1; values that are not allowed never get to the parameter server."""
    try:
        flags, others = read_flags(kind, rospy.myargv()[1:])
        build_known(kind, flags)
    except ParameterError as error:
        sys.exit(f'{name}: {error}')
    return flags, others


def introduce(inputs: Iterable[InputSubscriber], **at_work: str) -> None:
    """Log what is at work: titles with their texts, then the topics and services, which have to be there already."""
    topics = {'subscribes to': [source.resolved_name for source in inputs],
              'publishes': _own(registration.get_topic_manager().get_publications()),
              'serves': _own(registration.get_service_manager().get_services())}
    lines = [f'{title}: {text}' for title, text in at_work.items()]
    lines += [f'{title}: {", ".join(names)}' for title, names in topics.items() if names]
    rospy.loginfo('%s', '\n  '.join([f'{rospy.get_name()}:', *lines]))


def _own(entries: Iterable[Sequence[str]]) -> List[str]:
    return sorted(name for name, *_ in entries if name.rpartition('/')[2] not in _OF_EVERY_NODE)


def check_topic_name(key: str, topic: str) -> None:
    """Raise ParameterError for what is no name of a topic: rospy would only log an error and wait without end."""
    if not topic or not rosgraph.names.is_legal_name(topic):
        raise ParameterError(f"parameter '{key}' = {topic!r} is not allowed: the name of a topic", key)


def _how_to_delete(error: OpenposeRosError) -> str:
    """Return what to do about parameters that an earlier start set: the server keeps those of ended nodes."""
    if isinstance(error, ParameterError) and error.key and rospy.has_param(f'~{error.key}'):
        return f'. If it was not set on purpose, an earlier start left it: rosparam delete {rospy.get_name()}'
    return ''


class _Unfailing:
    """A stream whose lines are lost where its disk is full: rospy's log would raise that in whatever thread logs."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        with suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(OSError):
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class _RosLogHandler(logging.Handler):
    """Pass records of the standard logging module on to rospy's log."""

    def emit(self, record: logging.LogRecord) -> None:
        log = {logging.DEBUG: rospy.logdebug, logging.INFO: rospy.loginfo,
               logging.WARNING: rospy.logwarn}.get(record.levelno, rospy.logerr)
        log('%s', record.getMessage())
