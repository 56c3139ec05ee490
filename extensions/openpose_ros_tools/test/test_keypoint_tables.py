"""Keypoints between bags and CSV: equal to what rostopic echo writes, and back again; no master is needed."""
import subprocess

import genpy
import genpy.dynamic
import numpy as np
import pytest
import rosbag
from openpose_ros_msgs.msg import (
    BodypartDetection,
    BodypartDetection_3d,
    PersonDetection,
    PersonDetection_3d,
    PersonDetection_3dArray,
    PersonDetectionArray,
)
from std_msgs.msg import Header, String

from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.mocap.files import read_mocap
from openpose_ros_tools.ros.keypoints import csv_to_bag, keypoints_to_csv, keypoints_to_motion
from openpose_ros_tools.ros.keypoints.keypoint_bag import read_keypoints
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.ros.convert import people_from_array

SPACE = '/openpose_ros/skeleton_3d/detected_poses'
IMAGE = '/openpose_ros/detected_poses'
# An epoch stamp that no float64 holds [ns]; frames at 30 Hz; what rosbag needs to get a message [ns].
FIRST, PERIOD, DELAY = 1_700_000_000_123_456_789, 33_333_333, 41_000_017
NAN = float('nan')


def when(nanoseconds):
    return genpy.Time(0, nanoseconds)


def frames(number, dimensions, seed=0):
    """Yield the array message of each frame; every fifth is without people."""
    random = np.random.RandomState(seed)
    for index in range(number):
        header = Header(index, when(FIRST + index * PERIOD), 'camera')
        kind, array = ((PersonDetection_3d, PersonDetection_3dArray) if dimensions == 3
                       else (PersonDetection, PersonDetectionArray))
        count = (2, 1, 0, 3, 2)[index % 5]
        persons = [kind(header=header, num_people_detected=count, person_ID=10 + person, **{
            joint: part(random, dimensions, joint in COCO_18.joints and random.uniform() > 0.3)
            for joint in MESSAGE_JOINTS}) for person in range(count)]
        yield array(header=header, pose_model='COCO_18', persons=persons)


def part(random, dimensions, is_known):
    x, y, z, confidence = random.uniform(-3, 3, 4).tolist()
    if dimensions == 2:
        return BodypartDetection(x, y, abs(confidence) / 3) if is_known else BodypartDetection()
    return (BodypartDetection_3d(x, y, z, abs(confidence) / 3, random.choice([MEASURED, INFERRED]), abs(x) * 1e-7)
            if is_known else BodypartDetection_3d(NAN, NAN, NAN, 0, MISSING, NAN))


def single_topic(dimensions):
    return f'{SPACE}_keypoints_3d' if dimensions == 3 else f'{IMAGE}_keypoints'


def record(path, messages, single=None, array=None, delay=DELAY):
    """Write a bag as rosbag record does: each message with the time at which it came."""
    with rosbag.Bag(str(path), 'w') as bag:
        for message in messages:
            now = message.header.stamp.to_nsec() + delay
            for number, person in enumerate(message.persons):
                if single:
                    bag.write(single, person, when(now + 31_000 * number))
            if array:
                bag.write(array, message, when(now + 200_000))
    return path


def recording(tmp_path, dimensions, number=20):
    topic = single_topic(dimensions)
    return record(tmp_path / f'recorded_{dimensions}d.bag', frames(number, dimensions), topic,
                  topic.replace('_keypoints', ''))


def run(*arguments):
    return keypoints_to_csv.main([str(argument) for argument in arguments])


def converted(tmp_path, *arguments):
    """Return what keypoints_to_csv writes."""
    output = tmp_path / 'converted.csv'
    assert run(*arguments, '-o', output, '--overwrite') == 0
    return output.read_text()


def echoed(path, topic):
    """Return what `rostopic echo -p -b` writes; the master that is named does not exist."""
    answer = subprocess.run(['/usr/bin/env', 'ROS_MASTER_URI=http://localhost:1', 'rostopic', 'echo', '-p', '-b',
                             str(path), topic], stdout=subprocess.PIPE, check=True, timeout=60)
    return answer.stdout.decode()


def refusal(capsys, *arguments):
    assert run(*arguments) == 2
    return capsys.readouterr().err


# ---- CSV out of bags


@pytest.mark.parametrize('dimensions', [2, 3])
def test_extended_is_what_rostopic_writes(tmp_path, dimensions):
    bag = recording(tmp_path, dimensions)
    text = echoed(bag, single_topic(dimensions))
    assert text.count('\n') == 1 + 4 * 8 and ('nan' in text) == (dimensions == 3)
    assert converted(tmp_path, bag, '--extended') == text


def test_a_recording_begins_with_its_first_frame_also_without_people(tmp_path):
    messages = list(frames(12, 3))
    for message in messages[:3]:
        message.persons = []
    bag = record(tmp_path / 'a.bag', messages, array=f'{SPACE}_3d')
    assert keypoints_to_motion.trc([str(bag), '-o', str(tmp_path)]) == 0
    assert read_mocap(tmp_path / 'person_10.trc').times[0] == pytest.approx(3e-9 * PERIOD, abs=1e-3)


# ---- which topic


