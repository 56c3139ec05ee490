"""Stamps that are missing, jump or repeat."""
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector, edit


def at(*stamps: float) -> Injector:
    """Return what sends frames with these stamps [s]."""
    def inject(chain: Any) -> None:
        import rospy
        for stamp in stamps:
            chain.send(chain.frame(rospy.Time.from_sec(stamp)))
    return inject


def ahead(*seconds: float) -> Injector:
    """Return what sends frames with stamps that are ahead of the time by this [s]."""
    def inject(chain: Any) -> None:
        import rospy
        now = rospy.Time.now().to_sec()
        at(*(now + each for each in seconds))(chain)
    return inject


def apart(chain: Any) -> None:
    import rospy
    frame = chain.frame()
    frame.points.header.stamp -= rospy.Duration(0.02)
    chain.send(frame)


def too_many_nanoseconds(chain: Any) -> None:
    frame = chain.frame()
    edit([frame.image.header.stamp, frame.points.header.stamp], nsecs=2**32 - 1)
    chain.send(frame)
    chain.send(chain.frame())


FAULTS = [
    Fault('stamp 0', at(0.0), event='stamp 0', words=('driver has to',)),
    Fault('stamp an hour back', ahead(-3600.0), event='time jumped back'),
    Fault('stamp an hour ahead, then of now', ahead(3600.0, 0.0), event='time jumped back'),
    Fault('the same stamp twice', ahead(0.1, 0.1), event='stamp not newer'),
    Fault('more nanoseconds than a second has, then of now', too_many_nanoseconds, event='time jumped back'),
    Fault('points 20 ms before the image', apart, event=''),
]
