"""People as people_msgs/People: what costmap layers for people read."""
import genpy
from geometry_msgs.msg import Point
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSignalsArray
from std_msgs.msg import Header

from openpose_ros_bridges.located import Located, located
from openpose_ros_bridges.node_params import BridgeSettings
from openpose_ros_bridges.ros.bridge import PEOPLE, SIGNALS, Bridge, Output
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_signals.ros.convert import signals_from_array
from skeleton_extract_3d.ros.convert import people_from_array

PACKAGE = ForeignPackage('people_msgs', 'https://github.com/wg-perception/people (branch noetic)')


class PeopleMessages:
    """Makes messages of people.

    Attributes:
        kind: class of people_msgs/People.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self) -> None:
        self._person = PACKAGE.message('Person', {
            'name': 'string', 'position': 'geometry_msgs/Point', 'velocity': 'geometry_msgs/Point',
            'reliability': 'float64', 'tagnames': 'string[]', 'tags': 'string[]'})
        self.kind = PACKAGE.message('People', {'header': 'std_msgs/Header', 'people': 'people_msgs/Person[]'})

    def convert(self, people: PersonDetection_3dArray, signals: PersonSignalsArray) -> genpy.Message:
        """Return the message of one frame, in the frame of reference of the signals."""
        persons = located(people_from_array(people), signals_from_array(signals))
        return self.kind(header=signals.header, people=[self._of(person) for person in persons])

    def end(self, header: Header) -> genpy.Message:
        """Return the message without people."""
        return self.kind(header=header)

    def _of(self, person: Located) -> genpy.Message:
        # the message knows no unknown velocity, and its readers no NaN
        velocity = (0.0, 0.0, 0.0) if person.velocity is None else person.velocity
        return self._person(name=str(person.id), position=Point(*person.position), velocity=Point(*velocity),
                            reliability=person.reliability, tagnames=[name for name, _ in person.tags],
                            tags=[value for _, value in person.tags])


def _make(settings: BridgeSettings) -> Bridge:
    messages = PeopleMessages()
    return Bridge(settings.demand, Output('people', messages.kind, (PEOPLE, SIGNALS), messages.convert, messages.end))


def main() -> None:
    """Run the bridge to people_msgs."""
    run_node('people_msgs_node', BridgeSettings, _make)
