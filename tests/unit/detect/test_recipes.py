"""What the detector computes: the modes, and parameters that change them."""
from dataclasses import replace

import pytest

from openpose_ros_pkg.detect.recipes import (
    FASTER,
    MODES,
    MULTIPOSE_CROP,
    CropRefinement,
    DetectorParams,
    NetworkPass,
    Recipe,
    recipe_of,
)
from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MODELS, MOVENET_MULTIPOSE, MOVENET_THUNDER

ALL_MODES = pytest.mark.parametrize('mode', MODES)


def first_pass(**params):
    return recipe_of(DetectorParams(**params)).passes[0]


# --- modes ----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('recipe', [*MODES.values(), *FASTER], ids=lambda recipe: recipe.description)
def test_networks_of_a_recipe_fit_together(recipe):
    """One joint set, inputs of whole cells, and only networks that set-up fetches."""
    assert set(recipe.models) <= {MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER}
    assert len({model.skeleton for model in recipe.models}) == 1
    assert recipe.models[0] is recipe.passes[0].model
    for one in recipe.passes:
        assert one.zooms[0] == 1 and all(0 < zoom <= 1 for zoom in one.zooms)
        assert all(side % one.model.input.multiple_of == 0 for side in one.box)
        assert not one.mirror or one.model.decoder == 'paf'
    for one in recipe.refinements:
        assert one.side % one.model.input.multiple_of == 0
        assert one.model.input.fixed_size in (None, (one.side, one.side))


def test_opinions_and_their_weights():
    """Averaged fields are one opinion; MoveNet gives one for each scale, and every refinement one more."""
    thin = NetworkPass(MOBILENET_THIN, (656, 368), (1.0, 0.5), mirror=True, weight=3.0)
    movenet = NetworkPass(MOVENET_MULTIPOSE, (512, 512), (1.0, 0.5))
    assert (thin.opinions, movenet.opinions) == (1, 2)
    recipe = Recipe((thin, movenet), (MULTIPOSE_CROP, CropRefinement(MOVENET_THUNDER, 1.25, place_weight=8.0)))
    assert recipe.pass_opinions == 3
    assert recipe.weights == (3.0, 1.0, 1.0, 1.0, 1.0)
    assert recipe.place_weights == (3.0, 1.0, 1.0, 1.0, 8.0)
    assert recipe.models == (MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER)
    assert recipe.is_ensemble
    assert not Recipe((thin,)).is_ensemble
    assert Recipe((movenet,)).is_ensemble and Recipe((thin,), (MULTIPOSE_CROP,)).is_ensemble


def test_without_thunder_multipose_refines_people_but_fewer():
    recipe = MODES['balanced']
    assert recipe.without([MOVENET_THUNDER]) == replace(recipe, refinements=(MULTIPOSE_CROP,), max_refined=6)
    assert replace(recipe, max_refined=2).without([MOVENET_THUNDER]).max_refined == 2
    assert replace(recipe, refinements=()).without([MOVENET_THUNDER]).refinements == ()
    accurate = MODES['accurate'].without([MOVENET_THUNDER])
    assert accurate.models == (MOBILENET_THIN, MOVENET_MULTIPOSE)
    assert (len(accurate.refinements), accurate.max_refined) == (4, 20)


# --- parameters that change a mode ----------------------------------------------------------------------------------

@pytest.mark.parametrize('width, height, box', [
    (0, 0, MODES['balanced'].passes[0].box), (400, 300, (400, 300)), (400, 0, (400, -1)), (0, 300, (-1, 300)),
    (-1, 300, (-1, 300)), (400, -1, (400, -1)), (-1, 0, (-1, MODES['balanced'].passes[0].box[1])),
    (0, -1, (MODES['balanced'].passes[0].box[0], -1))])
def test_box(width, height, box):
    """-1 is as the other side makes it; 0 is the mode's, or -1 where the other side is given."""
    recipe = recipe_of(DetectorParams(net_input_width=width, net_input_height=height))
    assert recipe.passes[0].box == box
    assert recipe.passes[1:] == MODES['balanced'].passes[1:] and recipe.refinements == MODES['balanced'].refinements


@pytest.mark.parametrize('mode, num_scales, scale_gap, zooms', [
    ('balanced', 0, 0.0, (1.0,)), ('balanced', 1, 0.0, (1.0,)), ('balanced', 3, 0.0, (1.0, 0.7, 0.4)),
    ('balanced', 4, 0.25, (1.0, 0.75, 0.5, 0.25)), ('balanced', 0, 0.2, (1.0,)),
    ('accurate', 0, 0.0, (1.0, 2 / 3, 1 / 3)), ('accurate', 1, 0.0, (1.0,)), ('accurate', 2, 0.0, (1.0, 0.7)),
    ('accurate', 0, 0.2, (1.0, 0.8, 0.6))])
def test_scales(mode, num_scales, scale_gap, zooms):
    recipe = recipe_of(DetectorParams(mode=mode, num_scales=num_scales, scale_gap=scale_gap))
    assert recipe.passes[0].zooms == pytest.approx(zooms)
    assert recipe.passes[1:] == MODES[mode].passes[1:]


