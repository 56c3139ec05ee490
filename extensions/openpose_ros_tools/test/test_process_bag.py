"""process_bag computes each frame of a bag once, as the nodes do; errors name their cause."""
import functools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import genpy
import numpy as np
import pytest
import rosbag
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from known_recording import (
    BEGIN,
    CAMERA,
    COMPRESSED,
    DEPTH,
    EMPTY,
    FRAME_ID,
    FRAMES,
    IMAGE,
    INFO,
    POINTS,
    frame,
    known_people,
    messages,
    positions,
    stamp_of,
    write_recording,
)
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage

from disk_limits import file_size_limit
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.ros.topics import CameraTopics
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.ros.bag_files import open_bag, topic_finder
from openpose_ros_tools.ros.bag_to_images import main as main_of_images
from openpose_ros_tools.ros.process_bag import work
from openpose_ros_tools.ros.process_bag.job import BagSettings
from openpose_ros_tools.ros.process_bag.program import main, read_config
from skeleton_extract_3d.people import INFERRED, MEASURED
from skeleton_extract_3d.points.depth import DepthImage, cloud_from_depth, registered
from skeleton_extract_3d.ros.convert import camera_to_message, cloud_to_message, depth_to_message
from synthetic_scene import pinhole

NAMESPACE = '/openpose_ros/skeleton_3d'
# Joints that the scene shows are lifted from exact pixels and depth: what is left is the shape of the bodies [m].
MEDIAN_ERROR = 0.04


@pytest.fixture
def run(tmp_path):
    """Run the command on a bag whose people are known; return the exit status."""
    def run(source, *arguments, output=tmp_path / 'out.bag', create=known_people, **values):
        settings = [f'--set={key}={value}' for key, value in values.items()]
        return main([str(source), '-o', str(output), *map(str, arguments), *settings], create)
    return run


@pytest.fixture
def out(tmp_path):
    return tmp_path / 'out.bag'


@pytest.fixture
def recording(tmp_path):
    return write_recording(tmp_path / 'walk.bag')


def arrays(path, topic='detected_poses_3d', namespace=NAMESPACE):
    return [message for message, _ in messages(path, f'{namespace}/{topic}')]


def numbers_of(found):
    return [round((array.header.stamp.to_sec() - BEGIN) * 15) for array in found]


def left_behind(folder):
    return [path.name for path in folder.iterdir() if path.name.startswith('.')]


def with_transform(bag, topic='/tf_static', numbers=(0,)):
    """Note at some frames that the camera stands 1 m above the world, looking along y."""
    for number in numbers:
        transform = TransformStamped(Header(0, stamp_of(number), 'world'), FRAME_ID, None)
        transform.transform.translation = Vector3(0, 0, 1)
        transform.transform.rotation = Quaternion(-np.sqrt(0.5), 0, 0, np.sqrt(0.5))
        bag.write(topic, TFMessage([transform]), stamp_of(number))


# --- what is wrong is said --------------------------------------------------------------------------------------------

@pytest.mark.parametrize(('arguments', 'words'), [
    (['--image', '/cam/x'], '--image /cam/x'),
    (['--image', INFO], 'is of type sensor_msgs/CameraInfo, expected sensor_msgs/Image or'),
    (['--points', DEPTH], 'is of type sensor_msgs/Image, expected sensor_msgs/PointCloud2'),
    (['--camera-info', '/x'], '--camera-info /x'),
    (['--copy', '/x'], '--copy /x: not in the bag, which has /cam/camera_info'),
    (['--set', 'mode=quick'], "parameter 'mode' = 'quick'"),
    (['--set', 'verbos=1'], "did you mean 'verbose'"),
    (['--set', 'target_rate=10'], 'target_rate'),
    (['--set', 'target_frame=mars'], 'no frame with a result'),
    (['--depth', DEPTH, '--only-2d'], 'contradict each other'),
    (['--config', '/nowhere.yaml'], '--config /nowhere.yaml can not be read'),
])
def test_what_can_not_be_done_is_refused(run, recording, out, capsys, arguments, words):
    assert run(recording, *arguments) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()
    assert left_behind(out.parent) == []