def test_space_comes_before_image_and_single_people_before_arrays(tmp_path):
    topics = {single_topic(3): next(frames(1, 3)).persons[0], f'{SPACE}_3d': next(frames(1, 3)),
              single_topic(2): next(frames(1, 2)).persons[0], IMAGE: next(frames(1, 2))}
    path = tmp_path / 'some.bag'
    left = dict(topics)
    for topic, message in topics.items():
        with rosbag.Bag(str(path), 'w') as bag:
            for name, other in left.items():
                bag.write(name, other, when(FIRST))
            # recorded later, so that times tell which topic was read
            bag.write(topic, message, when(FIRST + 5))
        assert f'\n{FIRST + 5},' in converted(tmp_path, path)
        del left[topic]


def test_errors_name_the_topics(tmp_path, capsys):
    path = tmp_path / 'some.bag'
    for topics, topic, expected in (
            (('/one', '/two'), None, 'several topics of type openpose_ros_msgs/PersonDetection_3d: /one, /two; choose'),
            (('/one', '/two', '/words'), '/three', '/one (openpose_ros_msgs/PersonDetection_3d), /two'),
            (('/one', '/words'), '/words', '/words in'), (('/words',), None, 'no keypoints in'),
            ((), None, 'it has no topics')):
        with rosbag.Bag(str(path), 'w') as bag:
            for name in topics:
                bag.write(name, String('x') if name == '/words' else PersonDetection_3d(), when(FIRST))
        assert expected in refusal(capsys, path, '-o', tmp_path / 'no.csv', *(['--topic', topic] if topic else []))


# ---- bags and files that can not be read or written


def test_a_recording_that_was_cut_off_asks_for_reindex(tmp_path, capsys):
    bag = recording(tmp_path, 3, 60)
    bag.write_bytes(bag.read_bytes()[:-1])
    assert 'rosbag reindex' in refusal(capsys, bag, '-o', tmp_path / 'poses.csv')
    assert {path.name for path in tmp_path.iterdir()} == {bag.name}


def test_a_bag_of_the_format_before_2010_is_refused(tmp_path, capsys):
    path = tmp_path / 'old.bag'
    rosbag.Bag(str(path), 'w').close()
    path.write_bytes(path.read_bytes().replace(b'V2.0', b'V1.2', 1))
    assert 'is a bag of format 1.2, from before 2010: record it anew' in refusal(
        capsys, path, '-o', tmp_path / 'poses.csv')


# ---- bags out of CSV


def back(tmp_path, text, *arguments):
    """Return the path of the bag that csv_to_bag makes of a text."""
    path, bag = tmp_path / 'some.csv', tmp_path / 'back.bag'
    path.write_text(text)
    assert csv_to_bag.main([str(path), '-o', str(bag), '--overwrite', *arguments]) == 0
    return bag


def messages_of(path):
    with rosbag.Bag(str(path)) as bag:
        return [(topic, message, time.to_nsec()) for topic, message, time in bag.read_messages()]


@pytest.mark.parametrize('layout, dimensions, times', [
    ('--extended', 2, 'stamp'), ('--extended', 3, 'recorded'), (None, 2, 'recorded'), (None, 3, 'stamp')])
def test_to_a_bag_and_back_gives_the_same_bytes(tmp_path, layout, dimensions, times):
    options = [layout] if layout else []
    text = converted(tmp_path, recording(tmp_path, dimensions), '--time', times, *options)
    assert converted(tmp_path, back(tmp_path, text), *options) == text


def test_the_originals_columns_leave_the_rest_unknown(tmp_path):
    text = converted(tmp_path, recording(tmp_path, 3))
    bag = back(tmp_path, text, '--frame-id', 'kinect2_rgb_optical_frame')
    found = messages_of(bag)
    assert {topic for topic, _, _ in found} == {f'{SPACE}_keypoints_3d', f'{SPACE}_3d'}
    arrays = [message for _, message, _ in found if hasattr(message, 'persons')]
    assert [len(message.persons) for message in arrays] == [2, 1, 3, 2] * 4
    assert [message.header.seq for message in arrays] == list(range(16))
    assert arrays[0].header.stamp.to_nsec() == FIRST + DELAY
    for message in arrays:
        assert {person.header.stamp for person in message.persons} == {message.header.stamp}
        assert message.header.frame_id == message.persons[0].header.frame_id == 'kinect2_rgb_optical_frame'
        people = people_from_array(message)
        assert isinstance(people, People3D) and people.skeleton is COCO_18
        assert set(np.unique(people.status)) <= {MISSING, MEASURED} and np.isnan(people.sigma).all()


# ---- tables


@pytest.mark.parametrize('dimensions', [2, 3])
def test_bag_and_csv_are_the_same_table(tmp_path, dimensions):
    bag = recording(tmp_path, dimensions)
    text = converted(tmp_path, bag, '--extended')
    (tmp_path / 'some.csv').write_text(text)
    tables = [read_keypoints(bag)[0], read_keypoint_csv(tmp_path / 'some.csv'),
              read_keypoints(bag, single_topic(dimensions).replace('_keypoints', ''))[0]]
    assert len(tables[0]) == 32 and tables[0].dimensions == dimensions
    for other in tables[1:]:
        for name, value in vars(tables[0]).items():
            np.testing.assert_array_equal(getattr(other, name), value, err_msg=name)
