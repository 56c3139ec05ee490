"""The self-check catches networks that compute something else, and lets right ones pass."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends.self_check import check_backend, reference_path
from openpose_ros_pkg.networks.model_registry import (
    LANDMARK_MODELS,
    MOBILENET_THIN,
    MODELS,
    MOVENET_MULTIPOSE,
)

BODY_25, LIGHTWEIGHT, RTMO = MODELS['body_25'], MODELS['lightweight_openpose'], MODELS['rtmo_s']


class Network:
    """Gives what a function makes of the picture."""

    name = 'fake'
    description = 'Fake 1.0'

    def __init__(self, compute):
        self._compute = compute

    def infer(self, images):
        assert images.dtype == np.uint8 and images.ndim == 4 and len(images) == 1
        return self._compute(images)


def known_output(model, spoil=lambda output: output):
    """A network that gives the known output for the known picture, spoilt by a function."""
    def compute(images):
        with np.load(str(reference_path(model))) as reference:
            np.testing.assert_array_equal(images[0], reference['image'])
            return tuple(spoil(reference[f'output_{i}'].astype(np.float32)) for i in range(len(model.outputs)))
    return Network(compute)


# --- with a known output --------------------------------------------------------------------------------------------

def test_a_damaged_reference_is_an_error_that_names_it(tmp_path, monkeypatch):
    path = tmp_path / 'known.npz'
    content = reference_path(MOBILENET_THIN).read_bytes()
    monkeypatch.setattr('openpose_ros_pkg.networks.backends.self_check.reference_path', lambda model: path)
    for damaged in (b'', b'no archive', content[:-100], content[:5000] + bytes(1000) + content[6000:]):
        path.write_bytes(damaged)
        with pytest.raises(ModelError, match=r'known\.npz is damaged'):
            check_backend(known_output(MOBILENET_THIN), MOBILENET_THIN, exact=True)


@pytest.mark.parametrize('model', LANDMARK_MODELS.values(), ids=lambda model: model.name)
def test_networks_of_hands_and_faces_may_be_less_exact_with_fewer_bits(model):
    coarse, wrong = (known_output(model, lambda output, factor=factor: factor * output) for factor in (1.02, 1.1))
    check_backend(coarse, model, exact=False)
    for network, exact in ((coarse, True), (wrong, False)):
        with pytest.raises(ModelError, match=f'{model.name} wrongly: its output for a known image is off by up to'):
            check_backend(network, model, exact=exact)


@pytest.mark.parametrize('spoil, text', [
    (np.zeros_like, 'off by up to 1'), (lambda fields: fields[:, ::-1], 'off by'),
    (lambda fields: fields + 0.01, '0.01'),
    (lambda fields: fields * np.nan, 'nan'),
    (lambda fields: fields[:, :56], r'\(1, 56, 16, 12\), expected \(1, 57, 16, 12\)')],
    ids=['zero', 'channels in another order', 'small offset', 'NaN', 'channel missing'])
def test_wrong_network_is_caught_and_named(spoil, text):
    with pytest.raises(ModelError, match=f'Fake 1.0 computes mobilenet_thin wrongly.*{text}.*parameter backend'):
        check_backend(known_output(MOBILENET_THIN, spoil), MOBILENET_THIN, exact=True)


def rounded(output):
    """Keep 8 bits of each number, as bfloat16 does, and add the noise of a network that computes with such numbers."""
    bits = (output.astype(np.float32).view(np.uint32) + 0x8000) & 0xffff0000
    return bits.astype(np.uint32).view(np.float32) + np.random.default_rng(0).normal(0, 0.01, output.shape).astype('f4')


def test_people_of_reduced_precision_pass_where_its_numbers_would_not():
    network = known_output(MOBILENET_THIN, rounded)
    check_backend(network, MOBILENET_THIN, exact=False)
    with pytest.raises(ModelError, match='off by up to'):
        check_backend(network, MOBILENET_THIN, exact=True)


def moved(pixels, joints=slice(0, 18)):
    """Spoil fields: confidence maps that are shifted to the right by a part of a cell of 8 px."""
    def spoil(fields):
        fields, share = fields.copy(), pixels / 8
        maps = fields[:, joints]
        fields[:, joints] = (1 - share) * maps + share * np.roll(maps, 1, axis=3)
        return fields
    return spoil


@pytest.mark.parametrize('spoil, text', [
    (moved(2), r'off by [12]\.\d+ px \(median\)'), (lambda fields: 0.9 * fields, r'0\.0\d+ in score'),
    (lambda fields: fields[:, ::-1], 'does not find|off by'), (np.zeros_like, 'does not find a person'),
    (lambda maps: np.where(np.arange(57)[:, None, None] == 0, np.roll(maps, 2, axis=2), maps), 'px at most'),
    (lambda fields: fields * np.nan, 'not finite')],
    ids=['all moved by 2 px', 'scores a tenth lower', 'channels in another order', 'zero', 'one joint moved', 'NaN'])
def test_wrong_people_of_reduced_precision_are_caught(spoil, text):
    with pytest.raises(ModelError, match=text):
        check_backend(known_output(MOBILENET_THIN, spoil), MOBILENET_THIN, exact=False)


def changed(rows, columns, value):
    """Spoil MoveNet's output: add a value to some columns of some rows."""
    def spoil(people):
        people = people.copy()
        people[0, rows, columns] += value
        return people
    return spoil