@pytest.mark.parametrize(('option', 'place', 'words'), [
    ('--csv', 'walk.bag', 'is an input'), ('--csv', 'out.bag', 'would both be written to'),
    ('--csv', 'folder', 'is a folder'), ('--json', 'diary.txt', 'diary.txt is a file'),
    ('--csv', 'diary.txt/a.csv', 'diary.txt')])
def test_places_where_no_result_can_be_are_refused_before_the_work(run, recording, tmp_path, capsys, option, place,
                                                                   words):
    (tmp_path / 'folder').mkdir()
    (tmp_path / 'diary.txt').write_text('a diary')
    size = recording.stat().st_size
    assert run(recording, option, tmp_path / place, '--overwrite', create=None) == 2
    assert words in capsys.readouterr().err
    assert recording.stat().st_size == size


def test_configurations_of_nodes_are_read(tmp_path):
    """Of later files, of the nodes that find people, and without what is for live images."""
    (tmp_path / 'node.yaml').write_text('precision: auto\ntarget_rate: 30.0\nmode: accurate\nverbose: true\n'
                                        'write_keypoint: a\n')
    (tmp_path / 'all.yaml').write_text('people_signals_node: {summary: true}\n'
                                       'skeleton_extract_3d_node: {mode: fast}\n')
    assert read_config([tmp_path / 'node.yaml', tmp_path / 'all.yaml']) == {'mode': 'fast', 'verbose': True}
    assert build(BagSettings, {}).detector.backend.precision == 'f32'


# --- results ----------------------------------------------------------------------------------------------------------

def test_people_are_where_they_truly_are(run, recording, out):
    assert run(recording) == 0
    found = arrays(out)
    assert numbers_of(found) == list(range(FRAMES))
    errors = []
    for number, array in enumerate(found):
        assert (array.header.seq, array.header.frame_id) == (number, FRAME_ID)
        truth = frame(number).xyz
        if number >= FRAMES - EMPTY:
            assert not any(part.status == MEASURED for person in array.persons for part in (person.neck, person.nose))
            continue
        assert [person.person_ID for person in array.persons] == [1, 2]
        errors.append(np.linalg.norm(positions(array) - truth, axis=2)[frame(number).vis == 2])
    assert np.nanmedian(np.concatenate(errors)) < MEDIAN_ERROR
    assert sum(len(array.persons) for array in found) == len(messages(out, f'{NAMESPACE}/detected_poses_keypoints_3d'))
    # results have the time at which their frame was there
    times = [time for _, time in messages(out, f'{NAMESPACE}/detected_poses_3d')]
    assert times == [time for _, time in messages(recording, DEPTH)]


ALIGNED = '/camera/aligned_depth_to_color'


@pytest.mark.parametrize('topics, tolerance', [
    ({'image': COMPRESSED, 'points': POINTS}, 1e-4),  # the cloud holds float32 [m]
    # a RealSense camera, depth by two transports
    ({'image': '/camera/color/image_raw/compressed', 'points': f'{ALIGNED}/image_raw/compressedDepth',
      'info': f'{ALIGNED}/camera_info', 'others': lambda bag: bag.write(f'{ALIGNED}/image_raw/compressed',
                                                                        CompressedImage(), stamp_of(0))}, 0.0),
])
def test_clouds_and_compressed_topics_give_what_a_depth_image_gives(run, recording, tmp_path, out, topics, tolerance):
    assert run(recording) == 0
    assert run(write_recording(tmp_path / 'b.bag', **topics), output=tmp_path / 'of_b.bag') == 0
    for one, other in zip(arrays(out), arrays(tmp_path / 'of_b.bag')):
        assert one.header == other.header
        np.testing.assert_allclose(positions(one), positions(other), atol=tolerance, rtol=0)


def second_camera(bag):
    """Write images and depth that make it unclear which topics to take."""
    for number in range(FRAMES):
        bag.write('/oak/rgb/image_raw', Image(), stamp_of(number))
        bag.write('/oak/stereo/registered/image_raw', Image(encoding='16UC1'), stamp_of(number))


