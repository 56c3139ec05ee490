"""Messages of a camera and files of its images, turned into each other."""
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import cv2
import genpy
import numpy as np
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header

from openpose_ros_pkg.calibration import Calibration
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.params.camera_presets import CLOUD, COMPRESSED
from openpose_ros_pkg.ros.convert import (
    any_image_to_bgr,
    bgr_to_image,
    calibration_to_message,
    compressed_depth_to_image,
    image_to_pixels,
    order_of_file,
    pixels_to_image,
)
from openpose_ros_pkg.ros.topics import DEPTH_ENCODINGS, TOPICS
from openpose_ros_pkg.stream.image_decoding import decode_image, image_kind, read_file
from openpose_ros_tools.images import image_files
from openpose_ros_tools.images.image_files import MILLIMETRES
from skeleton_extract_3d.points.camera import check_same_aspect
from skeleton_extract_3d.points.rgbd_folder import RgbdFolder
from skeleton_extract_3d.ros.convert import cloud_from_message

_SUFFIXES = {'jpeg': '.jpg', 'png': '.png'}


Moment = Tuple[int, Dict[str, Tuple[int, Path]]]


@dataclass(frozen=True)
class FolderMessages:
    """Makes the messages of an RGB-D folder; several threads may call it."""

    folder: RgbdFolder
    size: Tuple[int, int]  # width and height of the images of its first stream
    namespace: str  # of the topics
    frame_id: str  # of all headers
    calibration: Optional[Calibration]  # of the camera, or None
    depth_scale: float = MILLIMETRES  # units of 16-bit depth per metre
    compressed: bool = False  # CompressedImage in place of Image for the colour images

    def moments(self) -> List[Moment]:
        """Return stamps, ascending, and their images: by stream the number of an image in it and its path."""
        by_stamp: Dict[int, Dict[str, Tuple[int, Path]]] = {}
        for stream, files in self.folder.streams.items():
            for number, file in enumerate(files):
                by_stamp.setdefault(file.stamp, {})[stream] = number, file.path
        return sorted(by_stamp.items())

    def messages(self, moment: Moment) -> Tuple[List[Tuple[str, genpy.Message]], List[str]]:
        """Return topics and messages of one stamp in the order of writing, and reasons of files that failed to decode.

        Raises:
            BadInputError: an image has another size than the first one.
        """
        made: Dict[str, genpy.Message] = {}
        failed = []
        stamp, files = moment
        for stream, (number, path) in files.items():
            header = Header(seq=number, stamp=genpy.Time(0, stamp), frame_id=self.frame_id)
            try:
                content, pixels = _read_image(stream, path)
            except BadInputError as error:
                failed.append(str(error))
                continue
            self._check(stream, path, pixels)
            if stream == 'depth':
                made['depth'] = self._depth_message(pixels, header)
            else:
                made['image'] = self._image_message(pixels, content, path, header)
            if self.calibration is not None:
                made.setdefault('camera_info', calibration_to_message(self.calibration, header))
        return [(f'{self.namespace}/{name}' + '/compressed' * (key == 'image' and self.compressed), made[key])
                for key, name in TOPICS.items() if key in made], failed

    def _image_message(self, pixels: np.ndarray, content: bytes, path: Path, header: Header) -> genpy.Message:
        if not self.compressed:
            return bgr_to_image(pixels, header)
        kind, plain = image_kind(content), decode_image(content, str(path), cv2.IMREAD_UNCHANGED)
        if kind is None or plain.dtype != np.uint8 or plain.shape[2:] != (3,):  # the format is to tell what is in it
            content, kind = image_files.encode_image(pixels, '.png', str(path)), 'png'
        return CompressedImage(header=header, format=f'bgr8; {kind} compressed bgr8', data=content)

    def _depth_message(self, depth: np.ndarray, header: Header) -> genpy.Message:
        scale = self.depth_scale
        if depth.dtype != np.float32 and scale == MILLIMETRES:
            return pixels_to_image(depth, '16UC1', header)
        metres = depth if depth.dtype == np.float32 else image_files.depth_to_metres(depth, scale)
        return pixels_to_image(metres, '32FC1', header)

    def _check(self, stream: str, path: Path, pixels: np.ndarray) -> None:
        size, main = (pixels.shape[1], pixels.shape[0]), next(iter(self.folder.streams))
        if stream == main and size != self.size:
            raise BadInputError(f'{path} is {size_text(size)}, expected {size_text(self.size)} as the first image')
        check_same_aspect(str(path), size, f'the first {main} image', self.size)


def first_size(folder: RgbdFolder) -> Tuple[int, int]:
    """Return width and height of the first colour image that can be decoded, of depth where there is no colour.

    Raises:
        BadInputError: none can be decoded.
    """
    stream, files = next(iter(folder.streams.items()))
    reason: Optional[BadInputError] = None
    for _, path in files:
        try:
            pixels = _read_image(stream, path)[1]
            return pixels.shape[1], pixels.shape[0]
        except BadInputError as error:
            reason = reason or error
    raise BadInputError(f'none of the {len(files)} {stream} images can be decoded: {reason}')


def file_of_message(stream: str, message: genpy.Message, depth_scale: Optional[float], source: str
                    ) -> Tuple[str, bytes]:
    """Return suffix and content of the file of an image message, or of the depth in a cloud.

    Args:
        depth_scale: units per metre of 16-bit depth; None: mm stay, and metres become a TIFF.
        source: of the message, for errors.

    Raises:
        BadInputError: the message contains no image; its text does not begin with `source`.
        ParameterError: depth does not fit the scale.
    """
    if stream == 'depth':
        return _depth_file(_depth_of(message), depth_scale, source)
    if message._type == COMPRESSED:
        kind = image_kind(message.data)
        if kind is None:
            raise BadInputError(f"{len(message.data)} bytes of format '{message.format}' are neither JPEG nor PNG")
        if order_of_file(message.format) == 'bgr8':
            return _SUFFIXES[kind], message.data
    return '.png', image_files.encode_image(any_image_to_bgr(message), '.png', source)


def _depth_file(depth: np.ndarray, depth_scale: Optional[float], source: str) -> Tuple[str, bytes]:
    if depth_scale is not None:
        metres = depth if depth.dtype == np.float32 else image_files.depth_to_metres(depth, MILLIMETRES)
        try:
            depth = image_files.depth_to_units(metres, depth_scale, source)
        except BadInputError as error:
            raise ParameterError(str(error)) from error
    suffix = '.tiff' if depth.dtype == np.float32 else '.png'
    return suffix, image_files.encode_image(depth, suffix, source)


def _depth_of(message: genpy.Message) -> np.ndarray:
    """Return the depth in a message, (H, W) uint16 [mm] or float32 [m]."""
    if message._type == CLOUD:
        cloud = cloud_from_message(message)
        v, u = np.mgrid[:cloud.height, :cloud.width]
        return cloud.depths(u, v).astype(np.float32)
    if message._type == COMPRESSED:
        return image_to_pixels(compressed_depth_to_image(message))[0]
    depth, _ = image_to_pixels(message)
    if depth.dtype not in (np.uint16, np.float32):
        raise BadInputError(f"depth has encoding '{message.encoding}', expected {', '.join(DEPTH_ENCODINGS)}")
    return depth


def _read_image(stream: str, path: Path) -> Tuple[bytes, np.ndarray]:
    content = read_file(path)
    return content, (image_files.decode_depth if stream == 'depth' else decode_image)(content, str(path))


def size_text(size: Sequence[int]) -> str:
    """Return width and height as text."""
    return f'{size[0]} x {size[1]}'
