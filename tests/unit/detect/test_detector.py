"""From an image to people in its pixels, with stand-ins for the networks and, where weights are, the real ones."""
import logging
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import openpose_ros_pkg.detect.detector
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import Detector, Networks, create_detector
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED
from openpose_ros_pkg.detect.network_detection import NetworkDetection, people_in
from openpose_ros_pkg.detect.recipes import MODES, DetectorSettings
from openpose_ros_pkg.errors import BadInputError, MissingWeightsError, ModelError, ParameterError
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.networks.model_registry import MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import ExpectedPeople
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import MovenetNetwork, PafNetwork, ThunderNetwork, Together, chart, in_order, person_at

SIZE = (640, 480)
ALONE = {'pose_model': 'mobilenet_thin', 'net_input_width': 656, 'net_input_height': 368}
ALL_MODES = pytest.mark.parametrize('mode', MODES)


def settings(**values):
    return build(DetectorSettings, {'pose_model': 'COCO', **values})


def alone(network, **values):
    """Return a detector with mobilenet_thin alone, at OpenPose's size."""
    return Detector(settings(**{**ALONE, **values}), Together(mobilenet_thin=network))


def together(paf=(), movenet=None, size=SIZE, **values):
    """Return a detector of which mobilenet_thin and MoveNet see these people; by default both the same."""
    by_movenet = paf if movenet is None else movenet
    networks = Together(mobilenet_thin=PafNetwork(paf, size), movenet_multipose=MovenetNetwork(by_movenet, size),
                        movenet_thunder=ThunderNetwork(by_movenet, size))
    return Detector(settings(**values), networks)


def moved(person, x, y):
    return person + np.array([x, y])


def assert_same(one, other):
    np.testing.assert_array_equal(one.keypoints, other.keypoints)
    np.testing.assert_array_equal(one.scores, other.scores)


# --- one network alone ----------------------------------------------------------------------------------------------

@pytest.mark.parametrize('size', [(640, 480), (641, 479), (959, 541), (321, 243)])
@pytest.mark.parametrize('place', [0.25, 0.5, 0.8], ids=['left', 'centre', 'right'])
def test_joints_come_back_in_pixels_of_the_image(size, place):
    """Half a pixel of the network, whatever the sizes round to."""
    width, height = size
    person = person_at(place * width, 0.2 * height, 0.7 * height)
    people = people_in(chart(*size), alone(PafNetwork([person], size)))
    assert people.keypoints.shape == (1, 18, 3) and people.ids.tolist() == [-1]
    assert people.scores[0] > 0.8
    scale = fit_image(size, 656, 368, 8).scale.min()
    np.testing.assert_allclose(people.xy[0], person, atol=0.5 / scale)


@pytest.mark.parametrize('image, text', [
    (None, 'NoneType'), (np.zeros((480, 640), np.uint8), r'\(480, 640\) uint8'),
    (np.zeros((480, 640, 4), np.uint8), r'\(480, 640, 4\)'), (np.zeros((480, 640, 3), np.float32), 'float32'),
    (np.zeros((0, 640, 3), np.uint8), '640x0'), (np.zeros((0, 0, 3), np.uint8), '0x0')],
    ids=['None', 'grey', 'four channels', 'float', 'no rows', '0x0'])
def test_bad_image_is_refused_and_the_next_one_works(image, text):
    unit = alone(PafNetwork([person_at(320, 80, 360)]))
    with pytest.raises(BadInputError, match=f'expected.*{text}|{text}.*expected'):
        people_in(image, unit)
    assert len(people_in(chart(*SIZE), unit)) == 1


# --- several networks and crop refinement ----------------------------------------------------------------------------

@ALL_MODES
@pytest.mark.parametrize('size', [(640, 480), (641, 479), (479, 641)])
def test_people_that_all_networks_see_are_at_their_places(mode, size):
    width, height = size
    people = [person_at(0.2 * width, 0.25 * height, 0.35 * height), person_at(0.7 * width, 0.3 * height, 0.5 * height)]
    image = chart(*size)
    before, image.flags.writeable = image.copy(), False
    found = people_in(image, together(people, size=size, mode=mode))
    np.testing.assert_array_equal(image, before)
    assert len(found) == 2 and found.ids.tolist() == [-1, -1]
    np.testing.assert_allclose(in_order(found), people, atol=1.5)
    assert (found.scores > 0.9).all() and (np.diff(found.scores) <= 0).all()
    assert people_in(image, together(size=size, mode=mode)).keypoints.shape == (0, 18, 3)


