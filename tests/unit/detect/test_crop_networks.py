"""Networks of the user's choice on crops (SimCC, such as RTMPose), alone and behind networks that find boxes."""
from dataclasses import replace

import numpy as np
import pytest

from followed_stream import FollowedStream
from openpose_ros_pkg.detect import recipe_choice
from openpose_ros_pkg.detect.crops import CrowdImage, prepare_crops
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import Person, PersonMemory, with_crop
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.detect.recipes import MODES, DetectorParams, DetectorSettings, crop_of
from openpose_ros_pkg.ensemble import mean_scores, person_scores
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.model_registry import MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import SIMCC_INPUT, YOLOX_INPUT, Decoder, Model, UserFiles
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import Poses, keypoints_in
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, HALPE_26
from stand_in_networks import (
    BoxNetwork,
    MovenetNetwork,
    PafNetwork,
    SimccNetwork,
    ThunderNetwork,
    Together,
    _turns,
    chart,
    person_at,
)
from whole_bodies import with_feet

SIZE = (640, 480)
MODEL = Model('mine', COCO_18, (), 'ours', UserFiles('here'), replace(SIMCC_INPUT, fixed_size=(192, 256)),
              ('simcc_x', 'simcc_y'), Decoder.SIMCC, points=17)
WITH_FEET = replace(MODEL, name='feet', skeleton=BODY_25, points=26)
OF_BOXES = Model('boxes', COCO_18, (), 'ours', UserFiles('here'), replace(YOLOX_INPUT, fixed_size=(416, 416)),
                 ('dets', 'labels'), Decoder.BOXES)
FEET = [i for i, joint in enumerate(BODY_25.joints) if joint.split('_')[-1] in ('toe', 'heel')]
ALL_MODES = pytest.mark.parametrize('mode', MODES)


@pytest.fixture(autouse=True)
def _known_by_name(monkeypatch):
    """The networks of this module are found by their names."""
    find, own = recipe_choice.find_model, {model.name: model for model in (MODEL, WITH_FEET, OF_BOXES)}
    monkeypatch.setattr(recipe_choice, 'find_model', lambda name, folder='': own.get(name) or find(name, folder))


def networks_of(people, size=SIZE):
    """Return stand-ins that see people with feet, (25, 2) each."""
    found = [keypoints_in(np.insert(one, 2, 1.0, axis=1)[None], BODY_25, COCO_18)[0, :, :2] for one in people]
    return {'mobilenet_thin': PafNetwork(found, size), 'movenet_multipose': MovenetNetwork(found, size),
            'movenet_thunder': ThunderNetwork(found, size),
            'mine': SimccNetwork(people, size, skeleton=BODY_25),
            'feet': SimccNetwork(people, size, skeleton=BODY_25, order=HALPE_26)}


def detector(people, size=SIZE, **values):
    return Detector(build(DetectorSettings, {'pose_model': 'COCO', **values}), Together(**networks_of(people, size)))


def right_of(person, pixels):
    return person + np.array([pixels, 0])


def in_order(people):
    return people.xy[np.argsort(people.xy[:, people.skeleton.index['neck'], 0])]


LEFT, RIGHT = with_feet(person_at(130, 120, 250)), with_feet(person_at(480, 130, 220))


# --- crops ----------------------------------------------------------------------------------------------------------

def scored(person):
    return np.insert(person, 2, 0.9, axis=1).astype(np.float32)


@pytest.mark.parametrize('size, padding', [((192, 256), 0), ((288, 384), 0)])
def test_a_crop_has_the_aspect_of_the_input_and_the_makers_border(size, padding):
    """The person's box, 1.25 times that of the joints, enlarged by 1.25; black beyond the image."""
    person = scored(person_at(100, 30, 300))
    one = crop_of(replace(MODEL, input=replace(SIMCC_INPUT, fixed_size=size)))
    crop, = prepare_crops(CrowdImage(chart(*SIZE), person[None], COCO_18), person[None], one)
    assert crop.input.shape == (size[1], size[0], 3)
    width, height = crop.view.plan.image_size
    assert height == pytest.approx(1.25 ** 2 * np.ptp(person[:, 1]), abs=3)
    assert width == pytest.approx(0.75 * height, abs=3)
    middle = (person[:, :2].min(axis=0) + person[:, :2].max(axis=0)) / 2
    np.testing.assert_allclose(crop.view.origin + (crop.view.plan.image_size - np.ones(2)) / 2, middle, atol=2)
    left, top = crop.view.origin
    assert left < -20 and top < -20
    assert (crop.input[:, 0] == padding).all() and (crop.input[0] == padding).all() and crop.input[-1, -1].any()


