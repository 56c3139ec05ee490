"""How networks look at a picture: sizes, the mirror image, and one person cut out of it."""
import numpy as np
import pytest

from known_fields import NETWORKS, render_fields, two_people
from openpose_ros_pkg.decode.direct import DirectDecodeParams
from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.detect.looks import look_closer, people_of_look, views_of
from openpose_ros_pkg.detect.oks import sigmas
from openpose_ros_pkg.detect.recipes import CloserLook, Look
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.networks.models import MOBILENET_THIN, MODELS, MOVENET_MULTIPOSE
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import MovenetNetwork, PafNetwork, chart, mirrored, person_at

SIGMAS = sigmas(COCO_18)
SIZE = (641, 479)


def people_by(network, look, size=SIZE):
    """Return the opinions, (P, 18, 3) each, of a network that looks at the chart."""
    views = views_of(chart(*size), look)
    for view in views:
        view.compute(network)
    return [keypoints for keypoints, _ in people_of_look(look, views, DecodeParams(), DirectDecodeParams())]


# --- views ----------------------------------------------------------------------------------------------------------

def test_one_view():
    (view,) = views_of(chart(*SIZE), Look(MOBILENET_THIN, (656, 368)))
    assert view.plan.scaled_size == (492, 368) and view.image.shape == (368, 496, 3) and not view.mirror


def test_each_scale_is_seen_with_its_mirror_image():
    views = views_of(chart(*SIZE), Look(MOBILENET_THIN, (656, 368), (1.0, 0.5), mirror=True))
    assert [(view.image.shape, view.mirror) for view in views] == [
        ((368, 496, 3), False), ((368, 496, 3), True), ((184, 248, 3), False), ((184, 248, 3), True)]
    plain, mirror = views[0], views[1]
    assert mirror.plan == plain.plan
    width = plain.plan.scaled_size[0]
    np.testing.assert_allclose(mirror.image[:, :width][:, ::-1].astype(int), plain.image[:, :width], atol=1)
    for image in (plain.image, mirror.image):  # the padding is at the right of both
        np.testing.assert_array_equal(image[:, width:], np.repeat(image[:, width - 1:width], 496 - width, axis=1))


@pytest.mark.parametrize('size', [(640, 480), (480, 640), (1280, 400)])
def test_network_of_one_size_gets_it_whatever_the_box(size):
    (view,) = views_of(chart(*size), Look(MODELS['rtmo_s'], (656, 368)))
    assert view.image.shape == (640, 640, 3)
    assert max(view.plan.scaled_size) == 640
    beyond = view.image[view.plan.scaled_size[1]:] if size[0] > size[1] else view.image[:, view.plan.scaled_size[0]:]
    assert beyond.size and (beyond == 114).all()


def test_free_side_of_a_long_thin_picture_is_refused():
    with pytest.raises(BadInputError, match='at most 4096'):
        views_of(np.zeros((10, 10000, 3), np.uint8), Look(MOBILENET_THIN, (-1, 368)))


def test_picture_is_left_alone():
    image = chart(*SIZE)
    before = image.copy()
    image.flags.writeable = False
    views_of(image, Look(MOBILENET_THIN, (656, 368), (1.0, 0.5), mirror=True))
    np.testing.assert_array_equal(image, before)


# --- what a network says --------------------------------------------------------------------------------------------

def test_nobody():
    assert [len(people) for people in people_by(PafNetwork(size=SIZE), Look(MOBILENET_THIN, (656, 368)))] == [0]
    opinions = people_by(MovenetNetwork(size=SIZE), Look(MOVENET_MULTIPOSE, (512, 512), (1.0, 0.5)))
    assert [people.shape for people in opinions] == [(0, 18, 3)] * 2


