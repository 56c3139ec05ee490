"""Calls of the detection service with a timeout; the service may start or restart at any time."""
import threading
from typing import Any, Dict, List, Optional

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
        self._proxy: Optional[rospy.ServiceProxy] = None
        self._thread: Optional[threading.Thread] = None
        self._ended = False

    def detect(self, image: Image) -> List[PersonDetection]:
        """Return the people in an image, in pixels of that image.

        Raises:
            ServiceCallError: no such service, an error, no answer within `service_timeout`, an earlier call that does
                not end, or the node ends.
        """
        if self._ended:
            raise self._failed('this node is shutting down')
        self._await()  # while a call can not be ended no other is begun, so that they do not pile up
        # rospy lets others close the connection of a persistent proxy only
        self._proxy = proxy = rospy.ServiceProxy(self.name, GetPersons, persistent=True)
        answer: Dict[str, Any] = {}

        def call() -> None:  # in a thread, as rospy waits without limit
            try:
                answer['detections'] = proxy(image).detections
            except Exception as error:  # rospy shows a connection that broke or was closed in many ways
                answer['error'] = error
            finally:
                proxy.close()

        self._thread = threading.Thread(target=call, name='service call', daemon=True)
        self._thread.start()
        self._await()
        if 'detections' not in answer:
            raise self._failed(str(answer.get('error', 'the call ended'))) from answer.get('error')
        return list(answer['detections'])

    def end(self) -> None:
        """Give up the call in progress, and begin no other one; any thread may do so."""
        self._ended = True
        if self._proxy is not None:
            self._proxy.close()

    def _await(self) -> None:
        if self._thread is not None and self._proxy is not None:
            self._thread.join(self._timeout)
            if self._thread.is_alive():
                self._proxy.close()  # if there is a connection yet; the thread then ends
                raise self._failed(f'no answer within {self._timeout:g} s')

    def _failed(self, text: str) -> ServiceCallError:
        if reason := why_unavailable(self.name):
            return ServiceCallError(f'waiting for service {self.name}: unavailable, {reason}; frames are skipped')
        return ServiceCallError(f'{self.name}: {text}')