# --- full search ------------------------------------------------------------------------------------------------------

@ALL_MODES
@pytest.mark.parametrize('name', ['mine', 'feet'])
def test_people_and_their_feet_are_at_their_places(mode, name):
    """Feet are known to the crop network alone, and as sure as it is."""
    unit = detector([LEFT, RIGHT], mode=mode, crop_model=name)
    skeleton = BODY_25 if name == 'feet' else COCO_18
    assert unit.skeleton == skeleton and MOVENET_THUNDER not in unit.recipe.models
    found = people_in(chart(*SIZE), unit)
    assert found.skeleton == skeleton and len(found) == 2 and found.present.all()
    truth = [keypoints_in(scored(one)[None], BODY_25, skeleton)[0, :, :2] for one in (LEFT, RIGHT)]
    np.testing.assert_allclose(in_order(found), truth, atol=1.5)
    assert (found.scores > 0.9).all()
    if name == 'feet':
        others = [i for i in range(25) if i not in FEET]
        np.testing.assert_allclose(found.confidence[:, FEET].mean(), found.confidence[:, others].mean(), atol=0.02)


def test_people_without_a_crop_do_not_fall_for_want_of_feet():
    """Of two people one is refined: the other one's score is that of a mode without feet."""
    people = [LEFT, RIGHT]
    plain, feet = (people_in(chart(*SIZE), detector(people, look_closer=1, crop_model=name))
                   for name in ('mine', 'feet'))
    assert len(plain) == len(feet) == 2
    np.testing.assert_allclose(feet.scores, plain.scores, atol=0.02)
    refined = feet.present[:, FEET].all(axis=1)
    assert refined.sum() == 1 and not feet.present[~refined][:, FEET].any()
    keypoints = np.full((1, 25, 3), 0.5, np.float32)
    keypoints[:, FEET] = np.nan, np.nan, 0
    known = np.ones((1, 25), bool)
    known[:, FEET] = False
    assert person_scores(keypoints, known) == pytest.approx([0.5])


@pytest.mark.parametrize('name', ['mine', 'feet'])
def test_of_people_who_stand_close_each_has_the_own_joints(name):
    """The crop network tells of the person nearest to the middle; the searcher sees all 3 px off."""
    people = [with_feet(person_at(x, 110, 240)) for x in (250, 310, 370)]
    unit = detector(people, mode='fast', crop_model=name)
    searcher = unit._networks.networks['movenet_multipose']
    searcher.people = [person + 3 for person in searcher.people]
    found = people_in(chart(*SIZE), unit)
    truth = [keypoints_in(scored(one)[None], BODY_25, found.skeleton)[0, :, :2] for one in people]
    assert len(found) == 3
    np.testing.assert_allclose(in_order(found), truth, atol=1.5)


# --- following --------------------------------------------------------------------------------------------------------

def test_a_crop_is_as_sure_as_the_mean_of_the_joints_that_its_network_can_know():
    """MoveNet's crop of a followed person, doubtful, where another network knows feet."""
    recipe = recipe_of(DetectorParams(mode='accurate', crop_model='feet'))
    pose = np.insert(LEFT, 2, 0.24, axis=1).astype(np.float32)
    crop = pose.copy()
    crop[FEET] = np.nan, np.nan, 0
    person = Person(pose, 1, PersonMemory(pose[:, 2], {}, 10.0))
    number = recipe.pass_opinions
    assert recipe.refinements[0].model.name == 'movenet_multipose'
    looked = with_crop(person, number, Poses(crop[None], np.ones(1)), recipe.sources.known[number], pose[None], recipe)
    assert looked.crop is not None


def test_half_a_person_at_the_border_of_the_image_is_as_sure_as_a_whole_one():
    whole = np.insert(LEFT, 2, 0.4, axis=1)
    half, rest = whole.copy(), whole.copy()
    half[::2] = rest[3:] = np.nan, np.nan, 0
    known = np.ones(25, bool)
    assert mean_scores(np.stack([whole, half]), known) == pytest.approx(0.4)
    assert mean_scores(rest, known) == pytest.approx(3 * 0.4 / (25 / 4))  # three joints are no person


