"""The self-check catches networks that compute something else, and lets right ones pass."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends.self_check import check_backend, reference_path
from openpose_ros_pkg.networks.model_registry import (
    FACE_LANDMARK,
    LANDMARK_MODELS,
    MOBILENET_THIN,
    MODELS,
    MOVENET_MULTIPOSE,
    MOVENET_THUNDER,
)

BODY_25, LIGHTWEIGHT, RTMO = MODELS['body_25'], MODELS['lightweight_openpose'], MODELS['rtmo_s']


class Network:
    """Gives what a function makes of the image."""

    name = 'fake'
    description = 'Fake 1.0'

    def __init__(self, compute):
        self._compute = compute

    def infer(self, images):
        assert images.dtype == np.uint8 and images.ndim == 4 and len(images) == 1
        return self._compute(images)


def known_output(model, spoil=lambda output: output):
    """A network that gives the known output for the known image, spoilt by a function."""
    def compute(images):
        with np.load(str(reference_path(model))) as reference:
            np.testing.assert_array_equal(images[0], reference['image'])
            return tuple(spoil(reference[f'output_{i}'].astype(np.float32)) for i in range(len(model.outputs)))
    return Network(compute)


# --- with a known output --------------------------------------------------------------------------------------------

def rounded(output):
    """Keep 8 bits of each number, as bfloat16 does, and add the noise of a network that computes with such numbers."""
    bits = (output.astype(np.float32).view(np.uint32) + 0x8000) & 0xffff0000
    return bits.astype(np.uint32).view(np.float32) + np.random.default_rng(0).normal(0, 0.01, output.shape).astype('f4')


def moved(pixels):
    """Spoil fields: confidence maps that are shifted to the right by a part of a cell of 8 px."""
    def spoil(fields):
        fields, share = fields.copy(), pixels / 8
        fields[:, :18] = (1 - share) * fields[:, :18] + share * np.roll(fields[:, :18], 1, axis=3)
        return fields
    return spoil


def changed(rows, columns, value):
    """Spoil MoveNet's output: add a value to some columns of some rows."""
    def spoil(people):
        people = people.copy()
        people[0, rows, columns] += value
        return people
    return spoil


def scaled(factor):
    return lambda output: factor * output


UNSURE, BOX, JOINTS, SCORES = slice(2, 6), slice(51, 55), slice(0, 51), slice(2, 51, 3)


@pytest.mark.parametrize('model', [MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER, *LANDMARK_MODELS.values()],
                         ids=lambda model: model.name)
def test_right_network_passes(model):
    check_backend(known_output(model), model)


@pytest.mark.parametrize('model, spoil', [
    (MOBILENET_THIN, rounded), (FACE_LANDMARK, scaled(1.02)),
    (MOVENET_MULTIPOSE, lambda people: people[:, [1, 0, 2, 3, 4, 5]]),
    (MOVENET_MULTIPOSE, changed(UNSURE, slice(None), 0.1)),
    (MOVENET_MULTIPOSE, changed(0, BOX, 0.1)), (MOVENET_MULTIPOSE, changed(1, JOINTS, 0.001))],
    ids=['fewer bits', 'less exact landmarks', 'equally sure people exchanged', 'chance below the sure ones', 'boxes',
         'joints by a thousandth'])
def test_what_is_chance_passes(model, spoil):
    check_backend(known_output(model, spoil), model)


@pytest.mark.parametrize('model, spoil, text', [
    (MOBILENET_THIN, lambda fields: fields[:, :56], r'\(1, 56, 16, 12\), expected \(1, 57, 16, 12\)'),
    (MOBILENET_THIN, moved(2), r'off by [12]\.\d+ px \(median\)'),
    (MOBILENET_THIN, scaled(0.9), r'0\.0\d+ in score'), (MOBILENET_THIN, np.zeros_like, 'does not find a person'),
    (MOBILENET_THIN, lambda maps: np.where(np.arange(57)[:, None, None] == 0, np.roll(maps, 2, axis=2), maps),
     'px at most'),
    (MOBILENET_THIN, scaled(np.nan), 'not finite'), (FACE_LANDMARK, scaled(1.1), 'off by up to'),
    (MOVENET_MULTIPOSE, changed(1, JOINTS, 0.005), r'off by 1\.\d\d px'),
    (MOVENET_MULTIPOSE, changed(1, SCORES, 0.06), r'0\.060 in score')])