@pytest.mark.parametrize('camera', ['realsense', 'auto'])
def test_a_camera_by_name_gives_the_topics(run, recording, tmp_path, out, capsys, camera):
    assert run(recording) == 0
    mixed = write_recording(tmp_path / 'mixed.bag', image='/camera/color/image_raw/compressed',
                            points=f'{ALIGNED}/image_raw/compressedDepth', info=f'{ALIGNED}/camera_info',
                            others=second_camera)
    assert run(mixed, output=tmp_path / 'of_mixed.bag') == 2
    assert 'choose one with --image' in capsys.readouterr().err
    assert run(mixed, '--camera', camera, output=tmp_path / 'of_mixed.bag') == 0
    for one, other in zip(arrays(out), arrays(tmp_path / 'of_mixed.bag')):
        np.testing.assert_array_equal(positions(one), positions(other))


@pytest.mark.parametrize('preset', ['realsense', 'auto'])
def test_topics_of_one_camera_of_several_are_in_its_namespace(tmp_path, preset):
    bag = write_recording(tmp_path / 'room.bag', image='/left/color/image_raw', points=None, others=lambda bag: [
        bag.write(f'/left{ALIGNED[7:]}/{name}', kind(), stamp_of(0)) for name, kind in (
            ('image_raw/compressedDepth', CompressedImage), ('camera_info', CameraInfo))])
    with open_bag(bag) as opened:
        topics, _ = topic_finder(opened, 'left').camera(preset=preset)
    assert topics == CameraTopics('/left/color/image_raw', '', f'/left{ALIGNED[7:]}/image_raw/compressedDepth',
                                  f'/left{ALIGNED[7:]}/camera_info')


def lidar(bag):
    for number in range(FRAMES):
        bag.write('/lidar/points', PointCloud2(header=Header(0, stamp_of(number), 'lidar'), height=1,
                                               width=7), stamp_of(number))


def test_clouds_without_rows_are_left_alone(run, tmp_path, out, capsys):
    """As those of a lidar, or of a RealSense camera that was not asked for ordered clouds."""
    assert run(write_recording(tmp_path / 'a.bag', others=lidar)) == 0
    assert len(arrays(out)) == FRAMES
    assert 'no depth' not in capsys.readouterr().err
    assert run(write_recording(tmp_path / 'b.bag', points=None, others=lidar), output=tmp_path / 'c.bag') == 0
    assert len(arrays(tmp_path / 'c.bag', 'detected_poses', '/openpose_ros')) == FRAMES
    assert 'readable depth images are on /lidar/points;' in capsys.readouterr().err


@pytest.mark.parametrize('pause', [0, 60])
def test_people_and_transforms_go_on_in_the_next_part_of_a_recording(run, tmp_path, capsys, pause):
    """As `rosbag record --split` makes them, with latched messages in the first part alone."""
    whole = write_recording(tmp_path / 'whole.bag', others=with_transform)
    (tmp_path / 'parts').mkdir()
    with rosbag.Bag(str(whole)) as bag, rosbag.Bag(str(tmp_path / 'parts/walk_0.bag'), 'w') as first, \
            rosbag.Bag(str(tmp_path / 'parts/walk_1.bag'), 'w') as second:
        for topic, message, time in bag.read_messages():
            if time < stamp_of(5):
                first.write(topic, message, time)
            elif topic != INFO:
                second.write(topic, message, time + genpy.Duration(pause))
    status = run(tmp_path / 'parts', '--workers', 1, '--csv', tmp_path / 'csv', output=tmp_path / 'out',
                 target_frame='world')
    said = capsys.readouterr()
    assert run(whole, target_frame='world') == 0
    if pause:  # another recording, which has neither
        assert status == 1 and f'FAILED {tmp_path}/parts/walk_1.bag: ' in said.out
        return
    found = arrays(tmp_path / 'out/walk_0.bag') + arrays(tmp_path / 'out/walk_1.bag')
    for one, other in zip(found, arrays(tmp_path / 'out.bag')):
        assert [person.person_ID for person in one.persons] == [person.person_ID for person in other.persons]
        np.testing.assert_array_equal(positions(one), positions(other))
    assert len(found) == FRAMES and status == 0


