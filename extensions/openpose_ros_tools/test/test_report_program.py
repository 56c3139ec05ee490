"""report on bags: what is on the page, what is missing and named, wrong inputs."""
import genpy
import numpy as np
import rosbag
from known_recording import FRAMES, IMAGE, stamp_of, write_recording
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from std_msgs.msg import Header

from animated_skeleton import STANDING, frames, held
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.convert import people_to_array as people_to_array_2d
from openpose_ros_pkg.ros.convert import people_to_messages
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.records import Gesture, PersonSignals, Posture
from openpose_ros_signals.ros.convert import signals_to_array
from openpose_ros_tools.ros.report import main
from skeleton_extract_3d.ros.convert import people_to_array

SPACE = '/openpose_ros/skeleton_3d'


def image_array(people, header):
    """Return the array message of people in the image."""
    return people_to_array_2d(people_to_messages(people, header), header, COCO_18)


def write_results(path, *, people=True, signals=False, image=False):
    """Write the results of a recording: a standing person; in the image, at its left."""
    keypoints = np.tile(np.array([80.0, 90.0, 0.9]), (1, 18, 1))
    keypoints[0, :, 1] += np.arange(18)
    with rosbag.Bag(str(path), 'w') as bag:
        for number, (_, person) in zip(range(FRAMES), frames(held((0.0, STANDING)), 10.0, 15)):
            stamp = stamp_of(number)
            header = Header(stamp=stamp, frame_id='room')
            bag.write(f'{SPACE}/detected_poses_3d', people_to_array(person, header) if people else
                      PersonDetection_3dArray(header=header), stamp)
            if signals:
                told = PersonSignals(1, np.zeros(3), Posture('kneeling', stamp.to_sec(), 0.5),
                                     (Gesture('beckon', 'left', stamp.to_sec(), 0.75),))
                bag.write(f'{SPACE}/people_signals', signals_to_array((told,), header), stamp)
            if image:
                found = People2D(COCO_18, keypoints, np.ones(1), np.ones(1))
                bag.write(f'{SPACE}/detected_poses', image_array(found, header), stamp)
    return path


def report(path, *options):
    """Return the page of a recording."""
    output = path.with_name('page.html')
    assert main([str(path), '-o', str(output), *map(str, options)]) == 0
    return output.read_text()


def test_signals_are_those_of_the_recording(tmp_path):
    text = report(write_results(tmp_path / 'a.bag', signals=True))
    assert 'kneeling' in text and 'beckon' in text and 'are computed' not in text


def test_without_signals_they_are_computed(tmp_path):
    path = write_results(tmp_path / 'a.bag')
    text = report(path)
    assert 'standing' in text and 'are computed from the joints' in text
    assert 'are computed' in report(path, '--overwrite', '--up', '0', '0', '1')


def test_crops_come_out_of_the_images(tmp_path):
    results = write_results(tmp_path / 'a.bag', image=True)
    write_recording(tmp_path / 'images.bag', image=IMAGE)
    assert report(results, '--images', tmp_path / 'images.bag', '--crops', 3).count('data:image/jpeg') == 3
    text = report(results, '--overwrite')
    assert 'There are no images of the people' in text and 'data:image/jpeg' not in text


def test_recordings_without_results_have_a_page_of_topics(tmp_path):
    write_recording(tmp_path / 'images.bag', image=IMAGE)
    text = report(tmp_path / 'images.bag')
    assert 'it holds no results' in text
    assert IMAGE in text


def test_people_in_the_image_alone(tmp_path):
    header = Header(stamp=genpy.Time(5), frame_id='camera')
    keypoints = np.tile(np.array([80.0, 90.0, 0.9]), (1, 18, 1))
    array = image_array(People2D(COCO_18, keypoints, np.ones(1), np.ones(1)), header)
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        bag.write('/openpose_ros/detected_poses', array, header.stamp)
        bag.write('/openpose_ros/detected_poses', PersonDetectionArray(header=Header(stamp=genpy.Time(6))),
                  genpy.Time(6))
    text = report(tmp_path / 'a.bag')
    assert 'The people are known in the image alone' in text
    assert 'Paths in the image' in text
    assert '2 frames, 1 of them without people' in text


def test_an_empty_bag(tmp_path):
    rosbag.Bag(str(tmp_path / 'a.bag'), 'w').close()
    assert 'without messages' in report(tmp_path / 'a.bag')


def test_the_page_is_beside_the_recording_and_stays(tmp_path):
    path = write_results(tmp_path / 'a.bag')
    assert main([str(path)]) == 0
    assert main([str(path)]) == 2
    assert main([str(path), '--overwrite']) == 0
    assert (tmp_path / 'a.html').is_file()
