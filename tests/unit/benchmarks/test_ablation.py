"""Ablation: what is varied, and where other constants take their place."""
import argparse
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import ablation
from chain_runs import CountedNetwork
from openpose_ros_pkg.detect import occlusion_masks
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.constants import constant
from scoring.counts import Counts
from scoring.figures import Ratio, differences
from skeleton_extract_3d import estimator
from skeleton_extract_3d.constants import METHOD


@dataclass(frozen=True)
class Part:
    ramp: tuple = constant((1.0, 2.0), 'A condition.', unit='m')
    count: int = constant(3, 'A number.')
    share: float = constant(0.7, 'A share.')
    nothing: float = constant(0.0, 'None.')


@dataclass(frozen=True)
class Whole:
    part: Part = Part()


WHOLE = Whole()


def by_default(whole=WHOLE, part=WHOLE.part):
    return whole.part.count, part.count


@pytest.mark.parametrize('value, half, twice', [
    (0.4, 0.2, 0.8), (3, 2, 6), (1, 1, 2), (45, 23, 91), (-12.0, -6.0, -24.0), ((1.5, 40.0), (0.75, 20.0), (3.0, 80.0)),
    ((('nose', 0.2),), (('nose', 0.1),), (('nose', 0.4),))])
def test_half_and_twice(value, half, twice):
    assert (ablation.scaled(value, 0.5), ablation.scaled(value, 2.0)) == (half, twice)


@pytest.mark.parametrize('text, values', [
    ('.part', {'ramp half': (0.5, 1.0), 'ramp twice': (2.0, 4.0), 'count half': 2, 'count twice': 6,
               'share half': 0.35, 'share twice': 1.0}),
    ('.part.count', {'count half': 2, 'count twice': 6}), ('.part.share=.1', {'share=.1': 0.1})])
def test_an_argument_names_a_record_a_constant_or_a_value(text, values):
    found = ablation.variants_of(argparse.ArgumentParser(), f'{__name__}.WHOLE{text}')
    assert {one.name: getattr(one.other.part, one.name.rpartition('.part.')[2].split()[0].split('=')[0])
            for one in found} == {f'{__name__}.WHOLE.part.{name}': value for name, value in values.items()}
    assert all(one.record is WHOLE and not one.parameters for one in found)


def test_a_parameter_has_no_dot_and_unknown_modules_are_refused():
    one, = ablation.variants_of(argparse.ArgumentParser(), 'smoothing=false')
    assert one.parameters == {'smoothing': False} and one.record is None
    with pytest.raises(BadInputError, match='there is no such module'):
        ablation.variants_of(argparse.ArgumentParser(), 'no_such.CONSTANTS')


def test_a_record_takes_the_place_of_another_until_the_end_also_after_an_error():
    other = ablation.changed(WHOLE, ['part', 'count'], 9)
    with pytest.raises(KeyError), ablation.in_place_of(WHOLE, other):
        assert by_default() == (9, 9) and WHOLE is other
        raise KeyError
    assert by_default() == (3, 3) and WHOLE.part.count == 3


def test_constants_of_the_chain_are_reached():
    layers = occlusion_masks.LAYERS
    with ablation.in_place_of(layers, ablation.changed(layers, ['doubt'], 0.9)):
        assert occlusion_masks.doubted.__defaults__[-1].doubt == occlusion_masks.LAYERS.doubt == 0.9
    method = ablation.changed(METHOD, ['body', 'upper_direction_spreads'], 7)
    assert (method.body.upper_direction_spreads == 7).all() and method.costs is METHOD.costs
    with ablation.in_place_of(METHOD, method):
        assert any(value is method for value in estimator.PeopleEstimator.__init__.__defaults__)
    assert occlusion_masks.doubted.__defaults__[-1] is layers


def test_a_network_computes_an_input_once():
    asked, given = [], []
    network = CountedNetwork(SimpleNamespace(name='', description='', fallback='', infer_many=lambda images: (
        asked.extend(images) or [(2 * image,) for image in images])), given.extend, cached=True)
    images = [np.full((1, 2, 2, 3), value, np.float32) for value in (1, 2, 1)]
    outputs = [network.infer_many(images), network.infer_many(images), [network.infer(image) for image in images]]
    assert all((found == 2 * image).all() for row in outputs for (found,), image in zip(row, images))
    assert (len(asked), len(given)) == (2, 9)


def test_figures_that_move_are_named():
    counts = [[Counts(str(number), {}, {'right': right, 'all': 100}, {}) for number, right in enumerate(values)]
              for values in ((50, 60, 70), (40, 50, 60), (51, 60, 69))]
    share = {'share': Ratio('', lambda each: each.sums['right'], lambda each: each.sums['all'], digits=2)}
    found = [ablation.moved(differences(counts[0], other, share), {'share': 'right'}) for other in counts]
    assert found == ['-', 'right -0.10 [-0.10, -0.10]', '-']
