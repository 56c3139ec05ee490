"""The frames of joints in known poses, however the body is turned; the convention is in docs/ros_api.md."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.skeletons import SKELETONS
from skeleton_extract_3d.body.joint_frames import joint_frames
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.points.transform import quaternions, transform_people

BODY_25, COCO_18 = SKELETONS['BODY_25'], SKELETONS['COCO_18']
X, Y, Z = np.eye(3)
# x forwards, y to the left, z up [m]; joints of the left side are mirrored to the right.
TRUNK = {'neck': (0, 0, 1.4), 'mid_hip': (0, 0, 0.9), 'nose': (0.105, 0, 1.57)}
LEFT = {'shoulder': (0, 0.17, 1.4), 'elbow': (0, 0.45, 1.4), 'wrist': (0, 0.70, 1.4), 'hip': (0, 0.1, 0.9),
        'knee': (0, 0.1, 0.5), 'ankle': (0, 0.1, 0.1), 'big_toe': (0.2, 0.1, 0.1), 'small_toe': (0.18, 0.15, 0.1),
        'heel': (-0.05, 0.1, 0.05), 'eye': (0.085, 0.03, 1.62), 'ear': (0.0, 0.074, 1.60)}


def body(skeleton=BODY_25, **changed):
    """A person in T-pose, with other positions for some joints; None: MISSING."""
    at = {**TRUNK, **{f'left_{joint}': xyz for joint, xyz in LEFT.items()},
          **{f'right_{joint}': (x, -y, z) for joint, (x, y, z) in LEFT.items()}, **changed}
    xyz = np.array([at[joint] or (np.nan,) * 3 for joint in skeleton.joints])[None]
    return of_positions(xyz, skeleton)


def of_positions(xyz, skeleton=BODY_25):
    there = np.isfinite(xyz).all(axis=2)
    return People3D(skeleton, xyz, there * 1.0, np.where(there, MEASURED, MISSING), np.full(there.shape, 0.02),
                    np.arange(len(xyz)))


def axes(people):
    return dict(zip(people.skeleton.joints, joint_frames(people)[0]))


def are(frame, x, y, z):
    np.testing.assert_allclose(frame, np.stack([x, y, z], axis=1), atol=1e-6)


def angle(one, other):
    """Greatest angle between frames [degrees]."""
    return np.degrees(max(np.linalg.norm(Rotation.from_quat(q).as_rotvec())
                          for q in quaternions(np.swapaxes(one, -1, -2).reshape(-1, 3, 3) @ other.reshape(-1, 3, 3))))


def test_no_people():
    frames = joint_frames(People3D.empty(COCO_18))
    assert frames.shape == (0, 18, 3, 3)
    assert quaternions(frames.reshape(-1, 3, 3)).shape == (0, 4)


@pytest.mark.parametrize('skeleton', [BODY_25, COCO_18, SKELETONS['COCO_17']], ids=lambda skeleton: skeleton.name)
def test_t_pose(skeleton):
    frames = axes(body(skeleton))
    for joint in ('neck', 'mid_hip', 'nose', 'left_eye', 'right_ear'):
        if joint in frames:
            are(frames[joint], X, Y, Z)
    for joint in ('left_shoulder', 'left_elbow', 'left_wrist'):
        are(frames[joint], Y, Z, X)
    for joint in ('right_shoulder', 'right_elbow', 'right_wrist'):
        are(frames[joint], -Y, -Z, X)
    for joint in ('left_hip', 'left_knee', 'right_hip', 'right_knee'):
        are(frames[joint], -Z, Y, X)
    for joint in ('left_ankle', 'right_big_toe', 'left_heel'):
        if 'left_big_toe' in frames:
            are(frames[joint], X, Y, Z)  # the foot points forwards
    if 'left_big_toe' not in frames:
        are(frames['left_ankle'], -Z, Y, X)


def test_bent_limbs_have_the_axis_of_the_bend_as_y():
    """Arms that hang with the forearms forwards; shins backwards: y points to the left in all of them."""
    changed = {}
    for side, y in (('left', 0.17), ('right', -0.17)):
        changed.update({f'{side}_elbow': (0, y, 1.12), f'{side}_wrist': (0.25, y, 1.12),
                        f'{side}_ankle': (-0.4, y * 0.1 / 0.17, 0.5)})
    frames = axes(body(COCO_18, **changed))
    for side in ('left', 'right'):
        are(frames[f'{side}_shoulder'], -Z, Y, X)
        are(frames[f'{side}_elbow'], X, Y, Z)
        are(frames[f'{side}_hip'], -Z, Y, X)
        are(frames[f'{side}_knee'], -X, Y, -Z)
        are(frames[f'{side}_ankle'], -X, Y, -Z)


def test_what_is_not_known_has_the_frame_of_the_joint_before():
    frames = axes(body(COCO_18, left_wrist=None, right_elbow=None, left_ear=None, right_ear=None, left_ankle=None))
    are(frames['left_elbow'], Y, Z, X)
    are(frames['left_knee'], -Z, Y, X)
    for joint in ('right_shoulder', 'right_wrist', 'nose'):
        are(frames[joint], X, Y, Z)
    one_ear = axes(body(COCO_18, left_ear=None))
    are(one_ear['nose'], X, Y, Z)
    no_hips = axes(body(COCO_18, left_hip=None, right_hip=None, left_shoulder=None))
    are(no_hips['neck'], X, Y, Z)  # the axes of the frame of reference
    are(no_hips['left_elbow'], Y, Z, X)
    lying = joint_frames(transform_people(body(COCO_18, left_hip=None, right_hip=None), ROLL, np.zeros(3)))[0]
    are(lying[COCO_18.index['neck']], X, Y, Z)
    np.testing.assert_allclose(lying[COCO_18.index['left_elbow']][:, 0], ROLL @ Y, atol=1e-6)  # the forearm is known


ROLL = np.array(Rotation.from_rotvec([0.3, 1.2, -0.4]).apply(np.eye(3))).T


positions = st.integers(0, 2 ** 32 - 1).map(np.random.RandomState)


@settings(max_examples=200, deadline=None)
@given(random=positions)
def test_frames_turn_with_the_body_and_are_rotations(random):
    """Any positions of any joints, some of them missing; where the trunk is known frames follow any turn."""
    xyz = body().xyz + random.normal(0, 0.3, (3, 25, 3))
    xyz[random.uniform(size=(3, 25)) < 0.2] = np.nan
    trunk = [BODY_25.index[joint] for joint in ('neck', 'mid_hip', 'left_shoulder', 'right_shoulder')]
    xyz[0, trunk] = body().xyz[0, trunk]
    people = of_positions(xyz)
    frames = joint_frames(people)
    np.testing.assert_allclose(np.swapaxes(frames, -1, -2) @ frames, np.broadcast_to(np.eye(3), frames.shape),
                               atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=1e-9)
    rotations = quaternions(frames.reshape(-1, 3, 3))
    np.testing.assert_allclose(np.linalg.norm(rotations, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(Rotation.from_quat(rotations).apply([1, 0, 0]), frames.reshape(-1, 3, 3)[..., 0],
                               atol=1e-9)
    vector = random.normal(size=3)
    turn = np.array(Rotation.from_rotvec(vector).apply(np.eye(3))).T
    turned = joint_frames(transform_people(people, turn, random.normal(size=3)))
    assert angle((turn @ frames)[0], turned[0]) < 0.1  # positions are float32


def test_frames_are_continuous_when_an_arm_goes_up_and_its_elbow_bends():
    """From hanging to overhead beside the head, then the elbow from straight to 140 degrees, in steps of a degree."""
    frames = []
    shoulder = np.array(LEFT['shoulder'])
    for lift, bend in [(lift, 0) for lift in range(180)] + [(90, bend) for bend in range(141)]:
        along = np.array([0, np.sin(np.radians(lift)), -np.cos(np.radians(lift))])
        further = Rotation.from_rotvec(np.radians(bend) * -X).apply(along) if lift == 90 else along
        elbow = shoulder + 0.28 * along
        people = body(COCO_18, left_elbow=tuple(elbow), left_wrist=tuple(elbow + 0.25 * further))
        frames.append(joint_frames(people)[0, [COCO_18.index['left_shoulder'], COCO_18.index['left_elbow']]])
    for part in (frames[:180], frames[180:]):
        assert max(angle(one, other) for one, other in zip(part, part[1:])) < 12
