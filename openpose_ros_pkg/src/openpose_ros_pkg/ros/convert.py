"""Turn messages into core types and back: the only place of this package that knows both."""
import dataclasses
import functools
import struct
from typing import Any, List, Optional, Sequence, Tuple, TypeVar, Union

import cv2
import numpy as np
from cv_bridge import CvBridge, CvBridgeError, getCvType
from openpose_ros_msgs.msg import (
    BodypartDetection,
    FaceDetection,
    FaceDetectionArray,
    HandDetection,
    HandDetectionArray,
    PersonDetection,
    PersonDetectionArray,
)
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import Header

from openpose_ros_pkg.calibration import Calibration, turned
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINTS, MESH_POINTS, Faces2D, Hands2D
from openpose_ros_pkg.output.files import jpeg_of
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SKELETONS, SkeletonModel
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS, PNG, check_pixels, decode_image, image_kind

# Plain OpenCV types hold colour in OpenCV's order; cv_bridge itself refuses to guess.
_PLAIN_TYPES = {'8UC1': 'mono8', '8UC3': 'bgr8', '8UC4': 'bgra8', '16UC3': 'bgr16'}
# YUYV is what most webcams deliver; cv_bridge of ROS noetic knows UYVY alone.
_YUYV = ('yuv422_yuy2', 'yuyv')
# OpenCV writes beyond the image when the last pair of columns is not whole.
_PAIRS_OF_COLUMNS = ('yuv422', 'uyvy', *_YUYV)

# Encodings whose pixels pass from and to a message unchanged: the same in OpenCV's order of channels, type, channels.
_EXACT_ENCODINGS = {
    'mono8': ('mono8', 'u1', 1), '8UC1': ('mono8', 'u1', 1), 'mono16': ('mono16', 'u2', 1),
    '16UC1': ('16UC1', 'u2', 1), '32FC1': ('32FC1', 'f4', 1),
    'bgr8': ('bgr8', 'u1', 3), 'rgb8': ('bgr8', 'u1', 3), '8UC3': ('bgr8', 'u1', 3),
    'bgra8': ('bgra8', 'u1', 4), 'rgba8': ('bgra8', 'u1', 4), '8UC4': ('bgra8', 'u1', 4),
    'bgr16': ('bgr16', 'u2', 3), 'rgb16': ('bgr16', 'u2', 3), '16UC3': ('bgr16', 'u2', 3),
    'bgra16': ('bgra16', 'u2', 4), 'rgba16': ('bgra16', 'u2', 4), '16UC4': ('bgra16', 'u2', 4)}
# compressed_depth_image_transport, compression_common.h, ConfigHeader: format, and two numbers for 32FC1.
_DEPTH_HEADER = struct.Struct('<iff')

_MISSING_PART = BodypartDetection()
# Fields of a message of one person that are no body parts; the parts follow, in the same order in all messages.
_NOT_PARTS = ('header', 'num_people_detected', 'person_ID')
_PARTS = tuple(name for name in PersonDetection.__slots__ if name not in _NOT_PARTS)
Part = TypeVar('Part')

_bridge = CvBridge()
TURNED_FRAME = '_turned'
"""End of the name of the optical frame of turned images."""