def test_a_person_who_leaves_is_lost_where_the_crop_network_is_not_sure():
    """SimCC networks place all joints where there is no person, too; then with scores below what the makers ask."""
    networks = networks_of([LEFT])
    unit = Detector(build(DetectorSettings, {'mode': 'fast', 'crop_model': 'mine'}), Together(**networks))
    stream = FollowedStream(unit, {'movenet_multipose': 1e-7, 'mine': 1e-7})
    assert len(stream.frame(10.0, chart(*SIZE))) == 1
    networks['movenet_multipose'].people, networks['mine'].confidence = [], 0.25
    assert [len(stream.frame(10.0 + 0.1 * i, chart(*SIZE))) for i in range(1, 4)] == 3 * [0]


# --- boxes ------------------------------------------------------------------------------------------------------------

def box_detector(people, **values):
    """Return a detector that finds boxes, then joints in them, and its networks."""
    networks = {'boxes': BoxNetwork(people, SIZE), **networks_of(people)}
    return Detector(build(DetectorSettings, {'pose_model': 'boxes', **values}), Together(**networks)), networks


def test_no_box_no_person():
    found = people_in(chart(*SIZE), box_detector([], crop_model='mine')[0])
    assert len(found) == 0 and found.skeleton == COCO_18


@pytest.mark.parametrize('crop_model', ['', 'mine', 'feet'])
def test_people_in_boxes_are_found_by_the_crop_network(crop_model):
    """Seen once: no other person is near."""
    unit, networks = box_detector([LEFT, RIGHT], crop_model=crop_model)
    found = people_in(chart(*SIZE), unit)
    skeleton = BODY_25 if crop_model == 'feet' else COCO_18
    assert found.skeleton == unit.skeleton == skeleton and len(found) == 2 and found.present.all()
    truth = [keypoints_in(scored(one)[None], BODY_25, skeleton)[0, :, :2] for one in (LEFT, RIGHT)]
    np.testing.assert_allclose(in_order(found), truth, atol=1.5)
    assert len(networks[crop_model or 'movenet_thunder'].inputs) == 2 and len(networks['boxes'].inputs) == 1
    assert (found.scores > 0.85).all()


def test_a_person_beside_another_one_is_seen_again_with_that_one_covered():
    people = [LEFT, right_of(LEFT, 90.0)]
    unit, networks = box_detector(people, crop_model='mine')
    truth = [keypoints_in(scored(one)[None], BODY_25, COCO_18)[0, :, :2] for one in people]
    np.testing.assert_allclose(in_order(people_in(chart(*SIZE), unit)), truth, atol=2.0)
    assert len(networks['mine'].inputs) == 4


class UpsideDown(SimccNetwork):
    """Sure of a person whose image is turned by half, alone."""

    def infer(self, images):
        self.confidence = 0.9 if _turns(images[0]) == 2 else 0.2
        return super().infer(images)


def test_a_box_without_a_sure_person_is_seen_turned():
    unit, networks = box_detector([LEFT], crop_model='mine', look_closer=0)
    networks['mine'] = unit.setup.networks['mine'] = UpsideDown([LEFT], SIZE, skeleton=BODY_25)
    found = people_in(chart(*SIZE), unit)
    np.testing.assert_allclose(found.xy[0], keypoints_in(scored(LEFT)[None], BODY_25, COCO_18)[0, :, :2], atol=1.5)
    assert len(networks['mine'].inputs) == 4
    networks['boxes'].confidence = 0.2  # hardly a person: not worth three more looks
    people_in(chart(*SIZE), box_detector([LEFT], crop_model='mine')[0])
    assert len(networks['mine'].inputs) == 4


def test_without_refinement_people_are_seen_once():
    unit, networks = box_detector([LEFT, RIGHT], crop_model='feet', look_closer=0)
    found = people_in(chart(*SIZE), unit)
    np.testing.assert_allclose(in_order(found), [LEFT, RIGHT], atol=1.5)
    assert len(networks['feet'].inputs) == 2


def test_two_boxes_of_one_person_are_one_person():
    unit, networks = box_detector([LEFT, RIGHT], crop_model='feet')
    networks['boxes'].people = [LEFT, LEFT + 2.0, RIGHT]
    assert len(people_in(chart(*SIZE), unit)) == 2


