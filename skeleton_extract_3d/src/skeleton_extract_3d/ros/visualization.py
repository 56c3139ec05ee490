"""The visualization node: joints, hands and faces in space to RViz markers."""
from typing import Any, Callable, List, Tuple, Type

import rospy
from openpose_ros_msgs.msg import FaceDetection_3dArray, HandDetection_3dArray, PersonDetection_3dArray
from visualization_msgs.msg import Marker

from openpose_ros_pkg.params.parameters import parameter_fields
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import PERSONS_QUEUE
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from skeleton_extract_3d.node_params import VisualizationSettings
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.show.markers import (
    LIMB_NAMESPACES,
    MarkerParams,
    MarkerSpec,
    ShownMarkers,
    face_markers,
    hand_markers,
    people_markers,
)

_NAMESPACE = 'openpose_ros/skeleton_3d'
# A person has up to four markers on each topic.
_MARKERS_QUEUE = 4 * PERSONS_QUEUE


class Visualization:
    """Turns the people of each frame into markers: a few per person, each with a namespace of its own.

    Those of hands and faces have topics of their own, and are made while these have subscribers.
    """

    def __init__(self, settings: VisualizationSettings) -> None:
        self._params, self._health = settings.markers, Health()
        self._live = LiveParameters(settings, [field.name for field in parameter_fields(MarkerParams)],
                                    self._reconfigure)
        demand = Demand(settings.demand.lazy, self._health)
        markers, limbs, hands, faces = (demand.advertise(f'{_NAMESPACE}/visualization_{name}', Marker, _MARKERS_QUEUE)
                                        for name in ('markers', 'skeleton', 'hands', 'faces'))
        inputs = {
            self._input('detected_poses_3d', PersonDetection_3dArray,
                        lambda message: people_markers(convert.people_from_array(message), self._params),
                        (markers, limbs)): (markers, limbs),
            self._input('detected_hands_3d', HandDetection_3dArray,
                        lambda message: hand_markers(convert.hands_from_array(message), self._params),
                        (hands, hands)): (hands,),
            self._input('detected_faces_3d', FaceDetection_3dArray,
                        lambda message: face_markers(convert.faces_from_array(message), self._params),
                        (faces, faces)): (faces,)}
        demand.read(*inputs, only_for=inputs)
        introduce(demand.inputs, markers=f'spheres of {self._params.joint_scale:g} m, limbs of '
                                         f'{self._params.skeleton_scale:g} m, lifetime {self._params.lifetime:g} s')

    def _input(self, topic: str, kind: Type[Any], make: Callable[[Any], List[MarkerSpec]],
               publishers: Tuple[rospy.Publisher, rospy.Publisher]) -> InputSubscriber:
        """Return an input whose newest message is shown by two publishers, of joints and of limbs."""
        shown = ShownMarkers()

        def process(message: Any) -> None:
            stamp = message.header.stamp
            for marker in shown.replaced(make(message), stamp.to_sec(), self._params.lifetime):
                publishers[marker.ns in LIMB_NAMESPACES].publish(convert.marker_to_message(marker, message.header))
            if kind is PersonDetection_3dArray:
                self._health.frame_done(stamp)

        # silent without `hands` or `face`
        source = InputSubscriber(f'{_NAMESPACE}/{topic}', kind, optional=kind is not PersonDetection_3dArray)
        worker = NewestWinsWorker(process, self._health.frame_failed, topic)
        source.registerCallback(worker.submit)
        if not source.optional:
            self._health.show(lambda: {'frames skipped': str(worker.replaced)})
        return source

    def _reconfigure(self, settings: VisualizationSettings) -> None:
        self._params = settings.markers


def main() -> None:
    """Run the visualization node."""
    run_node('skeleton_extract_3d_visualization_node', VisualizationSettings, Visualization)
