"""The people node: detection service and extractor in one process, so that no image is sent from one to the other."""
import rospy

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.params.nodes import LIVE_PARAMETERS as LIVE_IN_DETECTION
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.detection_service import STAGES as DETECTION_STAGES
from openpose_ros_pkg.ros.detection_service import DetectionService
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.timing_report import TimingReport
from skeleton_extract_3d.node_params import LIVE_PARAMETERS, PeopleSettings
from skeleton_extract_3d.ros.extractor import NAMESPACE, STAGES, Extractor
from skeleton_extract_3d.ros.landmark_stage import LandmarkFinder

# Service of the detection, as that of openpose_ros_node_3d.
SERVICE = 'detect_poses_3d'


class PeopleNode:
    """Finds people in the images of a camera and in space, and serves the detection to others.

    Raises:
        ParameterError: `image_topic` is set.
    """

    def __init__(self, settings: PeopleSettings) -> None:
        detection, extraction = settings.detection, settings.extraction
        if detection.stream.image_topic:
            raise ParameterError("parameter 'image_topic' has to be empty in this node: its images come on ~image",
                                 'image_topic')
        health, timing = Health(), TimingReport(STAGES, result='total')
        health.show(timing.medians)
        demand = Demand(extraction.is_lazy and not detection.save.active, health)
        requests = TimingReport(DETECTION_STAGES, result='total', topic='~detection/timing')
        self._service = DetectionService(SERVICE, NAMESPACE, detection, health, requests, demand)
        networks = detection.detector
        landmarks = create_landmark_detector(extraction.landmarks, networks.backend, networks.detector.model_folder)
        self._extractor = Extractor(extraction, self._service, LandmarkFinder(landmarks, networks.detector.target_rate),
                                    health, timing, demand)
        # a thread within a network would end the program with an abort
        rospy.on_shutdown(self._extractor.stop)
        self._live = LiveParameters(settings, {*LIVE_IN_DETECTION, *LIVE_PARAMETERS}, self._reconfigure)
        introduce(demand.inputs, **self._service.description, **self._extractor.describe(extraction.estimator))
        rospy.loginfo('Initialization Successful!')

    def _reconfigure(self, settings: PeopleSettings) -> None:
        self._service.reconfigure(settings.detection)
        self._extractor.reconfigure(settings.extraction)


def main() -> None:
    """Run the people node."""
    run_node('skeleton_extract_3d_node', PeopleSettings, PeopleNode)
