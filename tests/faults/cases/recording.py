"""The recorder of record.launch dies."""
import os
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import Any, List

from faults.fault import Scenario

TOPIC = '/recorded/detected_poses_3d'
RATE = 30.0  # [Hz]
FRAMES = 120
# Messages of the last second, which may be lost with the chunk that was not finished.
MOST_LOST = 30


def kill_recorder(rig: Any) -> None:
    """Record results at 30 Hz, kill the recorder, mend the bag: what was recorded up to the last second is there."""
    import rosbag
    with tempfile.TemporaryDirectory() as folder:
        launch = rig.session.start('record', ['roslaunch', 'openpose_ros_bringup', 'record.launch', f'folder:={folder}',
                                              f'topics:={TOPIC}'])
        try:
            publish_and_kill(rig.chain('cloud/people').result_of_good_frame())
        finally:
            rig.session.stop(launch)
        path, = Path(folder).glob('*.bag.active')
        subprocess.run(['rosbag', 'reindex', str(path)], check=True, stdout=subprocess.DEVNULL)
        with rosbag.Bag(str(path)) as bag:
            numbers: List[int] = [message.header.seq for _, message, _ in bag.read_messages(topics=[TOPIC])]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert FRAMES - MOST_LOST <= len(numbers) <= FRAMES


def publish_and_kill(people: Any) -> None:
    """Publish people again and again, and kill the recorder when it has had the time to take them."""
    from xmlrpc.client import ServerProxy

    import rosgraph
    import rospy

    from session import await_true
    publisher = rospy.Publisher(TOPIC, type(people), queue_size=10)
    await_true(lambda: publisher.get_num_connections() > 0, 'the recorder listens')
    rate = rospy.Rate(RATE)
    for _ in range(FRAMES):
        publisher.publish(people)
        rate.sleep()
    recorder: Any = ServerProxy(rosgraph.Master('/faults').lookupNode('/record_people'))
    os.kill(recorder.getPid('/faults')[2], signal.SIGKILL)
    publisher.unregister()


FAULTS = [Scenario('recorder is killed', kill_recorder, 'rosbag record',
                   'after `rosbag reindex`, all but the last second is in the bag')]