@pytest.mark.parametrize('zooms, mirror', [((1.0,), False), ((1.0, 0.6), False), ((1.0,), True), ((1.0, 0.6), True)])
def test_fields_of_all_views_are_one_opinion(zooms, mirror):
    person = person_at(250, 60, 380)
    (people,) = people_by(PafNetwork([person], SIZE), Look(MOBILENET_THIN, (656, 368), zooms, mirror))
    assert len(people) == 1
    np.testing.assert_allclose(people[0, :, :2], person, atol=1.5)


def test_outputs_of_a_network_that_gives_maps_and_fields_apart():
    class Apart(PafNetwork):
        def infer(self, images):
            (fields,) = super().infer(images)
            return fields[:, :19], fields[:, 19:]

    person = person_at(250, 60, 380)
    (people,) = people_by(Apart([person], SIZE), Look(MODELS['lightweight_openpose'], (656, 368), mirror=True))
    np.testing.assert_allclose(people[0, :, :2], person, atol=1.5)


@NETWORKS
def test_people_of_every_joint_set(model):
    """From fields in the network's pixels to joints in those of the picture."""
    people = two_people(model.skeleton, SIZE)
    look = Look(model, (656, 368))
    (view,) = views_of(chart(*SIZE), look)
    view.outputs = (render_fields([view.plan.to_net(person) for person in people], view.plan.net_size[::-1],
                                  skeleton=model.skeleton),)
    ((found, _),) = people_of_look(look, [view], DecodeParams(), DirectDecodeParams())
    order = np.argsort(found[:, model.skeleton.index['neck'], 0])
    np.testing.assert_allclose(found[order, :, :2], people, atol=1.0)


def test_each_view_of_a_network_that_finds_people_itself_is_an_opinion():
    person = person_at(250, 60, 380)
    network = MovenetNetwork([person], SIZE)
    opinions = people_by(network, Look(MOVENET_MULTIPOSE, (512, 512), (1.0, 0.5)))
    assert [image.shape for image in network.inputs] == [(384, 512, 3), (192, 256, 3)]
    assert len(opinions) == 2
    for people in opinions:
        assert len(people) == 1
        np.testing.assert_allclose(people[0, :, :2], person, atol=0.5)


# --- closer looks ---------------------------------------------------------------------------------------------------

def scored(person, noise=0.0):
    """(18, 3) of what is known of a person before the closer look."""
    noise = np.random.default_rng(0).normal(0, noise, person.shape)
    return np.column_stack([person + noise, np.full(18, 0.6)]).astype(np.float32)


def closer(network, person, margin=1.6, mirror=False, size=SIZE):
    return look_closer(chart(*size), person, CloserLook(margin, mirror), 256, network, DirectDecodeParams(), SIGMAS)


@pytest.mark.parametrize('mirror', [False, True], ids=['plain', 'mirror'])
@pytest.mark.parametrize('x, y, height', [
    (320, 150, 200), (20, 150, 200), (630, 150, 200), (320, 5, 150), (320, 350, 150), (10, 10, 400), (600, 440, 60),
    (320, 100, 40)], ids=['centre', 'left', 'right', 'top', 'bottom', 'large', 'corner', 'small'])
def test_joints_come_back_to_their_place_under_their_names(x, y, height, mirror):
    """Also those at the border, where less than the square is cut out; what lies beyond the picture is missing."""
    person = person_at(x, y, height)
    network = MovenetNetwork([person], SIZE)
    pose = closer(network, scored(person), mirror=mirror)
    assert network.inputs[0].shape == (256, 256, 3)
    inside = ((person > -0.5) & (person < np.subtract(SIZE, 0.5))).all(axis=1)
    neck, left, right = (COCO_18.index[joint] for joint in ('neck', 'left_shoulder', 'right_shoulder'))
    inside[neck] = inside[left] and inside[right]  # MoveNet has none of its own
    assert inside.sum() >= 7
    np.testing.assert_allclose(pose[inside, :2], person[inside], atol=0.5)
    assert np.isnan(pose[~inside, :2]).all() and (pose[~inside, 2] == 0).all()


