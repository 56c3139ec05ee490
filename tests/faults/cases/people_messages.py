"""People that can not be drawn, on the input of the visualization."""
from typing import Any, Callable

from faults.fault import Fault
from faults.injectors import Injector

NAN = float('nan')


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


def unknown_joints(message: Any) -> None:
    message.pose_model = 'none_such'


def fewer_velocities(message: Any) -> None:
    del message.velocities[1:]


def joint(**values: float) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        for name, value in values.items():
            setattr(message.persons[0].neck, name, value)
    return change


FAULTS = [
    Fault('people of an unknown joint set', people(unknown_joints), 'two/markers',
          words=("pose_model 'none_such' is unknown",)),
    Fault('velocities of one of two people', people(fewer_velocities), 'two/markers', words=('1 velocities of 2',)),
    Fault('joint that is measured, without a position', people(joint(x=NAN, status=1)), 'two/markers',
          words=('status must be MISSING',)),
    Fault('joint of an unknown status', people(joint(status=99)), 'two/markers',
          words=('status of a point is 99',)),
]
