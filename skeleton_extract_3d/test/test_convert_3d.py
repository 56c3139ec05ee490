"""Messages become core types and come back: clouds of any layout, depth images, people, markers, transforms."""
from io import BytesIO

import numpy as np
import pytest
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    HandDetection_3d,
    HandDetection_3dArray,
)
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointField, RegionOfInterest
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINTS
from openpose_ros_pkg.skeletons import COCO_18, SKELETONS
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.show.markers import MarkerSpec

W, H, K = 7, 5, len(COCO_18.joints)
HEADER = Header(frame_id='camera')
LENS = CameraModel(W, H, np.array([[6.0, 0, 3.1], [0, 6.5, 2.2], [0, 0, 1]]))
BARREL = (-0.2, 0.03, 0.001, -0.002, 0.0)


def points_of_pixels():
    """(u, v, 1 + u + 10 v) at each pixel."""
    v, u = np.mgrid[:H, :W].astype(np.float64)
    return np.stack([u, v, 1 + u + 10 * v], axis=-1)


def all_points(grid):
    v, u = (axis.ravel() for axis in np.mgrid[:grid.height, :grid.width])
    return grid.window(u, v, 1).reshape(grid.height, grid.width, 3)


def sent(message):
    """Return the message as a subscriber gets it."""
    buffer = BytesIO()
    message.serialize(buffer)
    return type(message)().deserialize(buffer.getvalue())


def test_a_cloud_comes_back_from_its_message():
    depth = np.full((H, W), 2.0)
    depth[1, 2] = 0
    cloud = cloud_from_depth(depth, LENS, np.full((H, W, 3), (10, 20, 30), np.uint8))
    message = sent(convert.cloud_to_message(cloud, HEADER))
    assert [(field.name, field.offset, field.datatype) for field in message.fields] == [
        ('x', 0, PointField.FLOAT32), ('y', 4, PointField.FLOAT32), ('z', 8, PointField.FLOAT32),
        ('rgb', 16, PointField.FLOAT32)]
    assert (message.point_step, message.row_step, message.header.frame_id) == (32, 32 * W, 'camera')
    expected = np.stack([cloud[axis] for axis in 'xyz'], axis=-1)
    np.testing.assert_array_equal(all_points(convert.cloud_from_message(message)), expected)
    assert np.isnan(expected[1, 2]).all() and np.isfinite(expected[0, 0]).all()
    # blue, green, red, as RViz reads the four bytes at rgb
    assert bytes(message.data[16:20]) == bytes((10, 20, 30, 0))


@pytest.mark.parametrize('dtype, unit', [(np.uint16, 0.001), (np.float32, 1)], ids=['mm', 'm'])
def test_a_depth_image_comes_back_from_its_messages(dtype, unit):
    """All layouts and lenses are in tests/unit/points/test_depth.py."""
    camera, z = CameraModel(W, H, LENS.matrix, 'plumb_bob', np.array(BARREL)), points_of_pixels()[..., 2] * 0.125
    messages = convert.depth_to_message((z / unit).astype(dtype), HEADER), convert.camera_to_message(camera, HEADER)
    points = all_points(convert.depth_image_from_messages(*map(sent, messages)))
    np.testing.assert_allclose(points[..., 2], z, atol=1e-6)
    v, u = np.mgrid[:H, :W]
    np.testing.assert_allclose(camera.project(points), np.stack([u.ravel(), v.ravel()], axis=-1), atol=1e-3)


@pytest.mark.parametrize('rectified', [False, True])
def test_a_depth_image_of_a_region_of_interest_has_its_part_of_the_camera(rectified):
    sensor = CameraModel(1280, 720, [900, 0, 640, 0, 900, 360, 0, 0, 1])
    info = convert.camera_to_message(sensor, HEADER)
    if rectified:  # P counts alone
        info.K, info.D = [0.0] * 9, BARREL
    info.roi = RegionOfInterest(x_offset=320, y_offset=180, width=640, height=360)
    depth = convert.depth_to_message(np.full((360, 640), 3000), HEADER)
    grid = convert.depth_image_from_messages(depth, sent(info), rectified)
    point = grid.window(np.array([0]), np.array([0]), 1)[0]
    np.testing.assert_allclose(point, [((320 - 640) / 300, (180 - 360) / 300, 3)])
    # of the same view at another resolution as well
    info.binning_x = info.binning_y = 2
    point = convert.depth_image_from_messages(depth, sent(info), rectified).window(np.array([0]), np.array([0]), 1)[0]
    np.testing.assert_allclose(point, [((320 - 640) / 300, (180 - 360) / 300, 3)], atol=0.01)
    with pytest.raises(BadInputError, match='640 x 360'):
        info.binning_x = info.binning_y = 0
        convert.depth_image_from_messages(convert.depth_to_message(np.ones((480, 640)), HEADER), sent(info), rectified)


