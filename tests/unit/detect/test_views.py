"""What networks see of an image: sizes, the mirror image, and a crop of one person."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.decode.direct import DirectThresholds
from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.detect.crops import CrowdImage, decode_crop, prepare_crops, quarter_turns
from openpose_ros_pkg.detect.recipes import MODES, THUNDER_CROP, CropRefinement, DetectorSettings, NetworkPass
from openpose_ros_pkg.detect.views import Setup, prepare_views
from openpose_ros_pkg.ensemble import most_alike, sigmas
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MOVENET_MULTIPOSE
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import Poses
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import MovenetNetwork, chart, person_at

SIGMAS = sigmas(COCO_18)
SIZE = (641, 479)


# --- views ----------------------------------------------------------------------------------------------------------

def test_each_scale_is_seen_with_its_mirror_image():
    views = prepare_views(chart(*SIZE), NetworkPass(MOBILENET_THIN, (656, 368), (1.0, 0.5), mirror=True))
    assert [(view.input.shape, view.view.mirror) for view in views] == [
        ((368, 496, 3), False), ((368, 496, 3), True), ((184, 248, 3), False), ((184, 248, 3), True)]
    plain, mirror = views[0], views[1]
    assert mirror.view.plan == plain.view.plan
    width = plain.view.plan.scaled_size[0]
    np.testing.assert_allclose(mirror.input[:, :width][:, ::-1].astype(int), plain.input[:, :width], atol=1)
    for image in (plain.input, mirror.input):  # the padding is at the right of both
        np.testing.assert_array_equal(image[:, width:], np.repeat(image[:, width - 1:width], 496 - width, axis=1))


# --- crop refinement ------------------------------------------------------------------------------------------------

def scored(person, noise=0.0):
    """(18, 3) of what is known of a person before the refinement."""
    noise = np.random.default_rng(0).normal(0, noise, person.shape)
    return np.column_stack([person + noise, np.full(18, 0.6)]).astype(np.float32)


def refined(network, person, margin=1.6, mirror=False, size=SIZE, centred=False):
    """Return the pose of the same person on a crop, None where none is."""
    refinement = CropRefinement(MOVENET_MULTIPOSE, margin, mirror, centred=centred)
    prepared, = prepare_crops(CrowdImage(chart(*size), person[None], COCO_18), person[None], refinement)
    setup = Setup(MODES['fast'], {}, DecodeParams(), DirectThresholds(), build(DetectorSettings, {}))
    found = decode_crop(prepared.compute(network), MOVENET_MULTIPOSE, setup).keypoints
    return most_alike(found, person, person[None], SIGMAS)


@pytest.mark.parametrize('columns', [None, (40, 200)])
def test_boxes_in_the_mirror_image_come_back_to_their_place(columns):
    image = np.zeros((120, 240, 3), np.uint8)
    image[30:70, 60:90] = 255
    views = prepare_views(image, NetworkPass(MOVENET_MULTIPOSE, (256, 256), mirror=True), columns)
    for view in views:
        rows, places = np.nonzero(view.input.max(axis=2) > 128)
        seen = np.array([[places.min(), rows.min(), places.max(), rows.max()]], np.float32)
        np.testing.assert_allclose(view.view.boxes_in_image(seen), [[60, 30, 89, 69]], atol=1.0)
    assert [view.view.mirror for view in views] == [False, True]


@pytest.mark.parametrize('centred', [False, True], ids=['cut off', 'centred'])
@pytest.mark.parametrize('mirror', [False, True], ids=['plain', 'mirror'])
@pytest.mark.parametrize('x, y, height', [
    (320, 150, 200), (20, 150, 200), (630, 150, 200), (320, 5, 150), (320, 350, 150), (10, 10, 400), (600, 440, 60),
    (320, 100, 40)], ids=['centre', 'left', 'right', 'top', 'bottom', 'large', 'corner', 'small'])
def test_joints_come_back_to_their_place_under_their_names(x, y, height, mirror, centred):
    """Also those at the border, where the crop is cut off or reaches beyond the image; what lies there is missing."""
    person = person_at(x, y, height)
    network = MovenetNetwork([person], SIZE)
    pose = refined(network, scored(person), mirror=mirror, centred=centred)
    assert network.inputs[0].shape == (256, 256, 3)
    inside = ((person > -0.5) & (person < np.subtract(SIZE, 0.5))).all(axis=1)
    neck, left, right = (COCO_18.index[joint] for joint in ('neck', 'left_shoulder', 'right_shoulder'))
    if not centred:  # a shoulder that is not in the crop, and MoveNet has no neck of its own
        inside[neck] = inside[left] and inside[right]
    assert inside.sum() >= 7
    np.testing.assert_allclose(pose[inside, :2], person[inside], atol=0.5)
    assert np.isnan(pose[~inside, :2]).all() and (pose[~inside, 2] == 0).all()


@pytest.mark.parametrize('x, y', [(20, 20), (620, 20), (320, 460)])
def test_a_person_at_the_border_is_in_the_middle_of_the_crop(x, y):
    """Beyond the image its border is repeated, where the refinement wants it."""
    person = person_at(x, y, 150)
    known = scored(person)
    beyond = ((person < 0) | (person > np.subtract(SIZE, 1))).any(axis=1)
    known[beyond] = (np.nan, np.nan, 0)
    crop, = prepare_crops(CrowdImage(chart(*SIZE), known[None], COCO_18), known[None], THUNDER_CROP)
    low, high = person[~beyond].min(axis=0), person[~beyond].max(axis=0)
    np.testing.assert_allclose(crop.view.plan.to_image((127.5, 127.5)) + crop.view.origin, (low + high) / 2, atol=1.1)
    column, row = np.rint(crop.view.plan.to_net(np.subtract((0, 0), crop.view.origin))).astype(int)
    if row > 3:
        assert (crop.input[0] == crop.input[row - 3]).mean() > 0.9
    if column > 3:
        assert (crop.input[:, 0] == crop.input[:, column - 3]).mean() > 0.9


def test_a_person_in_the_repeated_border_is_none():
    known = scored(person_at(20, 20, 150))
    crop, = prepare_crops(CrowdImage(chart(*SIZE), known[None], COCO_18), known[None], THUNDER_CROP)
    people = np.full((2, 18, 3), (1.0, 1.0, 0.8), np.float32)
    people[1, 0, :2] = crop.view.plan.to_net(np.subtract((30.0, 30.0), crop.view.origin))
    found = crop.view.in_image(Poses(people, np.array([0.9, 0.7], np.float32)), COCO_18)
    assert found.scores.tolist() == [np.float32(0.7)]
    np.testing.assert_allclose(found.keypoints[0, 0], [30, 30, 0.8], rtol=1e-5)
    assert not found.keypoints[0, 1:, 2].any()


# --- people who lie ---------------------------------------------------------------------------------------------------

def rotated(person, degrees):
    """Return (18, 2) pixels of a person turned clockwise around the middle of the image."""
    angle, middle = np.radians(degrees), np.divide(SIZE, 2)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return (person - middle) @ turn + middle


@pytest.mark.parametrize('degrees, turns', [
    (0, 0), (40, 0), (-40, 0), (50, 1), (90, 1), (130, 1), (140, 2), (180, 2), (-140, 2), (-130, 3), (-90, 3)])
def test_a_lying_person_is_turned_upright(degrees, turns):
    person = scored(rotated(person_at(320, 100, 250), degrees))
    alone = CrowdImage(chart(*SIZE), person[None], COCO_18)
    assert quarter_turns(person[None], COCO_18).tolist() == [turns]
    crop, = prepare_crops(alone, person[None], THUNDER_CROP)
    assert crop.view.turns == turns
    of_multipose = CropRefinement(MOVENET_MULTIPOSE, 1.6)
    crop, = prepare_crops(alone, person[None], of_multipose)
    assert crop.view.turns == 0, 'it is not square'
    seen = person[:, :2] - crop.view.origin
    for _ in range(turns):
        seen = np.column_stack([seen[:, 1], crop.view.plan.image_size[0] - 1 - seen[:, 0]])
    up = seen[COCO_18.index['neck']] - seen[[COCO_18.index['left_hip'], COCO_18.index['right_hip']]].mean(axis=0)
    assert -up[1] > 0.6 * np.linalg.norm(up)


@pytest.mark.parametrize('mirror', [False, True], ids=['plain', 'mirror'])
@pytest.mark.parametrize('turns', [0, 1, 2, 3])
def test_what_a_turned_network_sees_comes_back_to_its_place(turns, mirror):
    image, person = np.zeros((SIZE[1], SIZE[0], 3), np.uint8), scored(person_at(320, 150, 200))
    place = np.array([300, 200])
    image[place[1] - 2:place[1] + 3, place[0] - 2:place[0] + 3] = 255
    alone = CrowdImage(image, person[None], COCO_18)
    crop = prepare_crops(alone, person[None], replace(THUNDER_CROP, mirror=mirror))[0].turned(turns)
    rows, columns = np.nonzero(crop.input[..., 0] > 128)
    found = np.full((1, 18, 3), (columns.mean(), rows.mean(), 1.0), np.float32)
    back = crop.view.in_image(Poses(found, np.ones(1)), COCO_18)
    np.testing.assert_allclose(back.keypoints[0, 0, :2], place, atol=1.0)
