"""The people node: detection service and extractors in one process, so that no image is sent from one to the other."""
from dataclasses import replace
from typing import List

import rospy

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.params.nodes import LIVE_PARAMETERS as LIVE_IN_DETECTION
from openpose_ros_pkg.ros.demand import Demand, in_camera
from openpose_ros_pkg.ros.detection_service import STAGES as DETECTION_STAGES
from openpose_ros_pkg.ros.detection_service import DetectionService
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import check_topic_name, introduce, run_node
from openpose_ros_pkg.ros.timing_report import TimingReport
from skeleton_extract_3d.node_params import LIVE_PARAMETERS, PeopleSettings
from skeleton_extract_3d.ros.camera_inputs import settle_camera
from skeleton_extract_3d.ros.extractor import NAMESPACE, STAGES, Extractor, Networks, bodies_of

# Service of the detection, as that of openpose_ros_node_3d.
SERVICE = 'detect_poses_3d'


class PeopleNode:
    """Finds people in the images of one camera or several and in space, and serves the detection to others.

    Cameras and clients take turns with the networks, each camera with its newest image.

    Raises:
        ParameterError: `image_topic` is set, or `cameras` are no namespaces.
    """

    def __init__(self, settings: PeopleSettings) -> None:
        cameras = settings.cameras.names
        for camera in cameras if cameras != ('',) else ():
            check_topic_name('cameras', camera)
        if len(set(cameras)) < len(cameras):
            raise ParameterError(f"parameter 'cameras' names one twice: {' '.join(cameras)}", 'cameras')
        networks = settings.detection.detector  # their target rate is that of all cameras together
        networks = replace(networks, detector=replace(
            networks.detector, target_rate=networks.detector.target_rate * len(cameras)))
        settings = replace(settings, detection=replace(settings.detection, detector=networks),
                           extraction=settle_camera(settings.extraction, cameras[0]))
        detection, extraction = settings.detection, settings.extraction
        if detection.stream.image_topic:
            raise ParameterError("parameter 'image_topic' has to be empty in this node: its images come on ~image",
                                 'image_topic')
        health, timing = Health(), TimingReport(STAGES, result='total')
        demand = Demand(extraction.is_lazy and not detection.save.active, health)
        requests = TimingReport(DETECTION_STAGES, result='total', topic='~detection/timing')
        self._service = DetectionService(SERVICE, NAMESPACE, detection, health, requests, demand)
        self._service.warm_up()
        self._bodies = bodies_of(extraction.extractor, networks.backend, networks.detector.model_folder)
        self._extractors: List[Extractor] = []
        inputs: List[InputSubscriber] = []
        for camera in cameras:
            if camera:
                health = Health(name=in_camera(camera, rospy.get_name()))
                demand = Demand(extraction.is_lazy and not detection.save.active, health, camera)
                timing = TimingReport(STAGES, result='total', topic=demand.resolve('~timing'))
            health.show(timing.medians)
            extractor = self._extractor(settings, camera, health, timing, demand)
            self._extractors.append(extractor)
            inputs += demand.inputs
        self._live = LiveParameters(settings, {*LIVE_IN_DETECTION, *LIVE_PARAMETERS},
                                    lambda new: self._service.loop.call(lambda: self._reconfigure(new)))
        introduce(inputs, **self._service.description, **extractor.describe(extraction.estimator))
        rospy.loginfo('Initialization Successful!')

    def _extractor(self, settings: PeopleSettings, camera: str, health: Health, timing: TimingReport, demand: Demand
                   ) -> Extractor:
        params, landmarks = settings.detection.detector, settings.extraction.landmarks
        detector = create_landmark_detector(landmarks, params.backend, params.detector.model_folder,
                                            self._service.whole_body)
        service = self._service
        networks = Networks(service.detection, service.name, detector, service.loop, service.output,
                            params.detector.target_rate, camera.strip('/'), settings.detection.tracking, self._bodies)
        return Extractor(settings.extraction, networks, health, timing, demand)

    def _reconfigure(self, settings: PeopleSettings) -> None:
        self._service.reconfigure(settings.detection)
        for extractor in self._extractors:
            extractor.reconfigure(settings.extraction)


def main() -> None:
    """Run the people node."""
    run_node('skeleton_extract_3d_node', PeopleSettings, PeopleNode)
