"""Ablation: what is varied, what is beyond noise, and what that says of a constant."""
import argparse
import json
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from ablation_tools import parts, reasons, table
from ablation_tools.changes import IDLE, Sums, changes, counted, counts_of, verdict
from ablation_tools.command import add_options, run
from ablation_tools.kept import RememberedNetwork
from ablation_tools.scenes import image_switches
from ablation_tools.variants import ALWAYS, WITHOUT, constant_paths, in_shared, scaled, variants, with_values
from openpose_ros_pkg.detect.occlusion_masks import LAYERS
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.constants import METHOD

SCENES = 12


@dataclass(frozen=True)
class Part:
    ramp: tuple = constant((1.0, 2.0), 'A condition.', unit='m')
    count: int = constant(3, 'A number.')
    share: float = constant(0.7, 'A share.')


@dataclass(frozen=True)
class Whole:
    part: Part = Part()


@pytest.mark.parametrize('value, half, twice', [
    (0.4, 0.2, 0.8), (3, 2, 6), (1, 1, 2), (45, 23, 91), (-12.0, -6.0, -24.0), ((1.5, 40.0), (0.75, 20.0), (3.0, 80.0)),
    ((('nose', 0.2),), (('nose', 0.1),), (('nose', 0.4),))])
def test_half_and_twice(value, half, twice):
    assert (scaled(value, 0.5), scaled(value, 2.0)) == (half, twice)


def test_variants_change_one_constant_each():
    paths = constant_paths(Whole())
    found = {one.name: one.constants for one in variants(paths, without=True)}
    assert len(found) == 7 and len(variants(paths)) == 6
    assert found['part.ramp twice'] == {'part.ramp': (2.0, 4.0)}
    assert found[f'part.ramp {WITHOUT}'] == {'part.ramp': ALWAYS}
    assert found['part.count half'] == {'part.count': 2} and found['part.share twice'] == {'part.share': 1.0}
    assert [path for path, _ in constant_paths({'a.b': Part()})] == ['a.b.ramp', 'a.b.count', 'a.b.share']


def test_a_value_that_a_factor_leaves_as_it_is_is_no_variant():
    metadata = {'unit': 'share'}
    assert [one.name for one in variants([('zero', (0.0, metadata)), ('one', (1.0, metadata))])] == ['one half']


def test_other_values_are_those_of_a_copy():
    changed = with_values(METHOD, {'track.identity.same_place': 0.5, 'head.error': 0.5})
    assert (changed.track.identity.same_place, changed.head.error) == (0.5, 0.5)
    assert METHOD.track.identity.same_place != 0.5 and changed.costs is METHOD.costs


def test_shared_instances_have_their_constants_back_after_an_error():
    before = LAYERS.doubt
    with pytest.raises(KeyError), in_shared(parts.IN_DETECTION, {'detect.layers.doubt': 0.9}):
        assert LAYERS.doubt == 0.9
        raise KeyError
    assert LAYERS.doubt == before


@pytest.mark.parametrize('part', sorted(parts.MECHANISMS))
def test_mechanisms_name_constants_and_parameters_that_there_are(part):
    known = {path for path, _ in parts.paths_of(part)}
    for one in parts.MECHANISMS[part]:
        assert set(one.constants) <= known and (one.constants or one.parameters), one.name
        build(ChainSettings, one.parameters)


def test_every_constant_is_in_one_part_besides_that_of_long_sequences():
    paths = [path for part in set(parts.PARTS) - {'lives'} for path, _ in parts.paths_of(part)]
    assert len(set(paths)) == len(paths)
    assert 'track.identity.gap' in paths and not any(path.startswith(parts.NOT_SHOWN) for path in paths)
    assert {path for path, _ in parts.paths_of('lives')} < set(paths)


def test_a_network_computes_an_input_once():
    asked = []
    network = RememberedNetwork(SimpleNamespace(
        name='', description='', fallback='', infer_many=lambda images: asked.extend(images) or [(2 * image,)
                                                                                                 for image in images]))
    images = [np.full((1, 2, 2, 3), value, np.float32) for value in (1, 2, 1)]
    outputs = [network.infer_many(images), network.infer_many(images), [network.infer(image) for image in images]]
    assert all((found == 2 * image).all() for row in outputs for (found,), image in zip(row, images))
    assert len(asked) == network.passes == 2


def units(rates, figure='found'):
    """Return the counts of units of which each has this share of 50."""
    return counted(lambda sums, rate, whole: sums.add(figure, whole * rate, whole), rates, 50)


def difference(before, after):
    return changes(before, after, lambda figure: 0.005)


@pytest.mark.parametrize('after, is_clear', [
    (np.full(20, 0.5), False), (np.full(20, 0.4), True), (np.full(20, 0.497), False),
    (np.r_[np.full(10, 0.4), np.full(10, 0.6)], False)])
def test_a_change_is_clear_where_units_agree_and_it_is_large_enough(after, is_clear):
    change = difference(units(np.full(20, 0.5)), units(after))['found']
    assert change.value == pytest.approx(after.mean() - 0.5) and change.is_clear == is_clear
    assert change.low <= change.value + 1e-9 and change.value - 1e-9 <= change.high