def image_to_bgr(message: Image, most: float = MOST_MEGAPIXELS) -> np.ndarray:
    """Return the image of a message in any colour encoding of cv_bridge, (H, W, 3) uint8 BGR; of bgr8 a read-only view.

    Raises:
        BadInputError: empty, more than `most` megapixels, truncated, wrong step, or neither colour nor grey values.
    """
    encoding = _PLAIN_TYPES.get(message.encoding, message.encoding)
    rows = image_rows(message, 2 if encoding in _YUYV else _bytes_per_pixel(encoding), most)
    if encoding == 'bgr8':
        return np.ndarray((message.height, message.width, 3), np.uint8, message.data, strides=(message.step, 3, 1))
    if encoding in _PAIRS_OF_COLUMNS and message.width % 2:
        raise BadInputError(f"image width is {message.width}, expected an even number for encoding '{encoding}'")
    if encoding in _YUYV:
        return cv2.cvtColor(np.ascontiguousarray(rows).reshape(message.height, message.width, 2),
                            cv2.COLOR_YUV2BGR_YUY2)
    data = message.data if rows.flags.c_contiguous else rows.tobytes()
    if message.is_bigendian:  # with NumPy 2, the cv_bridge of Debian 13 can not swap bytes
        kind, _ = _bridge.encoding_to_dtype_with_channels(encoding)
        data = np.ascontiguousarray(rows).view(kind).byteswap().tobytes()
    unpadded = Image(header=message.header, height=message.height, width=message.width, encoding=encoding,
                     is_bigendian=0, step=rows.shape[1], data=data)
    try:
        return _bridge.imgmsg_to_cv2(unpadded, 'bgr8')
    except (CvBridgeError, TypeError, ValueError, cv2.error) as error:
        raise BadInputError(f"image encoding '{message.encoding}' can not be turned into bgr8: {error}") from error


def image_rows(message: Image, bytes_per_pixel: int, most: float = MOST_MEGAPIXELS) -> np.ndarray:
    """Return the bytes of an Image message without the padding of its rows, (H, W * bytes_per_pixel) uint8, as a view.

    Raises:
        BadInputError: the message is empty or too large, its step too short or its data truncated.
    """
    width, height, step = message.width, message.height, message.step
    if width == 0 or height == 0:
        raise BadInputError(f'empty image: {width} x {height}')
    check_pixels('image', width, height, most)
    if step < width * bytes_per_pixel:
        raise BadInputError(f'image step is {step} bytes, expected at least {width * bytes_per_pixel} for {width} '
                            f'columns of {message.encoding}')
    if len(message.data) < step * height:
        raise BadInputError(f'image data are truncated: {len(message.data)} bytes, expected {step * height} for '
                            f'{height} rows of {step} bytes')
    data = np.frombuffer(message.data, np.uint8, step * height)
    return data.reshape(height, step)[:, :width * bytes_per_pixel]


def image_to_pixels(message: Image) -> Tuple[np.ndarray, str]:
    """Return the pixels of an Image message without any loss, and their encoding, for `pixels_to_image`.

    Returns:
        (H, W) or (H, W, 3 or 4) uint8, uint16 or float32 in native byte order, colours in OpenCV's order; and mono8,
        mono16, 16UC1, 32FC1, bgr8, bgra8, bgr16 or bgra16. BadInputError: a broken image, or another encoding.
    """
    if message.encoding not in _EXACT_ENCODINGS:
        raise BadInputError(f"image encoding '{message.encoding}' has no pixels that can be kept unchanged; expected "
                            f"one of {', '.join(_EXACT_ENCODINGS)}")
    encoding, kind, channels = _EXACT_ENCODINGS[message.encoding]
    dtype = np.dtype(('>' if message.is_bigendian else '<') + kind)
    rows = np.ascontiguousarray(image_rows(message, dtype.itemsize * channels)).view(dtype)
    pixels = rows.reshape((message.height, message.width) + (channels,) * (channels > 1))
    if message.encoding.startswith('rgb'):
        pixels = pixels[..., [2, 1, 0, 3][:channels]]
    return np.ascontiguousarray(pixels, dtype.newbyteorder('=')), encoding


