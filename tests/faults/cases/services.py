"""Requests to the detection service that can not be answered, and many at once."""
from typing import Any

from faults.fault import Fault
from faults.injectors import request_refused

SERVICE = 'two/service'


def at_once(chain: Any) -> None:
    """Send 20 requests at the same time; all have to be answered."""
    from concurrent.futures import ThreadPoolExecutor

    import rospy
    from openpose_ros_msgs.srv import GetPersons

    def people(_: int) -> int:
        return len(rospy.ServiceProxy(chain.topic('detect_poses_3d'), GetPersons)(chain.frame().image).detections)
    with ThreadPoolExecutor(20) as clients:
        assert list(clients.map(people, range(20))) == [len(chain.reference)] * 20


FAULTS = [
    Fault('request without data', request_refused(data=b''), SERVICE, 'bad image', ('image data are truncated',)),
    Fault('request with an unknown encoding', request_refused(encoding='none_such'), SERVICE, 'bad image',
          ("'none_such'",)),
    Fault('20 requests at once', at_once, SERVICE, event=''),
]