@pytest.mark.parametrize('margin', [1.3, 1.6, 2.0])
def test_the_cut_is_a_square_round_the_joints(margin):
    person = person_at(320, 150, 150)
    network = MovenetNetwork([person], SIZE)
    closer(network, scored(person), margin)
    left, top, right, bottom = network.parts[0]
    low, high = person.min(axis=0), person.max(axis=0)
    side = margin * (high - low).max()
    assert (right - left, bottom - top) == pytest.approx((side, side), abs=2.5)
    np.testing.assert_allclose([(left + right) / 2, (top + bottom) / 2], (low + high) / 2, atol=1.5)


def test_the_cut_ends_at_the_border():
    person = person_at(20, 20, 150)
    network = MovenetNetwork([person], SIZE)
    closer(network, scored(person))
    left, top, right, bottom = network.parts[0]
    assert (left, top) == pytest.approx((-0.5, -0.5), abs=0.5) and right < 200 and bottom < 250


def test_unsure_joints_do_not_widen_the_cut():
    """A guess of a joint out of sight; where there are only guesses, they must do."""
    person = person_at(320, 150, 150)
    ankles = [COCO_18.index['left_ankle'], COCO_18.index['right_ankle']]
    known = scored(person)
    known[ankles] = (20, 470, 0.1)
    network = MovenetNetwork([person], SIZE)
    closer(network, known, margin=2.0)
    left, _, _, bottom = network.parts[0]
    assert left > 150 and bottom < 400
    known[:, 2] = 0.1
    closer(network, known, margin=2.0)
    assert network.parts[1][0] < 20 and network.parts[1][3] > 470


def test_missing_joints_do_not_matter():
    person = person_at(320, 150, 200)
    known = scored(person)
    known[8:14] = (np.nan, np.nan, 0)
    pose = closer(MovenetNetwork([person], SIZE), known, margin=3.5)
    np.testing.assert_allclose(pose[:, :2], person, atol=0.5)


@pytest.mark.parametrize('place', [(0, 0), (640, 478), (320, 240)])
def test_one_joint_is_enough_to_look(place):
    """Sixteen pixels at least are cut out; nobody can be told from one joint."""
    known = np.full((18, 3), (np.nan, np.nan, 0), np.float32)
    known[0] = (*place, 0.5)
    network = MovenetNetwork([person_at(320, 150, 200)], SIZE)
    assert closer(network, known) is None
    left, top, right, bottom = network.parts[0]
    assert 8 <= right - left <= 19 and 8 <= bottom - top <= 19


def test_picture_smaller_than_the_cut():
    person = person_at(6, 2, 8)
    pose = closer(MovenetNetwork([person], (12, 11)), scored(person), size=(12, 11))
    assert pose is not None
    there = pose[:, 2] > 0
    np.testing.assert_allclose(pose[there, :2], person[there], atol=0.5)


def test_nobody_there_is_no_opinion():
    assert closer(MovenetNetwork(size=SIZE), scored(person_at(320, 150, 200))) is None


@pytest.mark.parametrize('order', [1, -1])
def test_of_several_in_the_cut_the_person_itself_is_taken(order):
    people = [person_at(320, 150, 200), person_at(380, 155, 190)]
    for person in people:
        pose = closer(MovenetNetwork(people[::order], SIZE), scored(person, noise=3.0))
        np.testing.assert_allclose(pose[:, :2], person, atol=0.5)


def test_somebody_else_in_the_cut_is_no_opinion():
    known = scored(person_at(320, 150, 200))
    assert closer(MovenetNetwork([person_at(430, 150, 200)], SIZE), known) is None


def test_a_mirrored_person_would_be_somebody_else():
    """The stand-in does take left for right in the mirror, as networks do; the look turns it back."""
    person = person_at(320, 150, 200)
    network = MovenetNetwork([person], SIZE)
    closer(network, scored(person), mirror=True)
    left, _, right, _ = network.parts[0]
    assert left > right
    assert np.abs(mirrored(person, SIZE[0]) - person).max() > 50
