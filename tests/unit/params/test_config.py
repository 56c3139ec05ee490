"""The YAML files in config/ say what the parameter classes say: same keys, same defaults, same words."""
import pytest
import yaml

import openpose_ros_bridges.node_params
import openpose_ros_bringup.node_params
import openpose_ros_fusion.node_params
import openpose_ros_pkg.params.nodes
import openpose_ros_signals.node_params
import openpose_ros_web.node_params
import skeleton_extract_3d.node_params
from development import PACKAGES
from openpose_ros_pkg.params.camera_presets import presets_file
from openpose_ros_pkg.params.parameters import build, describe, flat_values, parameter_fields, to_yaml

FILES = [(PACKAGES[package.__name__.split('.')[0]] / 'config' / name, kind)
         for package in (openpose_ros_pkg.params.nodes, skeleton_extract_3d.node_params,
                         openpose_ros_fusion.node_params, openpose_ros_signals.node_params,
                         openpose_ros_bridges.node_params, openpose_ros_bringup.node_params,
                         openpose_ros_web.node_params)
         for name, kind in package.CONFIG_FILES.items()]
IDS = [path.name for path, _ in FILES]


@pytest.mark.parametrize('path, kind', FILES, ids=IDS)
def test_file_is_what_the_parameter_classes_say(path, kind):
    assert path.read_text() == to_yaml(kind), 'write it again with: ./run config'


@pytest.mark.parametrize('path, kind', FILES, ids=IDS)
def test_documented_words_need_no_quotes_in_a_file(path, kind, tmp_path):
    """YAML reads words like off, no and null as something else than texts."""
    for field in parameter_fields(kind):
        for word in (*(field.metadata['choices'] or ()), *field.metadata['words']):
            file = tmp_path / 'my.yaml'
            file.write_text(f'{field.name}: {word}' if word != '' else f"{field.name}: ''")
            assert flat_values(build(kind, yaml.safe_load(file.read_text())))[field.name] == word


def test_every_file_in_config_belongs_to_a_node():
    there = {path for package in ('openpose_ros_pkg', 'skeleton_extract_3d', 'openpose_ros_fusion',
                                        'openpose_ros_signals', 'openpose_ros_bridges', 'openpose_ros_bringup',
                                        'openpose_ros_web')
             for path in (PACKAGES[package] / 'config').iterdir()}
    assert there == {path for path, _ in FILES} | {presets_file()}


def test_parameters_that_detection_and_lifting_share_mean_the_same():
    """A node with both in its namespace gives one value to both; the camera is that of the lifting there."""
    meanings = {}
    for field in parameter_fields(skeleton_extract_3d.node_params.PeopleSettings):
        meanings.setdefault(field.name, set()).add((field.default, describe(field)))
    assert {name for name, found in meanings.items() if len(found) > 1} == {'camera'}
