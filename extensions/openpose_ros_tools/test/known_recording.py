"""A recording of two people who walk, and a detection that knows them: for the tests of process_bag.

A module of its own, so that processes that the tests start can make the detection.
"""
import os
import signal
import sys
import time
import zlib
from functools import lru_cache
from pathlib import Path
from typing import Any, Callable, Container, List, Optional, Tuple

import cv2
import genpy
import numpy as np
import rosbag
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_pkg.detect.detection import ImageFrame, KnownPeople
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros.convert import camera_to_message, cloud_to_message, depth_to_message
from synthetic_scene import Frame, Person, Room, pinhole, render, walking

FRAMES, RATE, BEGIN = 12, 15.0, 1_600_000_000
FRAME_ID = 'camera_optical_frame'
IMAGE, COMPRESSED, DEPTH, POINTS = '/cam/image_color', '/cam/image_color/compressed', '/cam/image_depth', '/cam/points'
INFO = '/cam/camera_info'
CAMERA = pinhole(320, 180)
# The last frames show no person.
EMPTY = 2
# x and z of a second camera, which looks along -x of the first one [m].
ASIDE = (3.0, 3.05)


@lru_cache(maxsize=None)
def frame(number: int, aside: bool = False) -> Frame:
    """Return a frame and the truth about it; `aside`: of the second camera."""
    places = [(x + 0.04 * number, z) for x, z in ((-0.9, 2.8), (0.5, 3.3))]
    if aside:
        places = [(z - ASIDE[1], ASIDE[0] - x) for x, z in places]
    people = [Person(i, x, z, walking(0.4 * number + i), yaw=-np.pi / 2 * aside) for i, (x, z) in enumerate(places)]
    return render(CAMERA, people if number < FRAMES - EMPTY else [], Room(wall=5.0), seed=number + FRAMES * aside)


def stamp_of(number: int) -> genpy.Time:
    """Return the stamp of a frame."""
    return genpy.Time.from_sec(BEGIN) + genpy.Duration.from_sec(number / RATE)


def write_recording(path: Path, *, image: Optional[str] = IMAGE, points: Optional[str] = DEPTH,
                    info: str = INFO, without_image: Container[int] = (), without_points: Container[int] = (),
                    offset: float = 0.0, others: Callable[[rosbag.Bag], Any] = lambda bag: None) -> Path:
    """Write a bag: images, and points some time after them.

    Args:
        points: DEPTH, also compressed, or POINTS, with camera info; None: images alone.
        without_image, without_points: frames that lack one.
        offset: of the stamps of the points [s].
        others: writes what else there is.
    """
    with rosbag.Bag(str(path), 'w') as bag:
        others(bag)
        for number in range(FRAMES):
            stamp = stamp_of(number)
            header, recorded = Header(number, stamp, FRAME_ID), stamp + genpy.Duration.from_sec(0.01)
            if image is not None and number not in without_image:
                bag.write(image, _image(image, number, header), recorded)
            if points is not None and number not in without_points:
                header = Header(number, stamp + genpy.Duration.from_sec(offset), FRAME_ID)
                recorded += genpy.Duration.from_sec(0.02)
                bag.write(info, camera_to_message(CAMERA, header), recorded)
                bag.write(points, _points(points, number, header), recorded)
    return path


def _image(topic: str, number: int, header: Header) -> Any:
    if topic.endswith('compressed'):
        return CompressedImage(header, 'png', cv2.imencode('.png', frame(number).bgr)[1].tobytes())
    return bgr_to_image(frame(number).bgr, header)


def _points(topic: str, number: int, header: Header) -> Any:
    if topic == DEPTH:
        return depth_to_message(frame(number).depth, header)
    if topic.endswith('compressedDepth'):
        png = cv2.imencode('.png', frame(number).depth)[1].tobytes()
        return CompressedImage(header, '16UC1; compressedDepth', bytes(12) + png)
    return cloud_to_message(cloud_from_depth(frame(number).depth * 0.001, CAMERA, frame(number).bgr), header)


class KnownFrames:
    """Tells exactly the people of a frame, and notes in a file which frames it was asked about.

    At a frame the process gets a signal of its own, as long as the file `died` does not exist.
    """

    def __init__(self, notes: Optional[Path] = None, dies_at: Optional[int] = None, died: Optional[Path] = None,
                 of: signal.Signals = signal.SIGKILL, slow: float = 0.0) -> None:
        self._notes, self._dies_at, self._died, self._of, self._slow = notes, dies_at, died, of, slow
        self._known = {zlib.crc32(frame(number, aside).bgr.tobytes()): (number, aside)
                       for number in range(FRAMES) for aside in (False, True)}

    def people(self, image: ImageFrame) -> People2D:
        """Return the people of a frame."""
        number, aside = self._known[zlib.crc32(np.ascontiguousarray(image.bgr).tobytes())]
        if number == self._dies_at and not self._died.exists():
            self._died.touch()
            os.kill(os.getpid(), self._of)
        if self._notes is not None:
            with self._notes.open('a') as handle:
                handle.write(f'{number}\n')
        time.sleep(self._slow)
        people = frame(number, aside).people
        keypoints = people.keypoints.copy()
        keypoints[frame(number, aside).vis != 2] = (np.nan, np.nan, 0)
        return People2D(COCO_18, keypoints, people.scores, np.full(len(people), -1))


def known_people(*_params: Any, **values: Any) -> KnownPeople:
    """Make the detection, whatever the parameters are; for functools.partial."""
    return KnownPeople(COCO_18, KnownFrames(**values).people)


def positions(array: Any) -> np.ndarray:
    """Return the joints of people in space, (N, 18, 3) [m]."""
    return np.array([[(part.x, part.y, part.z) for part in (getattr(person, joint) for joint in COCO_18.joints)]
                     for person in array.persons]).reshape(-1, 18, 3)


def messages(path: Path, topic: str) -> List[Tuple[Any, genpy.Time]]:
    """Return the messages of a topic with their times."""
    with rosbag.Bag(str(path)) as bag:
        return [(message, time) for _, message, time in bag.read_messages(topics=[topic])]
