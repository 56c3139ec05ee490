"""What the launch files give the nodes, without starting any; and which command lines they refuse."""
import itertools
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest
import yaml
from roslaunch.config import load_config_default
from roslaunch.xmlloader import XmlLoader

from development import PACKAGES, ROOT
from openpose_ros_pkg.params.launch_arguments import declared_arguments, mistakes

FILES = {path.name: path.resolve() for path in (ROOT / 'launch').iterdir()}
ARGUMENTS = {name: declared_arguments([path]) for name, path in FILES.items()}
EACH = [(name, argument) for name, arguments in sorted(ARGUMENTS.items()) for argument in arguments]
# Switches of which each starts something.
ALL_ON = {'people.launch': {'floor': 'true', 'people_cloud': 'true', 'rviz': 'true', 'record': '/bags',
                             'web': 'true'},
          'demo.launch': {'floor': 'true', 'people_cloud': 'true', 'web': 'true'},
          'cameras.launch': {'cameras': 'left right', 'rgb_cameras': 'door', 'rviz': 'true',
                              'web': 'true'},
          'bridges.launch': dict.fromkeys(('people_msgs', 'spencer', 'vision_msgs', 'hri', 'jsk', 'moveit',
                                            'obstacles', 'separation'), 'true'),
          'nodelets.launch': dict.fromkeys(('floor', 'people_cloud', 'cloud_to_depth'), 'true')}
# Parameters that launch files set whatever the arguments say.
SET = {'publish_2d': [True], 'publish_results': [False], 'colour_by_person': [True], 'label': [True],
       'joint_scale': [0.06], 'playback': ['pause'], 'wait_for_subscribers': [30.0],
       'camera': ['sequence', 'kinect2'], 'floor': [True], 'publish_tf': [True], 'use_floor': [True],
       'cameras': ['left right', ''], 'rgb_cameras': ['door'],
       'fixed_frame': ['world'], 'tracking_frame': ['world'], 'gravity_frame': ['world'], 'camera_ns': ['door']}
# What an argument may be given as, where another value would not differ from its default.
VALUES = {'camera': 'realsense', 'ns': 'here', 'cameras': 'a b', 'rgb_cameras': 'c', 'dimensions': '2',
          'look': 'original', 'markers': 'false', 'source': '1', 'folder': '/some', 'target_rate': '7',
          'config': 'CONFIG', 'port': '8081'}
# Arguments without effect unless another one is given.
NEEDS = {'people.launch': {'source': {'camera': 'files'}, 'folder': {'camera': 'sequence'},
                           'driver_args': {'driver': 'true'}},
         'record.launch': {key: {'raw': 'true'} for key in ('camera', 'camera_ns', 'cameras', 'compressed')}}


class Loader(XmlLoader):
    """Loads launch files without running their commands, which do nothing unless roslaunch is their parent."""

    def param_value(self, *arguments):
        return '' if arguments[-1] else super().param_value(*arguments)


def load(name, **arguments):
    """Return the configuration of a launch file that another one includes with these arguments."""
    given = ''.join(f'<arg name="{key}" value="{value}"/>' for key, value in arguments.items())
    text = f'<launch><include file="{FILES[name]}" pass_all_args="true">{given}</include></launch>'
    config = load_config_default([], None, loader=Loader(), roslaunch_strs=[text], verbose=False,
                                 assign_machines=False)
    assert not config.config_errors
    return config


def parameters(config):
    return {key: parameter.value for key, parameter in config.params.items() if '/launched/' not in key}


def names(config):
    return [node.namespace + node.name for node in config.nodes]


def description(config):
    """Return all that a configuration starts, as a value."""
    return parameters(config), [(node.namespace, node.name, node.type, node.args, node.remap_args, node.respawn)
                                for node in config.nodes]