def test_what_only_one_network_sees_is_kept_but_is_less_sure():
    """A person in the distance, that MoveNet misses, and one that mobilenet_thin misses."""
    both, paf, movenet = person_at(120, 100, 300), person_at(320, 100, 300), person_at(520, 100, 300)
    found = people_in(chart(*SIZE), together([both, paf], [both, movenet]))
    np.testing.assert_allclose(in_order(found), [both, paf, movenet], atol=1.5)
    assert found.xy[0, 0, 0] == pytest.approx(120, abs=1)  # the surest first
    thin, whole = (one.weight for one in MODES['balanced'].passes)
    for place, share in ((320, thin), (520, whole + 1)):  # MoveNet's is refined on a crop
        score = found.scores[np.abs(found.xy[:, 0, 0] - place).argmin()]
        assert score == pytest.approx(np.sqrt(0.9 * share / (thin + whole + 1)), abs=0.03)


@ALL_MODES
def test_no_person_is_found_twice(mode):
    """Six people who overlap, and networks that differ by more than the width of an eye."""
    people = [person_at(110 + 85 * i, 110, 250) for i in range(6)]
    found = people_in(chart(*SIZE), together(people, [moved(person, 5, 3) for person in people], mode=mode))
    assert len(found) == 6
    np.testing.assert_allclose(in_order(found), people, atol=6)


def test_the_wanted_number_of_people_is_refined():
    people = [person_at(60 + 90 * i, 110, 250) for i in range(6)]
    for wanted in (0, 2, 6, 20):
        unit = together(people, look_closer=wanted)
        people_in(chart(*SIZE), unit)
        assert len(unit._networks.networks['movenet_thunder'].inputs) == min(wanted, 6)


def test_a_tracked_person_in_the_skeleton_of_another_one_is_found():
    """Networks with the full image put the legs of one person to the head of the other; crops show each."""
    here, there = person_at(300, 100, 300), person_at(350, 100, 300)
    legs = np.array([joint.split('_')[-1] in ('hip', 'knee', 'ankle') for joint in COCO_18.joints])
    mixed = np.where(legs[:, np.newaxis], there, here)
    unit = Detector(settings(), Together(
        mobilenet_thin=PafNetwork([mixed], SIZE), movenet_multipose=MovenetNetwork([mixed], SIZE),
        movenet_thunder=ThunderNetwork([here, there], SIZE)))
    keypoints = np.insert(np.array([here, there], np.float32), 2, 1.0, axis=2)
    tracks = ExpectedPeople(COCO_18, keypoints, np.array([4, 7]), np.ones(2), np.ones(2), np.zeros(2))
    found = NetworkDetection(unit, NEVER_FOLLOWED).look(ImageFrame('', 0.0, chart(*SIZE)), tracks).people
    assert found.ids[np.argsort(found.xy[:, 1, 0])].tolist() == [4, 7]
    np.testing.assert_allclose(in_order(found), [here, there], atol=4)  # they are 50 px apart


def test_joints_need_a_score():
    """Those that one of three sources sees, 0.9 sure, score sqrt(0.9 / 3.5), where all agree 0.95."""
    person = person_at(320, 100, 300)
    wrist = COCO_18.index['left_wrist']
    away = person.copy()
    away[wrist] = (-300, -300)
    for threshold, there in ((0.0, True), (0.15, True), (0.75, False)):
        unit = together([person], [away], joint_min_score=threshold)
        found = people_in(chart(*SIZE), unit)
        assert found.present[0].sum() == 17 + there
        assert found.present[0, wrist] == there
    assert len(people_in(chart(*SIZE), together([person], joint_min_score=0.99))) == 0


# --- changes --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('pose_model, error', [('BODY_25', ModelError), ('none', ParameterError)],
                         ids=['no weights', 'unknown'])
