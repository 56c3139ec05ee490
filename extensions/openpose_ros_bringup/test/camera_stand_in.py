"""Publishes the shipped sequence as the driver of a camera would: on its topics, in its encodings, frame and format."""
import json
import struct
import threading
import time
from pathlib import Path
from typing import Any, Dict, List, Tuple

import cv2
import numpy as np
import roslib.packages
import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.params.camera_presets import CameraPreset
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence, play_order
from skeleton_extract_3d.ros.convert import camera_to_message, cloud_to_message

# Width of the images where the camera's are larger, and their rate [Hz].
WIDTH, RATE = 640, 5.0
# K of rectified images and P of others differ from the calibration of the images by this factor: to take them is wrong.
OTHER = 0.8
VISIBLE = 2
_NUMBERS = 1000  # more than there are frames
_CODES = {'rgb8': cv2.COLOR_BGR2RGB, 'bgr8': None, 'bgra8': cv2.COLOR_BGR2BGRA}


class StandIn:
    """Publishes frames from `start` to `stop`; the last digits of their stamps are their numbers, see `number_of`.

    Attributes:
        sent: number of frames that were published.
        xyz: of each frame the joints of its people in the frame of the camera, (P, 18, 3) [m]; NaN: hidden.
        uv: the same in the image, (P, 18, 2) [px].
    """

    def __init__(self, preset: CameraPreset) -> None:
        self._preset, self.sent = preset, 0
        folder = Path(roslib.packages.get_pkg_dir('skeleton_extract_3d')) / 'demo/cross'
        self._sequence = RgbdSequence.read(folder)
        self._camera, self._scale, self._above = _scaled(self._sequence.camera, preset)
        self.xyz, uv = _truth(folder, 'xyz'), _truth(folder, 'uv')
        self.uv = [(joints + 0.5) * self._scale - 0.5 + (0, self._above) for joints in uv]
        self._publishers: Dict[str, rospy.Publisher] = {}
        self._kept: Dict[int, Dict[str, Any]] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._play, daemon=True)

    def start(self) -> None:
        """Begin to publish."""
        kinds = {'image': Image, 'depth': Image, 'points': PointCloud2, 'camera_info': CameraInfo}
        self._publishers = {role: _publisher(self._preset, role, kind) for role, kind in kinds.items()
                            if self._preset.topic(role)}
        self._thread.start()

    @property
    def listeners(self) -> int:
        """Number of topics that have a subscriber."""
        return sum(publisher.get_num_connections() > 0 for publisher in self._publishers.values())

    def stop(self) -> None:
        """End, and take the topics away."""
        self._ended.set()
        self._thread.join()
        for publisher in self._publishers.values():
            publisher.unregister()

    def _play(self) -> None:
        for number in play_order(len(self._sequence), 'forth_and_back'):
            if self._ended.wait(1.0 / RATE) or rospy.is_shutdown():
                return
            nanoseconds = time.time_ns()
            stamp = rospy.Time(0, nanoseconds - nanoseconds % _NUMBERS + number)
            self.sent += 1
            if number not in self._kept:
                self._kept[number] = self._messages(number)
            for role, publisher in self._publishers.items():
                message = self._kept[number][role]
                message.header.stamp = stamp
                publisher.publish(message)

    def _messages(self, number: int) -> Dict[str, Any]:
        frame, preset, header = self._sequence.frame(number), self._preset, Header(frame_id=self._preset.frame)
        bgr = self._fitted(frame.bgr, cv2.INTER_AREA)
        depth = self._fitted(frame.depth, cv2.INTER_NEAREST)
        makers = {'image': lambda: _image(bgr, preset, header), 'depth': lambda: _depth(depth, preset, header),
                  'points': lambda: cloud_to_message(cloud_from_depth(depth * 0.001, self._camera, bgr), header),
                  'camera_info': lambda: self._info(header)}
        return {role: makers[role]() for role in self._publishers}

    def _fitted(self, picture: np.ndarray, interpolation: int) -> np.ndarray:
        """Return a picture as small as the camera's, with empty rows above and below."""
        picture = cv2.resize(picture, None, fx=self._scale, fy=self._scale, interpolation=interpolation)
        below = self._camera.height - picture.shape[0] - self._above
        return cv2.copyMakeBorder(picture, self._above, below, 0, 0, cv2.BORDER_CONSTANT)

    def _info(self, header: Header) -> CameraInfo:
        info = camera_to_message(self._camera, header)
        wrong = np.diag([OTHER, OTHER, 1.0])
        if self._preset.rectified:
            info.K = (wrong @ np.reshape(info.K, (3, 3))).ravel().tolist()
        else:
            info.P = (wrong @ np.reshape(info.P, (3, 4))).ravel().tolist()
        return info


def number_of(stamp: rospy.Time) -> int:
    """Return the number of the frame with this stamp."""
    return stamp.to_nsec() % _NUMBERS


def _scaled(camera: CameraModel, preset: CameraPreset) -> Tuple[CameraModel, float, int]:
    """Return the camera of the images, the factor of their size, and the number of rows above the picture."""
    width = min(preset.size[0], WIDTH)
    scale = width / camera.width
    inner = camera.scaled(width, round(camera.height * scale))
    height = round(width * preset.size[1] / preset.size[0])
    above = (height - inner.height) // 2
    matrix = inner.matrix.copy()
    matrix[1, 2] += above
    return CameraModel(width, height, matrix, inner.distortion_model, inner.distortion), scale, above


def _truth(folder: Path, key: str) -> List[np.ndarray]:
    """Return joints of the people of each frame; NaN: hidden."""
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    frames = []
    for frame in truth['frames']:
        people = np.array([person[key] for person in frame['people']], float)[:, order]
        people[np.array([person['vis'] for person in frame['people']])[:, order] != VISIBLE] = np.nan
        frames.append(people)
    return frames


def _publisher(preset: CameraPreset, role: str, kind: Any) -> rospy.Publisher:
    transport = {'image': preset.image_transport, 'depth': preset.depth_transport}.get(role, 'raw')
    if transport == 'raw':
        return rospy.Publisher(preset.topic(role), kind, queue_size=1)
    return rospy.Publisher(f'{preset.topic(role)}/{transport}', CompressedImage, queue_size=1)


def _image(bgr: np.ndarray, preset: CameraPreset, header: Header) -> Any:
    if preset.image_transport == 'compressed':
        return CompressedImage(header, 'bgr8; jpeg compressed bgr8', cv2.imencode('.jpg', bgr)[1].tobytes())
    code = _CODES[preset.image_encoding]
    if code is None:
        return bgr_to_image(bgr, header)
    picture = cv2.cvtColor(bgr, code)
    return Image(header, *picture.shape[:2], preset.image_encoding, 0, picture.strides[0], picture.tobytes())


def _depth(depth: np.ndarray, preset: CameraPreset, header: Header) -> Any:
    """Return the depth image of a (H, W) uint16 one [mm]; 32FC1 has NaN and, above, infinity where it is missing."""
    if preset.depth_transport == 'compressedDepth':
        return CompressedImage(header, '16UC1; compressedDepth png',
                               struct.pack('<iff', 0, 0, 0) + cv2.imencode('.png', depth)[1].tobytes())
    if preset.depth_encoding == '32FC1':
        depth = np.where(depth > 0, depth * 0.001, np.nan).astype('<f4')
        depth[:5] = np.inf
    return Image(header, *depth.shape, preset.depth_encoding, 0, depth.strides[0], depth.tobytes())
