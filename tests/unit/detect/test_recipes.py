"""What the detector computes: the modes, and parameters that change them."""
from dataclasses import replace

import pytest

from openpose_ros_pkg.detect.recipe_choice import recipe_of, recipes_of
from openpose_ros_pkg.detect.recipes import MODES, MULTIPOSE_CROP, SMALL_MODES, DetectorParams
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MODELS, MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import BOX_DECODERS, CROP_DECODERS

ALL_MODES = pytest.mark.parametrize('mode', MODES)


# --- modes ----------------------------------------------------------------------------------------------------------

def test_without_thunder_multipose_refines_people_but_fewer():
    recipe = MODES['balanced']
    assert recipe.without([MOVENET_THUNDER]) == replace(recipe, refinements=(MULTIPOSE_CROP,), max_refined=6)
    assert replace(recipe, max_refined=2).without([MOVENET_THUNDER]).max_refined == 2
    assert replace(recipe, refinements=()).without([MOVENET_THUNDER]).refinements == ()
    accurate = MODES['accurate'].without([MOVENET_THUNDER])
    assert accurate.models == (MOBILENET_THIN, MOVENET_MULTIPOSE)
    assert (len(accurate.refinements), accurate.max_refined) == (2, 20)
    assert SMALL_MODES['balanced'].without([MOVENET_THUNDER]).refinements == SMALL_MODES['fast'].refinements


BOX = MODES['balanced'].passes[0].box


@pytest.mark.parametrize('params, attribute, expected', [
    # -1 is as the other side makes it; 0 is the mode's, or -1 where the other side is given
    ({'net_input_width': 400, 'net_input_height': 300}, 'box', (400, 300)), ({}, 'box', BOX),
    ({'net_input_width': 400}, 'box', (400, -1)), ({'net_input_height': 300}, 'box', (-1, 300)),
    ({'net_input_width': -1}, 'box', (-1, BOX[1])), ({'num_scales': 3}, 'zooms', pytest.approx((1.0, 0.7, 0.4))),
    ({'num_scales': 4, 'scale_gap': 0.25}, 'zooms', (1.0, 0.75, 0.5, 0.25)), ({'scale_gap': 0.2}, 'zooms', (1.0,)),
    ({'mode': 'accurate'}, 'zooms', pytest.approx((1.0, 2 / 3, 1 / 3))),
    ({'mode': 'accurate', 'scale_gap': 0.2}, 'zooms', pytest.approx((1.0, 0.8, 0.6))), ({}, 'mirror', False),
    ({'mode': 'accurate'}, 'mirror', True), ({'mirror': 'always'}, 'mirror', True),
    ({'mode': 'accurate', 'mirror': 'never'}, 'mirror', False),
    ({'mode': 'fast', 'mirror': 'always'}, 'mirror', False)])  # it gives people at once: nothing to average
def test_parameters_change_the_first_pass_alone(params, attribute, expected):
    *small, recipe = recipes_of(DetectorParams(**params))
    assert bool(small) == (set(params) <= {'mode', 'mirror'})  # PicoDet has one size
    assert getattr(recipe.passes[0], attribute) == expected
    mode = MODES[params.get('mode', 'balanced')]
    assert (recipe.passes[1:], recipe.refinements) == (mode.passes[1:], mode.refinements)


@ALL_MODES
def test_crop_refinement(mode):
    both = SMALL_MODES[mode], MODES[mode]
    assert recipes_of(DetectorParams(mode=mode, look_closer=-1)) == both
    for recipe, *others in zip(both, *(recipes_of(DetectorParams(mode=mode, look_closer=people)) for people in (0, 3))):
        assert [(one.refinements, one.passes, one.max_refined) for one in others] == [
            ((), recipe.passes, recipe.max_refined), (recipe.refinements, recipe.passes, 3)]


def test_at_a_rate_balanced_may_become_fast_where_small_networks_are():
    assert recipes_of(DetectorParams(target_rate=30.0)) == (
        SMALL_MODES['balanced'], SMALL_MODES['fast'], MODES['balanced'])
    assert recipes_of(DetectorParams(mode='fast', target_rate=30.0)) == (SMALL_MODES['fast'], MODES['fast'])
    assert recipes_of(DetectorParams(mode='accurate', target_rate=30.0)) == (SMALL_MODES['accurate'], MODES['accurate'])


# --- one network alone ----------------------------------------------------------------------------------------------

WHOLE_IMAGE = [name for name, model in MODELS.items() if model.decoder not in (*CROP_DECODERS, *BOX_DECODERS)]


@pytest.mark.parametrize('name, model', [
    *((name, name) for name in WHOLE_IMAGE), ('BODY_25', 'body_25'), ('MPI', 'mpi')])
def test_one_network_alone(name, model):
    recipe = recipe_of(DetectorParams(mode='accurate', pose_model=name))
    assert recipe.models == (MODELS[model],) and recipe.refinements == () and len(recipe.passes) == 1
    assert recipe.passes[0].mirror == (MODELS[model].decoder == 'paf') and len(recipe.passes[0].zooms) == 3
    refined = recipe_of(DetectorParams(pose_model=name, look_closer=5))
    assert refined.models[-1] == MOVENET_THUNDER and refined.max_refined == 5
    crop, = set(refined.place_weights[refined.pass_opinions:])
    assert set(refined.place_weights[:refined.pass_opinions]) == {crop}


@pytest.mark.parametrize('name, boxes', [
    ('BODY_25', [(328, 184), (656, 368), (984, 552)]),
    ('yolo.yaml', [(480, 480), (640, 640), (960, 960)])])
def test_one_network_alone_gets_openposes_input_or_that_of_yolos_training_or_one_larger_or_smaller(
        tmp_path, monkeypatch, name, boxes):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'yolo.yaml').write_text('{decoder: yolo_pose, files: [a.onnx]}')
    assert [recipe_of(DetectorParams(mode=mode, pose_model=name)).passes[0].box for mode in MODES] == boxes


# --- what is refused ------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('values, text', [
    ({'mode': 'slow'}, "'mode' = 'slow'.*'fast', 'balanced', 'accurate', 'best'"),
    ({'net_input_width': -1, 'net_input_height': -1}, "'net_input_width', 'net_input_height' = -1, -1"),
    ({'net_input_height': 9999}, 'net_input_height'), ({'net_input_width': -2}, 'net_input_width'),
    ({'num_scales': 5}, r"'num_scales', 'scale_gap' = 5, 0\.0.*would be -0\.2"),
    ({'num_scales': 3, 'scale_gap': 0.5}, "'num_scales', 'scale_gap' = 3, 0.5.*would be 0,"),
    ({'mode': 'accurate', 'scale_gap': 0.6}, r"'num_scales', 'scale_gap' = 0, 0\.6.*of 3 scales would be -0\.2"),
    ({'look_closer': -2}, 'look_closer')])
def test_bad_parameters_are_refused(values, text):
    with pytest.raises(ParameterError, match=text):
        DetectorParams(**values)
