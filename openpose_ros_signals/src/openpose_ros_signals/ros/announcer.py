"""Who is there, for state machines: a latched topic, and a service."""
import threading
import time
from typing import Sequence

import rospy
from openpose_ros_msgs.msg import PeopleSummary
from openpose_ros_msgs.srv import GetPeople, GetPeopleRequest, GetPeopleResponse
from std_msgs.msg import Header

from openpose_ros_signals.records import PersonSignals
from openpose_ros_signals.ros.convert import summary_to_message
from openpose_ros_signals.show.summary import Summary

# Older people are no answer [s].
_OLDEST = 2.0


class Announcer:
    """Publishes who is there on `people_summary` when that changes, and answers `get_people`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._summary, self._header, self._arrival = Summary(), Header(), -float('inf')
        self._topic = rospy.Publisher('people_summary', PeopleSummary, queue_size=10, latch=True)
        self._service = rospy.Service('get_people', GetPeople, self._answer)

    def update(self, persons: Sequence[PersonSignals], header: Header) -> None:
        """Take the people of a frame."""
        with self._lock:
            changed = self._summary.update(persons, header.stamp.to_sec())
            self._header, self._arrival = header, time.monotonic()
        if changed:
            self._topic.publish(summary_to_message(self._summary.people, header))

    def _answer(self, _request: GetPeopleRequest) -> GetPeopleResponse:
        """Return who is there; raises rospy.ServiceException while no people come: that is not the same as nobody."""
        with self._lock:
            if time.monotonic() - self._arrival > _OLDEST:
                raise rospy.ServiceException(f'no people came for {_OLDEST:g} s: is the extractor running?')
            return GetPeopleResponse(summary_to_message(self._summary.people, self._header))
