"""Messages to core types and back: every encoding of one known picture, bad messages, people there and back."""
import struct

import cv2
import numpy as np
import pytest
from openpose_ros_msgs.msg import BodypartDetection, HandDetection, HandDetectionArray, PersonDetection
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINTS, MESH_POINTS, Faces2D, Hands2D
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.convert import (
    any_image_to_bgr,
    compressed_depth_to_image,
    faces_from_array,
    faces_to_array,
    hands_from_array,
    hands_to_array,
    image_to_bgr,
    image_to_pixels,
    people_from_array,
    people_from_messages,
    people_to_array,
    people_to_messages,
    pixels_to_image,
)
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS, SKELETONS

WIDTH, HEIGHT = 32, 24


def ramp():
    """A smooth colour picture: blue grows to the right, green downwards, red along the diagonal."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    return np.stack([40 + 4 * u, 30 + 6 * v, 220 - 2 * u - 3 * v], axis=2).astype(np.uint8)


def message(rows, encoding, padding=0, width=WIDTH, height=HEIGHT, is_bigendian=0):
    """An Image with `padding` bytes of noise after each row."""
    rows = np.frombuffer(np.ascontiguousarray(rows).tobytes(), np.uint8).reshape(height, -1)
    padded = np.hstack([rows, np.full((height, padding), 201, np.uint8)])
    return Image(height=height, width=width, encoding=encoding, is_bigendian=is_bigendian, step=padded.shape[1],
                 data=padded.tobytes())


def grey(bgr):
    """Luma of ITU-R BT.601, (H, W) float."""
    return bgr @ np.array([0.114, 0.587, 0.299])


def as_grey_bgr(values):
    return np.repeat(values[..., np.newaxis], 3, axis=2)


def yuv(bgr):
    """Y, U, V of ITU-R BT.601 in the studio range of video (16..235), (H, W) float each."""
    blue, green, red = np.moveaxis(bgr.astype(float), 2, 0)
    return (16 + 0.257 * red + 0.504 * green + 0.098 * blue,
            128 - 0.148 * red - 0.291 * green + 0.439 * blue,
            128 + 0.439 * red - 0.368 * green - 0.071 * blue)


def yuv422(bgr, luma_at):
    """Packed 4:2:2: luma of each pixel at byte `luma_at` of its two, U and V of each pair of pixels in the others."""
    y, u, v = (np.rint(plane).astype(np.uint8) for plane in yuv(bgr))
    packed = np.zeros((*y.shape, 2), np.uint8)
    packed[..., luma_at] = y
    packed[:, 0::2, 1 - luma_at] = u[:, 0::2]
    packed[:, 1::2, 1 - luma_at] = v[:, 0::2]
    return packed


def bayer(bgr, pattern):
    """What a sensor with a colour filter sees; the pattern names the first two pixels of the first two rows."""
    raw = np.zeros(bgr.shape[:2], np.uint8)
    for k, colour in enumerate(pattern):
        row, column = divmod(k, 2)
        raw[row::2, column::2] = bgr[row::2, column::2, 'bgr'.index(colour)]
    return raw


def with_alpha(picture):
    return np.dstack([picture, np.full(picture.shape[:2], 77, np.uint8)])


RAMP = ramp()
GREY16 = np.rint(grey(RAMP) * 257).astype('<u2')

# encoding, bytes, what must come out, tolerance
EXACT = [
    ('bgr8', RAMP, RAMP),
    ('8UC3', RAMP, RAMP),
    ('rgb8', RAMP[..., ::-1], RAMP),
    ('bgra8', with_alpha(RAMP), RAMP),
    ('8UC4', with_alpha(RAMP), RAMP),
    ('rgba8', with_alpha(RAMP[..., ::-1]), RAMP),
    ('mono8', RAMP[..., 0], as_grey_bgr(RAMP[..., 0])),
    ('8UC1', RAMP[..., 0], as_grey_bgr(RAMP[..., 0])),
]
APPROXIMATE = [
    # 16 bits rounded to 8: half a step, and one more where a library cuts instead
    ('mono16', GREY16, as_grey_bgr(grey(RAMP)), 1.01),
    # chroma of every second column (blue changes by 4 a pixel), rounding of Y, U, V multiplied by up to 2.02
    ('yuv422', yuv422(RAMP, 1), RAMP, 7),
    ('yuv422_yuy2', yuv422(RAMP, 0), RAMP, 7),
    ('yuyv', yuv422(RAMP, 0), RAMP, 7),
    # interpolation is exact on a ramp, the border repeats its neighbour: up to 6 a pixel
    ('bayer_rggb8', bayer(RAMP, 'rggb'), RAMP, 7),
    ('bayer_bggr8', bayer(RAMP, 'bggr'), RAMP, 7),
    ('bayer_gbrg8', bayer(RAMP, 'gbrg'), RAMP, 7),
    ('bayer_grbg8', bayer(RAMP, 'grbg'), RAMP, 7),
]
ENCODINGS = [(*case, 0) for case in EXACT] + APPROXIMATE


@pytest.mark.parametrize(('encoding', 'rows', 'expected', 'tolerance'), ENCODINGS, ids=[e[0] for e in ENCODINGS])
def test_encoding(encoding, rows, expected, tolerance):
    bgr = image_to_bgr(message(rows, encoding, padding=5))
    assert bgr.dtype == np.uint8 and bgr.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(bgr.astype(float) - expected).max() <= tolerance


def raw(encoding='bgr8', step=3 * WIDTH, size=3 * WIDTH * HEIGHT):
    return Image(width=WIDTH, height=HEIGHT, encoding=encoding, step=step, data=bytes(size))


@pytest.mark.parametrize('bad, text', [
    (raw(step=3 * WIDTH - 1), 'step is 95 bytes, expected at least 96 for'),
    (raw(size=100), f'100 bytes, expected {3 * WIDTH * HEIGHT} '), (Image(encoding='bgr8'), 'empty image: 0 x 0'),
    *((raw(encoding), f"encoding '{encoding}'; expected one that cv_bridge knows: rgb8") for encoding in ('', 'RGB8')),
    *((raw(encoding, 64 * WIDTH, 64 * WIDTH * HEIGHT), f"encoding '{encoding}' can not be turned into bgr8")
      for encoding in ('32FC1', '16UC1', '8UC2', '64FC3')),
    *((CompressedImage(format='png', data=data), f"'png' and {len(data)} bytes can not be decoded; expected JPEG")
      for data in (b'', b'garbage', cv2.imencode('.bmp', RAMP)[1].tobytes()))])
def test_images_that_are_refused(bad, text):
    with pytest.raises(BadInputError, match=text):
        any_image_to_bgr(bad)


@pytest.mark.parametrize('form, codec, pixels, tolerance', [
    ('rgb8; jpeg compressed ', '.jpg', RAMP[..., ::-1], 12), ('rgb8; jpeg compressed bgr8', '.jpg', RAMP, 12),
    ('rgb8', '.png', RAMP, 0), ('bayer_rggb8; png compressed ', '.png', bayer(RAMP, 'rggb'), 7)])
def test_order_of_colours_in_compressed_images(form, codec, pixels, tolerance):
    """As compressed_image_transport reads it: old publishers wrote red and blue exchanged, and mosaics as they are."""
    message = CompressedImage(format=form, data=cv2.imencode(codec, pixels)[1].tobytes())
    assert np.abs(any_image_to_bgr(message).astype(int) - RAMP)[1:-1, 1:-1].max() <= tolerance


@pytest.mark.parametrize('encode', [
    lambda grey: Image(width=200, height=100, encoding='mono8', step=200, data=grey.tobytes()),
    lambda grey: CompressedImage(data=cv2.imencode('.jpg', grey)[1].tobytes()),
    lambda grey: CompressedImage(data=cv2.imencode('.png', grey)[1].tobytes())], ids=['raw', 'jpeg', 'png'])
def test_images_beyond_the_limit(encode):
    message = encode(np.zeros((100, 200), np.uint8))
    assert any_image_to_bgr(message, most=0.02).shape == (100, 200, 3)
    with pytest.raises(BadInputError, match=r'is 200 x 100, .* at most 0.019 \(max_image_megapixels\)'):
        any_image_to_bgr(message, most=0.019)
    depth = packed_depth(np.zeros((100, 200), np.uint16), '16UC1; compressedDepth')
    with pytest.raises(BadInputError, match='compressed depth image is 200 x 100'):
        compressed_depth_to_image(depth, most=0.019)


# ------------------------------------------------------------------------------------------------ people

def two_people(skeleton=COCO_18):
    """The second one has only two joints: the first and the left ankle."""
    joints = len(skeleton.joints)
    keypoints = np.random.default_rng(7).uniform(0.1, 1.0, (2, joints, 3)).astype(np.float32)
    keypoints[..., :2] *= 500
    hidden = np.ones(joints, bool)
    hidden[[0, skeleton.joints.index('left_ankle')]] = False
    keypoints[1, hidden] = (np.nan, np.nan, 0)
    return People2D(skeleton, keypoints, [0.9, 0.4], [7, 12], existence=[0.75, 1.0])


def test_messages_hold_the_parts_that_joint_sets_may_have():
    """In this order; a network whose joints are among them can be described without touching code."""
    parts = [name for name in PersonDetection.__slots__ if name not in ('header', 'num_people_detected', 'person_ID')]
    assert parts == list(MESSAGE_JOINTS)


@pytest.mark.parametrize('skeleton', SKELETONS.values(), ids=SKELETONS.keys())
def test_people_there_and_back(skeleton):
    people, header = two_people(skeleton), Header(frame_id='camera')
    messages = people_to_messages(people, header)
    assert [(m.header, m.num_people_detected, m.person_ID) for m in messages] == [(header, 2, 7), (header, 2, 12)]
    back = people_from_messages(messages, skeleton)
    np.testing.assert_array_equal(back.keypoints, people.keypoints)
    assert back.ids.tolist() == [7, 12]
    array = people_to_array(people, header)
    assert (array.pose_model, array.persons) == (skeleton.name, messages)
    back = people_from_array(array)
    np.testing.assert_array_equal(back.keypoints, people.keypoints)
    np.testing.assert_array_equal(back.existence, people.existence)
    array.pose_model = 'none_such'
    with pytest.raises(BadInputError, match="pose_model 'none_such' is unknown"):
        people_from_array(array)


@pytest.mark.parametrize('part', [
    BodypartDetection(5, 6, 0), BodypartDetection(5, 6, float('nan')), BodypartDetection(float('nan'), 6, 0.5),
    BodypartDetection(5, float('inf'), 0.5), BodypartDetection(5, 6, -1)],
    ids=['confidence 0', 'confidence NaN', 'x NaN', 'y infinite', 'confidence negative'])
def test_a_part_that_is_missing_for_readers(part):
    person = PersonDetection(person_ID=3, neck=BodypartDetection(1, 2, 0.5), right_hip=part)
    people = people_from_messages([person], COCO_18)
    assert people.present[0].nonzero()[0].tolist() == [COCO_18.joints.index('neck')]
    assert np.isnan(people.xy[0, COCO_18.joints.index('right_hip')]).all()


@pytest.mark.parametrize('kind, channels, encodings, big, padding', [
    ('u1', 1, ('mono8', '8UC1'), 0, 0), ('u2', 1, ('mono16',), 1, 3), ('u2', 1, ('16UC1',), 0, 3),
    ('f4', 1, ('32FC1',), 1, 0), ('u1', 3, ('bgr8', '8UC3'), 0, 3), ('u2', 3, ('bgr16', '16UC3'), 1, 0),
    ('u1', 4, ('bgra8', '8UC4'), 0, 0), ('u2', 4, ('bgra16', '16UC4'), 1, 3)])
def test_pixels_come_and_go_bit_for_bit(kind, channels, encodings, big, padding):
    size = HEIGHT * WIDTH * channels * int(kind[1])
    bits = np.random.default_rng(1).integers(0, 256, size, np.uint8).tobytes()
    shape = (HEIGHT, WIDTH) + (channels,) * (channels > 1)
    expected = np.frombuffer(bits, '<' + kind).reshape(shape)
    for encoding in encodings:
        rows = expected.astype(('>' if big else '<') + kind)
        pixels, name = image_to_pixels(message(rows, encoding, padding, is_bigendian=big))
        assert (name, pixels.dtype.isnative, pixels.tobytes()) == (encodings[0], True, bits)
        back = pixels_to_image(pixels, name, Header(frame_id='cam'))
        assert (back.encoding, back.step, back.data, back.header.frame_id) == (name, len(bits) // HEIGHT, bits, 'cam')


def packed_depth(pixels, form, a=0.0, b=0.0):
    """A message of compressed_depth_image_transport: its header, and a PNG."""
    png = cv2.imencode('.png', pixels)[1].tobytes()
    return CompressedImage(Header(frame_id='cam'), form, struct.pack('<iff', 0, a, b) + png)


def test_compressed_depth_in_millimetres_is_exact():
    depth = np.arange(WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH) * 80
    for form in ('16UC1; compressedDepth', '16UC1; compressedDepth png'):
        image = compressed_depth_to_image(packed_depth(depth, form))
        assert (image.encoding, image.header.frame_id) == ('16UC1', 'cam')
        np.testing.assert_array_equal(image_to_pixels(image)[0], depth)


def test_compressed_depth_in_metres_is_that_of_its_inverse():
    """The numbers are those of the transport for depth_max 10 m and depth_quantization 100."""
    a, b = 100 * 101.0, 1 - 100 * 101.0 / 10
    metres = np.linspace(0.6, 9.9, WIDTH * HEIGHT, dtype=np.float32).reshape(HEIGHT, WIDTH)
    quantized = (a / metres + b).astype(np.uint16)
    quantized[0, 0] = 0
    image = compressed_depth_to_image(packed_depth(quantized, '32FC1; compressedDepth', a, b))
    back, encoding = image_to_pixels(image)
    assert encoding == '32FC1'
    assert np.isnan(back[0, 0])
    # one step of the inverse depth, at the greatest depth
    np.testing.assert_allclose(back.ravel()[1:], metres.ravel()[1:], atol=10 * 10 / a)


@pytest.mark.parametrize('bad', [
    CompressedImage(format='16UC1; compressedDepth'),
    CompressedImage(format='16UC1; compressedDepth rvl', data=bytes(40)),
    packed_depth(np.zeros((2, 2), np.uint16), 'rgb8; jpeg compressed bgr8'),
    packed_depth(np.zeros((2, 2), np.uint8), '16UC1; compressedDepth')])
def test_compressed_depth_that_is_none_is_refused(bad):
    with pytest.raises(BadInputError, match='can not be decoded; expected 16UC1'):
        compressed_depth_to_image(bad)


def landmarks(number, points):
    """(number, points, 3) keypoints that differ from each other; the last point of the last one is missing."""
    keypoints = np.arange(number * points * 3, dtype=np.float32).reshape(number, points, 3)
    keypoints[..., 2] = np.linspace(0.1, 0.9, points)
    keypoints[-1, -1] = (np.nan, np.nan, 0)
    return keypoints


def test_hands_go_into_a_message_and_come_back():
    hands = Hands2D(landmarks(2, HAND_POINTS), np.array([0.5, 0.75]), np.array([3, 7]), np.array([True, False]))
    array = hands_to_array(hands, Header(frame_id='camera'))
    assert [(hand.person_ID, hand.side, hand.header.frame_id) for hand in array.hands] == [
        (3, HandDetection.LEFT, 'camera'), (7, HandDetection.RIGHT, 'camera')]
    missing = array.hands[1].keypoints[-1]
    assert (missing.x, missing.y, missing.confidence) == (0, 0, 0)
    back = hands_from_array(array)
    for name in ('keypoints', 'scores', 'people', 'left'):
        np.testing.assert_array_equal(getattr(back, name), getattr(hands, name))


def test_faces_go_into_a_message_and_come_back_without_their_mesh():
    faces = Faces2D(landmarks(2, FACE_POINTS), np.ones((2, MESH_POINTS, 3)), np.array([0.5, 0.75]), np.array([3, 7]))
    back = faces_from_array(faces_to_array(faces, Header()))
    for name in ('keypoints', 'scores', 'people'):
        np.testing.assert_array_equal(getattr(back, name), getattr(faces, name))
    assert np.isnan(back.mesh).all()


def test_a_hand_without_a_side_is_refused():
    with pytest.raises(BadInputError, match='side of a hand is 3'):
        hands_from_array(HandDetectionArray(hands=[HandDetection(side=3)]))