def test_a_network_that_can_not_be_had_leaves_all_as_it_was(pose_model, error, monkeypatch, tmp_path):
    unit = together([person_at(320, 80, 360)])
    image, recipe = chart(*SIZE), unit.recipe
    before = people_in(image, unit)
    networks = Networks(BackendParams(), str(tmp_path))
    monkeypatch.setattr(unit, '_networks', networks)
    with pytest.raises(error):
        unit.reconfigure(settings(pose_model=pose_model, person_min_score=1.0))
    assert unit.recipe is recipe
    assert_same(people_in(image, unit), before)


# --- target rate ----------------------------------------------------------------------------------------------------

def test_target_rate_makes_the_detector_compute_less():
    people = [person_at(320, 80, 360)]
    unit = together(people, target_rate=1000.0)
    assert [one.box for one in unit.recipe.passes] == [(328, 184), (256, 256)]  # half of each side is the least
    assert len(people_in(chart(*SIZE), unit)) == 1
    assert together(people, target_rate=0.001).recipe == MODES['balanced']


# --- loading --------------------------------------------------------------------------------------------------------

@pytest.fixture
def machine(monkeypatch):
    """A machine on which some weights are there; networks are stand-ins, and those that are loaded are noted."""
    state = SimpleNamespace(there={'mobilenet_thin', 'movenet_multipose', 'movenet_thunder'}, runtime=True, loaded=[],
                            fallbacks={})

    def path(model, model_folder):
        if model.name not in state.there:
            raise MissingWeightsError(f'weights of {model.name} not found')
        return Path(model.name)

    def create(model, weights, params):
        if model is MOVENET_MULTIPOSE and not state.runtime:
            raise ParameterError("parameter 'backend' can not compute movenet_multipose")
        state.loaded.append(model.name)
        stand_in = {'paf': PafNetwork, 'movenet_multipose': MovenetNetwork, 'movenet_singlepose': ThunderNetwork}
        network = stand_in[model.decoder]([person_at(320, 80, 360)])
        network.fallback = state.fallbacks.get(model.name, '')
        return network

    monkeypatch.setattr(openpose_ros_pkg.detect.detector, 'weights_path', path)
    monkeypatch.setattr(openpose_ros_pkg.detect.detector, 'create_backend', create)
    return state


def created(**values):
    return create_detector(settings(**values))


def test_what_is_missing_or_slower_than_asked_for_is_told(machine):
    assert created(mode='fast').faults == ''
    machine.there.remove('movenet_multipose')
    machine.fallbacks['mobilenet_thin'] = 'joints in a known image are off by 3 px'
    slower, missing = created(mode='balanced').faults.split('; ')
    assert slower == 'stand-in computes mobilenet_thin: joints in a known image are off by 3 px'
    assert missing.startswith('movenet_multipose is missing, so people are found less accurately')
    machine.there.remove('movenet_thunder')  # optional: no fault
    assert set(created(mode='balanced').not_installed) == {'picodet', 'movenet_thunder'}


@pytest.mark.parametrize('mode, lacks, runtime', [
    ('balanced', MOVENET_MULTIPOSE, True), ('accurate', MOVENET_MULTIPOSE, False), ('balanced', MOVENET_THUNDER, True)],
    ids=['weights of the second', 'runtime of the second', 'weights of Thunder'])
def test_without_one_network_the_others_find_people_and_a_warning_tells(mode, lacks, runtime, machine, caplog):
    if runtime:
        machine.there.remove(lacks.name)
    machine.runtime = runtime
    with caplog.at_level(logging.WARNING):
        unit = created(mode=mode)
    (record,) = caplog.records
    assert f'{lacks.name} is ' in record.getMessage() and 'people are found less accurately' in record.getMessage()
    assert unit.recipe == MODES[mode].without([lacks])
    np.testing.assert_allclose(people_in(chart(*SIZE), unit).xy, [person_at(320, 80, 360)], atol=1.5)


def test_without_the_first_network_there_is_no_detector(machine):
    machine.there.remove('mobilenet_thin')
    with pytest.raises(ModelError, match='weights of mobilenet_thin not found'):
        created()
    machine.runtime = False
    with pytest.raises(ParameterError, match="'backend' can not compute movenet"):
        created(mode='fast')