OTHER, BASELINE = pinhole(640, 360, 0.42), 0.025
OTHER_TOPICS = ('/camera/color/image_raw', '/camera/color/camera_info', '/camera/depth/image_rect_raw',
                '/camera/depth/camera_info')


def camera_beside(bag):
    transform = TransformStamped(Header(0, stamp_of(0), 'depth'), FRAME_ID, None)
    transform.transform.translation.x, transform.transform.rotation.w = BASELINE, 1
    bag.write('/tf_static', TFMessage([transform]), stamp_of(0))


def unregistered(path, frames, others, cloud=False):
    """Write the recording with the depth of a camera beside that of the images, of another lens."""
    with rosbag.Bag(str(path), 'w') as bag:
        others(bag)
        for number in range(FRAMES):
            stamp, seen = stamp_of(number), frame(number)
            depth = registered(DepthImage(seen.depth, CAMERA), OTHER, (np.eye(3), np.array([BASELINE, 0, 0])))
            z = depth.depths(*np.meshgrid(np.arange(depth.width), np.arange(depth.height)))
            headers = [Header(number, stamp, each) for each in frames]
            points = depth_to_message(np.nan_to_num(z * 1000).astype(np.uint16), headers[1])
            if cloud:
                points = cloud_to_message(cloud_from_depth(z, depth.camera, np.zeros((*z.shape, 3), np.uint8)),
                                          headers[1])
            for topic, message in zip(OTHER_TOPICS, (bgr_to_image(seen.bgr, headers[0]), camera_to_message(
                    CAMERA, headers[0]), points, camera_to_message(depth.camera, headers[1]))):
                bag.write(topic, message, stamp)
    return path


@pytest.mark.parametrize('frames, others, cloud, words', [
    ((FRAME_ID, 'depth'), camera_beside, False, 'by both calibrations, 25 mm'),
    ((FRAME_ID, '/depth'), camera_beside, True, 'by both calibrations, 25 mm'),
    (('0', '0'), lambda bag: None, False, 'by both calibrations, 0 mm'),
    ((FRAME_ID, 'depth'), lambda bag: None, False, 'does not tell where its camera is')])
def test_depth_of_another_camera_is_registered_or_refused(run, recording, tmp_path, out, capsys, frames,
                                                          others, cloud, words):
    """Of OTHER fx differs by a quarter, so the joints of people at 3 m would be half a metre off."""
    other = unregistered(tmp_path / 'b.bag', frames, others, cloud)
    assert run(other) == (2 if 'does not tell' in words else 0)
    assert words in capsys.readouterr().err
    assert main_of_images([str(other), '-o', str(tmp_path / 'images')]) == 2
    if out.exists():
        assert run(recording, output=tmp_path / 'aligned.bag') == 0
        for one, other in zip(arrays(out), arrays(tmp_path / 'aligned.bag')):
            assert one.header.frame_id == frames[0]
            far = np.linalg.norm(positions(one) - positions(other), axis=2)
            assert not far.size or np.nanmedian(far) < BASELINE * (1.5 if frames[1] == '0' else 0.5)


def test_images_alone_give_people_in_the_image(run, tmp_path, out):
    for source, arguments in ((write_recording(tmp_path / 'a.bag', points=None), ()),
                              (write_recording(tmp_path / 'b.bag'), ('--only-2d',))):
        assert run(source, *arguments, '--csv', tmp_path / 'a.csv', '--overwrite') == 0
        found = arrays(out, 'detected_poses', '/openpose_ros')
        assert numbers_of(found) == list(range(FRAMES))
        assert [person.person_ID for person in found[3].persons] == [1, 2]
        expected = frame(3).people.xy[0, COCO_18.index['neck']]
        np.testing.assert_allclose((found[3].persons[0].neck.x, found[3].persons[0].neck.y), expected, rtol=1e-6)
        assert len((tmp_path / 'a.csv').read_text().splitlines()) == 1 + 2 * (FRAMES - EMPTY)
        with rosbag.Bag(str(out)) as bag:
            assert not any('skeleton_3d' in topic for topic in bag.get_type_and_topic_info().topics)


