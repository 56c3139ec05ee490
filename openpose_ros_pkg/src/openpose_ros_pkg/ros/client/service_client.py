"""Call the detection service with a timeout, two images at a time; the service may start or restart at any time."""
import threading
from collections import deque
from typing import Deque, List, Optional

import rospy
from openpose_ros_msgs.msg import PersonDetection
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image

from openpose_ros_pkg.errors import ServiceCallError
from openpose_ros_pkg.params.nodes import ServiceClientParams
from openpose_ros_pkg.ros.master.calls import why_unavailable

# How long before the networks become free the next image is sent, so that it is ready by then: rospy sends and receives
# it, and the service makes of it what the networks see (960 x 540) [s].
REQUEST_LEAD = 0.015


class DetectionClient:
    """Client of openpose_ros_msgs/GetPersons; `name` is the resolved one of the service.

    Each call makes its own connection: on one machine that costs no more (measured), and a service that was restarted
    is found again. While the service computes one image, the next may be sent. `begin` and `result` are for one thread
    each.
    """

    def __init__(self, service: str, params: ServiceClientParams) -> None:
        self.name = rospy.resolve_name(service)
        self._timeout = params.service_timeout
        self._hung: Deque[Call] = deque()

    def begin(self, image: Image) -> 'Call':
        """Send an image and return at once; ServiceCallError: a call that was given up has not ended."""
        # as long as a call can not be ended no other is begun, so that they do not pile up
        while self._hung:
            if not self._hung[0].ended.wait(self._timeout):
                self._hung[0].give_up()
                raise self._no_answer()
            self._hung.popleft()
        return Call(self.name, image)

    def result(self, call: 'Call') -> List[PersonDetection]:
        """Return the people in an image, in pixels of that image.

        Raises:
            ServiceCallError: no such service, an error, or no answer within `service_timeout` from now.
        """
        if not call.ended.wait(self._timeout):
            call.give_up()
            self._hung.append(call)
            raise self._no_answer()
        if call.error is not None:
            raise self._failed(str(call.error)) from call.error
        return call.detections

    def _no_answer(self) -> ServiceCallError:
        return self._failed(f'no answer within {self._timeout:g} s')

    def _failed(self, text: str) -> ServiceCallError:
        if reason := why_unavailable(self.name):
            return ServiceCallError(f'waiting for service {self.name}: unavailable, {reason}; frames are skipped')
        return ServiceCallError(f'{self.name}: {text}')


class Call:
    """A call in a thread of its own, as rospy waits without limit. `ended` is set with `detections` or `error`."""

    def __init__(self, name: str, image: Image) -> None:
        self.ended = threading.Event()
        self.detections: List[PersonDetection] = []
        self.error: Optional[Exception] = None
        # rospy lets others close the connection of a persistent proxy only
        self._proxy = rospy.ServiceProxy(name, GetPersons, persistent=True)
        threading.Thread(target=self._run, args=(image,), name='service call', daemon=True).start()

    def give_up(self) -> None:
        """Close the connection, if there is one yet; the thread then ends."""
        self._proxy.close()

    def _run(self, image: Image) -> None:
        try:
            self.detections = self._proxy(image).detections
        except Exception as error:  # rospy shows a connection that broke or was closed in many ways
            self.error = error
        finally:
            self._proxy.close()
            self.ended.set()
