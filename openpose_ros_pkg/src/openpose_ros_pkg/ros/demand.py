"""Read the inputs of a node only while its results are wanted."""
import threading
import time
from typing import Any, List, Mapping, Optional, Protocol, Sequence, Type

import rospy
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.input_watch import InputWatch
from openpose_ros_pkg.ros.threads import repeat

READS = 'reads'
"""Key of /diagnostics: topics that a node reads, each with its type in brackets."""
# rospy tells of a lost connection within half a second, but may do so before it has removed it: check again [s].
_CHECK_PERIOD = 1.0


class Readers(Protocol):
    """What is read as long as it has connections: a publisher, or another way out of the node."""

    def get_num_connections(self) -> int:
        """Return how many there are."""


# What needs an input.
Needs = Mapping[InputSubscriber, Sequence[Readers]]


def in_camera(camera: str, name: str) -> str:
    """Return a name as a node of the same name in the namespace of a camera would resolve it; empty: one camera.

    A name that is remapped to one outside of the node's namespace is the same for all cameras.
    """
    if not camera:
        return name
    namespace, resolved = rospy.get_namespace(), rospy.resolve_name(name)
    if not resolved.startswith(namespace):
        return str(resolved)
    return f'{rospy.resolve_name(camera)}/{resolved[len(namespace):]}'


class Demand(rospy.SubscribeListener):
    """Whether the results of a node are wanted: its inputs are subscribed then, and only then.

    Results are wanted while the node is enabled (service `~enable`, std_srvs/SetBool) and one of the topics advertised
    here has a subscriber.

    Args:
        lazy: false: the results are always wanted, e.g. as they are saved.
        health: shows on /diagnostics why the node rests, which inputs are silent, and how many messages were lost.
        camera: one of several in this node, whose results are wanted or not by themselves, see `in_camera`.

    Attributes:
        enabled: whether `~enable` lets it work.
        inputs: what it reads.
        watch: tells what is wrong with the inputs.
    """

    def __init__(self, lazy: bool, health: Health, camera: str = '') -> None:
        self._lazy, self._camera = lazy, camera
        self.enabled = True
        self._publishers: List[Readers] = []
        self.inputs: Sequence[InputSubscriber] = ()
        self._only_for: Needs = {}
        self._since: Optional[float] = None
        self._health = health
        self.watch = InputWatch(health)
        self._lock = threading.Lock()
        self._changed = threading.Event()
        health.show(lambda: {'enabled': str(self.enabled).lower()})
        health.explain_rest(self.why_resting)
        self._service = rospy.Service(self.resolve('~enable'), SetBool, self._enable)

    def advertise(self, topic: str, kind: Type[Any], queue_size: int) -> rospy.Publisher:
        """Return a publisher of results."""
        publisher = rospy.Publisher(self.resolve(topic), kind, subscriber_listener=self, queue_size=queue_size)
        self._publishers.append(publisher)
        return publisher

    def add(self, readers: Readers) -> None:
        """Let results be wanted while there are other readers, which call `peer_subscribe` when they come or go."""
        self._publishers.append(readers)

    def resolve(self, name: str) -> str:
        """Return the name of a topic or service, where it belongs to one of several cameras."""
        return in_camera(self._camera, name)

    def read(self, *inputs: InputSubscriber, only_for: Optional[Needs] = None) -> None:
        """Subscribe to the inputs whenever results are wanted; to be called once, after all publishers were made.

        Args:
            only_for: readers without which one of the inputs is not needed.
        """
        self.inputs, self._only_for = inputs, only_for or {}
        for source in inputs:
            source.on_error = self._health.frame_failed
        self._health.show(lambda: {READS: ', '.join(f'{source.resolved_name} ({source.kind})' for source in inputs)})
        self._health.show(lambda: {f'lost before this node, {source.resolved_name}': str(source.lost)
                                   for source in inputs})
        self._update()
        if self.why_resting():
            self._log()
        repeat(self._await_change, 'demand')
        self.watch.start(inputs)

    @property
    def seconds(self) -> float:
        """For how long the inputs have been subscribed [s]; 0 while they are not."""
        since = self._since
        return 0.0 if since is None else time.monotonic() - since

    def why_resting(self) -> str:
        """Return why the node does nothing, in a few words; empty while it works."""
        if not self.enabled:
            return 'disabled'
        return 'idle: no subscriber' if self.inputs and self._since is None else ''

    def is_wanted(self, *publishers: Readers) -> bool:
        """Return whether one of these topics has a subscriber, or the node is not lazy."""
        return not self._lazy or any(publisher.get_num_connections() > 0 for publisher in publishers)

    def peer_subscribe(self, *_: Any) -> None:
        """Called with locks of rospy held, so the inputs are left to another thread."""
        self._changed.set()

    peer_unsubscribe = peer_subscribe

    def _await_change(self) -> None:
        self._changed.wait(_CHECK_PERIOD)
        self._changed.clear()
        self._update()

    def _enable(self, request: SetBoolRequest) -> SetBoolResponse:
        self.enabled = request.data
        self._update()
        return SetBoolResponse(success=True, message='enabled' if request.data else 'disabled')

    def _update(self) -> None:
        with self._lock:
            wanted = self.enabled and self.is_wanted(*self._publishers)
            if not self.inputs or rospy.is_shutdown():
                return
            for source in self.inputs:
                needed = wanted and (source not in self._only_for or self.is_wanted(*self._only_for[source]))
                if needed and not source.subscribed:
                    source.subscribe()
                elif source.subscribed and not needed:
                    source.unsubscribe()
            if wanted == (self._since is not None):
                return
            self._since = time.monotonic() if wanted else None
        self._log()

    def _log(self) -> None:
        rest = self.why_resting()
        rospy.loginfo('%s %s', f'{rest}; not reading' if rest else 'reading',
                      ', '.join(source.resolved_name for source in self.inputs))