def of_config_files(config):
    """Return the parameters of the nodes' own YAML files, by their full names."""
    of_node = {'openpose_ros_service_node_3d': 'openpose_ros_node', 'openpose_ros_service_node': 'openpose_ros_node',
               'openpose_ros_node': 'openpose_ros_node_firephinx'}
    found = {}
    for node in config.nodes:
        files = ['openpose_ros_node'] * (node.type == 'people_3d_node')
        for file in [*files, of_node.get(node.name, node.name)]:
            for path in ROOT.glob(f'**/config/{file}.yaml'):
                for key, value in yaml.safe_load(path.read_text()).items():
                    found[f'{node.namespace}{node.name}/{key}'] = value
    return found


@pytest.mark.parametrize('name, argument', EACH)
def test_an_empty_argument_is_what_the_config_files_say(name, argument):
    config = load(name, **{**ALL_ON.get(name, {}), argument: ''})
    expected, found = of_config_files(config), parameters(config)
    assert expected or not [node for node in config.nodes if node.package.startswith(('openpose', 'skeleton'))
                            and node.type != 'record_camera']  # has no parameters
    wrong = {key: found.get(key) for key, value in expected.items()
             if found.get(key) != value and found.get(key) not in SET.get(key.rpartition('/')[2], ())}
    assert wrong == {}


@pytest.mark.parametrize('name, argument', EACH)
def test_each_argument_has_an_effect(name, argument, tmp_path):
    config = tmp_path / 'mine.yaml'
    config.write_text('\n'.join(f'{node.rpartition("/")[2]}: {{tf_timeout: 0.7, lazy: false}}' for node in names(load(
        name, **ALL_ON.get(name, {})))))
    default = ARGUMENTS[name][argument]
    others = {**ALL_ON.get(name, {}), **NEEDS.get(name, {}).get(argument, {})}
    others.pop(argument, None)
    value = VALUES.get(argument, 'false' if default == 'true' else 'true' if default == 'false' else 'other')
    value = {'CONFIG': str(config), default: 'people'}.get(value, value)
    assert description(load(name, **{**others, argument: value})) != description(load(name, **others))


@pytest.mark.parametrize('name', sorted(FILES))
def test_a_misspelt_argument_is_refused(name):
    argument = max(ARGUMENTS[name], key=len)
    refused = subprocess.run(['roslaunch', str(FILES[name]), f'{argument[:-1]}:=x'], check=False,
                             capture_output=True, text=True)
    assert refused.returncode != 0
    assert f"there is no argument '{argument[:-1]}'; do you mean '{argument}'?" in refused.stderr


@pytest.mark.parametrize('words, text', [
    (['rviz:=yes'], "'rviz:=yes' is not allowed: true or false"),
    (['config:=/etc/passwd'], 'no YAML file of parameters by node')])
def test_values_that_would_be_ignored_are_refused(words, text):
    refused = subprocess.run(['roslaunch', 'openpose_ros_bringup', 'people.launch', *words],
                             capture_output=True, text=True, check=False)
    assert refused.returncode != 0
    assert text in refused.stderr


def test_right_arguments_are_taken_and_kept():
    taken = subprocess.run(['roslaunch', '--dump-params', 'openpose_ros_bringup', 'demo.launch', 'mode:=fast',
                            '__log:=x'], stdout=subprocess.PIPE, check=True)
    found = yaml.safe_load(taken.stdout)
    assert found['/openpose_ros/launched/demo'] == 'demo.launch mode:=fast'
    assert found['/skeleton_extract_3d_node/mode'] == 'fast'


def test_no_files_together_start_signals_twice():
    for name, other in itertools.combinations(FILES, 2):
        started = [each for file in (name, other) for each in names(load(file, **ALL_ON.get(file, {})))]
        # each of these starts the whole chain
        chains = 2 if {name, other} == {'people.launch', 'demo.launch'} else 1
        assert started.count('/people_signals_node') <= chains
        assert started.count('/people/people_signals_node') <= 1
    assert not [node for node in names(load('bridges.launch', **ALL_ON['bridges.launch'])) if 'signals' in node]


