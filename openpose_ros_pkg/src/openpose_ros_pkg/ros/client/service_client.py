"""Call the detection service with a timeout; the service may start or restart at any time."""
import threading
from typing import List, Optional

import rospy
from openpose_ros_msgs.msg import PersonDetection
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image

from openpose_ros_pkg.errors import ServiceCallError
from openpose_ros_pkg.params.nodes import ServiceClientParams
from openpose_ros_pkg.ros.master.calls import why_unavailable


class DetectionClient:
    """Client of openpose_ros_msgs/GetPersons for one thread; `name` is the resolved one of the service.

    Each call makes its own connection: on one machine that costs no more (measured), and a service that was restarted
    is found again.
    """

    def __init__(self, service: str, params: ServiceClientParams) -> None:
        self.name = rospy.resolve_name(service)
        self._timeout = params.service_timeout
        self._call: Optional[_Call] = None
        self._ended = False

    def detect(self, image: Image) -> List[PersonDetection]:
        """Return the people in an image, in pixels of that image.

        Raises:
            ServiceCallError: no such service, an error, no answer within `service_timeout`, an earlier call that does
                not end, or the node ends.
        """
        if self._ended:
            raise self._failed('this node is shutting down')
        # as long as a call can not be ended no other is begun, so that they do not pile up
        if self._call is not None:
            self._await(self._call)
        self._call = call = _Call(self.name, image)
        self._await(call)
        if call.error is not None:
            raise self._failed(str(call.error)) from call.error
        return call.detections

    def end(self) -> None:
        """Give up the call in progress, and begin no other one; any thread may do so."""
        self._ended = True
        if self._call is not None:
            self._call.give_up()

    def _await(self, call: '_Call') -> None:
        if not call.ended.wait(self._timeout):
            call.give_up()
            raise self._failed(f'no answer within {self._timeout:g} s')

    def _failed(self, text: str) -> ServiceCallError:
        if reason := why_unavailable(self.name):
            return ServiceCallError(f'waiting for service {self.name}: unavailable, {reason}; frames are skipped')
        return ServiceCallError(f'{self.name}: {text}')


class _Call:
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
