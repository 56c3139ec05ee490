"""People who stand close together: in the crop of one, the others are covered."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.decode.direct import DirectThresholds
from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.detect.crops import CrowdImage, prepare_crops
from openpose_ros_pkg.detect.detection import DepthView, ImageFrame
from openpose_ros_pkg.detect.following import Person, voted
from openpose_ros_pkg.detect.look import Networks
from openpose_ros_pkg.detect.occlusion_masks import bodies_of_others, foregrounds
from openpose_ros_pkg.detect.recipes import MODES, THUNDER_CROP, DetectorSettings
from openpose_ros_pkg.detect.views import Setup
from openpose_ros_pkg.networks.model_registry import MOVENET_THUNDER
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_17, COCO_18
from stand_in_networks import person_at

SIZE = (640, 480)


def scored(x, score=0.6):
    """(18, 3) of a person whose middle is at a column."""
    return np.column_stack([person_at(x, 120, 240), np.full(18, score)]).astype(np.float32)


def stripes():
    """An image in which each column has a colour of its own."""
    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    image[..., 0] = np.arange(SIZE[0]) % 256
    image[..., 1] = 40 + np.arange(SIZE[0]) // 8
    return image


def covered(person, people, refinement=THUNDER_CROP):
    """Return the crop of a person, and which of its pixels other people change, (256, 256) bool."""
    plain, crop = (prepare_crops(CrowdImage(stripes(), np.array(shown), COCO_18), person[None], refinement)[0]
                   for shown in ([person], people))
    return crop, (plain.input != crop.input).any(axis=2)


def pixels(person, crop, mirror=False):
    """Return the joints that lie in a crop, (N, 2) int of its input."""
    xy = person[:, :2] - crop.view.origin
    if mirror:
        xy[:, 0] = crop.view.plan.image_size[0] - 1 - xy[:, 0]
    xy = np.rint(crop.view.plan.to_net(xy)).astype(int)
    return xy[((xy >= 0) & (xy < 256)).all(axis=1)]


@pytest.mark.parametrize('mirror', [False, True], ids=['plain', 'mirror'])
def test_another_person_is_covered_in_the_mean_colour(mirror):
    person, other = scored(300), scored(440)
    crop, changed = covered(person, [other, person], replace(THUNDER_CROP, mirror=mirror))
    x, y = pixels(other, crop, mirror).T
    assert len(x) > 6 and changed[y, x].all()
    assert len(np.unique(crop.input[changed], axis=0)) == 1
    x, y = pixels(person, crop, mirror).T
    assert not changed[y, x].any()


def test_what_lies_on_the_person_stays():
    """An arm of a person in front: of two bodies in one place the crop shows the one in front."""
    person, other = scored(300), scored(320)
    crop, changed = covered(person, [person, other])
    x, y = pixels(person, crop).T
    assert changed.any() and not changed[y, x].any()


def test_a_crop_that_shows_another_person_is_no_opinion_on_the_first():
    """It would take the whole body to where the other one is."""
    recipe = MODES['balanced']
    people = np.array([scored(300), scored(330)])
    persons = [Person(person, opinions={0: person, 1: person}) for person in people]
    crops = prepare_crops(CrowdImage(stripes(), people, COCO_18), people, THUNDER_CROP)
    order = [COCO_18.index[joint] for joint in COCO_17.joints]
    of_second = [crop.view.plan.to_net(people[1][order, :2] - crop.view.origin) for crop in crops]

    class SecondPerson:
        def infer_many(self, images):
            return [(np.column_stack([xy[:, ::-1] / 256, np.full(len(xy), 0.9)]).astype(np.float32)[None, None],)
                    for xy in of_second]

    setup = Setup(recipe, {MOVENET_THUNDER.name: SecondPerson()}, DecodeParams(), DirectThresholds(),
                  build(DetectorSettings, {'person_min_score': 0.1}))
    found = Networks(setup, ImageFrame('', 0.0, stripes())).look(persons, [0, 1]).people
    assert found[0].crop is None and found[1].crop is not None
    np.testing.assert_allclose(voted(found, recipe, 1.0).keypoints[..., 0], people[..., 0], atol=1.0)


def view(*layers, wall=6.0):
    """Return the depth of boxes, (left, right [px of the image], metres) each, before a wall; at half the size."""
    depth = np.full((SIZE[1] // 2, SIZE[0] // 2), wall, np.float32)
    for left, right, metres in sorted(layers, key=lambda layer: -layer[2]):
        depth[40:, left // 2:right // 2] = metres
    return DepthView(depth, 300.0)


def before(people, depth):
    return foregrounds(np.array(people), COCO_18, depth, SIZE)


BEHIND, FRONT = scored(300), scored(360)
TWO = view((200, 320, 3.0), (322, 450, 2.0))


@pytest.mark.parametrize('depth', [None, view(), view((200, 450, 2.0)), view((200, 320, 2.2), (322, 450, 2.0)),
                                   DepthView(np.full((24, 32), np.nan, np.float32), 30.0)],
                         ids=['unknown', 'a wall', 'one surface', 'side by side', 'missing'])
def test_without_a_gap_in_depth_no_person_is_in_front(depth):
    assert before([BEHIND, FRONT], depth) == [None, None]


@pytest.mark.parametrize('far', [1e6, 1e30])
def test_a_joint_that_is_expected_next_to_the_camera_counts_as_missing(far):
    """It lies far beyond the image, and the breadth of limbs is in proportion to the size of the body."""
    fronts, wrist = np.stack([FRONT, FRONT]), COCO_18.index['right_wrist']
    fronts[0, wrist, :2], fronts[1, wrist] = (far, -far), (np.nan, np.nan, 0)
    for front in fronts:
        foreground, none = before([BEHIND, front], TWO)
        assert none is None and foreground.nearer.tolist() == [False, True]
    expected, missing = (bodies_of_others(BEHIND, front[None], COCO_18, SIZE[::-1]) for front in fronts)
    np.testing.assert_array_equal(expected, missing)
    assert missing.any()


@pytest.mark.parametrize('mirror', [False, True], ids=['plain', 'mirror'])
def test_of_a_person_in_front_all_is_covered_also_an_arm_before_the_person(mirror):
    hand, front, depth = BEHIND[COCO_18.index['right_hip'], :2], FRONT.copy(), view((200, 320, 3.0), (322, 450, 2.0))
    front[COCO_18.index['right_wrist'], :2] = hand
    column, row = (hand / 2).astype(int)
    depth.depth[row - 6:row + 7, column - 6:column + 7] = 1.9
    foreground, none = before([BEHIND, front], depth)
    assert none is None and foreground.nearer.tolist() == [False, True]
    crops = [prepare_crops(CrowdImage(stripes(), np.array(people), COCO_18), BEHIND[None],
                           replace(THUNDER_CROP, mirror=mirror), [one])[0]
             for people, one in (([BEHIND], None), ([BEHIND, front], foreground))]
    changed = (crops[0].input != crops[1].input).any(axis=2)
    near = np.hypot(*(BEHIND[:, :2] - hand).T) < 30
    for person, is_covered in ((front[front[:, 0] > 330], True), (front[[COCO_18.index['right_wrist']]], True),
                               (BEHIND[(BEHIND[:, 0] < 310) & ~near], False)):
        x, y = pixels(person, crops[0], mirror).T
        assert len(x) > 0 and (changed[y, x] == is_covered).all()


def behind(opinions, foreground):
    recipe = MODES['balanced']  # crops count as much as searches here
    refinements = tuple(replace(one, place_weight=1.0) for one in recipe.refinements)
    person = Person(BEHIND, crop=opinions.get(recipe.pass_opinions), front=foreground, opinions=opinions)
    return voted([person], replace(recipe, refinements=refinements), 1.0).keypoints[0]


def test_opinions_of_the_full_image_on_a_person_nearer_are_doubted_where_a_crop_tells():
    foreground, plain = before([BEHIND, FRONT], TWO)
    opinions = {0: FRONT, 1: FRONT, 2: BEHIND}
    nearer = foreground.covers(FRONT[:, :2])
    told, undoubted = behind(opinions, foreground), behind(opinions, plain)
    away = np.hypot(*(told[:, :2] - BEHIND[:, :2]).T) - np.hypot(*(undoubted[:, :2] - BEHIND[:, :2]).T)
    assert nearer.sum() > 10 and (away[nearer] < -20).all() and (away[~nearer] == 0).all()
    alone = {0: FRONT, 1: FRONT}
    np.testing.assert_array_equal(behind(alone, foreground), behind(alone, plain))


def test_of_two_joints_in_one_place_a_person_behind_others_has_one():
    """The network sees one leg, and takes it for both."""
    left, right = COCO_18.index['left_knee'], COCO_18.index['right_knee']
    pose = BEHIND.copy()
    pose[right] = pose[left] + (1, 1, -0.2)
    foreground, plain = before([pose, FRONT], TWO)
    for one, missing in ((foreground, [right]), (plain, [])):
        found = behind({0: pose, 1: pose, 2: pose}, one)
        assert np.flatnonzero(np.isnan(found[:, 0])).tolist() == missing == np.flatnonzero(found[:, 2] == 0).tolist()