def test_wrong_network_is_caught_and_named(model, spoil, text):
    with pytest.raises(ModelError, match=f'Fake 1.0 computes {model.name} wrongly.*{text}.*parameter backend'):
        check_backend(known_output(model, spoil), model)


# --- without: the structure -----------------------------------------------------------------------------------------

def fields(*channels, stride=8, value=0.0):
    """A network with outputs of some channels each."""
    def compute(images):
        height, width = images.shape[1] // stride, images.shape[2] // stride
        return tuple(np.full((1, count, height, width), value, np.float32) for count in channels)
    return Network(compute)


def people(*shapes):
    return Network(lambda images: tuple(np.zeros(shape, np.float32) for shape in shapes))


def of_kind(decoder, outputs, size=(192, 256), points=17):
    """A network of another decoder; size: (width, height) of its input."""
    return replace(RTMO, name=decoder, decoder=decoder, points=points, outputs=('output',) * outputs,
                   input=replace(RTMO.input, fixed_size=size))


KINDS = [
    (of_kind('simcc', 2), [(1, 17, 384), (1, 17, 512)], [(1, 26, 384), (1, 26, 512)]),
    (of_kind('simcc', 2, points=133), [(1, 133, 384), (1, 133, 512)], [(1, 133, 512), (1, 133, 384)]),
    (of_kind('yolox', 2), [(1, 9, 5), (1, 9)], [(1, 9, 4), (1, 9)]),
    (of_kind('yolox', 1, (416, 416)), [(1, 3549, 6)], [(1, 3548, 6)]),
    (of_kind('yolox', 1), [(1, 1008, 85)], [(1, 9, 5)])]
IDS = [f'{model.name} {len(model.outputs)}' for model, _, _ in KINDS]


@pytest.mark.parametrize('model, right, wrong', KINDS, ids=IDS)
def test_structure_of_networks_by_their_file(model, right, wrong):
    check_backend(people(*right), model)
    with pytest.raises(ModelError, match=f'{model.decoder} wrongly: its outputs .* have the shapes .*expected'):
        check_backend(people(*wrong), model)


@pytest.mark.parametrize('model, network, text', [
    (BODY_25, fields(57), r'outputs net_output have the shapes \(1, 57, 16, 12\) for an image of 96x128, expected '
                          r'\(1, C, 16, 12\) with 78 channels in all \(26 confidence maps and 52 of the'),
    (BODY_25, fields(78, stride=4), r'\(1, 78, 32, 24\) for an image of 96x128, expected \(1, C, 16, 12\)'),
    (BODY_25, Network(lambda images: 1 / 0), r'zero'), (BODY_25, fields(26, 52), 'it has 2 outputs, expected 1'),
    (LIGHTWEIGHT, fields(19, 19), r'\(1, 19, 16, 12\) and \(1, 19, 16, 12\) for .*57 channels in all'),
    (BODY_25, fields(78, value=np.nan), 'output net_output has values that are not finite'),
    (RTMO, people((1, 9, 4), (1, 9, 17, 3)), r'expected \(1, N, 5\) and \(1, N, 17, 3\)'),
    (RTMO, people((1, 9, 5), (1, 9, 26, 3)), r'expected \(1, N, 5\) and \(1, N, 17, 3\)')],
    ids=['channels', 'stride', 'crash', 'one too many', 'one too small', 'NaN', 'boxes', 'joints'])
def test_wrong_structure_is_caught_and_both_are_named(model, network, text):
    with pytest.raises(ModelError, match=f'Fake 1.0 (computes|can not compute) {model.name}.*{text}'):
        check_backend(network, model)