def test_boxes_of_followed_people_take_no_crop_and_confirm_them():
    unit, networks = box_detector([LEFT], crop_model='feet')
    stream = FollowedStream(unit, {'boxes': 1e-7, 'feet': 1e-7})
    middle = with_feet(person_at(310, 130, 240))
    for i in range(6):
        people = [right_of(LEFT, 6.0 * i)] + [middle] * (i >= 3)
        networks['boxes'].people = networks['feet'].people = people
        before = len(networks['feet'].inputs)
        found = stream.frame(10.0 + 0.1 * i, chart(*SIZE))
        crops = len(networks['feet'].inputs) - before
        # of a new person in its box, and beside another one upright with that covered
        assert crops == {3: 3}.get(i, 2 if i > 3 else 1)
        if i != 3:  # the new person is expected in the next image
            np.testing.assert_allclose(in_order(found), people, atol=2.0)
            assert (found.scores > 0.85).all()
    assert sorted(found.ids) == [1, 2]


def test_behind_boxes_stands_a_network_for_one_person():
    recipe = recipe_of(DetectorParams(pose_model='boxes'))
    assert [model.name for model in recipe.models] == ['boxes', 'movenet_thunder']
    assert recipe.needed == recipe.models and recipe.skeleton == COCO_18
    with pytest.raises(ParameterError, match=r"'boxes', 'movenet_multipose' are not allowed.*simcc"):
        recipe_of(DetectorParams(pose_model='boxes', crop_model='movenet_multipose'))


# --- parameters -------------------------------------------------------------------------------------------------------

def test_a_crop_network_takes_the_place_of_thunder():
    for values in ({'crop_model': 'mine'}, {'pose_model': 'mine'}, {'pose_model': 'mine', 'crop_model': 'mine'}):
        recipe = recipe_of(DetectorParams(**values))
        assert recipe.passes == MODES['balanced'].passes
        assert recipe.refinements == (crop_of(MODEL),) and MODEL in recipe.needed
    accurate = recipe_of(DetectorParams(mode='accurate', crop_model='mine'))
    assert [(one.model.name, one.mirror) for one in accurate.refinements] == [
        ('movenet_multipose', False), ('movenet_multipose', True), ('mine', False), ('mine', True)]
    assert recipe_of(DetectorParams(crop_model='movenet_thunder')).refinements == MODES['balanced'].refinements


def test_behind_one_network_alone_the_crop_network_refines_without_look_closer():
    recipe = recipe_of(DetectorParams(pose_model='rtmo_s', crop_model='feet'))
    assert [model.name for model in recipe.models] == ['rtmo_s', 'feet'] and recipe.skeleton == BODY_25
    # a joint set of its own stays
    assert recipe_of(DetectorParams(pose_model='mpi', crop_model='feet')).skeleton.name == 'MPI_15'


def test_the_joint_set_stays_while_a_detector_runs():
    unit = detector([LEFT])
    before = people_in(chart(*SIZE), unit)
    with pytest.raises(ParameterError, match='joint set BODY_25, but people have that of COCO_18'):
        unit.reconfigure(build(DetectorSettings, {'pose_model': 'COCO', 'crop_model': 'feet'}))
    np.testing.assert_array_equal(people_in(chart(*SIZE), unit).keypoints, before.keypoints)
    unit.reconfigure(build(DetectorSettings, {'pose_model': 'COCO', 'crop_model': 'mine'}))
    assert [model.name for model in unit.recipe.models][-1] == 'mine'


@pytest.mark.parametrize('values, text', [
    ({'crop_model': 'nothing'}, "'crop_model' = 'nothing' is not allowed: one of .*movenet_thunder"),
    ({'crop_model': 'rtmo_s'}, "'crop_model' = 'rtmo_s' is not allowed: its decoder is rtmo, expected .*simcc"),
    ({'crop_model': 'body_25'}, "'crop_model' = 'body_25' is not allowed"),
    ({'pose_model': 'mine', 'look_closer': 0}, "'pose_model', 'look_closer' = 'mine', 0 are not allowed"),
    ({'crop_model': 'mine', 'look_closer': 0}, "'crop_model', 'look_closer' = 'mine', 0 are not allowed"),
    ({'crop_model': 'mine', 'pose_model': 'feet'}, "'pose_model', 'crop_model' = 'feet', 'mine' are not allowed")])
def test_wrong_names_are_refused(values, text):
    with pytest.raises(ParameterError, match=text):
        recipe_of(DetectorParams(**values))
