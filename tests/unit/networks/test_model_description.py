"""Networks that users describe in YAML: read whole, or refused with file, key, value and what is allowed."""
import re
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_description import read_description
from openpose_ros_pkg.networks.model_types import (
    SIMCC_INPUT,
    YOLOX_INPUT,
    InputRecipe,
    WeightsFile,
)
from openpose_ros_pkg.networks.models import find_model, weights_path
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, Limb

ROOT = Path(__file__).parents[3]
LEAST = {'skeleton': 'BODY_25', 'files': ['net.onnx'], 'outputs': ['heatmaps', 'pafs'], 'decoder': 'paf'}
ARMS = {
    'joints': ['neck', 'right_shoulder', 'right_wrist', 'left_shoulder', 'left_wrist'],
    'limbs': [{'start': 'neck', 'end': 'right_shoulder', 'paf': [0, 1]},
              {'start': 'neck', 'end': 'left_shoulder', 'paf': [4, 5]},
              {'start': 'right_shoulder', 'end': 'right_wrist', 'paf': [2, 3]},
              {'start': 'left_shoulder', 'end': 'left_wrist', 'paf': [7, 6], 'starts_person': False}]}


def described(folder, name='mine', **changes):
    """Read a description that is the shortest one but for some keys; None leaves a key out."""
    path = folder / f'{name}.yaml'
    content = {key: value for key, value in {**LEAST, **changes}.items() if value is not None}
    path.write_text(yaml.safe_dump(content))
    return read_description(path)


# --- what is read ---------------------------------------------------------------------------------------------------

def test_the_shortest_description(tmp_path):
    model = described(tmp_path)
    assert (model.name, model.skeleton, model.decoder) == ('mine', BODY_25, 'paf')
    assert model.files == (WeightsFile('net.onnx'),) and model.outputs == ('heatmaps', 'pafs')
    assert model.input == InputRecipe()
    assert (model.stride, model.heatmaps, model.channels, model.output_layout) == (8, 26, 78, 'NCHW')
    assert model.peak_threshold == 0 and model.licence == 'not stated'


def test_every_key(tmp_path):
    model = described(
        tmp_path, licence='MIT', source='my own training', stride=4, heatmaps=27, peak_threshold=0.1,
        output_layout='NHWC',
        files=['net.xml', {'name': 'net.bin', 'size': 7, 'sha256': 'AB' * 32, 'md5': '0f' * 16}],
        input={'channels': 'RGB', 'layout': 'NHWC', 'dtype': 'float32', 'mean': 128, 'scale': 0.0078125,
               'multiple_of': 32, 'padding': 114, 'fixed_size': [640, 480]})
    assert model.files == (WeightsFile('net.xml'), WeightsFile('net.bin', 7, 'ab' * 32, '0f' * 16))
    assert model.input == InputRecipe('RGB', 'NHWC', 'float32', 128.0, 1 / 128, 32, 114, (640, 480))
    assert (model.licence, model.source.where, model.stride, model.heatmaps, model.peak_threshold) == (
        'MIT', 'my own training', 4, 27, 0.1)
    assert model.output_layout == 'NHWC'


def test_a_joint_set_of_ones_own(tmp_path):
    skeleton = described(tmp_path, skeleton=ARMS).skeleton
    assert skeleton.name == 'mine' and skeleton.joints == tuple(ARMS['joints'])
    assert skeleton.limbs == (
        Limb('neck', 'right_shoulder', (0, 1)), Limb('neck', 'left_shoulder', (4, 5)),
        Limb('right_shoulder', 'right_wrist', (2, 3)), Limb('left_shoulder', 'left_wrist', (7, 6), False))
    assert skeleton.drawn_limbs == (('neck', 'right_shoulder'), ('neck', 'left_shoulder'),
                                    ('right_shoulder', 'right_wrist'))
    assert skeleton.colours[2] == BODY_25.colours[BODY_25.index['right_wrist']]
    assert skeleton.swap == (0, 3, 4, 1, 2)
    drawn = described(tmp_path, skeleton={**ARMS, 'drawn_limbs': [['neck', 'left_wrist']]}).skeleton.drawn_limbs
    assert drawn == (('neck', 'left_wrist'),)


@pytest.mark.parametrize('decoder, outputs, stated, size', [
    ('simcc', ['x', 'y'], SIMCC_INPUT, [192, 256]), ('yolox', ['dets', 'labels'], YOLOX_INPUT, None)])
def test_inputs_of_known_makers_need_not_be_described(tmp_path, decoder, outputs, stated, size):
    model = described(tmp_path, skeleton=None, decoder=decoder, outputs=outputs,
                      input={'fixed_size': size} if size else None)
    assert (model.decoder, model.outputs, model.skeleton, model.points) == (decoder, tuple(outputs), COCO_18, 17)
    assert model.input == replace(stated, fixed_size=tuple(size) if size else None)


