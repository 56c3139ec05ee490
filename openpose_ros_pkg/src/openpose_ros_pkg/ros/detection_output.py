"""Publish and save the people in images, with their hands and faces, as the parameters of the detection say."""
import functools
import itertools
import time
from typing import Dict, List, Optional

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from openpose_ros_msgs.msg import PersonDetection

from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.keypoint_scale import scale_keypoints
from openpose_ros_pkg.output.recorder import REFUSE, Recorder
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.people_publisher import LANDMARK_STAGE, Drawing, LandmarkPublisher, PeoplePublisher
from openpose_ros_pkg.ros.timing_report import TimingReport


class DetectionOutput:
    """Where the people in images go, besides the clients of the service; for one thread.

    `source` of each `ImageFrame` is a message with the header of the image; `whole_body`: whether people have the
    points of a network for whole bodies.
    """

    def __init__(self, namespace: str, settings: ServiceSettings, whole_body: bool, health: Health,
                 timing: TimingReport, demand: Demand) -> None:
        self._settings, self._timing = settings, timing
        self._recorder: Optional[Recorder] = None
        if settings.save.active:
            self._recorder = self._make_recorder(health)
        health.show(self._recorder_counters)
        self._publisher: Optional[PeoplePublisher] = None
        if settings.publishing.publish_results:
            self._publisher = PeoplePublisher(namespace, settings.draw, settings.images, health, timing, demand)
        self._landmarks: Optional[LandmarkPublisher] = None
        if self._publisher is not None or self._recorder is not None:
            params = settings.detector
            detector = create_landmark_detector(settings.landmarks, params.backend, params.detector.model_folder,
                                                whole_body)
            self._landmarks = LandmarkPublisher(namespace if self._publisher is not None else None, detector,
                                                settings.landmarks, params.detector.target_rate, health, demand)

    def _make_recorder(self, health: Health) -> Recorder:
        recorder = Recorder(self._settings.save, self._settings.draw, self._settings.keypoint_scale, existing=REFUSE)
        recorder.on_fault = functools.partial(health.warn, 'frame not saved')
        self._numbers = itertools.count(recorder.next_number())
        health.show_lasting(recorder.fault, DiagnosticStatus.ERROR)
        rospy.on_shutdown(recorder.close)
        return recorder

    def publish(self, frame: ImageFrame, people: People2D) -> None:
        """Publish the people of an image."""
        begin, header = time.monotonic(), frame.source.header
        if self._publisher is not None:
            self._publisher.publish(people, header, self._scaled(people, frame))
        self._timing.add('publish', time.monotonic() - begin)

    def complete(self, frame: ImageFrame, people: People2D) -> None:
        """Find and publish their hands and faces, draw and save them, where that is wanted."""
        begin = time.monotonic()
        landmarks = self._find_landmarks(people, frame)
        self._timing.add(LANDMARK_STAGE, time.monotonic() - begin)
        if self._publisher is not None:
            self._publisher.draw(Drawing(frame.source.header, frame.bgr, people, None, landmarks))
        if self._recorder is not None:
            self._recorder.submit(next(self._numbers), frame.bgr, people, landmarks)

    def _find_landmarks(self, people: People2D, frame: ImageFrame) -> Optional[Landmarks2D]:
        """Return hands and faces of the people of an image, after publishing them; None: they are not wanted."""
        if self._landmarks is None:
            return None
        used = self._recorder is not None or (self._publisher is not None and self._publisher.draws)
        asked = self._landmarks.look(used, used)
        if not (asked.hands or asked.face):
            return None
        found = self._landmarks.detector.detect(frame.bgr, people, None, frame.camera, frame.stamp,
                                                self._landmarks.seconds)
        self._landmarks.publish(found, frame.source.header)
        return found

    def _scaled(self, people: People2D, frame: ImageFrame) -> Optional[List[PersonDetection]]:
        """Return the messages with coordinates as `keypoint_scale` wants them; None: in pixels."""
        scale = self._settings.keypoint_scale
        if scale.keypoint_scale == 0:
            return None
        return convert.people_to_messages(people, frame.source.header,
                                          scale_keypoints(people.keypoints, frame.size, scale))

    def _recorder_counters(self) -> Dict[str, str]:
        counters = self._recorder.counters if self._recorder is not None else {}
        return {f'saving, {key}': str(number) for key, number in counters.items()}

    def reconfigure(self, settings: ServiceSettings) -> None:
        """Take new parameters; they hold from the next frame on."""
        self._settings = settings
        if self._landmarks is not None:
            self._landmarks.reconfigure(settings.landmarks)
        if self._publisher is not None:
            self._publisher.reconfigure(settings.draw, settings.images)
        if self._recorder is not None:
            self._recorder.reconfigure(settings.draw)
