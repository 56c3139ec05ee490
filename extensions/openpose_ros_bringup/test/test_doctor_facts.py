"""What the doctor reads of messages, nodes and names of topics."""
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_bringup.doctor.snapshot import Camera, ChainNode, Stream
from openpose_ros_bringup.ros.doctor import program
from openpose_ros_bringup.ros.doctor.inputs import find_cameras, nodes_within
from openpose_ros_bringup.ros.doctor.streams import CameraListener, Listener
from openpose_ros_pkg.params.camera_presets import find_preset, read_presets
from openpose_ros_pkg.ros.convert import pixels_to_image
from openpose_ros_pkg.ros.demand import READS
from openpose_ros_pkg.stream.silent_topic import PublishedTopic
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.ros.convert import camera_to_message

IMAGE, COMPRESSED, CLOUD, INFO = (kind._type for kind in (Image, CompressedImage, PointCloud2, CameraInfo))
AUTO = 'auto', '', {}


def published(topics):
    return {topic: PublishedTopic(kind, ['/driver']) for topic, kind in topics.items()}


def node(reads, name='/skeleton_extract_3d_node', **parameters):
    return ChainNode(name, values={READS: ', '.join(f'{topic} ({kind})' for topic, kind in reads)},
                     parameters=parameters)


def topics_of(camera):
    return {stream.role: stream.topic for stream in camera.streams}


@pytest.mark.parametrize('name', sorted(read_presets()))
def test_each_preset_that_is_published_is_found(name):
    preset = find_preset(name)
    camera, = find_cameras(*AUTO, [], published(preset.inputs()))
    assert {stream.topic: stream.kind for stream in camera.streams} == preset.inputs()
    named, = find_cameras(name, '', {}, [], {})
    line, _, missing = named.driver.partition('    # ')
    assert (line, named.rectified) == (preset.driver_line(), preset.rectified)
    assert missing in (f'the package {preset.package} is not installed on this machine', '')


@pytest.mark.parametrize('missing', ['depth', 'camera_info'])
def test_a_preset_of_which_a_topic_is_misspelt(missing):
    preset = find_preset('realsense')
    topics = {topic: kind for topic, kind in preset.inputs().items() if topic != preset.topic(missing)}
    assert find_cameras(*AUTO, [], published(topics))[0].preset == 'realsense'


def test_a_realsense_without_align_depth():
    topics = {'/camera/color/image_raw': IMAGE, '/camera/color/camera_info': INFO,
              '/camera/depth/image_rect_raw': IMAGE, '/camera/depth/camera_info': INFO}
    camera, = find_cameras(*AUTO, [], published(topics))
    assert (camera.preset, 'align_depth:=true' in camera.driver) == ('realsense', True)
    assert find_cameras(*AUTO, [], published({'/hero/rgb/image_raw': IMAGE, '/hero/points': CLOUD})) == []


def test_the_cameras_that_nodes_read():
    realsense = find_preset('realsense')
    reads = [(realsense.topic(role, 'left'), kind) for role, kind in
             (('camera_info', INFO), ('image', IMAGE), ('depth', IMAGE))]
    left = node([*reads, ('/floor', 'pcl_msgs/ModelCoefficients')], '/left/skeleton_extract_3d_node')
    flat = node([('/x/image', IMAGE)], '/openpose_ros_service_node')
    first, second = find_cameras(*AUTO, [left, flat], {})
    assert (first.preset, first.namespace, first.node) == ('realsense', 'left', '/left/skeleton_extract_3d_node')
    assert 'camera:=left' in first.driver
    assert topics_of(first) == {role: realsense.topic(role, 'left') for role in ('image', 'depth', 'camera_info')}
    assert (second.preset, second.points, second.node) == ('', None, '/openpose_ros_service_node')
    assert nodes_within('left', [left, flat]) == [left] and nodes_within('x', [left, flat]) == [flat]
    assert nodes_within('', [left, flat]) == [left, flat] and nodes_within('lef', [left, flat]) == []
    assert find_cameras('realsense', '', {}, [left, flat], {})[0].node == ''  # no node reads it


def test_topics_that_the_user_names():
    camera, = find_cameras('auto', '', {'image': '/a/image', 'depth': '/a/depth'}, [], {})
    assert topics_of(camera) == {'image': '/a/image', 'depth': '/a/depth', 'camera_info': '/a/camera_info'}


@pytest.mark.parametrize('options, text', [
    (['--points', '/a'], 'need --image'), (['--camera', 'realsence'], "did you mean 'realsense'?"),
    (['--seconds', 'x'], 'expected a number from 0.1')])
def test_a_wrong_command_line(options, text, capsys):
    try:
        status = program.main(options)
    except SystemExit as end:
        status = end.code
    assert status == 2 and text in capsys.readouterr().err


@pytest.mark.parametrize('rectified, expected', [(True, True), ('auto', True), (False, False), ('false', False)])
def test_rectified_images(rectified, expected):
    zed = find_preset('zed')
    reads = [(zed.topic(role), kind) for role, kind in (('camera_info', INFO), ('image', IMAGE), ('depth', IMAGE))]
    assert find_cameras(*AUTO, [node(reads, rectified=rectified)], {})[0].rectified is expected


def test_a_depth_image_is_read_with_its_camera_info():
    listener, header = Listener(Stream('depth', '/depth', IMAGE), {}), Header(frame_id='optical')
    listener.newest = pixels_to_image(np.full((4, 6), 1500, np.uint16), '16UC1', header)
    assert listener.read(None, False).points is None
    camera = CameraModel(6, 4, np.array([[5, 0, 2.5], [0, 5, 1.5], [0, 0, 1]]))
    assert listener.read(camera_to_message(camera, header), False).points.camera_model().matrix[0, 0] == 5
    listener.newest = pixels_to_image(np.zeros((4, 6, 3), np.uint8), 'bgr8', header)
    stream = listener.read(camera_to_message(camera, header), False)
    assert stream.fault.startswith("depth image has encoding 'bgr8'") and stream.frame_id == 'optical'


def test_points_of_a_camera_that_is_covered_for_a_moment(monkeypatch):
    covered, free = (pixels_to_image(np.full((96, 128), depth, np.uint16), '16UC1', Header()) for depth in (0, 1500))
    optics = camera_to_message(CameraModel(128, 96, np.array([[90, 0, 64], [0, 90, 48], [0, 0, 1]])), Header())
    listener = CameraListener(Camera(Stream('image', '/image', IMAGE), Stream('points', '/depth', IMAGE),
                                     Stream('info', '/info', INFO)), {})
    points, info = listener._listeners['points'], listener._listeners['info']
    monkeypatch.setattr(info, 'newest', optics)
    monkeypatch.setattr('rospy.get_time', lambda: 10.0)
    for message, is_seen in zip([covered, free, covered], [False, True, True]):
        points._note(message)
        assert listener.has(1) is is_seen
    assert listener.read().points.doubt is None and len(listener.read().points.arrivals) == 3