def test_a_figure_without_a_denominator_changes_nothing():
    change = difference(counts_of([Sums({'found': (0, 0)})] * 3), counts_of([Sums({'found': (1, 0)})] * 3))['found']
    assert np.isnan(change.value) and not change.is_clear


def test_verdicts():
    base, less, more = (units(np.full(20, rate)) for rate in (0.5, 0.4, 0.6))
    same, worse, better = (difference(base, other) for other in (base, less, more))
    assert verdict([same, same]) == verdict([{}, {}, {}]) == IDLE
    assert verdict([worse, same]) == verdict([worse, better]) == verdict([worse, {}]) == 'earns its place'
    assert verdict([same, same, worse]) == 'earns its place'
    assert verdict([worse, worse]) == 'fragile'
    missed = difference(units(np.full(20, 0.1), 'missed'), units(np.full(20, 0.2), 'missed'))
    assert verdict([missed, missed]) == 'fragile'


def test_a_command_prints_a_row_for_each_constant(capsys, tmp_path):
    def score(whole):
        return units(np.full(20, whole.part.share / 2))

    parser = argparse.ArgumentParser()
    add_options(parser)
    for _ in range(2):
        arguments = parser.parse_args(['--before', str(tmp_path / 'before.json')])
        run(constant_paths(Whole()), lambda values: with_values(Whole(), values), {'people': score}, {}, arguments)
        text = capsys.readouterr().out
        assert '| found | 0.3500 | 20 |  |  |' in text
    assert '| part.ramp | 1.0, 2.0 | - | - | - | idle here |' in text
    assert '| part.share | 0.7 | found -0.175 [-0.175, -0.175] | found +0.150 [+0.150, +0.150] | - |' in text
    run(constant_paths(Whole(Part(share=0.5))), lambda values: with_values(Whole(Part(share=0.5)), values),
        {'people': score}, {'part': ()}, arguments)
    text = capsys.readouterr().out
    assert '| found | 0.2500 | 20 | -0.100 [-0.100, -0.100] | beyond noise |' in text and 'earns' not in text


def sums(right, errors, switches=1):
    """Return the sums of a scene: joints within 100 mm of 200, ids that switch, and errors [mm] of as many joints."""
    return {'visible_100': [right, 200.0], 'switches': [switches],
            'visible_median': np.bincount(errors, minlength=300).tolist()}


def scenes():
    random = np.random.RandomState(0)
    for _ in range(SCENES):
        right, errors = random.randint(150, 180), random.randint(20, 40, 200)
        yield {table.BASE: sums(right, errors), 'other.worse half': sums(right - 20, errors + 10, 3),
               'other.worse twice': sums(right - 10, errors), 'other.same half': sums(right, errors),
               'other.same twice': sums(right, errors)}


def test_differences_are_those_that_were_made():
    of = table.effects(list(scenes()))
    worse = of['other.worse half']
    assert all(one.is_clear for one in worse.values())
    assert worse['visible_100'].value == pytest.approx(-0.1) and worse['switches'].value == 2 * SCENES
    assert worse['visible_median'].value == pytest.approx(10)
    assert not any(one.is_clear for one in of['other.same half'].values())
    assert not of['other.worse twice']['switches'].is_clear


def test_a_variant_is_compared_in_the_scenes_that_have_it():
    some = [{name: one for name, one in scene.items() if number < 6 or 'worse half' not in name}
            for number, scene in enumerate(scenes())]
    assert table.effects(some)['other.worse half']['switches'].value == 2 * 6


def test_the_table_says_what_holds_a_narrow_value_and_what_moves_nothing(tmp_path, monkeypatch):
    for number, each in enumerate(scenes()):
        (tmp_path / f'{number}.estimator.json').write_text(json.dumps({
            'commit': 'c0ffee', 'values': {'other.worse': '1', 'other.same': '2', '': ['other.worse half']},
            'sums': each}))
    assert table.unsettled(tmp_path, 'estimator') == {'other.same'}
    assert '| `same` | 2 | - | - | deleted |' in table.report(tmp_path)
    monkeypatch.setitem(reasons.KEPT, 'other', 'a guard')
    monkeypatch.setattr(table, 'paths_of', lambda part: [('other.worse', None), ('other.same', None)])
    text = table.report(tmp_path)
    assert '| `worse` | 1 | visible -10.0' in text and 'switches +24 ± 0.0' in text and '| fragile |' in text
    assert '| `same` | 2 | - | - | idle: a guard |' in text
    assert '| other.worse half | visible -10.0' in text and '| needed |' in text
    assert f'{SCENES} scenes' in text


def test_switches_in_the_image():
    uv = np.random.RandomState(0).uniform(0, 100, (18, 2))
    true = [[(1, uv, np.full(18, 2)), (2, uv + 300, np.full(18, 2))]] * 4
    keypoints = np.stack([np.insert(xy, 2, 1, axis=1) for xy in (uv, uv + 300)]).astype(np.float32)
    found = [People2D(COCO_18, keypoints, np.ones(2), np.array(ids)) for ids in ((1, 2), (1, 2), (2, 1), (2, 3))]
    assert image_switches(true, found)['image_switches'] == [3]
