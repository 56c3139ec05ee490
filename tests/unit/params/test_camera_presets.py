"""Cameras by name: the shipped table, files of users, and the camera that published topics are."""
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import (
    CAMERA_INFO,
    COMPRESSED,
    IMAGE,
    choose_camera,
    find_preset,
    read_presets,
)

PRESETS = read_presets()
CAMERAS = [name for name, preset in PRESETS.items() if preset.package]


@pytest.mark.parametrize('name', CAMERAS)
def test_entries_of_the_table_are_complete(name):
    preset = PRESETS[name]
    assert preset.title and preset.frame and preset.image_encoding and preset.camera_info and preset.source
    assert len(preset.size) == 2
    assert preset.driver_line().split()[:3] == ['roslaunch', preset.package, preset.launch_file]
    assert bool(preset.depth_encoding) == (preset.dimensions == 3)


def test_namespace_takes_the_place_of_the_presets():
    assert list(PRESETS['realsense'].inputs(ns='/left/')) == [
        '/left/color/image_raw', '/left/aligned_depth_to_color/image_raw', '/left/aligned_depth_to_color/camera_info']
    assert PRESETS['azure_kinect'].topic('image') == '/rgb/image_raw'
    assert PRESETS['azure_kinect'].topic('image', 'k4a') == '/k4a/rgb/image_raw'
    assert PRESETS['realsense'].topic('points') == ''


@pytest.mark.parametrize('name, ns, words, command', [
    ('realsense', 'left', ['serial_no:=7', 'enable_sync:=false'],
     'roslaunch realsense2_camera rs_camera.launch align_depth:=true enable_sync:=false camera:=left serial_no:=7'),
    ('zed', '/zed2/', ['zed2.launch'], 'roslaunch zed_wrapper zed2.launch camera_name:=zed2'),
    ('zed', 'zed', [], 'roslaunch zed_wrapper zed2i.launch camera_name:=zed'),
    ('azure_kinect', 'k4a', ['fps:=15'], 'env ROS_NAMESPACE=k4a roslaunch azure_kinect_ros_driver driver.launch '
     'color_resolution:=720P depth_mode:=NFOV_UNBINNED fps:=15 point_cloud:=false rgb_point_cloud:=false')])
def test_command_of_the_driver(name, ns, words, command):
    assert ' '.join(PRESETS[name].driver_command(ns, words)) == command


@pytest.mark.parametrize('name, ns, words', [('usb_cam', 'left', []), ('realsense', '', ['fps=30'])])
def test_what_the_driver_does_not_take_is_refused(name, ns, words):
    with pytest.raises(ParameterError, match='not allowed'):
        PRESETS[name].driver_command(ns, words)


@pytest.mark.parametrize('name, arguments, topics', [
    ('kinect2', {}, ['/kinect2/qhd/image_color', '/kinect2/qhd/image_depth_rect', '/kinect2/qhd/camera_info']),
    ('kinect2', {'ns': 'left', 'compressed': True}, [
        '/left/qhd/image_color/compressed', '/left/qhd/image_depth_rect/compressedDepth', '/left/qhd/camera_info']),
    ('kinect2', {'dimensions': 2}, ['/kinect2/qhd/image_color', '/kinect2/qhd/camera_info']),
    ('usb_cam', {}, ['/usb_cam/image_raw', '/usb_cam/camera_info'])])
def test_topics_to_record(name, arguments, topics):
    assert PRESETS[name].recorded(**arguments) == topics


@pytest.mark.parametrize('name, text', [
    ('realsens', "did you mean 'realsense'"), ('kinect', 'one of realsense, kinect2'), ('', 'auto, or a YAML file')])
def test_unknown_name_is_refused_with_the_list(name, text):
    with pytest.raises(ParameterError, match=text):
        find_preset(name)


def test_file_of_a_user(tmp_path):
    file = tmp_path / 'my_camera.yaml'
    file.write_text('mine: {ns: lab, image: rgb, points_source: depth_image, depth: depth, camera_info: info,\n'
                    '       image_transport: compressed, depth_transport: compressedDepth}')
    preset = find_preset(str(file))
    assert preset.name == 'mine' and preset.driver_line() == ''
    assert preset.inputs() == {'/lab/rgb/compressed': COMPRESSED, '/lab/depth/compressedDepth': COMPRESSED,
                               '/lab/info': CAMERA_INFO}


@pytest.mark.parametrize('text, error', [
    ('', 'is no table of cameras'),
    ('mine: {imgae: a}', r"unknown key imgae \(did you mean 'image'\?\); allowed: image, title"),
    ('mine: {ns: a}', 'mine: it needs image'),
    ('mine: {image: a, points_source: point_cloud}', "'point_cloud' needs points"),
    ('mine: {image: a, points_source: depth_image, depth: d}', "'depth_image' needs camera_info"),
    ('mine: {image: a, size: [640]}', 'size = .640., expected a list of 2 values, each an int'),
    ('a: {image: a}\nb: {image: b}', 'holds a, b, expected one camera')])
def test_wrong_file_is_refused(text, error, tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text(text)
    with pytest.raises(ParameterError, match=error):
        find_preset(str(file))


@pytest.mark.parametrize('name', CAMERAS)
def test_each_camera_is_recognised_by_its_topics(name):
    preset = PRESETS[name]
    choice = choose_camera(preset.inputs(), preset.dimensions)
    assert choice.chosen.preset.name == name and choice.chosen.ns == preset.ns
    assert choice.others == () and choice.images == ()


def test_two_cameras_first_of_the_table_is_chosen_and_the_other_named():
    topics = {**PRESETS['oakd'].inputs(), **PRESETS['realsense'].inputs(), '/cv_camera/image_raw': IMAGE}
    choice = choose_camera(topics)
    assert choice.chosen.preset.name == 'realsense'
    assert [other.preset.name for other in choice.others] == ['oakd']
    assert str(choice) == 'oakd (/oak/rgb/image_rect); images on /cv_camera/image_raw'


def test_two_cameras_of_a_kind_that_of_the_usual_namespace_is_chosen():
    topics = {**PRESETS['realsense'].inputs(ns='a'), **PRESETS['realsense'].inputs()}
    choice = choose_camera(topics)
    assert choice.chosen.ns == 'camera' and [other.ns for other in choice.others] == ['a']


def test_camera_without_aligned_depth_is_not_chosen_and_its_line_named():
    topics = {'/camera/color/image_raw': IMAGE, '/camera/depth/image_rect_raw': IMAGE}
    choice = choose_camera(topics)
    assert choice.chosen is None
    assert 'realsense (/camera/color/image_raw) without /camera/aligned_depth_to_color/image_raw' in str(choice)
    assert 'align_depth:=true' in str(choice)
    assert choose_camera(topics, 2).chosen.preset.name == 'realsense'


def test_image_in_another_namespace_is_no_webcam():
    choice = choose_camera({'/camera/depth/image_raw': IMAGE}, 2)
    assert choice.chosen is None and choice.images == ('/camera/depth/image_raw',)