@pytest.mark.parametrize('mode, mirror, expected', [
    ('fast', 'auto', False), ('balanced', 'auto', False), ('accurate', 'auto', True), ('balanced', 'always', True),
    ('accurate', 'never', False),
    ('fast', 'always', False)])  # its first network gives people at once: nothing to average
def test_mirror(mode, mirror, expected):
    assert first_pass(mode=mode, mirror=mirror).mirror is expected


@ALL_MODES
def test_crop_refinement(mode):
    assert recipe_of(DetectorParams(mode=mode, look_closer=-1)) == MODES[mode]
    unrefined = recipe_of(DetectorParams(mode=mode, look_closer=0))
    assert (unrefined.refinements, unrefined.passes) == ((), MODES[mode].passes)
    for people in (1, 3, 50):
        bounded = recipe_of(DetectorParams(mode=mode, look_closer=people))
        assert (bounded.max_refined, bounded.refinements) == (people, MODES[mode].refinements)


# --- one network alone ----------------------------------------------------------------------------------------------

@ALL_MODES
@pytest.mark.parametrize('name, model', [
    *((name, name) for name in MODELS), ('BODY_25', 'body_25'), ('MPI', 'mpi'), ('MPI_4_layers', 'mpi_4_layers')])
def test_one_network_alone(mode, name, model):
    recipe = recipe_of(DetectorParams(mode=mode, pose_model=name))
    assert recipe.models == (MODELS[model],)
    assert recipe.refinements == () and len(recipe.passes) == 1
    assert not recipe.passes[0].mirror or MODELS[model].decoder == 'paf'


def test_one_network_alone_gets_openposes_input_a_larger_one_or_a_smaller_one():
    boxes = {mode: first_pass(mode=mode, pose_model='BODY_25').box for mode in MODES}
    assert boxes == {'fast': (328, 184), 'balanced': (656, 368), 'accurate': (984, 552)}
    assert first_pass(mode='accurate', pose_model='BODY_25').mirror
    assert len(first_pass(mode='accurate', pose_model='BODY_25').zooms) == 3


@ALL_MODES
@pytest.mark.parametrize('name', ['body_25', 'rtmo_s', 'mobilenet_thin'])
def test_with_look_closer_thunder_refines_the_people_of_one_network(mode, name):
    recipe = recipe_of(DetectorParams(mode=mode, pose_model=name, look_closer=5))
    assert recipe.models == (MODELS[name], MOVENET_THUNDER) and recipe.max_refined == 5
    assert recipe.skeleton is MODELS[name].skeleton
    crop, = set(recipe.place_weights[recipe.pass_opinions:])
    assert set(recipe.place_weights[:recipe.pass_opinions]) == {crop}


def test_yolo_pose_sees_the_image_in_the_sizes_that_it_was_trained_for(tmp_path):
    (tmp_path / 'mine.yaml').write_text('{decoder: yolo_pose, files: [a.onnx]}')
    boxes = {mode: first_pass(mode=mode, pose_model=str(tmp_path / 'mine.yaml')).box for mode in MODES}
    assert boxes == {'fast': (480, 480), 'balanced': (640, 640), 'accurate': (960, 960)}


def test_network_of_ones_own(tmp_path):
    (tmp_path / 'mine.yaml').write_text('{skeleton: COCO_18, files: [a.onnx], outputs: [fields], decoder: paf}')
    assert first_pass(pose_model=str(tmp_path / 'mine.yaml')).model.name == 'mine'
    (tmp_path / 'bad.yaml').write_text('{skeleton: COCO_19, files: [a.onnx], outputs: [fields], decoder: paf}')
    with pytest.raises(ModelError, match=r'bad\.yaml'):
        first_pass(pose_model=str(tmp_path / 'bad.yaml'))


# --- what is refused ------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('values, text', [
    ({'mode': 'best'}, "'mode' = 'best'.*'fast', 'balanced', 'accurate'"),
    ({'net_input_width': -1, 'net_input_height': -1}, "'net_input_width', 'net_input_height' = -1, -1"),
    ({'net_input_height': 9999}, 'net_input_height'), ({'net_input_width': -2}, 'net_input_width'),
    ({'num_scales': 5}, r"'num_scales', 'scale_gap' = 5, 0\.0.*would be -0\.2"),
    ({'num_scales': 3, 'scale_gap': 0.5}, "'num_scales', 'scale_gap' = 3, 0.5.*would be 0,"),
    ({'mode': 'accurate', 'scale_gap': 0.6}, r"'num_scales', 'scale_gap' = 0, 0\.6.*of 3 scales would be -0\.2"),
    ({'num_scales': -1}, 'num_scales'), ({'scale_gap': 1.0}, 'scale_gap'), ({'mirror': 'yes'}, 'mirror'),
    ({'look_closer': -2}, 'look_closer'), ({'target_rate': -1.0}, 'target_rate')])
def test_bad_parameters_are_refused(values, text):
    with pytest.raises(ParameterError, match=text):
        DetectorParams(**values)
