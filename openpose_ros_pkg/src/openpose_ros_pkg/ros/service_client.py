"""Call the detection service from a worker thread: waits for it, gives up in time, goes on when it returns."""
import threading
from typing import List

import rospy
from openpose_ros_msgs.msg import PersonDetection
from openpose_ros_msgs.srv import GetPersons
from sensor_msgs.msg import Image

from openpose_ros_pkg.node_params import ServiceClientParams

# How often a client that waits for the service says so [s].
_SAY_PERIOD = 5.0


class ServiceCallError(Exception):
    """The service did not answer this request; the next one may succeed."""


class DetectionClient:
    """Client of openpose_ros_msgs/GetPersons.

    Each call makes its own connection: measured to cost no more than a persistent one on one machine, and a service
    that was restarted is found without further ado.
    """

    def __init__(self, service: str, params: ServiceClientParams) -> None:
        self._name = rospy.resolve_name(service)
        self._timeout = params.service_timeout
        self._proxy = rospy.ServiceProxy(self._name, GetPersons)

    def wait(self) -> bool:
        """Block until the service is there, saying so on the log; return False on shutdown."""
        waited = 0.0
        while not rospy.is_shutdown():
            try:
                rospy.wait_for_service(self._name, timeout=_SAY_PERIOD)
                if waited:
                    rospy.loginfo('service %s is there', self._name)
                return True
            except rospy.ROSInterruptException:
                return False
            except rospy.ROSException:
                waited += _SAY_PERIOD
                rospy.logwarn('waiting for service %s since %.0f s; frames are skipped meanwhile', self._name, waited)
        return False

    def detect(self, image: Image) -> List[PersonDetection]:
        """Return the people in an image, in pixels of that image.

        Raises:
            ServiceCallError: there is no such service, it answered with an error, or not within `service_timeout`.
        """
        expired = threading.Event()
        timer = threading.Timer(self._timeout, self._give_up, [expired])
        timer.daemon = True
        timer.start()
        try:
            return self._proxy(image).detections
        except (rospy.ServiceException, rospy.exceptions.TransportException, AttributeError) as error:
            # a connection closed by the timer shows up in rospy as any of these
            if expired.is_set():
                raise ServiceCallError(f'no answer from {self._name} within {self._timeout:g} s') from error
            raise ServiceCallError(f'{self._name}: {error}') from error
        finally:
            timer.cancel()

    def _give_up(self, expired: threading.Event) -> None:
        expired.set()
        self._proxy.close()
