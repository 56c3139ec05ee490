"""People of cameras that can not be fused, and cameras that can not be where they are said to be."""
import copy
from typing import Any, Callable

from faults.fault import Fault, Scenario
from faults.injectors import Injector, altered, refused

NAN = float('nan')
HOUR = 3600
PEOPLE, OUT_OF_TIME = 'fusion/people', 'messages out of time'


def left(change: Callable[[Any], None]) -> Injector:
    """Return what sends a frame after a function changed the people of the left camera."""
    return altered(lambda frame: change(frame.left))


def every_joint(**values: Any) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        for person in message.persons:
            for slot in person.__slots__:
                joint = getattr(person, slot)
                for name, value in values.items():
                    if hasattr(joint, name):
                        setattr(joint, name, value)
    return change


def in_frame(name: str) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        message.header.frame_id = name
    return change


def later(seconds: int) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        message.header.stamp.secs += seconds
    return change


def without_stamp(message: Any) -> None:
    message.header.stamp.secs = message.header.stamp.nsecs = 0


def of_an_unknown_joint_set(message: Any) -> None:
    message.pose_model = 'none_such'


def a_thousand(message: Any) -> None:
    message.persons = [copy.deepcopy(message.persons[0]) for _ in range(1000)]


def one_id(message: Any) -> None:
    for person in message.persons:
        person.person_ID = 1


def nobody(message: Any) -> None:
    message.persons, message.velocities = [], []


def info(**fields: Any) -> Injector:
    """Return what sends a frame in which the calibration of the camera without depth has other values."""
    def change(frame: Any) -> None:
        for name, value in fields.items():
            setattr(frame.info, name, value)
    return altered(change)


def all_stamps(seconds: int) -> Injector:
    """Return what sends a frame of another time from all cameras."""
    def change(frame: Any) -> None:
        for message in vars(frame).values():
            message.header.stamp.secs += seconds
    return altered(change)


def counted(inject: Injector) -> Injector:
    """Return what injects a fault until the node has counted a message as out of time."""
    def until_counted(chain: Any) -> None:
        from session import await_true
        before = chain.diagnostics.count(PEOPLE, OUT_OF_TIME)

        def noticed() -> bool:
            inject(chain)
            return bool(chain.diagnostics.count(PEOPLE, OUT_OF_TIME) > before)
        await_true(noticed, f'{OUT_OF_TIME} are counted')
    return until_counted


def camera_dies(chain: Any) -> None:
    import rospy

    from session import await_true
    publisher = chain.publishers['left']
    topic = publisher.resolved_name
    publisher.unregister()
    for _ in range(5):
        frame = chain.frame()
        for name in ('info', 'door', 'right'):
            chain.publishers[name].publish(getattr(frame, name))
    chain.publishers['left'] = rospy.Publisher(topic, type(chain.frame().left), queue_size=10)
    await_true(lambda: chain.publishers['left'].get_num_connections(), 'the fusion listens to the camera again')


PROGRAM = 'extensions/openpose_ros_fusion/scripts/people_fusion_node'
CAMERA = '{fixed_frame: room, cameras: [{name: left, frame_id: left, translation: [0, 0, 1], rotation: %s}]}'
RIG = {'rig': '{file}', 'cameras': 'left'}
ENDS = 'ends with 1 and names it'
FAULTS = [
    Fault('people of an unknown joint set', left(of_an_unknown_joint_set), PEOPLE,
          words=("pose_model 'none_such' is unknown",)),
    Fault('measured joints without positions', left(every_joint(x=NAN)), PEOPLE, words=('status must be MISSING',)),
    Fault('joints a thousand kilometres away', left(every_joint(z=1e6)), PEOPLE, words=('1e+06 m away',)),
    Fault('sigma of NaN', left(every_joint(sigma=NAN)), PEOPLE, event=''),
    Fault('sigma of a nanometre', left(every_joint(sigma=1e-9)), PEOPLE, event=''),
    Fault('a thousand people', left(a_thousand), PEOPLE, words=('1000 people at a time',)),
    Fault('two people of one id', left(one_id), PEOPLE, event=''),
    Fault('a camera sees nobody', left(nobody), PEOPLE, event=''),
    Fault('frame that tf does not know', left(in_frame('none_such')), PEOPLE, 'no transform', ('none_such',)),
    Fault('people without a stamp', left(without_stamp), PEOPLE, 'stamp 0', ('driver has to',)),
    Fault('people of an hour ago: counted as out of time', counted(left(later(-HOUR))), PEOPLE, event=''),
    Fault('all cameras are an hour ahead', all_stamps(HOUR), PEOPLE, event=''),
    Fault('publisher of a camera dies and comes back', camera_dies, PEOPLE, event=''),
    Fault('camera without depth: K of zeros', info(K=[0.0] * 9), PEOPLE, words=('camera is not calibrated',)),
    Fault('camera without depth: D of -50', info(D=[-50.0] * 5), PEOPLE, event=''),
    Scenario('fusion without cameras', refused(PROGRAM, {'cameras': "''"}, "'cameras'"), 'people_fusion_node', ENDS),
    Scenario('rig file that is no YAML', refused(PROGRAM, RIG, 'settings.yaml', text='{'), 'people_fusion_node', ENDS),
    Scenario('rig file without a camera', refused(
        PROGRAM, RIG, "no camera 'left'", text=CAMERA.replace('name: left', 'name: right') % [0, 0, 0, 1]),
             'people_fusion_node', ENDS),
]
