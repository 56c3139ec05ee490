"""Requests to the detection service that can not be answered, and many at once."""
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector

SERVICE = 'two/service'


def call(chain: Any, image: Any) -> Any:
    import rospy
    from openpose_ros_msgs.srv import GetPersons
    return rospy.ServiceProxy(chain.topic('detect_poses_3d'), GetPersons)(image).detections


def refused(**fields: Any) -> Injector:
    """Return what sends an image with other values in these fields, and expects an error as answer."""
    def inject(chain: Any) -> None:
        import rospy
        image = chain.frame().image
        for name, value in fields.items():
            setattr(image, name, value)
        try:
            call(chain, image)
        except rospy.ServiceException:
            return
        raise AssertionError('the service answered')
    return inject


def at_once(chain: Any) -> None:
    """Send 20 requests at the same time; all have to be answered."""
    from concurrent.futures import ThreadPoolExecutor
    with ThreadPoolExecutor(20) as clients:
        answers = list(clients.map(lambda _: len(call(chain, chain.frame().image)), range(20)))
    assert answers == [len(chain.reference)] * 20


FAULTS = [
    Fault('request without data', refused(data=b''), SERVICE, 'bad image', ('image data are truncated',)),
    Fault('request with an unknown encoding', refused(encoding='none_such'), SERVICE, 'bad image', ("'none_such'",)),
    Fault('20 requests at once', at_once, SERVICE, event=''),
]
