"""The visualization node: joints, hands and faces in space to RViz markers."""
from typing import Any, Callable, Type

from openpose_ros_msgs.msg import FaceDetection_3dArray, HandDetection_3dArray, PersonDetection_3dArray
from visualization_msgs.msg import Marker

from openpose_ros_pkg.params.parameters import parameter_fields
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import PERSONS_QUEUE
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker
from skeleton_extract_3d.node_params import VisualizationSettings
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.show.landmark_markers import LandmarkMarkers
from skeleton_extract_3d.show.markers import LIMB_NAMESPACES, MarkerParams, PeopleMarkers

_NAMESPACE = 'openpose_ros/skeleton_3d'
# A person has up to four markers on each topic, without spheres of sigma.
_MARKERS_QUEUE = 4 * PERSONS_QUEUE


class Visualization:
    """Turns the array of people of each frame into markers: a few per person, each with a namespace of its own.

    Those of hands and faces have topics of their own, and are made while these have subscribers.
    """

    def __init__(self, settings: VisualizationSettings) -> None:
        self._markers = PeopleMarkers(settings.markers)
        self._hand_markers, self._face_markers = LandmarkMarkers(settings.markers), LandmarkMarkers(settings.markers)
        self._health = Health()
        self._live = LiveParameters(settings, [field.name for field in parameter_fields(MarkerParams)],
                                    self._reconfigure)
        demand = Demand(settings.demand.lazy, self._health)
        self._joints = demand.advertise(f'{_NAMESPACE}/visualization_markers', Marker, _MARKERS_QUEUE)
        self._limbs = demand.advertise(f'{_NAMESPACE}/visualization_skeleton', Marker, _MARKERS_QUEUE)
        self._hands = demand.advertise(f'{_NAMESPACE}/visualization_hands', Marker, _MARKERS_QUEUE)
        self._faces = demand.advertise(f'{_NAMESPACE}/visualization_faces', Marker, _MARKERS_QUEUE)
        self._worker = NewestWinsWorker(self._process, self._health.frame_failed, 'visualization')
        self._health.show(lambda: {'frames skipped': str(self._worker.replaced)})
        people = InputSubscriber(f'{_NAMESPACE}/detected_poses_3d', PersonDetection_3dArray)
        people.registerCallback(self._worker.submit)
        hands = self._input('detected_hands_3d', HandDetection_3dArray, self._process_hands)
        faces = self._input('detected_faces_3d', FaceDetection_3dArray, self._process_faces)
        demand.read(people, hands, faces, only_for={people: (self._joints, self._limbs), hands: (self._hands,),
                                                    faces: (self._faces,)})
        params = settings.markers
        introduce(demand.inputs, markers=f'spheres of {params.joint_scale:g} m, limbs of {params.skeleton_scale:g} m, '
                                         f'trails of {params.trail_seconds:g} s, lifetime {params.lifetime:g} s')

    def _input(self, topic: str, kind: Type[Any], process: Callable[[Any], None]) -> InputSubscriber:
        """Return an input, silent without `hands` or `face`, whose messages are processed in a thread of its own."""
        source = InputSubscriber(f'{_NAMESPACE}/{topic}', kind, optional=True)
        source.registerCallback(NewestWinsWorker(process, self._health.frame_failed, topic).submit)
        return source

    def _reconfigure(self, settings: VisualizationSettings) -> None:
        for markers in (self._markers, self._hand_markers, self._face_markers):
            markers.reconfigure(settings.markers)

    def _process(self, message: PersonDetection_3dArray) -> None:
        people = convert.people_from_array(message)
        for marker in self._markers.update(people, message.header.stamp.to_sec(), message.header.frame_id):
            publisher = self._limbs if marker.ns in LIMB_NAMESPACES else self._joints
            publisher.publish(convert.marker_to_message(marker, message.header))
        self._health.frame_done(message.header.stamp)

    def _process_hands(self, message: HandDetection_3dArray) -> None:
        hands = convert.hands_from_array(message)
        for marker in self._hand_markers.hands(hands, message.header.stamp.to_sec()):
            self._hands.publish(convert.marker_to_message(marker, message.header))

    def _process_faces(self, message: FaceDetection_3dArray) -> None:
        faces = convert.faces_from_array(message)
        for marker in self._face_markers.faces(faces, message.header.stamp.to_sec()):
            self._faces.publish(convert.marker_to_message(marker, message.header))


def main() -> None:
    """Run the visualization node."""
    run_node('skeleton_extract_3d_visualization_node', VisualizationSettings, Visualization)
