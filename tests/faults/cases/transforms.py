"""Frames that tf does not know, or not at the time of the points; people are wanted in the frame of the room."""
from typing import Any

from faults.fault import Fault
from faults.injectors import NAN, Injector, edit


def transform(parent: str, child: str, stamp: float = 0.0, w: float = 1.0) -> Any:
    """Return a TransformStamped, by default of the time of now."""
    import rospy
    from geometry_msgs.msg import Quaternion, Transform, TransformStamped
    from std_msgs.msg import Header
    time = rospy.Time.from_sec(stamp) if stamp else rospy.Time.now()
    return TransformStamped(Header(stamp=time, frame_id=parent), child, Transform(rotation=Quaternion(w=w)))


def seen_from(frame_id: str, *transforms: Any) -> Injector:
    """Return what publishes transforms and then sends a frame whose points are in that frame.

    Args:
        transforms: arguments of `transform`.
    """
    def inject(chain: Any) -> None:
        import rospy
        from tf2_msgs.msg import TFMessage

        from session import await_true
        publisher = rospy.Publisher('/tf', TFMessage, queue_size=10)
        await_true(lambda: publisher.get_num_connections() > 0, '/tf is heard')
        publisher.publish(TFMessage([transform(*each) for each in transforms]))
        frame = chain.frame()
        edit([message.header for message in vars(frame).values()], frame_id=frame_id)
        chain.send(frame)
        publisher.unregister()
    return inject


def is_dropped(title: str, inject: Injector, *words: str) -> Fault:
    return Fault(title, inject, 'depth/people', 'no transform', ('the frame is dropped', *words))


FAULTS = [
    is_dropped('points in a frame that is not published', seen_from('nowhere'), 'nowhere'),
    is_dropped('transform of an hour ago', seen_from('old', ('room', 'old', 1.7e9)), 'old'),
    is_dropped('transform with a rotation of NaN', seen_from('nan', ('room', 'nan', 0.0, NAN)), 'nan'),
    is_dropped("frames that are each other's parents", seen_from('hen', ('egg', 'hen'), ('hen', 'egg')), 'hen'),
]
