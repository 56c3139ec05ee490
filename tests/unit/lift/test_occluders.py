"""Who or what is in front of a keypoint: other people, the own body, furniture."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift import occluders
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import Person, Pose, Room, pinhole, pointing, render, standing

CAMERA = pinhole(320, 180)
FOCAL = 180.0
INDEX = COCO_18.index


def rows(*names):
    return [INDEX[name] for name in names]


def folded_arm():
    """Return a pose with the left wrist before the trunk."""
    rest = standing(8)
    fore = np.stack([rest.forearms[0], pointing(60, -40, 1)])
    return Pose(rest.upper_arms, fore, rest.thighs, rest.shins)


def scene(pose):
    return render(CAMERA, [Person(1, 0.0, 2.6, pose)], Room(wall=4.5))


def observed(frame):
    return observe(frame.people, frame.size, DepthImage(frame.depth, frame.camera), frame.camera)


def flat(frame):
    seen, root = observed(frame), np.array([2.6])
    covered = METHOD.compiled.covered_by_self(seen.uv, root, seen.focal)
    return occluders.flat_arms(DepthImage(frame.depth, frame.camera), seen, covered)


def test_a_hand_that_is_held_out_is_the_own_one():
    rest = standing(5)
    forwards = np.stack([pointing(80, 5, side) for side in (-1, 1)])
    frame = scene(Pose(forwards, forwards, rest.thighs, rest.shins))
    u, v = np.rint(frame.people.xy[0, INDEX['left_wrist']]).astype(int)
    assert frame.depth[v, u] < 1000 * (2.6 - 0.4), 'far in front of the trunk'
    assert not flat(frame)[0, rows('left_elbow', 'right_elbow', 'left_wrist', 'right_wrist')].any()


def test_a_flat_chest_where_a_wrist_should_be_is_hardly_the_wrist():
    # the wrist is behind the back, its keypoint on the trunk
    frame = scene(standing(2))
    keypoints = frame.people.keypoints.copy()
    keypoints[0, INDEX['left_wrist'], :2] = frame.people.xy[0, rows('left_hip', 'right_hip', 'neck')].mean(axis=0)
    seen = observed(frame)
    uv = keypoints[..., :2].astype(float)
    points, root = DepthImage(frame.depth, CAMERA), np.array([2.6])
    depth = seen.samples.copy()
    u, v = np.rint(uv[0, INDEX['left_wrist']]).astype(int)
    depth[0, INDEX['left_wrist']] = frame.depth[v, u] / 1000
    covered = METHOD.compiled.covered_by_self(uv, root, FOCAL)
    assert covered[0, INDEX['left_wrist']]
    beside = replace(seen, uv=uv, samples=depth)
    assert occluders.flat_arms(points, beside, covered)[0, INDEX['left_wrist']]
    # a folded arm stands out from the trunk
    assert not flat(scene(folded_arm()))[0, INDEX['left_wrist']]


@pytest.mark.parametrize('towards, share', [(0.9, 0.15), (-0.9, 1.0)], ids=['left', 'right'])
def test_a_limb_of_the_side_that_is_turned_away_is_hardly_seen_on_the_body(towards, share):
    frame, wrist = scene(folded_arm()), INDEX['left_wrist']
    facing, turned = (occluders.ownership(DepthImage(frame.depth, CAMERA), observed(frame), np.array([2.6]), left)[0][0]
                      for left in (np.zeros((1, 3)), np.array([[0.2, 0.0, towards]])))
    assert turned[wrist] == pytest.approx(share * facing[wrist])


@pytest.mark.parametrize('off, is_covered', [(0.0, True), (0.07, True), (0.09, False), (1.5, False)])
def test_a_keypoint_beside_another_body_is_covered_within_the_breadth_of_its_parts(off, is_covered):
    """`off`: distance from the middle of a forearm, whose half breadth is 0.08 m, to the side [m]."""
    frame, place = scene(standing(0)), [INDEX['left_elbow'], INDEX['left_wrist']]
    uv = np.repeat(observed(frame).uv, 2, axis=0)
    outwards = np.sign(uv[0, place, 0].mean() - uv[0, INDEX['neck'], 0])
    uv[1] = uv[0, place].mean(axis=0) + np.array([outwards * off * FOCAL / 2.6, 0.0])
    uv[1, 0] = np.nan
    depths = METHOD.compiled.others_depths(uv, np.full((2, 18), 2.6), FOCAL)
    assert np.isinf(depths[:, :, 1][1]).all() and np.isinf(depths[1, 0]).all(), 'neither oneself nor without a keypoint'
    np.testing.assert_allclose(depths[1, 1:, 0], 2.6 if is_covered else np.inf)
