"""People that can not be drawn, on the input of the visualization."""
from typing import Any, Callable

from faults.fault import Fault
from faults.injectors import NAN, Injector, edit


def people(change: Callable[[Any], None]) -> Injector:
    """Return what publishes the people of a good frame after a function changed them."""
    def inject(chain: Any) -> None:
        import rospy

        from session import await_true
        message = chain.result_of_good_frame()
        change(message)
        publisher = rospy.Publisher(chain.topic('openpose_ros/skeleton_3d/detected_poses_3d'), type(message),
                                    queue_size=1)
        # the subscriber of the suite itself, and the visualization
        await_true(lambda: publisher.get_num_connections() >= 2, 'the visualization listens')
        publisher.publish(message)
    return inject


def joint(**values: float) -> Injector:
    return people(lambda message: edit(message.persons[0].neck, **values))


FAULTS = [
    Fault('people of an unknown joint set', people(lambda message: edit(message, pose_model='none_such')),
          'two/markers', words=("pose_model 'none_such' is unknown",)),
    Fault('velocities of one of two people', people(lambda message: edit(message, velocities=message.velocities[:1])),
          'two/markers', words=('1 velocities of 2',)),
    Fault('joint that is measured, without a position', joint(x=NAN, status=1), 'two/markers',
          words=('status must be MISSING',)),
    Fault('joint of an unknown status', joint(status=99), 'two/markers', words=('status of a point is 99',)),
]
