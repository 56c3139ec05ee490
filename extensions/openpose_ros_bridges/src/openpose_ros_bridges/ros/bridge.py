"""What all bridges have in common: inputs, a thread for each output, messages as tables of fields, and diagnostics."""
import math
import threading
import time
from typing import Any, Callable, Dict, NamedTuple, Optional, Sequence, Tuple, Type, Union

import genpy
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray, PersonSignalsArray
from std_msgs.msg import Header

from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from openpose_ros_pkg.stream.pairing import PairingParams
from openpose_ros_signals.ros.input_end import InputEnd
from skeleton_extract_3d.ros.synchronizer import StampSynchronizer

IN_SPACE = 'openpose_ros/skeleton_3d'
# Topics of people, in space and in the image, and of what they do.
PEOPLE = (f'{IN_SPACE}/detected_poses_3d', PersonDetection_3dArray)
IN_IMAGE = (f'{IN_SPACE}/detected_poses', PersonDetectionArray)
SIGNALS = (f'{IN_SPACE}/people_signals', PersonSignalsArray)
# Most messages per second to planners.
PLANNER_RATE = 10.0
# Signals have the stamp of their people; half a millisecond allows for rounded ones [s].
_SAME_STAMP = 0.0005
# rospy sends what was published before its connections are closed within this time [s].
_FLUSH_TIME = 0.1


def start_signals() -> str:
    """Return the command that starts the node of signals in the namespace of this one."""
    namespace = rospy.get_namespace().strip('/')
    return f"roslaunch openpose_ros_bringup people.launch chain:=false{namespace and f' ns:={namespace}'}"


class FieldMap:
    """Makes a message of another package: of each field its type, as `rosmsg show` has it, and what returns its value.

    Raises:
        ForeignPackageError: the message is not found, or has other fields.
    """

    def __init__(self, package: ForeignPackage, message: str, /, **fields: Tuple[str, Callable[..., Any]]) -> None:
        self.kind = package.message(message, {field: kind for field, (kind, _) in fields.items()})
        self._values = {field: value for field, (_, value) in fields.items()}

    def __call__(self, *source: Any) -> genpy.Message:
        """Return the message whose fields follow from the arguments."""
        return self.kind(**{field: value(*source) for field, value in self._values.items()})


HEADER = 'std_msgs/Header', lambda header, *_: header
"""A header, which is the first argument."""


class Output(NamedTuple):
    """A topic that a bridge publishes."""

    topic: str
    kind: Type[genpy.Message]
    inputs: Sequence[Tuple[str, Type[genpy.Message]]]  # one topic, or two whose messages have the same stamp
    # Makes the message of those of the inputs, None: nothing is to be said; raises BadInputError for what is unusable.
    convert: Callable[..., Optional[genpy.Message]]
    # Makes of its header the message without people that is published once when the inputs have ended, or the node
    # ends: for messages whose readers keep people until the next one comes.
    end: Optional[Callable[[Header], Optional[genpy.Message]]] = None
    rate: float = 0.0  # most messages per second, of the newest people; 0: no limit


class _Publisher:
    """Publishes an output."""

    def __init__(self, output: Output, topic: rospy.Publisher, health: Health) -> None:
        self._output, self._topic, self._health = output, topic, health
        self._frame_id = ''
        self._due = -math.inf
        self._lock, self._is_shut_down = threading.Lock(), False
        self._input = None if output.end is None else InputEnd(self._end)
        if output.end is not None:
            rospy.on_shutdown(lambda: self._end(shut_down=True))

    def publish(self, messages: Tuple[genpy.Message, ...]) -> None:
        """Convert and publish messages of the inputs."""
        with self._lock:
            if time.monotonic() >= self._due and not self._is_shut_down:
                result = self._output.convert(*messages)
                if self._output.rate:
                    self._due = max(self._due + 1 / self._output.rate, time.monotonic())
                header = getattr(result, 'header', messages[-1].header)
                self._frame_id = header.frame_id
                if result is not None:
                    self._topic.publish(result)
                self._health.frame_done(header.stamp)
        if self._input is not None:
            self._input.heard()

    def _end(self, shut_down: bool = False) -> None:
        with self._lock:
            # a reader that comes back has people from before, which the next message then has to remove
            if not self._is_shut_down and self._frame_id and self._topic.get_num_connections():
                result = self._output.end(Header(stamp=rospy.get_rostime(), frame_id=self._frame_id))
                if result is not None:
                    self._topic.publish(result)
            self._is_shut_down |= shut_down
        if shut_down:
            time.sleep(_FLUSH_TIME)


class Bridge:
    """Publishes people in the messages of another package, while there are subscribers."""

    def __init__(self, lazy: bool, outputs: Sequence[Output]) -> None:
        self._health = Health()
        demand = Demand(lazy, self._health)
        needs: Dict[InputSubscriber, Sequence[rospy.Publisher]] = {}
        workers = []
        for output in outputs:
            publisher = demand.advertise(output.topic, output.kind, RESULTS_QUEUE)
            worker = NewestWinsWorker(_Publisher(output, publisher, self._health).publish, self._health.frame_failed,
                                      output.topic)
            sources = [InputSubscriber(*source, start=start_signals() if source == SIGNALS else '')
                       for source in output.inputs]
            newest: Union[InputSubscriber, StampSynchronizer] = sources[0]
            if len(sources) == 2:
                newest = StampSynchronizer(sources, PairingParams(slop=_SAME_STAMP), self._health,
                                           ('people', 'signals'))
                newest.watch_pairs(demand.watch, sources, setting='')
            newest.registerCallback(lambda *messages, worker=worker: worker.submit(messages))
            needs.update({source: [publisher] for source in sources})
            workers.append(worker)
        self._health.show(lambda: {'frames skipped': str(sum(worker.replaced for worker in workers))})
        demand.read(*needs, only_for=needs)
        introduce(demand.inputs, messages=', '.join(output.kind._type for output in outputs))


def run_bridge(name: str, settings: Type[Any], outputs: Callable[[Any], Sequence[Output]]) -> None:
    """Run the node with what a function returns for its settings."""
    def make(values: Any) -> Bridge:
        return Bridge(values.lazy, outputs(values))

    make.__module__ = outputs.__module__  # whose docstring is the help of the node
    run_node(name, settings, make)