@pytest.fixture
def no_bodies(monkeypatch):
    """Let no network see bodies: people are placed by their sizes."""
    class Blind:
        def observe(self, bgr, keypoints, skeleton):
            return [None] * len(keypoints)

    monkeypatch.setattr(work, 'create_body_landmarks', lambda *_: Blind())


@pytest.mark.parametrize('points', [None, POINTS])
@pytest.mark.parametrize('image', [IMAGE, COMPRESSED])
def test_people_in_space_by_images_and_their_calibration(run, tmp_path, out, no_bodies, image, points):
    info = '/cam/camera_info'
    source = write_recording(tmp_path / 'a.bag', image=image, points=points, others=lambda bag: bag.write(
        info, camera_to_message(CAMERA, Header(0, stamp_of(0), FRAME_ID)), stamp_of(0)))
    assert run(source, '--csv', tmp_path / 'a.csv', points_source='none') == 0
    found = arrays(out)
    assert numbers_of(found) == list(range(FRAMES)) and {array.header.frame_id for array in found} == {FRAME_ID}
    for number, array in enumerate(found[:FRAMES - EMPTY]):
        assert len(array.persons) == 2
        for person, truth in zip(array.persons, frame(number).xyz):
            assert {person.neck.status, person.left_hip.status} == {INFERRED}
            neck = np.array([person.neck.x, person.neck.y, person.neck.z])
            # by their size alone; they are two deviations of the stature larger than an adult
            assert np.linalg.norm(neck - truth[COCO_18.index['neck']]) < min(2.5 * person.neck.sigma, 1.0)
    assert len((tmp_path / 'a.csv').read_text().splitlines()) == 1 + sum(len(array.persons) for array in found)


def test_a_camera_without_depth_needs_its_calibration(run, tmp_path, no_bodies, capsys):
    assert run(write_recording(tmp_path / 'a.bag', points=None), points_source='none') == 2
    assert 'no topic of camera infos' in capsys.readouterr().err


def test_lone_images_and_points_are_counted_and_all_others_used_once(run, tmp_path, out, capsys):
    source = write_recording(tmp_path / 'a.bag', without_image=(3,), without_points=(5, 6, FRAMES - 1))
    notes = tmp_path / 'notes'
    assert run(source, create=functools.partial(known_people, notes=notes)) == 0
    pairs = [number for number in range(FRAMES) if number not in (3, 5, 6, FRAMES - 1)]
    assert numbers_of(arrays(out)) == pairs
    assert sorted(map(int, notes.read_text().split())) == pairs
    assert '3 images without points; 1 points without an image' in capsys.readouterr().out


@pytest.mark.parametrize('late', [0, 4])
def test_points_with_stamps_of_their_own_are_paired_from_their_first_frame_on(run, tmp_path, out, late):
    """Also where the first images have no points to learn the difference of the stamps from."""
    assert run(write_recording(tmp_path / 'a.bag', offset=0.021, without_points=range(late))) == 0
    assert numbers_of(arrays(out, 'detected_poses')) == list(range(late, FRAMES))


def test_what_is_said_where_nothing_pairs_makes_it_pair(run, tmp_path, out, capsys):
    others = [number for number in range(FRAMES) if number != 3]
    source = write_recording(tmp_path / 'a.bag', offset=0.21, without_image=others, without_points=others)
    assert run(source) == 2
    said = capsys.readouterr().err
    assert f'the nearest stamps of {IMAGE} and {DEPTH} differ by 0.21 s, allowed are 0.005 s; --set slop=0.3' in said
    assert run(source, slop=0.3) == 0
    (found,) = arrays(out)
    assert [person.person_ID for person in found.persons] == [1, 2]
    assert 'nearest stamps' not in capsys.readouterr().out