@pytest.mark.parametrize('camera', [LENS, CameraModel(W, H, LENS.matrix, 'plumb_bob', np.array(BARREL))], ids=str)
def test_a_camera_comes_back_from_its_message(camera):
    back = convert.camera_from_message(sent(convert.camera_to_message(camera, HEADER)))
    assert (back.width, back.height) == (W, H)
    np.testing.assert_array_equal(back.matrix, camera.matrix)
    np.testing.assert_array_equal(back.distortion, camera.distortion)


def some_people():
    """Three people: complete, with one joint of each status, with none."""
    random = np.random.default_rng(3)
    xyz = random.uniform(-3, 3, (3, K, 3))
    status = np.full((3, K), MEASURED)
    status[1], status[2] = MISSING, MISSING
    status[1, 4], status[1, 7] = INFERRED, MEASURED
    xyz[status == MISSING] = np.nan
    confidence = random.uniform(0.1, 1, (3, K)) * (status != MISSING)
    sigma = np.where(status == INFERRED, 0.05, np.nan)
    velocity = np.where(np.isnan(xyz), np.nan, random.uniform(-2, 2, (3, K, 3)))
    velocity[0, 5] = np.nan
    return People3D(COCO_18, xyz, confidence, status, sigma, [4, 17, 2], velocity, [0.5, 1.0, 0.625])


def test_no_people_come_back_as_none():
    none = People3D.empty(COCO_18)
    assert convert.people_to_messages(none, HEADER) == convert.velocities_to_messages(none) == []
    assert convert.people_to_transforms(none, HEADER) == []
    array = sent(convert.people_to_array(none, HEADER))
    assert (array.pose_model, array.header.frame_id) == ('COCO_18', 'camera')
    assert array.persons == array.velocities == [] and len(array.existence) == 0
    assert len(convert.people_from_array(array)) == 0


def test_people_come_back_from_their_messages():
    people = some_people()
    array = sent(convert.people_to_array(people, HEADER))
    assert (array.pose_model, array.header.frame_id) == ('COCO_18', 'camera')
    back = convert.people_from_array(array)
    assert back.skeleton is COCO_18
    for name in ('xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity', 'existence'):
        np.testing.assert_array_equal(getattr(back, name), getattr(people, name), name)
    array.existence = []
    np.testing.assert_array_equal(convert.people_from_array(array).existence, [1, 1, 1])


@pytest.mark.parametrize('change, match', [
    ({'existence': [0.5, 0.5]}, 'existence: expected'), ({'existence': [0.5, 0.5, 1.25]}, 'existence: expected'),
    ({'existence': [np.nan, 0.5, 0.5]}, 'existence: expected'), ({'velocities': 2}, '2 velocities of 3 persons'),
    ({'pose_model': 'SPIDER'}, 'SPIDER.*' + '.*'.join(SKELETONS)), ({'x': np.nan}, 'MISSING')], ids=str)
def test_bad_people_are_refused(change, match):
    array = convert.people_to_array(some_people(), HEADER)
    array.existence = change.get('existence', array.existence)
    array.velocities = array.velocities[:change.get('velocities', 3)]
    array.pose_model = change.get('pose_model', array.pose_model)
    array.persons[0].neck.x = change.get('x', array.persons[0].neck.x)
    with pytest.raises(BadInputError, match=match):
        convert.people_from_array(sent(array))


def test_each_position_is_a_frame_of_its_own():
    people = some_people()
    transforms = {transform.child_frame_id: transform for transform in convert.people_to_transforms(people, HEADER)}
    assert set(transforms) == {f'person_4/{joint}' for joint in COCO_18.joints} | {
        'person_17/right_wrist', 'person_17/left_wrist'}
    wrist = sent(transforms['person_17/right_wrist'])
    assert wrist.header.frame_id == 'camera'
    rotation, translation = convert.rotation_and_translation(wrist)
    np.testing.assert_array_equal(rotation, np.eye(3))
    np.testing.assert_array_equal(translation, people.xyz[1, COCO_18.index['right_wrist']])
    rotation, elbow = convert.rotation_and_translation(sent(transforms['person_4/right_elbow']))
    forearm = people.xyz[0, COCO_18.index['right_wrist']] - elbow
    np.testing.assert_allclose(rotation[:, 0], forearm / np.linalg.norm(forearm), atol=1e-6)


