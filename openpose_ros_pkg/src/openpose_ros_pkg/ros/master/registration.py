"""Keep a node known to the ROS master: rospy registers once, and a master that was restarted knows nobody.

What two nodes say to each other needs no master, so a chain goes on without one. But clients, new subscribers and nodes
that are started again find only what is registered.
"""
import time
from typing import Any, Callable, Dict, Sequence

import rosgraph
import rospy
from rospy.core import is_shutdown_requested
from rospy.impl import registration

from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, call_master, is_listening
from openpose_ros_pkg.ros.threads import repeat

# Period of looking, in wall time: one request of a few milliseconds [s].
PERIOD = 1.0


class RegistrationWatch:
    """Looks whether the services of this node are still its own, and registers all anew where they are not.

    Every node has services, and the master forgets all of a node at once; so services tell of topics as well. Private
    parameters that the master lost are set again. A service that another running node has taken is left to it.

    Attributes:
        warn: gets event and text of what was found.
    """

    def __init__(self) -> None:
        self.warn: Callable[[str, str], None] = lambda event, text: rospy.logwarn('%s: %s', event, text)
        self._parameters: Dict[str, Any] = {}
        self._fault = ''

    def start(self) -> None:
        """Begin to look, in a thread of its own."""
        repeat(self._keep_looking, 'registration')

    def fault(self) -> str:
        """Return what keeps others from finding this node; empty: nothing."""
        return self._fault

    def _keep_looking(self) -> None:
        while not is_shutdown_requested():
            try:
                fault = self._look()
            except CALL_ERRORS as error:
                fault = f'the ROS master {rosgraph.get_master_uri()} does not answer: {type(error).__name__}'
            if fault and not self._fault and not is_shutdown_requested():
                self.warn('not to be found', fault)
            self._fault = fault
            time.sleep(PERIOD)

    def _look(self) -> str:
        """Register anew what the master has lost; return what keeps others from finding this node."""
        own = dict(registration.get_service_manager().get_services())
        *found, parameters = call_master([*(('lookupService', name) for name in own), ('getParam', rospy.get_name())])
        registered = {name: uri if code == 1 else '' for name, (code, _, uri) in zip(own, found)}
        taken = [name for name, uri in registered.items() if uri not in ('', own[name]) and is_listening(uri)]
        lost = [name for name, uri in registered.items() if uri != own[name] and name not in taken]
        if parameters[0] == 1:
            self._parameters = parameters[2]
        if lost and self._register(taken, set_parameters=parameters[0] != 1):
            self.warn('registered anew', 'the ROS master was restarted or has forgotten this node'
                      if len(lost) + len(taken) == len(own) else f'another node served {", ".join(lost)} for a while')
        return f'another running node gets the requests for {", ".join(taken)}' if taken else ''

    def _register(self, left_out: Sequence[str], set_parameters: bool) -> bool:
        """Register all topics and services but those left out, as rospy does at the start; false: the node ends."""
        topics, services = registration.get_topic_manager(), registration.get_service_manager()
        me = rospy.get_node_uri()
        with topics.lock, services.lock:  # nothing comes or goes in between
            manager = next((each for each in registration.get_registration_listeners().listeners
                            if isinstance(each, registration.RegManager)), None)
            if manager is None or is_shutdown_requested():
                return False
            subscriptions = topics.get_subscriptions()
            answers = call_master([
                *(('registerSubscriber', name, kind, me) for name, kind in subscriptions),
                *(('registerPublisher', name, kind, me) for name, kind in topics.get_publications()),
                *(('registerService', name, uri, me) for name, uri in services.get_services() if name not in left_out),
                *([('setParam', rospy.get_name(), self._parameters)] if set_parameters and self._parameters else [])])
            for (name, _), (_, _, publishers) in zip(subscriptions, answers):
                manager.publisher_update(name, publishers)
        return True


WATCH = RegistrationWatch()
"""That of this process, as rospy's node is."""
