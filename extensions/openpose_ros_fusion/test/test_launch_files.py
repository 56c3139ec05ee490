"""What the launch files give the nodes, without starting any."""
from pathlib import Path

from roslaunch.config import load_config_default

PACKAGE = Path(__file__).resolve().parents[1]
NODE = '/people/people_fusion_node/'


def parameters(name, **arguments):
    """Return the parameters that a launch file sets, by name."""
    given = [f'{key}:={value}' for key, value in arguments.items()]
    config = load_config_default([(str(PACKAGE / 'launch' / name), given)], None, verbose=False, assign_machines=False)
    return {key: parameter.value for key, parameter in config.params.items()}


def config_of_a_user(folder):
    path = folder / 'mine.yaml'
    path.write_text('{cameras: kitchen hall, rgb_cameras: door, fixed_frame: house, rig: /house.yaml}')
    return path


def test_a_config_file_holds_where_an_argument_is_not_given(tmp_path):
    found = parameters('people_fusion.launch', config=config_of_a_user(tmp_path))
    assert [found[NODE + name] for name in ('cameras', 'rgb_cameras', 'fixed_frame', 'rig')] == [
        'kitchen hall', 'door', 'house', '/house.yaml']


def test_arguments_come_before_the_config_file(tmp_path):
    """Who names the cameras of one kind has named all cameras."""
    found = parameters('people_fusion.launch', config=config_of_a_user(tmp_path), rgb_cameras='left right',
                       fixed_frame='room', rig='/room.yaml')
    assert [found[NODE + name] for name in ('cameras', 'rgb_cameras', 'fixed_frame', 'rig')] == [
        '', 'left right', 'room', '/room.yaml']


def test_cameras_without_depth_have_a_detector_and_are_fused():
    found = parameters('several_cameras.launch', cameras='kitchen', rgb_cameras='door window', image='image_raw')
    assert (found[NODE + 'cameras'], found[NODE + 'rgb_cameras']) == ('kitchen', 'door window')
    assert all(found[f'/{name}/openpose_ros_service_node/image_topic'] == 'image_raw' for name in ('door', 'window'))
