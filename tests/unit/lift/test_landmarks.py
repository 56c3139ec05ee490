"""Hands and faces in space, before flat surfaces at known depths."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.landmarks.face_points import SHAPE, with_depth
from openpose_ros_pkg.landmarks.records import FACE_POINTS, MESH_POINTS, Faces2D, Hands2D, Landmarks2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.lift.landmarks import lift_landmarks
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.transform import transform_landmarks

SIZE, FOCAL = (640, 480), 500.0
CAMERA = CameraModel(*SIZE, np.array([[FOCAL, 0, 319.5], [0, FOCAL, 239.5], [0, 0, 1]]))
NO_PEOPLE = People3D.empty(COCO_18)
# An open hand in its plane, wrist at the origin, fingers up [m].
OPEN_HAND = np.array([(0.0, 0.0)] + [(x * (1 + 0.3 * k), y * (1 + 0.35 * k)) for x, y in (
    (-0.03, -0.03), (-0.02, -0.08), (0.0, -0.085), (0.02, -0.08), (0.035, -0.07)) for k in range(4)])
FLESH = METHOD.landmarks.flesh


def wall(depth):
    return np.full(SIZE[::-1], round(1000 * depth), np.uint16)


def hand(depth, middle=(0.1, 0.05), person=1, left=True):
    """Return an open hand whose surface is at a depth [m], in the image."""
    xy = FOCAL * (OPEN_HAND + middle) / depth + CAMERA.matrix[:2, 2]
    return Hands2D(np.column_stack([xy, np.full(21, 0.9)])[np.newaxis], [0.9], [person], [left])


def lifted(hands, depth_image, people=NO_PEOPLE):
    found = Landmarks2D(hands, Faces2D.empty())
    return lift_landmarks(found, DepthImage(depth_image, CAMERA), SIZE, people).hands


def with_wrist(depth, status=MEASURED, person=1):
    """Return a person whose left wrist is at a depth [m]."""
    xyz, states = np.full((1, 18, 3), np.nan), np.zeros((1, 18))
    wrist = COCO_18.index['left_wrist']
    xyz[0, wrist], states[0, wrist] = (0.1, 0.05, depth), status
    return People3D(COCO_18, xyz, np.ones((1, 18)), states, np.full((1, 18), 0.03), [person])


def test_points_lie_under_the_skin_of_a_hand():
    points = lifted(hand(1.0), wall(1.0)).points
    assert (points.status == MEASURED).all()
    assert points.xyz[0, 0, 2] == pytest.approx(1.0 + FLESH[0], abs=1e-3)  # the wrist is the thickest
    assert points.xyz[0, [8, 12, 16, 20], 2] == pytest.approx(1.0 + FLESH[4], abs=1e-3)  # finger tips
    np.testing.assert_allclose(points.xyz[0, :, :2] / points.xyz[0, :, 2:], np.add(OPEN_HAND, (0.1, 0.05)), atol=1e-3)


@pytest.mark.parametrize('size', [(320, 240), (960, 720)])
def test_the_image_may_be_larger_or_smaller_than_the_points(size):
    hands = hand(1.0)
    scale = size[0] / SIZE[0]
    keypoints = hands.keypoints * [scale, scale, 1] + [0.5 * scale - 0.5, 0.5 * scale - 0.5, 0]
    found = Landmarks2D(Hands2D(keypoints, hands.scores, hands.people, hands.left), Faces2D.empty())
    points = lift_landmarks(found, DepthImage(wall(1.0), CAMERA), size, NO_PEOPLE).hands.points
    np.testing.assert_allclose(points.xyz, lifted(hands, wall(1.0)).points.xyz, atol=1e-3)


def test_a_finger_beyond_which_the_wall_is_seen_is_inferred_beside_its_base():
    hands, depth = hand(1.0), wall(1.0)
    x, y = np.rint(hands.keypoints[0, 8, :2]).astype(int)  # tip of the index finger
    depth[y - 3:y + 4, x - 3:x + 4] = 2000
    points = lifted(hands, depth).points
    assert points.status[0, 8] == INFERRED and (np.delete(points.status[0], 8) == MEASURED).all()
    assert points.xyz[0, 8, 2] == pytest.approx(1.0, abs=0.02)
    assert points.sigma[0, 8] > 1.5 * points.sigma[0, 12]


def test_a_hand_without_any_depth_is_left_out():
    assert len(lifted(hand(1.0), wall(0.0))) == 0


def test_a_hand_far_from_the_wrist_of_the_person_is_not_theirs():
    assert len(lifted(hand(1.0), wall(2.0), with_wrist(1.0))) == 0
    assert len(lifted(hand(1.0), wall(1.1), with_wrist(1.0))) == 1
    assert len(lifted(hand(1.0), wall(2.0), with_wrist(1.0, INFERRED))) == 1  # that wrist was not seen
    assert len(lifted(hand(1.0), wall(2.0), with_wrist(1.0, person=2))) == 1  # the wrist of another person


def two_hands(depth, gap, binning=1):
    """Return the points of a left hand whose surface is seen, and of the right one behind it by a gap [m].

    The depth image has one pixel for each binning x binning pixels of the image.
    """
    front, back = hand(depth), hand(depth, middle=(0.103, 0.05), left=False)
    both = Hands2D(np.concatenate([front.keypoints, back.keypoints]), [0.9, 0.9], [1, 1], [True, False])
    xyz, status = np.full((1, 18, 3), np.nan), np.zeros((1, 18))
    for side, z in (('left', depth), ('right', depth + gap)):
        xyz[0, COCO_18.index[f'{side}_wrist']], status[0, COCO_18.index[f'{side}_wrist']] = (0.1, 0.05, z), MEASURED
    people = People3D(COCO_18, xyz, np.ones((1, 18)), status, np.full((1, 18), 0.03), [1])
    return lifted(both, wall(depth)[::binning, ::binning], people).points


@pytest.mark.parametrize('binning', [1, 2, 4])  # a coarser depth image tells the same of the hands of an image
def test_points_behind_another_hand_are_inferred_between_its_surface_and_the_own_wrist(binning):
    points = two_hands(1.0, gap=0.1, binning=binning)
    assert (points.status[0] == MEASURED).all() and (points.status[1] == INFERRED).all()
    assert points.xyz[1, 8, 2] == pytest.approx(1.06 + FLESH[4], abs=1e-3)  # of 1.02 and 1.10


@pytest.mark.parametrize('left, shows_back', [(True, False), (False, True)])
def test_the_end_of_a_finger_folded_behind_the_own_hand_is_inferred_behind_it(left, shows_back):
    # thumb at the left of the image: the palm of a left hand, the back of a right one
    hands = hand(1.0, left=left)
    keypoints = hands.keypoints.copy()
    keypoints[0, 8, :2] = keypoints[0, [0, 5], :2].mean(axis=0)  # tip of the index finger on the palm
    points = lifted(Hands2D(keypoints, hands.scores, hands.people, hands.left), wall(1.0)).points
    assert (points.status[0, 8] == INFERRED) == shows_back and (np.delete(points.status[0], 8) == MEASURED).all()
    behind = 2 * METHOD.landmarks.half_finger if shows_back else 0.0
    assert points.xyz[0, 8, 2] == pytest.approx(1.0 + behind + FLESH[4], abs=1e-3)


# Where the middle of the face is [m], and how the line of sight to it is turned from the optical axis.
PLACE = np.array([0.2, -0.1, 1.5])
SIGHT = Rotation.from_rotvec(np.cross([0, 0, 1], PLACE) / np.hypot(*PLACE[:2]) * np.arctan2(np.hypot(*PLACE[:2]), 1.5))


def face_shape():
    """Return the mesh of a head that looks along -z, (468, 3) [m]: x to its left, y down; half an ellipsoid."""
    x, y = np.random.default_rng(1).uniform(-1, 1, (2, 4 * MESH_POINTS))
    inside = np.hypot(x, y) < 0.95
    x, y = x[inside][:MESH_POINTS], y[inside][:MESH_POINTS]
    mesh = np.stack([0.07 * x, 0.1 * y, 0.08 * (1 - np.sqrt(1 - x ** 2 - y ** 2))], axis=1)
    for points, place in (((263, 33), (0.045, -0.03)), ((362, 133), (0.015, -0.03)), ((291, 61), (0.025, 0.04)),
                          ((454, 234), (0.065, 0.0)), ((389, 162), (0.06, -0.02)), ((397, 172), (0.055, 0.05))):
        # eyes and mouth are as far forward as each other: the head looks square to the line between them
        far = 0.02 if points[0] in (263, 362, 291) else 0.06
        mesh[list(points)] = [(*place, far), (-place[0], place[1], far)]
    return mesh - mesh.mean(axis=0)


def face(turn, error=0.0):
    """Return a face at `PLACE`, turned from looking into the camera along the line of sight, as the network gives it.

    Args:
        error: by which it looks too far down in the mesh, which is right in the image [deg].
    """
    mesh = turn.apply(face_shape())
    mesh[:, 2] -= np.tan(np.radians(error)) * mesh[:, 1]
    mesh *= FOCAL / PLACE[2]
    mesh[:, :2] += FOCAL * PLACE[:2] / PLACE[2] + CAMERA.matrix[:2, 2]
    keypoints = np.tile([*(mesh[:, :2].mean(axis=0)), 0.9], (1, FACE_POINTS, 1))
    return Landmarks2D(Hands2D.empty(), Faces2D(keypoints, mesh[np.newaxis], [0.9], [1]))


def surface(turn, noise=0.0, seed=0):
    """Return the depth image of that face, with noise [m]; nothing is seen around it."""
    points, image = turn.apply(face_shape()), np.zeros(SIZE[::-1], np.uint16)
    at = np.round(points[:, :2] * FOCAL / PLACE[2] + FOCAL * PLACE[:2] / PLACE[2] + CAMERA.matrix[:2, 2]).astype(int)
    seen = points + SIGHT.inv().apply(PLACE)
    depth = SIGHT.apply(seen)[:, 2] + np.random.default_rng(seed).normal(0, noise, len(points))
    for row in np.argsort(-points[:, 2]):
        image[at[row, 1] - 1:at[row, 1] + 2, at[row, 0] - 1:at[row, 0] + 2] = round(1000 * depth[row])
    return image


def lifted_face(found, depth_image, turn):
    """Return by how much its direction is off the true one, and its sigma [deg]."""
    faces = lift_landmarks(found, DepthImage(depth_image, CAMERA), SIZE, NO_PEOPLE).faces
    forward, true = Rotation.from_quat(faces.orientations[0]).apply([1, 0, 0]), SIGHT.apply(turn.apply([0, 0, -1]))
    return np.degrees([np.arccos(forward @ true), faces.orientation_sigma[0]])


@pytest.mark.parametrize('yaw', [-40.0, 0.0, 25.0])
@pytest.mark.parametrize('pitch', [-20.0, 0.0, 20.0])
def test_the_head_looks_where_the_mesh_is_turned_to_from_the_line_of_sight(yaw, pitch):
    turn = Rotation.from_euler('yx', [yaw, pitch], degrees=True)
    for depth_image in (surface(turn), np.zeros(SIZE[::-1], np.uint16)):
        assert lifted_face(face(turn), depth_image, turn)[0] < 1.5


@pytest.mark.parametrize('yaw', [-40.0, 0.0, 25.0])
@pytest.mark.parametrize('error', [-9.0, 9.0])
def test_depth_corrects_the_tilt_of_a_mesh(yaw, error):
    turn = Rotation.from_euler('yx', [yaw, 5.0], degrees=True)
    off, sigma = lifted_face(face(turn, error), surface(turn, 0.004), turn)
    without, wider = lifted_face(face(turn, error), np.zeros(SIZE[::-1], np.uint16), turn)
    assert off < 3.5 < 6 < without
    assert off < sigma < wider < 12 and without < 2 * wider


def test_the_direction_of_a_head_that_is_turned_away_is_less_certain():
    ahead, away = (Rotation.from_euler('y', yaw, degrees=True) for yaw in (0.0, 70.0))
    assert lifted_face(face(away), surface(away), away)[1] > 1.5 * lifted_face(face(ahead), surface(ahead), ahead)[1]


AHEAD = Rotation.from_quat([0.0, 0.0, 0.0, 1.0])


def average_face(turn, missing=()):
    """Return a face as a network for whole bodies gives it, in the middle of the image."""
    shape = turn.apply(SHAPE * (1, -1, -1)) / 100 * FOCAL / 1.5
    keypoints = np.column_stack([shape[:, :2] + CAMERA.matrix[:2, 2], np.full(FACE_POINTS, 0.9)])
    keypoints[list(missing)] = np.nan, np.nan, 0
    return Landmarks2D(Hands2D.empty(), Faces2D(keypoints[np.newaxis], with_depth(keypoints)[np.newaxis], [0.9], [1]))


def lifted_average_face(depth, turn=AHEAD, missing=()):
    """Return that face before a wall at a depth [m], 0: none."""
    return lift_landmarks(average_face(turn, missing), DepthImage(wall(depth), CAMERA), SIZE, NO_PEOPLE).faces


@pytest.mark.parametrize('missing', [(), (3, 17, 48)])
@pytest.mark.parametrize('yaw, pitch', [(-40.0, 0.0), (0.0, 15.0), (25.0, -10.0)])
def test_the_points_of_an_average_face_tell_the_direction_of_the_head_without_a_mesh(yaw, pitch, missing):
    turn = Rotation.from_euler('yx', [yaw, pitch], degrees=True)
    ahead, turned = (Rotation.from_quat(lifted_average_face(0.0, one, missing).orientations[0]).apply([1, 0, 0])
                     for one in (AHEAD, turn))
    # the mouth of an average face is a little before the eyes
    assert np.degrees(np.arccos(ahead @ [0, 0, -1])) < 8
    np.testing.assert_allclose(turned, turn.apply(ahead), atol=0.02)


def test_a_face_of_too_few_points_has_no_direction():
    missing = [number for number in range(FACE_POINTS) if number not in (36, 39, 45)]
    faces = lifted_average_face(1.5, missing=missing)
    assert np.isnan(faces.orientations).all() and np.isnan(faces.orientation_sigma).all()
    assert (faces.points.status[0, [36, 39, 45]] == MEASURED).all()


def test_in_another_frame_points_and_heads_turn_together():
    turn, shift = Rotation.from_euler('z', 90, degrees=True), np.array([1.0, 2.0, 3.0])
    matrix = turn.apply(np.eye(3)).T
    before = lift_landmarks(face(Rotation.from_rotvec([0, 0, 0])), DepthImage(wall(1.5), CAMERA), SIZE, NO_PEOPLE)
    after = transform_landmarks(before, matrix, shift)
    np.testing.assert_allclose(after.faces.points.xyz, before.faces.points.xyz @ matrix.T + shift, atol=1e-5)
    forward = [Rotation.from_quat(one.faces.orientations[0]).apply([1, 0, 0]) for one in (before, after)]
    np.testing.assert_allclose(forward[1], turn.apply(forward[0]), atol=1e-5)
    nothing = transform_landmarks(Landmarks3D(), matrix, shift)
    assert len(nothing.hands) == len(nothing.faces) == 0