def test_a_python_without_yaml_refuses_no_config_file(monkeypatch):
    monkeypatch.setitem(sys.modules, 'openpose_ros_pkg.structured_text', None)
    assert mistakes({'config': '/etc/passwd', 'mod': ''}, {'config': '', 'mode': ''}) == [
        "there is no argument 'mod'; do you mean 'mode'?"]


def test_a_config_file_holds_where_an_argument_is_not_given(tmp_path):
    mine = tmp_path / 'mine.yaml'
    mine.write_text('skeleton_extract_3d_node: {mode: fast, slop: 0.3}\n'
                    'people_fusion_node: {cameras: kitchen hall, fixed_frame: house, rig: /house.yaml}\n')
    found = parameters(load('people.launch', config=mine))
    assert (found['/skeleton_extract_3d_node/mode'], found['/skeleton_extract_3d_node/slop']) == ('fast', 0.3)
    found = parameters(load('people.launch', config=mine, mode='accurate'))
    assert (found['/skeleton_extract_3d_node/mode'], found['/skeleton_extract_3d_node/slop']) == ('accurate', 0.3)
    node = '/people/people_fusion_node/'
    found = parameters(load('cameras.launch', config=mine, cameras=''))
    assert [found[node + key] for key in ('cameras', 'fixed_frame', 'rig')] == ['kitchen hall', 'house', '/house.yaml']
    found = parameters(load('cameras.launch', config=mine, rgb_cameras='left right', fixed_frame='room',
                            rig='/room.yaml'))
    assert [found[node + key] for key in ('cameras', 'rgb_cameras', 'fixed_frame', 'rig')] == [
        '', 'left right', 'room', '/room.yaml']


def test_cameras_without_depth_have_a_detector_each_and_are_fused():
    found = parameters(load('cameras.launch', cameras='kitchen', rgb_cameras='door window'))
    fusion = '/people/people_fusion_node/'
    assert (found[fusion + 'cameras'], found[fusion + 'rgb_cameras']) == ('kitchen', 'door window')
    for name in ('door', 'window'):
        assert found[f'/{name}/openpose_ros_service_node/camera_ns'] == name
    alone = names(load('cameras.launch', rgb_cameras='door window'))
    assert '/skeleton_extract_3d_node' not in alone


@pytest.mark.parametrize('name, arguments', [
    ('people.launch', {'web': 'true', 'floor': 'true'}), ('cameras.launch', {'web': 'true'}),
    ('cameras.launch', {'rgb_cameras': 'left', 'web': 'true'}), ('bridges.launch', {'jsk': 'true'})])
def test_nodes_that_are_started_again_know_it(name, arguments):
    """They rest after an error that a start does not mend."""
    for node in load(name, **arguments).nodes:
        assert ('OPENPOSE_ROS_RESPAWNS', '1') in node.env_args or not node.respawn, node.name


@pytest.mark.parametrize('arguments, name, ends', [
    ({'camera': 'sequence'}, 'rgbd_player_node', True), ({'camera': 'files', 'source': 'a.mp4'}, 'camera_node', True),
    ({'camera': 'files'}, 'camera_node', False)])
def test_files_that_can_not_be_played_end_the_launch_and_a_webcam_is_started_again(arguments, name, ends):
    node, = (node for node in load('people.launch', **arguments).nodes if node.name == name)
    assert (node.required, not node.respawn, dict(node.env_args)['OPENPOSE_ROS_RESPAWNS']) == (
        ends, ends, '' if ends else '1')


def test_all_files_are_at_the_top_and_there_are_ten_at_most():
    all_files = {path for folder in PACKAGES.values() for path in folder.glob('launch/*')}
    assert set(FILES.values()) == all_files
    assert len(all_files) <= 10
    assert all(ElementTree.parse(str(path)).getroot().tag == 'launch' for path in all_files)
