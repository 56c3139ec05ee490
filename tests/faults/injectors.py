"""What cases inject, where more than one needs it."""
import tempfile
from operator import attrgetter
from pathlib import Path
from typing import Any, Callable, Dict

Injector = Callable[[Any], None]
NAN = float('nan')


def edit(messages: Any, **fields: Any) -> None:
    """Set fields of a message, or of each one of a list, to values or to functions of their values."""
    for message in messages if isinstance(messages, list) else [messages]:
        for name, value in fields.items():
            setattr(message, name, value(getattr(message, name)) if callable(value) else value)


def altered(change: Callable[[Any], None]) -> Injector:
    """Return what sends a frame after a function changed its messages."""
    def inject(chain: Any) -> None:
        frame = chain.frame()
        change(frame)
        chain.send(frame)
    return inject


def changed(part: str, **fields: Any) -> Injector:
    """Return what sends a frame of which a part, as 'image' or 'left.header', has other values; see `edit`."""
    return altered(lambda frame: edit(attrgetter(part)(frame), **fields))


def with_matrix(**elements: float) -> Injector:
    """Return what sends a camera info with other elements of K, k0 to k8."""
    return changed('info', K=lambda values: [elements.get(f'k{i}', value) for i, value in enumerate(values)])


def request_refused(*words: str, **fields: Any) -> Injector:
    """Return what asks the service about an image with other values, and expects an error with these words."""
    def inject(chain: Any) -> None:
        import rospy
        from openpose_ros_msgs.srv import GetPersons
        image = chain.frame().image
        edit(image, **fields)
        try:
            rospy.ServiceProxy(chain.topic('detect_poses_3d'), GetPersons)(image)
        except rospy.ServiceException as error:
            assert all(word in str(error) for word in words), error
        else:
            raise AssertionError('the service answered')
    return inject


def refused(program: str, parameters: Dict[str, Any], *words: str, text: str = '') -> Callable[[Any], None]:
    """Return what starts a program with these parameters, which has to end with 1 and these words.

    Args:
        text: of a file that is written; {file} in a parameter is its path.
    """
    def run(rig: Any) -> None:
        from faults.rig import PATIENCE, Program, start_node
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'settings.yaml'
            path.write_text(text)
            # a name of its own, as the parameter server keeps what a node was given
            process = start_node(rig.session, f'refused/node_{abs(hash((program, words)))}', Program(program, {
                name: str(value).format(file=path) for name, value in parameters.items()}))
            status, said = process.wait(PATIENCE), rig.session.log(process)
            assert (status, [word for word in words if word not in said]) == (1, []), said
    return run