def pixels_to_image(pixels: np.ndarray, encoding: str, header: Header) -> Image:
    """Return the Image message of pixels; see `image_to_pixels` for types and encodings."""
    height, width = pixels.shape[:2]
    little = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder('<'))
    return Image(header=header, height=height, width=width, encoding=encoding, is_bigendian=0,
                 step=little.nbytes // height, data=little.tobytes())


def order_of_file(format_text: str) -> str:
    """Return the encoding of the file in a CompressedImage: bgr8, rgb8 where red and blue are exchanged, or a mosaic's.

    Source: compressed_image_transport, compressed_subscriber.cpp; its publishers wrote RGB in place of BGR at first.
    """
    encoding, _, codec = format_text.strip().partition(';')
    if encoding.startswith(('rgb', 'bgr')) and codec and 'compressed bgr' not in codec:
        return 'rgb8'
    return encoding if encoding.startswith('bayer') else 'bgr8'


def compressed_image_to_bgr(message: CompressedImage, most: float = MOST_MEGAPIXELS) -> np.ndarray:
    """Return the image of a CompressedImage message as (H, W, 3) uint8 BGR; BadInputError: no whole JPEG or PNG."""
    if image_kind(message.data) is None:
        raise BadInputError(f"compressed image of format '{message.format}' and {len(message.data)} bytes can not be "
                            'decoded; expected JPEG or PNG, as image_transport publishes')
    order = order_of_file(message.format)
    image = decode_image(message.data, f"compressed image of format '{message.format}'",
                         cv2.IMREAD_COLOR if order in ('bgr8', 'rgb8') else cv2.IMREAD_UNCHANGED, most)
    if image.ndim == 2:
        return image_to_bgr(pixels_to_image(image, order, message.header), most)
    return np.ascontiguousarray(image[..., ::-1]) if order == 'rgb8' else image


def is_png_of_depth(data: bytes) -> bool:
    """Return whether bytes are a PNG of one channel of 16 bits."""
    return data.startswith(PNG) and data[24:26] == b'\x10\x00'


def compressed_depth_to_image(message: CompressedImage, most: float = MOST_MEGAPIXELS) -> Image:
    """Return the 16UC1 or 32FC1 image in a message of compressed_depth_image_transport; BadInputError: it has none."""
    encoding = message.format.partition(';')[0].strip()
    begin = message.data.find(PNG, 0, _DEPTH_HEADER.size + len(PNG))
    pixels = None
    if (encoding in ('16UC1', '32FC1') or is_png_of_depth(message.data)) and begin >= 0:
        pixels = decode_image(message.data[begin:], 'compressed depth image', cv2.IMREAD_UNCHANGED, most)
    if pixels is None or pixels.ndim != 2 or pixels.dtype != np.uint16 or (
            encoding == '32FC1' and begin != _DEPTH_HEADER.size):
        raise BadInputError(f"compressed depth image ({len(message.data)} bytes, format '{message.format}') can not be "
                            'decoded; expected 16UC1 or 32FC1 as PNG')
    if encoding == '32FC1':
        # codec.cpp of compressed_depth_image_transport: inverse depth, 0 where there is none
        _, a, b = _DEPTH_HEADER.unpack_from(message.data)
        inverse = np.where(pixels == 0, np.nan, pixels).astype(np.float32)
        pixels = np.float32(a) / (inverse - np.float32(b))
    return pixels_to_image(pixels, '32FC1' if encoding == '32FC1' else '16UC1', message.header)


def any_image_to_bgr(message: Union[Image, CompressedImage], most: float = MOST_MEGAPIXELS) -> np.ndarray:
    """Return the image of a raw or compressed image, (H, W, 3) uint8 BGR; BadInputError: it has none."""
    to_bgr = compressed_image_to_bgr if message._type == CompressedImage._type else image_to_bgr
    return to_bgr(message, most)


def bgr_to_image(bgr: np.ndarray, header: Header) -> Image:
    """Return an Image message (bgr8) of a (H, W, 3) uint8 image."""
    return pixels_to_image(bgr, 'bgr8', header)


def bgr_to_jpeg(bgr: np.ndarray, header: Header, quality: int) -> CompressedImage:
    """Return the JPEG, of a quality of 1 to 100, of a (H, W, 3) uint8 image, as image_transport's plugin makes it."""
    return CompressedImage(header=header, format='bgr8; jpeg compressed bgr8', data=jpeg_of(bgr, quality))


def people_to_messages(people: People2D, header: Header, keypoints: Optional[np.ndarray] = None
                       ) -> List[PersonDetection]:
    """Return one PersonDetection per person; a missing joint is x = y = 0 with confidence 0.

    Args:
        keypoints: (P, K, 3) in other units than those of `people` (see keypoint_scale), or None.
    """
    keypoints = people.keypoints if keypoints is None else keypoints
    # a joint has a score here exactly where `people` has it
    return [PersonDetection(header, len(people), max(track, 0),
                            *in_order_of_fields(_parts(values), people.skeleton, _MISSING_PART))
            for values, track in zip(keypoints, people.ids.tolist())]


def in_order_of_fields(parts: Sequence[Part], skeleton: SkeletonModel, missing: Part) -> List[Part]:
    """Return the parts of a person, one for each joint of a skeleton, in the order of messages."""
    with_missing = [*parts, missing]
    return [with_missing[row] for row in _rows_of_fields(skeleton.joints)]


@functools.lru_cache(maxsize=None)
def _rows_of_fields(joints: Tuple[str, ...]) -> Tuple[int, ...]:
    """Return which of the joints each body part of messages is; -1: none."""
    return tuple(joints.index(name) if name in joints else -1 for name in _PARTS)


def people_to_array(people: People2D, header: Header) -> PersonDetectionArray:
    """Return the message of one image, see `people_to_messages`."""
    return PersonDetectionArray(header=header, pose_model=people.skeleton.name,
                                persons=people_to_messages(people, header), existence=people.existence.tolist())


def people_from_array(message: PersonDetectionArray) -> People2D:
    """Return the people of one frame; BadInputError: unknown joint set, or an existence is no probability."""
    people = people_from_messages(message.persons, skeleton_of(message.pose_model))
    try:
        return dataclasses.replace(people, existence=existence_of(message))
    except ValueError as error:
        raise BadInputError(str(error)) from error


def existence_of(message: Any) -> Optional[np.ndarray]:
    """Return the probabilities that the people of an array message are there, (P,); None: the message has none."""
    existence = getattr(message, 'existence', ())  # messages in bags of version 1.0.0 lack the field
    return np.array(existence) if len(existence) else None


def skeleton_of(pose_model: str) -> SkeletonModel:
    """Return the joint set that a message names; BadInputError: it is unknown."""
    if pose_model not in SKELETONS:
        raise BadInputError(f"pose_model '{pose_model}' is unknown, expected one of {', '.join(SKELETONS)}")
    return SKELETONS[pose_model]


def people_from_messages(messages: Sequence[PersonDetection], skeleton: SkeletonModel) -> People2D:
    """Return the people of one frame; confidence 0 or NaN: missing; parts outside the skeleton are not read."""
    values = _points([[getattr(message, joint) for joint in skeleton.joints] for message in messages],
                     len(skeleton.joints))
    body = [i for i, joint in enumerate(skeleton.joints) if joint.split('_')[-1] not in ('toe', 'heel')]
    return People2D(skeleton, values, values[:, body, 2].mean(axis=1),
                    np.array([message.person_ID for message in messages], np.int64))


def hands_to_array(hands: Hands2D, header: Header) -> HandDetectionArray:
    """Return the message of the hands in an image; a missing point is x = y = 0 with confidence 0."""
    return HandDetectionArray(header=header, hands=[
        HandDetection(header=header, person_ID=max(person, 0), side=HandDetection.LEFT if left else HandDetection.RIGHT,
                      confidence=score, keypoints=_parts(points))
        for points, score, person, left in zip(hands.keypoints, hands.scores.tolist(), hands.people.tolist(),
                                               hands.left.tolist())])


def hands_from_array(message: HandDetectionArray) -> Hands2D:
    """Return the hands in an image; BadInputError: a side is neither LEFT nor RIGHT."""
    for hand in message.hands:
        check_side(hand.side)
    return Hands2D(_points([hand.keypoints for hand in message.hands], HAND_POINTS),
                   np.array([hand.confidence for hand in message.hands]),
                   np.array([hand.person_ID for hand in message.hands]),
                   np.array([hand.side == HandDetection.LEFT for hand in message.hands]))


def check_side(side: int) -> None:
    """Raise BadInputError where a side of a hand is neither LEFT nor RIGHT."""
    if side not in (HandDetection.LEFT, HandDetection.RIGHT):
        raise BadInputError(f'side of a hand is {side}, expected {HandDetection.LEFT} (LEFT) or {HandDetection.RIGHT} '
                            '(RIGHT)')


def faces_to_array(faces: Faces2D, header: Header) -> FaceDetectionArray:
    """Return the message of the faces in an image, without their mesh; missing points as those of hands."""
    return FaceDetectionArray(header=header, faces=[
        FaceDetection(header=header, person_ID=max(person, 0), confidence=score, keypoints=_parts(points))
        for points, score, person in zip(faces.keypoints, faces.scores.tolist(), faces.people.tolist())])


def faces_from_array(message: FaceDetectionArray) -> Faces2D:
    """Return the faces in an image; the mesh, which messages have not, is NaN."""
    return Faces2D(_points([face.keypoints for face in message.faces], FACE_POINTS),
                   np.full((len(message.faces), MESH_POINTS, 3), np.nan),
                   np.array([face.confidence for face in message.faces]),
                   np.array([face.person_ID for face in message.faces]))


def _parts(points: np.ndarray) -> List[BodypartDetection]:
    return [_part(x, y, score) if score > 0 else _MISSING_PART for x, y, score in points.tolist()]


def _part(x: float, y: float, confidence: float) -> BodypartDetection:
    part = BodypartDetection()  # with arguments, genpy takes 5 to 25 times as long
    part.x, part.y, part.confidence = x, y, confidence
    return part


def _points(parts: Sequence[Sequence[BodypartDetection]], number: int) -> np.ndarray:
    """Return points (N, number, 3) of messages; confidence 0 or NaN: missing."""
    values = np.array([[(part.x, part.y, part.confidence) for part in row] for row in parts],
                      np.float32).reshape(-1, number, 3)
    values[~(np.isfinite(values).all(axis=2) & (values[..., 2] > 0))] = (np.nan, np.nan, 0)
    return values


def _bytes_per_pixel(encoding: str) -> int:
    try:
        cv_type = getCvType(encoding)
    except RuntimeError:
        raise BadInputError(f"unknown image encoding '{encoding}'; expected one that cv_bridge knows: rgb8, bgr8, "
                            'rgba8, bgra8, mono8, mono16, bayer_*, yuv422, yuv422_yuy2') from None
    depth, channels = cv_type & 7, (cv_type >> 3) + 1
    return channels * (1, 1, 2, 2, 4, 4, 8, 2)[depth]


def turned_header(header: Header, degrees: int) -> Header:
    """Return a header with the frame of a camera beside the camera that is turned; of 0 degrees, that of the camera."""
    return Header(header.seq, header.stamp, header.frame_id + TURNED_FRAME) if degrees else header


def turned_image(message: Image, degrees: int) -> Image:
    """Return a raw image turned clockwise; BadInputError: see `image_to_pixels`."""
    pixels, encoding = image_to_pixels(message)
    return pixels_to_image(np.rot90(pixels, -degrees // 90), encoding, turned_header(message.header, degrees))


def turned_info(message: CameraInfo, degrees: int) -> CameraInfo:
    """Return the camera info of images that are turned clockwise."""
    return calibration_to_message(turned(calibration_from_message(message), degrees),
                                  turned_header(message.header, degrees))


def calibration_to_message(calibration: Calibration, header: Header) -> CameraInfo:
    return CameraInfo(header=header, width=calibration.width, height=calibration.height,
                      distortion_model=calibration.distortion_model, D=list(calibration.distortion),
                      K=list(calibration.matrix), R=list(calibration.rectification), P=list(calibration.projection),
                      binning_x=calibration.binning[0], binning_y=calibration.binning[1],
                      roi=RegionOfInterest(*calibration.region))


def calibration_from_message(message: CameraInfo) -> Calibration:
    return Calibration(message.width, message.height, message.distortion_model, message.D, message.K, message.R,
                       message.P, '', (message.binning_x, message.binning_y),
                       tuple(getattr(message.roi, key) for key in message.roi.__slots__))
