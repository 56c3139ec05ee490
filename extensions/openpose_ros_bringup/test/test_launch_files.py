"""What the launch files give the nodes, without starting any; and which command lines they refuse."""
import functools
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
import yaml
from roslaunch.config import load_config_default
from roslaunch.xmlloader import XmlLoader

from development import PACKAGES, ROOT
from openpose_ros_pkg.params.launch_arguments import checked_files, declared_arguments

FILES = {path.name: path.resolve() for path in (ROOT / 'launch').iterdir()}
ARGUMENTS = {name: declared_arguments([path]) for name, path in FILES.items()}
EACH = [(name, argument) for name, arguments in sorted(ARGUMENTS.items()) for argument in arguments]
# Switches of which each starts something.
ALL_ON = {'people.launch': {'floor': 'true', 'rviz': 'true', 'record': '/bags', 'web': 'true'},
          'demo.launch': {'floor': 'true', 'web': 'true'},
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
          'points_source': 'none', 'look': 'people', 'source': '1', 'folder': '/some', 'target_rate': '7',
          'config': 'CONFIG', 'driver': 'true'}
# Arguments without effect unless another one is given.
NEEDS = {'people.launch': {'source': {'camera': 'files'}}}


class Loader(XmlLoader):
    """Loads launch files without running their commands, which do nothing unless roslaunch is their parent."""

    def param_value(self, *arguments):
        return '' if arguments[-1] else super().param_value(*arguments)


@functools.lru_cache(maxsize=None)
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


@pytest.mark.parametrize('name', sorted(FILES))
def test_empty_arguments_are_what_the_config_files_say(name):
    config = load(name, **{**dict.fromkeys(ARGUMENTS[name], ''), **ALL_ON.get(name, {})})
    expected, found = of_config_files(config), parameters(config)
    assert expected or not [node for node in config.nodes if node.package.startswith(('openpose', 'skeleton'))
                            and node.type != 'record_camera']  # has no parameters
    wrong = {key: found.get(key) for key, value in expected.items()
             if found.get(key) != value and found.get(key) not in SET.get(key.rpartition('/')[2], ())}
    assert wrong == {}


@pytest.mark.parametrize('name, argument', EACH)
def test_each_argument_has_an_effect(name, argument, tmp_path):
    config = tmp_path / 'mine.yaml'
    config.write_text('\n'.join(f'{node.rpartition("/")[2]}: {{lazy: false}}' for node in names(load(
        name, **ALL_ON.get(name, {})))))
    default = ARGUMENTS[name][argument]
    others = {**ALL_ON.get(name, {}), **NEEDS.get(name, {}).get(argument, {})}
    others.pop(argument, None)
    value = VALUES.get(argument, 'false' if default == 'true' else 'true' if default == 'false' else 'other')
    value = str(config) if value == 'CONFIG' else value
    assert description(load(name, **{**others, argument: value})) != description(load(name, **others))


@pytest.mark.parametrize('words, text', [
    (['target_rat:=5'], "there is no argument 'target_rat'; do you mean 'target_rate'?"),
    (['persons:=0'], 'parameters are set by config:=FILE with NODE'),
    (['rviz:=yes'], "'rviz:=yes' is not allowed: true or false"),
    (['config:=/etc/passwd'], 'no YAML file of parameters by node')])
def test_arguments_that_would_be_ignored_are_refused(words, text):
    refused = subprocess.run(['roslaunch', 'openpose_ros_bringup', 'people.launch', *words],
                             capture_output=True, text=True, check=False)
    assert refused.returncode != 0
    assert text in refused.stderr


@pytest.mark.parametrize('name', sorted(FILES))
def test_each_file_checks_its_arguments(name):
    assert declared_arguments(checked_files(FILES[name])).keys() >= ARGUMENTS[name].keys()
    assert 'scripts/check_arguments' in FILES[name].read_text()