def test_the_examples_of_the_documentation_are_right(tmp_path):
    examples = [*re.findall(r'```yaml\n(.*?)```', (ROOT / 'docs/networks.md').read_text(), re.DOTALL),
                (ROOT / 'examples/network.yaml').read_text()]
    assert len(examples) >= 2
    for number, text in enumerate(examples):
        path = tmp_path / f'example_{number}.yaml'
        path.write_text(text)
        assert read_description(path).channels > 0


# --- where it is found ----------------------------------------------------------------------------------------------

def test_found_by_path_or_by_name_in_the_folder_of_models(tmp_path):
    (tmp_path / 'mine').mkdir()
    model = described(tmp_path / 'mine')
    assert find_model('mine', str(tmp_path)) == model
    assert find_model(str(tmp_path / 'mine' / 'mine.yaml')) == model


def test_the_joints_are_known_without_weights_which_lie_beside_the_description(tmp_path):
    model = described(tmp_path)
    with pytest.raises(ModelError) as caught:
        weights_path(model)
    assert f'looked for {tmp_path / "net.onnx"}' in str(caught.value)
    assert f'put net.onnx beside {tmp_path / "mine.yaml"}' in str(caught.value)
    (tmp_path / 'net.onnx').write_bytes(b'weights')
    assert weights_path(model, '/nowhere') == tmp_path / 'net.onnx'


# --- what is refused ------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('name', ['mobilenet_thin', 'COCO', 'BODY_25', 'my net', 'MPI_15'])
def test_names_that_mean_something_else_are_refused(tmp_path, name):
    with pytest.raises(ModelError, match=f"can not have the name '{name}'"):
        described(tmp_path, name)


def limbs(*changed):
    """The joint set of arms with other limbs at its front."""
    return {**ARMS, 'limbs': [*changed, *ARMS['limbs'][len(changed):]]}


FIRST = ARMS['limbs'][0]


@pytest.mark.parametrize('changes, expected', [
    ({'heatmap': 3}, "unknown key heatmap (did you mean 'heatmaps'?); allowed: files"),
    ({'input': 'BGR'}, "input: 'BGR', expected keys of channels"),
    ({'input': {'scale': 'small'}}, "input: scale = 'small', expected a float"),
    ({'input': {'mean': None}}, 'input: mean = None, expected a float'),
    ({'input': {'mean': [1, 2]}}, 'input: mean = [1.0, 2.0], expected a number, or three, of the colours'),
    ({'input': {'multiple_of': 12}}, 'expected multiples of stride, which is 8'),
    ({'input': {'fixed_size': [642, 480]}}, 'expected multiples of stride, which is 8'),
    ({'heatmaps': 24}, 'heatmaps = 24, expected 25 or more'),
    ({'decoder': 'yolo'}, "decoder = 'yolo', expected one of 'paf', 'movenet_multipose'"),
    ({'files': None}, 'it needs files'), ({'files': [5]}, 'files[0]: 5, expected keys of name'),
    ({'files': ['a', '../b']}, 'files: expected names of files that lie beside'),
    ({'outputs': 'net_output'}, "outputs = 'net_output', expected a list"),
    ({'outputs': ['a', 'b', 'c']}, 'expected 1 or 2 names for decoder paf'),
    ({'decoder': 'rtmo'}, "skeleton = 'BODY_25', expected COCO_18, which is what decoder rtmo gives"),
    ({'points': 26}, 'points = 26, expected one of 17'),
    ({'decoder': 'simcc', 'skeleton': None}, 'input: fixed_size is missing'),
    ({'skeleton': {'joints': ['nose']}}, 'skeleton: it needs limbs'),
    ({'skeleton': {**ARMS, 'joints': ['nose', 'nose']}}, "joints = ['nose', 'nose'], expected each once"),
    ({'skeleton': limbs({**FIRST, 'end': 'nose'})}, 'limb neck - nose, expected two of neck, '),
    ({'skeleton': limbs({**FIRST, 'paf': [0, 2]})}, 'each channel of 0 .. 7 once'),
    ({'skeleton': limbs({**FIRST, 'end': 'right_wrist'})}, 'limb neck - right_wrist has no partner neck - left_wrist')])
def test_what_is_not_allowed_is_named_with_what_is(tmp_path, changes, expected):
    with pytest.raises(ModelError) as caught:
        described(tmp_path, **changes)
    assert str(tmp_path / 'mine.yaml') in str(caught.value)
    assert expected in str(caught.value)
