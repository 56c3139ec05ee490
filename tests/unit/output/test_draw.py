"""Drawn people: colours, opacity, labels, borders."""
import numpy as np
import pytest

from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18


def people_of(*persons, ids=None, score=0.9):
    """Return People2D from (18, 2) positions; NaN is missing."""
    keypoints = np.zeros((len(persons), 18, 3), np.float32)
    for row, person in zip(keypoints, persons):
        row[:, :2] = person
        row[:, 2] = np.where(np.isfinite(person).all(axis=1), score, 0)
    return People2D(COCO_18, keypoints, np.full(len(persons), 0.9), ids or [-1] * len(persons))


def only(**joints):
    """Return a person with these joints alone."""
    person = np.full((18, 2), np.nan)
    for name, xy in joints.items():
        person[COCO_18.index[name]] = xy
    return person


@pytest.fixture
def photo():
    return np.random.default_rng(0).integers(0, 256, (270, 480, 3), dtype=np.uint8)


def test_limb_has_the_colour_of_its_second_joint_and_needs_both():
    image = np.zeros((270, 480, 3), np.uint8)
    person = only(right_elbow=(100.0, 100.0), right_wrist=(200.0, 100.0), left_wrist=(200.0, 200.0))
    drawn = draw_people(image, people_of(person), DrawParams(alpha_pose=1.0))
    assert tuple(drawn[100, 150]) == COCO_18.colours[COCO_18.index['right_wrist']][::-1]
    assert not drawn[150, 150].any()


@pytest.mark.parametrize('alpha', [0.0, 0.3, 0.6, 1.0])
def test_opacity(alpha):
    image = np.full((270, 480, 3), 100, np.uint8)
    drawn = draw_people(image, people_of(only(nose=(200.0, 100.0))), DrawParams(alpha_pose=alpha))
    colour = np.array(COCO_18.colours[0][::-1])
    np.testing.assert_allclose(drawn[100, 200], alpha * colour + (1 - alpha) * 100, atol=1)
    if alpha == 0:
        np.testing.assert_array_equal(drawn, image)


def hidden_joints(*names):
    """Return which joints of one person are hidden, (1, 18) bool."""
    return np.array([[joint in names for joint in COCO_18.joints]])


def test_hidden_joint_is_a_hollow_circle():
    image, people = np.zeros((540, 960, 3), np.uint8), people_of(only(nose=(200.0, 100.0), left_hip=(400.0, 400.0)))
    drawn = draw_people(image, people, DrawParams(alpha_pose=1.0), hidden_joints('nose'))
    assert not drawn[100, 200].any()
    # a line of one pixel that is smoothed has nowhere the full colour
    circle = drawn[93:108, 193:208].reshape(-1, 3).max(axis=0)
    np.testing.assert_allclose(circle, COCO_18.colours[COCO_18.index['nose']][::-1], rtol=0.4)
    assert tuple(drawn[400, 400]) == COCO_18.colours[COCO_18.index['left_hip']][::-1]


@pytest.mark.parametrize('hidden', [('right_elbow',), ('right_wrist',), ('right_elbow', 'right_wrist')], ids=str)
def test_limb_with_a_hidden_end_is_thin_and_dashed(hidden):
    image, width = np.zeros((540, 960, 3), np.uint8), 300
    people = people_of(only(right_elbow=(100.0, 100.0), right_wrist=(100.0 + width, 100.0)))
    seen, dashed = (draw_people(image, people, DrawParams(alpha_pose=1.0), which)[85:116, 120:380].any(axis=2)
                    for which in (None, hidden_joints(*hidden)))
    assert seen[15].all()
    assert 0.3 < dashed[15].mean() < 0.8
    assert dashed.sum(axis=0).max() < seen.sum(axis=0).max()


@pytest.mark.parametrize('size', [(480, 270), (960, 540), (1920, 1080), (40, 30), (1, 1)])
def test_joints_at_the_border(size):
    width, height = size
    corners = only(nose=(0, 0), neck=(width - 1, 0), right_hip=(0, height - 1), left_hip=(width - 1, height - 1),
                   right_shoulder=(width / 2, 0), left_shoulder=(width - 1, height / 2))
    drawn = draw_people(np.zeros((height, width, 3), np.uint8), people_of(corners, ids=[123456]), DrawParams())
    assert drawn.shape == (height, width, 3) and drawn.any()