def test_markers_carry_header_pose_lifetime_and_points():
    points = np.array([(0, 0, 1), (0.5, -0.5, 2)], np.float32)
    spec = MarkerSpec('skeleton', 7, 'add', 'line_list', points, 0.03, (0, 0, 1, 0.5), lifetime=0.25)
    marker = sent(convert.marker_to_message(spec, HEADER))
    assert (marker.ns, marker.id, marker.type, marker.action) == ('skeleton', 7, Marker.LINE_LIST, Marker.ADD)
    assert marker.header.frame_id == 'camera' and marker.lifetime.to_sec() == 0.25
    orientation = marker.pose.orientation
    assert (orientation.x, orientation.y, orientation.z, orientation.w) == (0, 0, 0, 1)
    assert (marker.color.r, marker.color.g, marker.color.b, marker.color.a) == (0, 0, 1, 0.5)
    np.testing.assert_array_equal([(point.x, point.y, point.z) for point in marker.points], points)


@pytest.mark.parametrize('kind, scale', [('sphere_list', (1, 1, 1)), ('line_list', (1, 0, 0)), ('arrow', (1, 2, 3)),
                                         ('text', (0, 0, 1))])
def test_markers_have_the_scale_that_rviz_reads(kind, scale):
    """RViz warns of any other one."""
    spec = MarkerSpec('skeleton', 7, 'add', kind, np.ones((2, 3), np.float32), 0.5, (0, 0, 1, 0.5))
    found = convert.marker_to_message(spec, HEADER).scale
    assert (found.x, found.y, found.z) == tuple(0.5 * each for each in scale)


@pytest.mark.parametrize('angles', [(0, 0, 0), (90, 0, 0), (0, 180, 0), (-95, 10, 170), (20, -30, 40)], ids=str)
def test_a_transform_comes_back_from_its_message(angles):
    matrix = np.eye(4)
    matrix[:3, :3] = np.transpose(Rotation.from_euler('xyz', angles, degrees=True).apply(np.eye(3)))
    matrix[:3, 3] = 1, -2, 0.5
    message = sent(convert.transform_from_matrix(matrix, Header(frame_id='world'), 'camera'))
    assert (message.header.frame_id, message.child_frame_id) == ('world', 'camera')
    rotation, translation = convert.rotation_and_translation(message)
    np.testing.assert_allclose(rotation, matrix[:3, :3], atol=1e-9)
    np.testing.assert_array_equal(translation, (1, -2, 0.5))


def two_of(points):
    """Points of two hands or faces: the first MEASURED, the second INFERRED but for its last, which is MISSING."""
    xyz = np.arange(2 * points * 3, dtype=np.float32).reshape(2, points, 3)
    status = np.repeat([[MEASURED], [INFERRED]], points, axis=1)
    sigma, confidence = np.full((2, points), 0.125, np.float32), np.full((2, points), 0.5, np.float32)
    xyz[1, -1], status[1, -1], sigma[1, -1], confidence[1, -1] = np.nan, MISSING, np.nan, 0
    return Points3D(xyz, confidence, status, sigma)


def assert_same(one, other, *names):
    for name in ('xyz', 'confidence', 'status', 'sigma'):
        np.testing.assert_array_equal(getattr(one.points, name), getattr(other.points, name))
    for name in names:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_hands_go_into_a_message_and_come_back():
    hands = Hands3D(two_of(HAND_POINTS), np.array([0.5, 0.75], np.float32), np.array([3, 7]), np.array([True, False]))
    array = sent(convert.hands_to_array(hands, HEADER))
    assert [(hand.person_ID, hand.side, hand.header.frame_id) for hand in array.hands] == [
        (3, HandDetection_3d.LEFT, 'camera'), (7, HandDetection_3d.RIGHT, 'camera')]
    assert_same(convert.hands_from_array(array), hands, 'scores', 'people', 'left')


def test_faces_go_into_a_message_and_come_back_with_the_direction_of_the_head():
    turns = np.array([[0.5, -0.5, 0.5, 0.5], [np.nan] * 4], np.float32)  # the second is not known
    faces = Faces3D(two_of(FACE_POINTS), np.array([0.5, 0.75], np.float32), np.array([3, 7]), turns,
                    np.array([0.25, np.nan], np.float32))
    array = sent(convert.faces_to_array(faces, HEADER))
    first = array.faces[0].orientation
    assert (first.x, first.y, first.z, first.w) == (0.5, -0.5, 0.5, 0.5)
    assert_same(convert.faces_from_array(array), faces, 'scores', 'people', 'orientations', 'orientation_sigma')


@pytest.mark.parametrize('change, match', [
    ({'side': 0}, 'side of a hand is 0'), ({'status': 3}, 'status of a point is 3'),
    ({'status': MISSING}, 'status must be MISSING exactly'),
])
def test_a_bad_hand_is_refused(change, match):
    part = BodypartDetection_3d(1, 2, 3, 0.5, change.get('status', MEASURED), 0.125)
    hand = HandDetection_3d(side=change.get('side', HandDetection_3d.LEFT), keypoints=[part] * HAND_POINTS)
    with pytest.raises(BadInputError, match=match):
        convert.hands_from_array(HandDetection_3dArray(hands=[hand]))
