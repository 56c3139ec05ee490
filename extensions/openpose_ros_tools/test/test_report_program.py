"""report on bags: what is in the page, what is missing and named, wrong inputs."""
import base64
import json
import re
import zlib

import cv2
import genpy
import numpy as np
import rosbag
from known_recording import FRAME_ID, FRAMES, IMAGE, stamp_of, write_recording
from std_msgs.msg import Header

from animated_skeleton import STANDING, frames, held
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.convert import people_to_array as people_to_array_2d
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.records import Gesture, PersonSignals, Posture
from openpose_ros_signals.ros.convert import signals_to_array
from openpose_ros_tools.ros.report import main
from skeleton_extract_3d.landmarks import Hands3D, Points3D
from skeleton_extract_3d.ros.convert import hands_to_array, people_to_array

SPACE = '/openpose_ros/skeleton_3d'


def write_results(path, *, signals=False, frame='room', hands=False):
    """Write the results of a recording: a standing person, and a left hand of all its frames."""
    with rosbag.Bag(str(path), 'w') as bag:
        for number, (_, person) in zip(range(FRAMES), frames(held((0.0, STANDING)), 10.0, 15)):
            stamp = stamp_of(number)
            header = Header(stamp=stamp, frame_id=frame)
            bag.write(f'{SPACE}/detected_poses_3d', people_to_array(person, header), stamp)
            if hands:
                points = Points3D(np.full((1, 21, 3), 0.5), np.ones((1, 21)), np.ones((1, 21)), np.ones((1, 21)))
                hand = Hands3D(points, np.ones(1), np.ones(1, int), np.ones(1, bool))
                bag.write(f'{SPACE}/detected_hands_3d', hands_to_array(hand, header), stamp)
            if signals:
                told = PersonSignals(1, np.zeros(3), Posture('kneeling', stamp.to_sec(), 0.5),
                                     (Gesture('stop', 'left', stamp.to_sec(), 0.75),))
                bag.write(f'{SPACE}/people_signals', signals_to_array((told,), header), stamp)
    return path


def report(path, *options):
    """Return the page of a recording, and the lines of JSON within it."""
    output = path.with_name('page.html')
    assert main([str(path), '-o', str(output), *map(str, options)]) == 0
    text = output.read_text()
    inside = re.search('id="recording">([^<]*)<', text)[1]
    return text, [json.loads(line) for line in zlib.decompress(base64.b64decode(inside)).decode().splitlines()]


def test_signals_are_those_of_the_recording(tmp_path):
    _, (facts, *frames) = report(write_results(tmp_path / 'a.bag', signals=True))
    assert facts['notes'] == ['There are no images: a.bag has no topic of colour images. --images names a recording '
                              'with images.']
    assert {(span['kind'], span['name']) for span in facts['spans']} == {('posture', 'kneeling'), ('gesture', 'stop')}
    assert len(frames) == FRAMES
    for (signals, people), number in zip(frames, range(FRAMES)):
        assert people['stamp'] == signals['stamp'] == round(stamp_of(number).to_sec(), 6)
        assert people['people'][0]['id'] == signals['people'][0]['id'] == 1


def test_without_signals_they_are_computed(tmp_path):
    path = write_results(tmp_path / 'a.bag')
    computed = 'Postures and gestures are computed from the joints, not read from the recording.'
    _, (facts, *_) = report(path)
    assert 'standing' in {span['name'] for span in facts['spans']} and computed in facts['notes']
    _, (facts, *_) = report(path, '--overwrite', '--up', '0', '0', '1')
    assert computed in facts['notes']


def test_hands_and_the_camera_in_whose_frame_people_are(tmp_path):
    write_recording(tmp_path / 'images.bag', image=IMAGE)
    path = write_results(tmp_path / 'a.bag', frame=FRAME_ID, hands=True)
    _, (facts, *frames) = report(path, '--images', tmp_path / 'images.bag')
    camera, = facts['cameras']['cameras']
    assert camera['size'] == [320, 180] and camera['position'] == [0, 0, 0]
    assert len(facts['images']) == FRAMES and facts['images'][0][0] == 0.0
    pixels = cv2.imdecode(np.frombuffer(base64.b64decode(facts['images'][0][1])[16:], np.uint8), cv2.IMREAD_COLOR)
    assert pixels.shape == (180, 320, 3)
    assert [message['type'] for message in frames[3]] == ['signals', 'people', 'hands']
    assert frames[3][2]['hands'][0]['side'] == 'left' and frames[3][2]['hands'][0]['xyz'] == [500] * 63


def test_recordings_without_people_in_space_are_refused(tmp_path, capsys):
    write_recording(tmp_path / 'images.bag', image=IMAGE)
    assert main([str(tmp_path / 'images.bag')]) == 2
    assert 'as it holds no results. To compute them: rosrun openpose_ros_tools process_bag' in capsys.readouterr().err
    header = Header(stamp=genpy.Time(5), frame_id='camera')
    keypoints = np.tile(np.array([80.0, 90.0, 0.9]), (1, 18, 1))
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        bag.write('/openpose_ros/detected_poses', people_to_array_2d(
            People2D(COCO_18, keypoints, np.ones(1), np.ones(1)), header), header.stamp)
    assert main([str(tmp_path / 'a.bag')]) == 2
    assert 'people in the image alone' in capsys.readouterr().err
    rosbag.Bag(str(tmp_path / 'b.bag'), 'w').close()
    assert main([str(tmp_path / 'b.bag')]) == 2
    assert not list(tmp_path.glob('*.html'))
