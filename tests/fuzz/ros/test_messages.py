"""Messages with any values, as they may come over the wire: core types that hold together, or BadInputError."""
import copy
import json
from io import BytesIO

import cv2
import genpy
import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, Transform, TransformStamped
from hypothesis import example, given
from hypothesis import strategies as st
from openpose_ros_msgs.msg import (
    PersonDetection,
    PersonDetectionArray,
    PersonGesture,
    PersonPointing,
    PersonSignals,
    PersonSignalsArray,
)
from openpose_ros_msgs.srv import GetPersonsRequest, GetPersonsResponse
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from fuzzing import mutated, survives
from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.skeletons import BODY_25, COCO_18
from openpose_ros_signals.ros.convert import signals_from_array
from openpose_ros_tools.ros.image_messages import file_of_message
from openpose_ros_tools.ros.keypoints.keypoint_bag import rows_of
from openpose_ros_tools.tables.keypoint_table import table_of
from openpose_ros_web import protocol
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros import convert as convert_3d

HEADER = Header(1, genpy.Time(1600000000, 5), 'camera')
WIDTH, HEIGHT = 16, 12
BGR = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
CAMERA = CameraModel(WIDTH, HEIGHT, np.array([20.0, 0, 8, 0, 20, 6, 0, 0, 1]), 'plumb_bob',
                     np.array([0.1, -0.1, 0, 0, 0]))
DEPTH = np.full((HEIGHT, WIDTH), 2000, np.uint16)
# Of 40 megapixels in three channels of 16 bits, decoded and converted.
IMAGE_MEMORY = 40_000_000 * 3 * 2 * 3
INTEGERS = (0, 1, 2, 3, 7, 255, 65535, 65536, 2 ** 31 - 1, 2 ** 31, 2 ** 32 - 1)
FLOATS = (np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, 1e-300, 1e-6, -1.0, 1e6, 1e38, 1e300, -1e300)
TEXTS = ('', 'x', 'é人', 'bgr8', 'rgb16', 'mono8', 'mono16', '16UC1', '32FC1', '64FC4', '8UC2', 'bayer_rggb8', 'yuv422',
         'yuv422_yuy2', 'png', 'jpeg', '16UC1; compressedDepth', '32FC1; compressedDepth png', 'plumb_bob',
         'equidistant', 'rational_polynomial', 'COCO_18', 'BODY_25', 'a' * 5000)
NEAR = (-2, -1, 1, 2)
CHANGES = st.lists(st.tuples(st.integers(0, 10 ** 6), st.integers(0, 10 ** 6)), max_size=4)


def leaves(message):
    """Yield holder, key and type of each value in a message that is no message itself."""
    for name, kind in zip(message.__slots__, message._slot_types):
        value = getattr(message, name)
        if isinstance(value, genpy.Message):
            yield from leaves(value)
        elif isinstance(value, (list, tuple)) and value and isinstance(value[0], genpy.Message):
            yield message, name, kind
            for part in value:
                yield from leaves(part)
        else:
            yield message, name, kind


