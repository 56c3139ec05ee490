"""Which people are there, for state machines: the service get_people."""
import threading
from typing import Tuple

import rospy
from openpose_ros_msgs.srv import GetPeople, GetPeopleRequest, GetPeopleResponse
from std_msgs.msg import Header

from openpose_ros_signals.reader import Present
from openpose_ros_signals.ros.convert import summary_to_message
from openpose_ros_signals.ros.input_end import Silence


class PeopleServer:
    """Answers `get_people`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._present: Tuple[Present, ...] = ()
        self._header, self._silence = Header(), Silence()
        self._service = rospy.Service('get_people', GetPeople, self._answer)

    def take(self, present: Tuple[Present, ...], header: Header) -> None:
        """Take the people that are there at the time of a frame."""
        self._silence.heard()
        with self._lock:
            self._present, self._header = present, header

    def _answer(self, _request: GetPeopleRequest) -> GetPeopleResponse:
        """Return the people that are there; raises rospy.ServiceException while no messages come."""
        if self._silence.lasts:
            raise rospy.ServiceException('no people come: is the extractor running?')
        with self._lock:
            return GetPeopleResponse(summary_to_message(self._present, self._header))