UNSURE = slice(2, 6)


@pytest.mark.parametrize('spoil', [
    lambda people: people[:, [1, 0, 2, 3, 4, 5]], lambda people: people[:, ::-1], changed(UNSURE, slice(None), 0.2)],
    ids=['equally sure people exchanged', 'all in another order', 'chance below the sure ones'])
def test_what_is_chance_in_movenet_does_not_count(spoil):
    check_backend(known_output(MOVENET_MULTIPOSE, spoil), MOVENET_MULTIPOSE, exact=True)


@pytest.mark.parametrize('spoil', [
    np.zeros_like, changed(0, slice(51, 55), 0.01), changed(1, slice(0, 51), 0.01), changed(0, 55, -0.1),
    lambda people: people * np.nan, changed(5, 3, np.nan)],
    ids=['zero', 'box moved', 'joints moved', 'score', 'NaN', 'NaN in an unsure one'])
def test_wrong_movenet_is_caught(spoil):
    with pytest.raises(ModelError, match='computes movenet_multipose wrongly: its output for a known image is off'):
        check_backend(known_output(MOVENET_MULTIPOSE, spoil), MOVENET_MULTIPOSE, exact=True)


def test_movenet_in_reduced_precision_is_judged_by_its_people():
    """Box and score of a person do not matter; where the joints are and their scores do."""
    check_backend(known_output(MOVENET_MULTIPOSE, changed(0, slice(51, 55), 0.1)), MOVENET_MULTIPOSE, exact=False)
    check_backend(known_output(MOVENET_MULTIPOSE, changed(1, slice(0, 51), 0.001)), MOVENET_MULTIPOSE, exact=False)
    with pytest.raises(ModelError, match=r'off by 1\.\d\d px'):
        check_backend(known_output(MOVENET_MULTIPOSE, changed(1, slice(0, 51), 0.005)), MOVENET_MULTIPOSE, exact=False)
    with pytest.raises(ModelError, match=r'0\.060 in score'):
        check_backend(known_output(MOVENET_MULTIPOSE, changed(1, slice(2, 51, 3), 0.06)), MOVENET_MULTIPOSE,
                      exact=False)


# --- without: the structure -----------------------------------------------------------------------------------------

def fields(*channels, stride=8, value=0.0):
    """A network with outputs of some channels each."""
    def compute(images):
        height, width = images.shape[1] // stride, images.shape[2] // stride
        return tuple(np.full((1, count, height, width), value, np.float32) for count in channels)
    return Network(compute)


def people(boxes, joints):
    return Network(lambda images: (np.zeros(boxes, np.float32), np.zeros(joints, np.float32)))


@pytest.mark.parametrize('model, network', [
    (BODY_25, fields(78)), (LIGHTWEIGHT, fields(19, 38)), (RTMO, people((1, 9, 5), (1, 9, 17, 3))),
    (RTMO, people((1, 0, 5), (1, 0, 17, 3))),
    (replace(MOVENET_MULTIPOSE, name='own'), Network(lambda images: (np.zeros((1, 6, 56), np.float32),)))],
    ids=['one output', 'two outputs', 'RTMO', 'RTMO without people', 'MoveNet of another file'])
def test_right_structure_passes(model, network):
    assert not reference_path(model).exists()
    check_backend(network, model, exact=True)


@pytest.mark.parametrize('model, network, text', [
    (BODY_25, fields(57), r'outputs net_output have the shapes \(1, 57, 16, 12\) for an image of 96x128, expected '
                          r'\(1, C, 16, 12\) with 78 channels in all \(26 confidence maps and 52 of the'),
    (BODY_25, fields(78, stride=4), r'\(1, 78, 32, 24\) for an image of 96x128, expected \(1, C, 16, 12\)'),
    (BODY_25, Network(lambda images: 1 / 0), r'zero'),
    (BODY_25, fields(26, 52), 'it has 2 outputs, expected 1'),
    (LIGHTWEIGHT, fields(19, 19), r'\(1, 19, 16, 12\) and \(1, 19, 16, 12\) for .*57 channels in all'),
    (BODY_25, fields(78, value=np.nan), 'output net_output has values that are not finite'),
    (RTMO, people((1, 9, 4), (1, 9, 17, 3)), r'expected \(1, N, 5\) and \(1, N, 17, 3\)'),
    (RTMO, people((1, 9, 5), (1, 9, 26, 3)), r'expected \(1, N, 5\) and \(1, N, 17, 3\)')],
    ids=['channels', 'stride', 'crash', 'one too many', 'one too small', 'NaN', 'boxes', 'joints'])
def test_wrong_structure_is_caught_and_both_are_named(model, network, text):
    with pytest.raises(ModelError, match=f'Fake 1.0 (computes|can not compute) {model.name}.*{text}'):
        check_backend(network, model, exact=True)
