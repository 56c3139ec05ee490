"""People of cameras that can not be fused, and cameras that can not be where they are said to be."""
import copy
from operator import attrgetter
from typing import Any, List

from faults.fault import Fault, Scenario
from faults.injectors import NAN, Injector, altered, changed, edit, refused

HOUR = 3600
PEOPLE, OUT_OF_TIME = 'fusion/people', 'messages out of time'


def every_joint(part: str, **values: Any) -> Injector:
    """Return what sends a frame in which all joints of a message of people have other values."""
    return altered(lambda frame: edit([
        getattr(person, slot) for person in attrgetter(part)(frame).persons for slot in person.__slots__
        if hasattr(getattr(person, slot), 'sigma')], **values))


def a_thousand(persons: List[Any]) -> List[Any]:
    return [copy.deepcopy(persons[0]) for _ in range(1000)]


def later(seconds: int, *parts: str) -> Injector:
    """Return what sends a frame of which messages have another time."""
    return altered(lambda frame: edit([getattr(frame, part).header.stamp for part in parts or vars(frame)],
                                      secs=lambda secs: secs + seconds))


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
    Fault('people of an unknown joint set', changed('left', pose_model='none_such'), PEOPLE,
          words=("pose_model 'none_such' is unknown",)),
    Fault('measured joints without positions', every_joint('left', x=NAN), PEOPLE, words=('status must be MISSING',)),
    Fault('joints a thousand kilometres away', every_joint('left', z=1e6), PEOPLE, words=('1e+06 m away',)),
    Fault('sigma of NaN', every_joint('left', sigma=NAN), PEOPLE, event=''),
    Fault('sigma of a nanometre', every_joint('left', sigma=1e-9), PEOPLE, event=''),
    Fault('a thousand people', changed('left', persons=a_thousand), PEOPLE, words=('1000 people at a time',)),
    Fault('two people of one id', changed('left.persons', person_ID=1), PEOPLE, event=''),
    Fault('a camera sees no person', changed('left', persons=[], velocities=[]), PEOPLE, event=''),
    Fault('frame that tf does not know', changed('left.header', frame_id='none_such'), PEOPLE, 'no transform',
          ('none_such',)),
    Fault('people without a stamp', changed('left.header.stamp', secs=0, nsecs=0), PEOPLE, 'stamp 0',
          ('driver has to',)),
    Fault('people of an hour ago: counted as out of time', counted(later(-HOUR, 'left')), PEOPLE, event=''),
    Fault('all cameras are an hour ahead', later(HOUR), PEOPLE, event=''),
    Fault('publisher of a camera dies and comes back', camera_dies, PEOPLE, event=''),
    Fault('camera without depth: K of zeros', changed('info', K=[0.0] * 9), PEOPLE,
          words=('camera is not calibrated',)),
    Fault('camera without depth: D of -50', changed('info', D=[-50.0] * 5), PEOPLE, event=''),
    Scenario('fusion without cameras', refused(PROGRAM, {'cameras': "''"}, "'cameras'"), 'people_fusion_node', ENDS),
    Scenario('rig file that is no YAML', refused(PROGRAM, RIG, 'settings.yaml', text='{'), 'people_fusion_node', ENDS),
    Scenario('rig file without a camera', refused(
        PROGRAM, RIG, "no camera 'left'", text=CAMERA.replace('name: left', 'name: right') % [0, 0, 0, 1]),
             'people_fusion_node', ENDS),
]
