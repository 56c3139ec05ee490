"""Several opinions on the same people become one."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from known_fields import FRONT
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.detect.recipes import DetectorParams
from openpose_ros_pkg.ensemble import group, sigmas, stacked, vote, vote_with_crops, without_duplicates
from openpose_ros_pkg.people import People2D, Poses
from openpose_ros_pkg.skeletons import BODY_25, COCO_18

SIGMAS = sigmas(COCO_18)
WRIST, NOSE = COCO_18.index['right_wrist'], COCO_18.index['nose']


def pose(x, score=0.9, height=200.0, y=50.0):
    """(18, 3) of a person with the nose at x, y."""
    return np.column_stack([height * FRONT + (x, y), np.full(18, score)]).astype(np.float32)


def grouped(*sources):
    """Sources and first x of each person's poses: [{source: x}]."""
    people = group([np.array(source, np.float32).reshape(-1, 18, 3) for source in sources], SIGMAS)
    return sorted(({number: round(float(found[NOSE, 0])) for number, found in person.items()} for person in people),
                  key=lambda person: min(person.values()))


def test_the_more_alike_pose_is_the_person():
    """Both poses of the second source would do; the other one stays a person of its own."""
    assert grouped([pose(100)], [pose(112), pose(99)]) == [{0: 100, 1: 99}, {1: 112}]


def test_agreement_gives_the_place_and_the_score():
    """Score: the root of the mean over the sources of their scores."""
    result = vote(np.stack([pose(100), pose(100)]), np.ones(2), SIGMAS)
    assert result.shape == (18, 3) and result.dtype == np.float32
    np.testing.assert_allclose(result[:, :2], pose(100)[:, :2], atol=1e-4)
    np.testing.assert_allclose(result[:, 2], np.sqrt(0.9), atol=1e-5)


def test_an_outlier_is_left_out():
    """Two of three agree on the wrist; the third, though surest, neither moves it nor adds to its score."""
    poses = [pose(100, 0.6), pose(101, 0.6), pose(100, 1.0)]
    poses[2][WRIST, :2] += (120, -60)
    result = vote(np.stack(poses), np.ones(3), SIGMAS)
    np.testing.assert_allclose(result[WRIST, :2], pose(100.5)[WRIST, :2], atol=0.1)
    assert result[WRIST, 2] == pytest.approx(np.sqrt(1.2 / 3), abs=0.01)
    assert result[NOSE, 2] == pytest.approx(np.sqrt(2.2 / 3), abs=0.02)


def test_joints_that_no_crop_can_show_keep_what_the_full_image_says():
    """BODY_25 by a network on the full image; Thunder's crop has no feet and says the rest lies 4 px further right."""
    recipe = recipe_of(DetectorParams(pose_model='body_25', look_closer=20))
    search = np.full((25, 3), 0.8, np.float32)
    search[:, :2] = np.random.default_rng(0).uniform(0, 200, (25, 2))
    feet = [i for i, joint in enumerate(BODY_25.joints) if 'toe' in joint or 'heel' in joint]
    crop = search + np.array([4, 0, 0], np.float32)
    crop[feet] = (np.nan, np.nan, 0)
    result = vote_with_crops(np.stack([search, crop]), recipe.sources)
    alone = vote(search[None], recipe.sources.weights[:1], sigmas(BODY_25))
    np.testing.assert_allclose(result[feet], alone[feet], atol=1e-5)
    others = [i for i in range(25) if i not in feet]
    shift = result[others, 0] - search[others, 0]
    assert (shift > 0).all() and (shift < 4).all()
    unseen = vote_with_crops(stacked([{0: search}], 2, 25)[0], recipe.sources)
    assert (unseen[others, 2] < result[others, 2]).all()
    np.testing.assert_allclose(unseen[feet], result[feet], atol=1e-5)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 2 ** 32 - 1), count=st.integers(1, 5), noise=st.sampled_from([0.0, 2.0, 20.0, 300.0]),
       share=st.sampled_from([0.0, 0.3, 0.9]), silent=st.integers(0, 2))
def test_any_opinions_give_a_pose_among_them(seed, count, noise, share, silent):
    """Whatever they are: valid, within the box of the opinions, and the order of the sources does not matter."""
    random = np.random.default_rng(seed)
    poses = np.stack([pose(100)] * count)
    poses[..., :2] += random.normal(0, noise, (count, 18, 2))
    poses[..., 2] = random.uniform(0.01, 1, (count, 18))
    poses[random.uniform(size=(count, 18)) < share] = (np.nan, np.nan, 0)
    poses[:, 0] = pose(100)[0]  # a pose has a joint at least
    weights = random.uniform(0.5, 3, count + silent)
    result = vote(stacked([dict(enumerate(poses))], count + silent, 18)[0], weights, SIGMAS)
    People2D(COCO_18, result[np.newaxis], [0.5], [-1])
    there = result[:, 2] > 0
    np.testing.assert_array_equal(there, np.isfinite(poses[..., 0]).any(axis=0))
    assert (result[:, 2] <= 1 + 1e-6).all()
    low, high = np.nanmin(poses[:, there, :2], axis=0), np.nanmax(poses[:, there, :2], axis=0)
    assert (result[there, :2] >= low - 1e-2).all() and (result[there, :2] <= high + 1e-2).all()
    backwards = stacked([dict(enumerate(poses))], count + silent, 18)[0, ::-1]
    np.testing.assert_allclose(vote(backwards, weights[::-1], SIGMAS), result, atol=1e-2)


def test_of_people_who_are_almost_the_same_the_surest_stays_also_with_left_and_right_exchanged():
    people = np.stack([pose(100), pose(400), pose(102), pose(401)[list(COCO_18.swap)], pose(140)[list(COCO_18.swap)]])
    scores = np.array([0.5, 0.9, 0.7, 0.3, 0.6], np.float32)
    assert without_duplicates(Poses(people, scores), SIGMAS, COCO_18.swap).tolist() == [1, 2, 4]