def changed(value, kind, number):
    """Return another value of the type of a field."""
    if kind == 'string':
        return TEXTS[number % len(TEXTS)]
    if kind == 'uint8[]':
        size = len(value) + (NEAR * 5 + (-len(value), -len(value) // 2, 100))[number % 23]
        return (bytes(value) + bytes(200))[:max(size, 0)]
    if kind.startswith('float') and '[' in kind:
        values = list(value)
        if values and number % 7:
            values[number // 7 % len(values)] = float_of(kind, number // 3)
        elif kind.endswith('[]'):
            values = (values * 3)[:number // 7 % 16]
        return values
    if isinstance(value, (list, tuple)):
        return (list(value) * 2)[:number % (2 * len(value) + 1)]
    if kind in ('time', 'duration') or not isinstance(value, (int, float)):
        return value
    if kind.startswith('float'):
        return float_of(kind, number)
    most = {'bool': 1, 'uint8': 255, 'int8': 127, 'uint16': 65535}.get(kind, 2 ** 32 - 1)
    near = value + NEAR[number // 2 % 4]
    return min(max(near if number % 2 else INTEGERS[number // 2 % len(INTEGERS)], 0), most)


def float_of(kind, number):
    """Return a number that a field of this type can hold."""
    value = FLOATS[number % len(FLOATS)]
    return value if kind.startswith('float64') else min(max(value, -3e38), 3e38) if np.isfinite(value) else value


def spoiled(*messages):
    """Yield a message with some fields changed, as a subscriber gets it."""
    def spoil(chosen):
        number, changes = chosen
        message = copy.deepcopy(messages[number])
        for place, value in changes:
            fields = list(leaves(message))
            holder, name, kind = fields[place % len(fields)]
            setattr(holder, name, changed(getattr(holder, name), kind, value))
        return type(message)().deserialize(serialized(message))
    return st.tuples(st.integers(0, len(messages) - 1), CHANGES).map(spoil)


def serialized(message):
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def images():
    for encoding, dtype, channels in (('bgr8', np.uint8, 3), ('mono8', np.uint8, 1), ('rgb16', np.uint16, 3),
                                      ('bayer_rggb8', np.uint8, 1), ('yuv422_yuy2', np.uint8, 2),
                                      ('16UC1', np.uint16, 1), ('32FC1', np.float32, 1)):
        pixels = np.full((HEIGHT, WIDTH, channels), 7, dtype)
        yield Image(HEADER, HEIGHT, WIDTH, encoding, 0, pixels.nbytes // HEIGHT, pixels.tobytes())


def compressed(suffix, name, pixels, begin=b''):
    return CompressedImage(HEADER, name, begin + cv2.imencode(suffix, pixels)[1].tobytes())


COMPRESSED = [compressed('.jpg', 'jpeg', BGR), compressed('.png', 'bgr8; png compressed bgr8', BGR)]
PACKED = [compressed('.png', '16UC1; compressedDepth', DEPTH, bytes(12)),
          compressed('.png', '32FC1; compressedDepth', DEPTH, np.array([0, 100, 1], np.float32).tobytes())]
CLOUD = convert_3d.cloud_to_message(cloud_from_depth(DEPTH / 1000.0, CAMERA, BGR), HEADER)
INFO = convert_3d.camera_to_message(CAMERA, HEADER)


def people_messages():
    detections = [PersonDetection(header=HEADER, person_ID=number) for number in (1, 2)]
    for detection in detections:
        detection.nose.x = detection.nose.y = 5.0
        detection.nose.confidence = 0.5
    return PersonDetectionArray(HEADER, COCO_18.name, detections, [0.25, 1.0])


def people_in_space():
    shape = (2, len(COCO_18.joints))
    people = People3D(COCO_18, np.ones((*shape, 3)), np.ones(shape), np.full(shape, MEASURED), np.ones(shape),
                      np.array([1, 2]), np.zeros((*shape, 3)))
    return convert_3d.people_to_array(people, HEADER)


@given(spoiled(*images()))
def test_image(message):
    bgr = survives(convert_2d.image_to_bgr, message, size=len(message.data), memory=IMAGE_MEMORY)
    assert bgr is None or (bgr.shape == (message.height, message.width, 3) and bgr.dtype == np.uint8)
    pixels = survives(convert_2d.image_to_pixels, message, size=len(message.data))
    assert pixels is None or pixels[0].shape[:2] == (message.height, message.width)


@given(spoiled(*COMPRESSED), st.one_of(st.none(), *(mutated(message.data) for message in COMPRESSED)))
def test_compressed_image(message, data):
    message.data = message.data if data is None else data
    bgr = survives(convert_2d.any_image_to_bgr, message, size=len(message.data), memory=IMAGE_MEMORY)
    assert bgr is None or (bgr.ndim == 3 and bgr.dtype == np.uint8)


@given(spoiled(*PACKED), st.one_of(st.none(), *(mutated(message.data) for message in PACKED)))
def test_compressed_depth(message, data):
    message.data = message.data if data is None else data
    image = survives(convert_2d.compressed_depth_to_image, message, size=len(message.data), memory=IMAGE_MEMORY)
    assert image is None or image.encoding in ('16UC1', '32FC1')


def points_of(message):
    """Read everything that lifting asks of a cloud."""
    cloud = convert_3d.cloud_from_message(message)
    return cloud, cloud.window(np.array([0, cloud.width - 1]), np.array([0, cloud.height - 1]), 5), cloud.camera_model()


@given(spoiled(CLOUD))
def test_cloud(message):
    read = survives(points_of, message, size=len(message.data))
    if read is not None:
        cloud, window, camera = read
        finite = np.isfinite(window)
        assert (finite.all(axis=2) == finite.any(axis=2)).all() and (cloud.width, cloud.height) == (message.width,
                                                                                                   message.height)
        assert camera is None or np.isfinite(camera.matrix).all()


def camera_with_rays(message, rectified):
    """Return a camera and the rays of its corners."""
    camera = convert_3d.camera_from_message(message, rectified)
    return camera, camera.rays(np.array([[0, 0], [camera.width - 1, camera.height - 1]]))


@pytest.mark.parametrize('rectified', [False, True])
@given(message=spoiled(INFO))
def test_camera_info(rectified, message):
    read = survives(camera_with_rays, message, rectified, size=1000)
    if read is not None:
        assert np.isfinite(read[0].matrix).all() and not np.isinf(read[1]).any()
    calibration = survives(convert_2d.calibration_from_message, message, size=1000)
    assert calibration is None or calibration.width == message.width


def points_of_depth(image, info):
    """Read everything that lifting asks of a depth image."""
    depth = convert_3d.depth_image_from_messages(image, info)
    return depth.window(np.array([0, depth.width - 1]), np.array([0, depth.height - 1]), 5)


@given(spoiled(convert_3d.depth_to_message(DEPTH, HEADER)), spoiled(INFO))
def test_depth_image(image, info):
    window = survives(points_of_depth, image, info, size=len(image.data))
    assert window is None or not np.isinf(window).any()


@given(st.one_of(*(st.tuples(st.just(stream), spoiled(*messages)) for stream, messages in (
    ('colour', [*images(), *COMPRESSED]), ('depth', [*images(), *PACKED, CLOUD])))))
def test_file_of_a_message(chosen):
    stream, message = chosen
    survives(file_of_message, stream, message, None, 'bag', size=len(message.data), memory=IMAGE_MEMORY,
             errors=(OpenposeRosError,))


@pytest.mark.parametrize('skeleton', [COCO_18, BODY_25])
@given(message=spoiled(people_messages()))
def test_people(skeleton, message):
    people = survives(convert_2d.people_from_messages, message.persons, skeleton, size=10000)
    assert len(people) == len(message.persons)
    assert (np.isfinite(people.xy).all(axis=2) == (people.confidence > 0)).all()
    people = survives(convert_2d.people_from_array, message, size=10000)
    assert people is None or ((people.existence >= 0) & (people.existence <= 1)).all()


@given(spoiled(people_in_space()))
def test_people_in_space(message):
    people = survives(convert_3d.people_from_array, message, size=10000)
    if people is not None:
        assert (np.isfinite(people.xyz).all(axis=2) == (people.status != MISSING)).all()


MOMENT = protocol.Moment(1.0, 0.1, 2.0, 'world')
STILL = np.eye(3), np.zeros(3)


def page_message(message):
    """Return what a page reads of people or signals."""
    if isinstance(message, PersonSignalsArray):
        made = protocol.signals_message(signals_from_array(message), STILL, MOMENT)
    else:
        made = protocol.people_message(convert_3d.people_from_array(message), STILL, MOMENT)
    return json.loads(protocol.encode(made))


def signals():
    person = PersonSignals(person_ID=1, posture='standing', gestures=[PersonGesture(
        name='point', arm='left', pointing=[PersonPointing(target='lamp')])])
    return PersonSignalsArray(HEADER, [person])


@given(spoiled(people_in_space(), signals()))
def test_what_pages_get(message):
    found = survives(page_message, message, size=10000)
    if found is not None:
        assert len(found['people']) == len(message.persons)


def table_of_message(message, dimensions):
    """Return the table of a message."""
    return table_of(rows_of(message, dimensions), dimensions, 'a message')


@given(st.one_of(spoiled(people_messages()).map(lambda message: (message, 2)),
                 spoiled(people_in_space()).map(lambda message: (message, 3))))
def test_table_of_people(chosen):
    message, dimensions = chosen
    table = survives(table_of_message, message, dimensions, size=10000)
    assert table is None or np.isfinite(table.positions[table.status != MISSING]).all()


@given(spoiled(TransformStamped(HEADER, 'camera', Transform(rotation=Quaternion(w=1.0)))))
@example(TransformStamped())
def test_transform(message):
    transform = survives(convert_3d.rotation_and_translation, message, size=1000)
    if transform is not None:
        assert np.allclose(transform[0] @ transform[0].T, np.eye(3), atol=1e-6) and np.isfinite(transform[1]).all()


REQUEST, RESPONSE = GetPersonsRequest(next(images())), GetPersonsResponse(people_messages().persons)


@pytest.mark.parametrize('kind, good', [(GetPersonsRequest, REQUEST), (GetPersonsResponse, RESPONSE),
                                        (Image, next(images())), (PointCloud2, CLOUD), (CameraInfo, INFO)])
@given(data=st.data())
def test_bytes_of_messages(kind, good, data):
    content = data.draw(mutated(serialized(good)))
    message = survives(kind().deserialize, content, size=len(content), errors=(genpy.DeserializationError,))
    if kind is GetPersonsRequest and message is not None:
        survives(convert_2d.image_to_bgr, message.image, size=len(content), memory=IMAGE_MEMORY)
    if kind is GetPersonsResponse and message is not None:
        survives(convert_2d.people_from_messages, message.detections, COCO_18, size=len(content))