def test_each_output_that_is_there_is_refused(run, recording, tmp_path, out, capsys):
    for path, option in ((out, ()), (tmp_path / 'a.csv', ('--csv', tmp_path / 'a.csv')),
                         (tmp_path / 'json/walk_000000000000_keypoints.json', ('--json', tmp_path / 'json'))):
        path.parent.mkdir(exist_ok=True)
        path.write_text('a diary')
        assert run(recording, *option, create=None) == 2
        assert f'{option[1] if option else out} is there already; give another name, or --overwrite' in (
            capsys.readouterr().err)
        assert path.read_text() == 'a diary'
        path.unlink()


def test_joints_and_signals_are_given_in_another_frame_whose_floor_is_at_z_0(run, tmp_path, out):
    source = write_recording(tmp_path / 'a.bag', others=with_transform)
    assert run(source, '--signals', target_frame='world', tracking_frame='world') == 0
    assert run(source, output=tmp_path / 'plain.bag') == 0
    for there, here in zip(arrays(out), arrays(tmp_path / 'plain.bag')):
        assert there.header.frame_id == 'world'
        x, y, z = np.moveaxis(positions(here), 2, 0)
        np.testing.assert_allclose(positions(there), np.stack([x, z, 1 - y], axis=2), atol=1e-5)
    frames = arrays(out, 'people_signals')
    assert [len(frame.persons) for frame in frames] == [len(frame.persons) for frame in arrays(out)]
    told = [person for frame in frames for person in frame.persons]
    assert {person.header.frame_id for person in told} == {'world'}
    assert {person.posture for person in told} == {'unknown', 'standing'}  # unknown until it has held for a moment
    np.testing.assert_allclose([person.floor_pose.position.z for person in told], 0.0, atol=1e-6)


def test_signals_of_a_level_camera_have_x_forward_and_z_up(run, tmp_path, out):
    assert run(write_recording(tmp_path / 'a.bag'), '--signals') == 0
    with rosbag.Bag(str(out)) as bag:
        connected = {(each.header.frame_id, each.child_frame_id) for _, message, _ in bag.read_messages('/tf')
                     for each in message.transforms}
    for people, signals in zip(arrays(out), arrays(out, 'people_signals')):
        assert signals.header.frame_id == people.header.frame_id + '_upright'
        assert connected == {(people.header.frame_id, signals.header.frame_id)}
        for person, told in zip(people.persons, signals.persons):
            here, neck, up = told.position, person.neck, told.floor_pose.orientation
            assert (here.x, here.y, here.z) == pytest.approx((neck.z, -neck.x, -neck.y), abs=0.5)
            np.testing.assert_allclose((up.x, up.y), 0.0, atol=1e-6)


def test_frames_without_their_transform_are_counted(run, tmp_path, out, capsys):
    moving_camera = functools.partial(with_transform, topic='/tf', numbers=range(4, FRAMES))
    source = write_recording(tmp_path / 'a.bag', others=moving_camera)
    assert run(source, target_frame='world') == 0
    assert numbers_of(arrays(out)) == list(range(4, FRAMES))
    assert '4 frames dropped: no transform' in capsys.readouterr().out


def test_originals_are_copied_as_they_are(run, tmp_path, out):
    def others(bag):
        with_transform(bag)
        for number in range(100):
            bag.write('/notes', String(str(number)), stamp_of(0) + genpy.Duration.from_sec(number / 100))
        bag.write(f'{NAMESPACE}/detected_poses_image', Image(), stamp_of(0))

    source = write_recording(tmp_path / 'a.bag', others=others)
    assert run(source, '--copy', 'all', '--compression', 'lz4') == 0
    with rosbag.Bag(str(source)) as given, rosbag.Bag(str(out)) as made:
        def raw(bag, topic):
            return [(time, message[:3]) for _, message, time in bag.read_messages(topics=[topic], raw=True)]

        topics = set(given.get_type_and_topic_info().topics)
        for topic in topics:
            assert raw(made, topic) == ([] if topic.startswith(NAMESPACE) else raw(given, topic))
        assert made.get_compression_info().compression == 'lz4'
    assert run(source, '--copy', '/notes', output=tmp_path / 'c.bag') == 0
    assert len(messages(tmp_path / 'c.bag', '/notes')) == 100
    assert messages(tmp_path / 'c.bag', IMAGE) == []
    assert run(source, '--copy', f'{NAMESPACE}/detected_poses_image', output=tmp_path / 'd.bag') == 2


