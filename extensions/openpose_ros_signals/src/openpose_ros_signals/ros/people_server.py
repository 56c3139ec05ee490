"""Which people are there, for state machines: the service get_people."""
import threading
from typing import Dict, Mapping, Sequence

import rospy
from openpose_ros_msgs.srv import GetPeople, GetPeopleRequest, GetPeopleResponse
from std_msgs.msg import Header

from openpose_ros_signals.records import PersonSignals
from openpose_ros_signals.ros.convert import summary_to_message
from openpose_ros_signals.ros.input_end import Silence
from openpose_ros_signals.show.presence import Present, presence


class PeopleServer:
    """Answers `get_people`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._present: Dict[int, Present] = {}
        self._header, self._silence = Header(), Silence()
        self._service = rospy.Service('get_people', GetPeople, self._answer)

    def take(self, persons: Sequence[PersonSignals], header: Header, known: Mapping[int, float]) -> None:
        """Take the people of a frame, see `presence`."""
        self._silence.heard()
        with self._lock:
            self._present = presence(self._present, persons, header.stamp.to_sec(), known)
            self._header = header

    def _answer(self, _request: GetPeopleRequest) -> GetPeopleResponse:
        """Return the people that are there; raises rospy.ServiceException while no messages come."""
        if self._silence.lasts:
            raise rospy.ServiceException('no people come: is the extractor running?')
        with self._lock:
            return GetPeopleResponse(summary_to_message(tuple(self._present.values()), self._header))
