"""Where a camera was by the tf of a bag, in which the clock may have been reset any number of times."""
import genpy
import pytest
import rosbag
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import NoTransformError
from openpose_ros_tools.ros.bag_files import deserialized, open_bag, stamped_messages
from openpose_ros_tools.ros.process_bag.transforms import RecordedTransforms

PERIOD = 0.05
# By which images are recorded after their stamps, longer than transforms [s].
LATENCY = 0.12


def written(bag, topic, stamp, child, x, time, parent='world'):
    one = TransformStamped(header=Header(stamp=genpy.Time.from_sec(stamp), frame_id=parent), child_frame_id=child)
    one.transform.translation, one.transform.rotation = Vector3(x, 0, 0), Quaternion(0, 0, 0, 1)
    bag.write(topic, TFMessage([one]), genpy.Time.from_sec(time))


def write_runs(path, runs, rate=1.0):
    """Write /tf of runs of a clock, by their first and last stamps [s], one after the other.

    The base goes 1 m per second of the clock, and begins at 1000 m in the first run, at 2000 m in the second. The
    camera is 0.5 m before it by /tf_static, which is sent once.

    Returns:
        time of recording, stamp and x of images [s, s, m].
    """
    images, time = [], 5000.0
    with rosbag.Bag(str(path), 'w') as bag:
        written(bag, '/tf_static', 0.0, 'camera', 0.5, time, 'base')
        for number, (first, last) in enumerate(runs, 1):
            for i in range(round((last - first) / PERIOD) + 1):
                elapsed, stamp = i * PERIOD / rate, first + i * PERIOD
                written(bag, '/tf', stamp, 'base', 1000 * number + i * PERIOD, time + elapsed)
                written(bag, '/tf', stamp, f'other_{i % 3}', 0.0, time + elapsed + 0.01)
                if i:  # between the transforms before and after
                    x = 1000 * number + (i - 0.5) * PERIOD + 0.5
                    images.append((time + elapsed + LATENCY, stamp - PERIOD / 2, x))
            time += elapsed + PERIOD
    return sorted(images)


def places(path, images):
    """Return the x of each image by the bag [m], None where there is none."""
    with rosbag.Bag(str(path)) as bag:
        transforms, found = RecordedTransforms(bag), []
        for time, stamp, _ in images:
            transforms.read_until(genpy.Time.from_sec(time), genpy.Time.from_sec(stamp))
            try:
                found.append(transforms.lookup('world', 'camera', genpy.Time.from_sec(stamp)).transform.translation.x)
            except NoTransformError:
                found.append(None)
    return found


@pytest.mark.parametrize('runs, rate', [
    ([(100.0, 110.0)], 1.0), ([(0.0, 10.0), (0.0, 10.0)], 1.0), ([(100.0, 110.0), (0.0, 10.0)], 1.0),
    ([(100.0, 105.0), (104.0, 110.0)], 1.0), ([(0.0, 10.0)] * 3, 0.3)], ids=[
        'one run', 'restarted', 'back to 0', 'a second back',
        'slow simulation'])
def test_each_frame_has_the_transforms_of_its_own_run(tmp_path, runs, rate):
    images = write_runs(tmp_path / 'a.bag', runs, rate)
    wrong = [(image, x) for image, x in zip(images, places(tmp_path / 'a.bag', images))
             if x is None or abs(x - image[2]) > 1e-6]
    assert not wrong, f'{len(wrong)} of {len(images)}'


def test_frames_that_begin_or_pause_around_a_reset_have_the_transforms_of_their_run(tmp_path):
    images = write_runs(tmp_path / 'a.bag', [(0.0, 10.0)] * 3)
    third = len(images) // 3
    images = images[third + 10:2 * third - 20] + images[2 * third + 100:]
    assert places(tmp_path / 'a.bag', images) == pytest.approx([x for _, _, x in images])


def test_a_transform_with_an_old_stamp_is_no_reset(tmp_path):
    images = write_runs(tmp_path / 'a.bag', [(100.0, 110.0)])
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'a') as bag:
        for time in (5002.0, 5002.3, 5006.0):
            written(bag, '/tf', 90.0, 'other_1', 0.0, time)
    assert places(tmp_path / 'a.bag', images) == pytest.approx([x for _, _, x in images])


def test_a_static_transform_that_is_sent_again_holds_from_then_on(tmp_path):
    images = write_runs(tmp_path / 'a.bag', [(0.0, 10.0), (0.0, 10.0)])
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'a') as bag:
        written(bag, '/tf_static', 0.0, 'camera', 0.75, 5010.2, 'base')
    half = len(images) // 2
    found = places(tmp_path / 'a.bag', images)
    assert found[half - 100] == pytest.approx(images[half - 100][2])
    assert found[half:] == pytest.approx([x + 0.25 for _, _, x in images[half:]])


def test_leading_slashes_of_frames_are_left_out(tmp_path):
    """As in bags of tf's time; tf2 refuses them."""
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for stamp in (1.0, 2.0):
            written(bag, '/tf', stamp, '/camera', 3.0, stamp, '/world')
        bag.write('/image', Image(header=Header(stamp=genpy.Time(1, 5), frame_id='/camera')), genpy.Time(1, 5))
    with open_bag(tmp_path / 'a.bag') as bag:
        image, = stamped_messages(bag, ['/image'])
        assert (image.frame_id, deserialized(image).header.frame_id) == ('camera', 'camera')
        transforms = RecordedTransforms(bag)
        transforms.read_until(genpy.Time(2), genpy.Time(1, 5))
        assert transforms.lookup('world', 'camera', genpy.Time(1, 5)).transform.translation.x == 3.0