def test_right_arguments_are_taken_and_kept():
    taken = subprocess.run(['roslaunch', '--dump-params', 'openpose_ros_bringup', 'demo.launch', 'mode:=fast',
                            '__log:=x'], stdout=subprocess.PIPE, check=True)
    found = yaml.safe_load(taken.stdout)
    assert found['/openpose_ros/launched/demo'] == 'demo.launch mode:=fast'
    assert found['/skeleton_extract_3d_node/mode'] == 'fast'


@pytest.mark.parametrize('arguments, expected', [
    ({'depth': '/a/b/image'}, {'points_source': 'depth_image', '~depth_image': '/a/b/image',
                               '~camera_info': '/a/b/camera_info'}),
    ({'points': '/a/points'}, {'points_source': 'point_cloud', '~point_cloud': '/a/points'}),
    ({'camera': 'realsense'}, {'points_source': 'auto', 'camera': 'realsense'}),
    ({'camera': 'realsense', 'points_source': 'none'}, {'points_source': 'none', 'camera': 'realsense'}),
    ({'camera': 'usb_cam', 'points': 'none', 'dimensions': '3'}, {'points_source': 'none', 'camera': 'usb_cam'}),
    ({'image': '/a/image', 'points_source': 'none', 'floor': 'true', 'fixed_frame': 'room'}, {
        'points_source': 'none', '~camera_info': '/a/camera_info', 'use_floor': True, 'tracking_frame': 'room'})])
def test_topics_say_which_points_are_read(arguments, expected):
    config = load('people.launch', **arguments)
    node, = (node for node in config.nodes if node.name == 'skeleton_extract_3d_node')
    values = {**dict(node.remap_args), **{key.rpartition('/')[2]: value for key, value in parameters(config).items()
                                          if key.startswith('/skeleton_extract_3d_node/')}}
    assert {key: values.get(key) for key in expected} == expected


def test_the_floor_of_a_camera_without_depth_is_found_by_no_node():
    started = names(load('people.launch', camera='usb_cam', dimensions='3', floor='true', fixed_frame='room'))
    assert sorted(started) == ['/people_signals_node', '/skeleton_extract_3d_node',
                               '/skeleton_extract_3d_visualization_node']


@pytest.mark.parametrize('arguments', [{'camera': 'usb_cam'}, {'image': '/a/image', 'points': 'none'},
                                       {'camera': 'realsense', 'dimensions': '2'}])
def test_people_in_the_image_alone(arguments):
    started = names(load('people.launch', web='true', **arguments))
    assert started == ['/openpose_ros_service_node', '/people_web_node']


@pytest.mark.parametrize('driver, words', [('true', ''), ('rs_rgbd.launch', 'rs_rgbd.launch'), ('fps:=15', 'fps:=15')])
def test_the_driver_and_its_arguments(driver, words):
    node, = (node for node in load('people.launch', camera='realsense', driver=driver).nodes
             if node.name == 'camera_driver')
    assert node.args.split() == ['--camera', "'realsense'", '--source', "''", *words.split()]


def test_a_config_file_holds_where_an_argument_is_not_given(tmp_path):
    mine = tmp_path / 'mine.yaml'
    mine.write_text('skeleton_extract_3d_node: {mode: fast, slop: 0.3}\n'
                    'people_fusion_node: {cameras: kitchen hall, fixed_frame: house, rig: /house.yaml}\n')
    found = parameters(load('people.launch', config=str(mine)))
    assert (found['/skeleton_extract_3d_node/mode'], found['/skeleton_extract_3d_node/slop']) == ('fast', 0.3)
    found = parameters(load('people.launch', config=str(mine), mode='accurate'))
    assert (found['/skeleton_extract_3d_node/mode'], found['/skeleton_extract_3d_node/slop']) == ('accurate', 0.3)
    node = '/people/people_fusion_node/'
    found = parameters(load('cameras.launch', config=str(mine), cameras=''))
    assert [found[node + key] for key in ('cameras', 'fixed_frame', 'rig')] == ['kitchen hall', 'house', '/house.yaml']
    found = parameters(load('cameras.launch', config=str(mine), rgb_cameras='left right', fixed_frame='room',
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