def test_json_markers_and_tf(run, recording, tmp_path, out):
    assert run(recording, '--json', tmp_path / 'json', '--markers', publish_tf='true') == 0
    files = sorted((tmp_path / 'json').iterdir())
    assert [path.name for path in files] == [f'walk_{number:012d}_keypoints.json' for number in range(FRAMES)]
    (tmp_path / 'json/of_another_000000000000_keypoints.json').write_text('{}')
    shorter = write_recording(tmp_path / 'walk.bag', without_image=(0,))
    assert run(shorter, '--json', tmp_path / 'json', '--markers', '--overwrite', publish_tf='true') == 0
    assert len(list((tmp_path / 'json').glob('walk_*'))) == FRAMES - 1
    assert (tmp_path / 'json/of_another_000000000000_keypoints.json').exists()
    array, files = arrays(out)[3], sorted((tmp_path / 'json').glob('walk_*'))
    people = json.loads(files[3].read_text())['people']
    assert [entry['person_id'] for entry in people] == [[person.person_ID] for person in array.persons]
    in_space = np.array([entry['pose_keypoints_3d'] for entry in people], np.float32).reshape(-1, 18, 4)
    np.testing.assert_array_equal(in_space[..., :3], np.nan_to_num(positions(array)).astype(np.float32))
    assert len(messages(out, f'{NAMESPACE}/visualization_skeleton')) >= 2 * (FRAMES - 1 - EMPTY)
    joints, _ = messages(out, '/tf')[3]
    assert joints.transforms[0].header.frame_id == FRAME_ID
    assert 'person_1/nose' in [transform.child_frame_id for transform in joints.transforms]


@pytest.mark.parametrize('option, name, limit', [
    ((), 'out.bag', 1000), (('--csv', 't.csv', '--copy', 'all'), 'out.bag', 100000)])
def test_a_full_disk_is_told_with_the_file_and_nothing_stays(run, recording, tmp_path, capfd, option, name, limit):
    arguments = [tmp_path / word if '.' in word else word for word in option]
    with rosbag.Bag(str(recording)) as bag:  # rosbag writes modules for the types of messages once
        assert len(list(bag.read_messages())) > FRAMES
    with file_size_limit(limit):
        assert run(recording, *arguments) == 2
    assert f'process_bag: {tmp_path / name}: File too large\n' in capfd.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [recording.name]


def test_an_interrupt_leaves_nothing(recording, tmp_path):
    script = ('import functools, sys\n'
              'from known_recording import known_people\n'
              'from openpose_ros_tools.ros.process_bag.program import main\n'
              "if __name__ == '__main__':\n"
              '    sys.exit(main(sys.argv[1:], functools.partial(known_people, slow=0.5)))\n')
    (tmp_path / 'command.py').write_text(script)
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    for number in (signal.SIGINT, signal.SIGTERM):
        with (tmp_path / 'errors').open('w') as errors:
            command = subprocess.Popen([sys.executable, str(tmp_path / 'command.py'), str(recording), '-o', str(
                tmp_path / 'out.bag'), '--csv', str(tmp_path / 'a.csv'), '--json', str(tmp_path / 'json')],
                env=environment, start_new_session=True, stderr=errors)
        while command.poll() is None and not any(name.startswith('.out.bag') for name in left_behind(tmp_path)):
            time.sleep(0.01)
        # a terminal sends Ctrl-C to the whole group
        (os.killpg if number == signal.SIGINT else os.kill)(command.pid, number)
        assert command.wait(60) == 130
        assert sorted(path.name for path in tmp_path.iterdir()) == ['command.py', 'errors', 'walk.bag']
        assert 'Traceback' not in (tmp_path / 'errors').read_text()
