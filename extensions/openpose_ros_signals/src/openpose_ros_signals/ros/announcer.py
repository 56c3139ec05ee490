"""Who is there, for state machines: a latched topic, and a service."""
import threading
from typing import Callable, Mapping, Sequence

import rospy
from openpose_ros_msgs.msg import PeopleSummary
from openpose_ros_msgs.srv import GetPeople, GetPeopleRequest, GetPeopleResponse
from std_msgs.msg import Header

from openpose_ros_signals.records import PersonSignals
from openpose_ros_signals.ros.convert import summary_to_message
from openpose_ros_signals.ros.input_end import InputEnd
from openpose_ros_signals.show.summary import Summary


class Announcer:
    """Publishes who is there on `people_summary` when that changes, and answers `get_people`.

    Args:
        on_error: called with what fails in the thread that notices that no people come any more.
    """

    def __init__(self, on_error: Callable[[Exception], None]) -> None:
        self._lock = threading.Lock()
        self._summary, self._header = Summary(), Header()
        self._topic = rospy.Publisher('people_summary', PeopleSummary, queue_size=10, latch=True)
        self._input = InputEnd(self._clear, on_error)
        self._service = rospy.Service('get_people', GetPeople, self._answer)

    def update(self, persons: Sequence[PersonSignals], header: Header, known: Mapping[int, float]) -> None:
        """Take the people of a frame, see `Summary.update`."""
        self._input.heard()
        with self._lock:
            changed = self._summary.update(persons, header.stamp.to_sec(), known)
            self._header = header
        if changed:
            self._topic.publish(summary_to_message(self._summary.people, header))

    def _clear(self) -> None:
        """Publish an empty summary: the topic tells changes, so that its silence would say that all people stay."""
        with self._lock:
            changed = self._summary.clear()
        if changed:
            self._topic.publish(PeopleSummary(header=Header(stamp=rospy.get_rostime(),
                                                            frame_id=self._header.frame_id)))

    def _answer(self, _request: GetPeopleRequest) -> GetPeopleResponse:
        """Return who is there; raises rospy.ServiceException while no messages come."""
        if self._input.silent:
            raise rospy.ServiceException('no people come: is the extractor running?')
        with self._lock:
            return GetPeopleResponse(summary_to_message(self._summary.people, self._header))
