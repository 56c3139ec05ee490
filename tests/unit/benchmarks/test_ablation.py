"""Ablation: what is varied, and what it says of known counts."""
import json

import numpy as np
import pytest

from ablations import mechanisms, reasons, table
from ablations.effects import effects, image_switches
from ablations.variants import (
    PARTS,
    all_paths,
    half_and_twice,
    in_detection,
    scaled,
    with_values,
)
from openpose_ros_pkg.detect.occlusion_masks import LAYERS
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.constants import METHOD

SCENES = 12


@pytest.mark.parametrize('value, half, twice', [
    (0.4, 0.2, 0.8), (3, 2, 6), (1, 1, 2), (45, 23, 91), (-12.0, -6.0, -24.0), ((1.5, 40.0), (0.75, 20.0), (3.0, 80.0)),
    ((('nose', 0.2),), (('nose', 0.1),), (('nose', 0.4),))])
def test_half_and_twice(value, half, twice):
    assert (scaled(value, 0.5), scaled(value, 2.0)) == (half, twice)


def test_a_share_is_at_most_one():
    values = {one.name: one.constants for one in half_and_twice([('share', (0.8, {'unit': 'share'}))])}
    assert values == {'share half': {'share': 0.4}, 'share twice': {'share': 1.0}}


def test_other_values_are_those_of_a_copy():
    changed = with_values(METHOD, {'track.identity.same_place': 0.5, 'head.error': 0.5})
    assert (changed.track.identity.same_place, changed.head.error) == (0.5, 0.5)
    assert METHOD.track.identity.same_place != 0.5 and changed.costs is METHOD.costs


def test_detection_has_its_constants_back_after_an_error():
    before = LAYERS.doubt
    with pytest.raises(KeyError), in_detection({'detect.layers.doubt': 0.9}):
        assert LAYERS.doubt == 0.9
        raise KeyError
    assert LAYERS.doubt == before


@pytest.mark.parametrize('part', sorted(mechanisms.OF_PART))
def test_mechanisms_name_constants_and_parameters_that_there_are(part):
    known = {path for path, _ in all_paths(part)}
    for one in mechanisms.OF_PART[part]:
        assert set(one.constants) <= known and (one.constants or one.parameters), one.name
        build(ChainSettings, one.parameters)


def test_every_constant_is_in_one_part():
    assert len({path for part in PARTS for path, _ in all_paths(part)}) == sum(len(all_paths(part)) for part in PARTS)


def sums(right, errors):
    """Return the sums of a scene: joints within 100 mm of 200, and errors [mm] of as many joints."""
    return {'visible_100': [right, 200.0], 'switches': [1, 1.0],
            'visible_median': np.bincount(errors, minlength=300).tolist()}


def scenes():
    random = np.random.RandomState(0)
    for _ in range(SCENES):
        right, errors = random.randint(150, 180), random.randint(20, 40, 200)
        yield {table.BASE: sums(right, errors), 'other.worse half': sums(right - 20, errors + 10),
               'other.worse twice': sums(right - 10, errors), 'other.same half': sums(right, errors),
               'other.same twice': sums(right, errors)}


def test_differences_are_those_that_were_made():
    of = effects(list(scenes()), table.BASE)
    worse = of['other.worse half']
    assert worse['visible_100'].value == pytest.approx(-0.1) and worse['visible_100'].moves
    assert worse['visible_median'].value == pytest.approx(10) and worse['visible_median'].moves
    assert not any(one.moves for one in of['other.same half'].values()) and not worse['switches'].moves


def test_the_table_says_what_holds_a_narrow_value_and_what_moves_nothing(tmp_path, monkeypatch):
    for number, each in enumerate(scenes()):
        (tmp_path / f'{number}.estimator.json').write_text(json.dumps(
            {'commit': 'c0ffee', 'values': {'other.worse': '1', 'other.same': '2', '': []}, 'sums': each}))
    assert table.unsettled(tmp_path, 'estimator') == {'other.same'}
    monkeypatch.setitem(reasons.KEPT, 'other', 'a guard')
    monkeypatch.setitem(reasons.WENT, 'other.same', 'something else')
    text = table.report(tmp_path, {'other.worse', 'other.same'})
    assert '| `worse` | 1 | visible -10.0' in text and '| fragile |' in text
    assert '| `same` | 2 | - | - | idle: a guard |' in text
    assert '| deleted: something else |' in table.report(tmp_path, {'other.worse'}) and f'{SCENES} scenes' in text


def test_switches_in_the_image():
    uv = np.random.RandomState(0).uniform(0, 100, (18, 2))
    true = [[(1, uv, np.full(18, 2)), (2, uv + 300, np.full(18, 2))]] * 4
    keypoints = np.stack([np.insert(xy, 2, 1, axis=1) for xy in (uv, uv + 300)]).astype(np.float32)
    found = [People2D(COCO_18, keypoints, np.ones(2), np.array(ids)) for ids in ((1, 2), (1, 2), (2, 1), (2, 3))]
    assert image_switches(true, found)['image_switches'] == [3, 1.0]
