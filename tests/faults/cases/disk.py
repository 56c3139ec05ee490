"""Disks that are full, or take nothing. A limit for the size of files stands for them, as it needs no rights."""
import signal
import tempfile
from pathlib import Path
from typing import Any, Callable, Dict

import cv2

from faults.fault import Scenario

SERVICE = 'openpose_ros_pkg/scripts/openpose_ros_node'
# So many frames in a row are not saved.
LASTING = 10


def started(rig: Any, node: str, parameters: Dict[str, Any], *prefix: str) -> Any:
    """Start a service node, under another program if it is named; return its process, and what calls it with a good
    image and returns the number of people."""
    import rospy
    from openpose_ros_msgs.srv import GetPersons

    from faults.rig import PATIENCE, Program, start_node
    process = start_node(rig.session, node, Program(SERVICE, {
        'mode': 'fast', 'precision': 'f32', 'publish_results': False, **parameters}), *prefix)
    image, service = rig.chain('cloud/people').frame().image, f"/{node.partition('/')[0]}/detect_poses"
    rospy.wait_for_service(service, PATIENCE)
    call = rospy.ServiceProxy(service, GetPersons)
    return process, lambda: len(call(image).detections)


def says(rig: Any, node: str, level: str, *words: str) -> Callable[[], bool]:
    """Return what tells whether the last status of a node has a level, and a text with all these words."""
    def said() -> bool:
        last = rig.diagnostics.reports(node)[-1:]
        return bool(last) and last[0].level == level and all(word in last[0].text for word in words)
    return said


def no_room_for_results(rig: Any) -> None:
    """Saving fails and says so, harms no answer, and goes on when there is room again."""
    from disk_limits import file_size_limit
    from faults.rig import PATIENCE
    from session import await_true
    with tempfile.TemporaryDirectory() as name:
        folder, video, node = Path(name) / 'json', Path(name) / 'people.avi', 'saving/service'
        process, detect = started(rig, node, {'write_json': folder, 'write_video': video})
        people = detect()
        await_true(lambda: rig.diagnostics.count(node, 'saving, written') == 2, 'the first frame is saved')
        with file_size_limit(100, process.pid):
            assert [detect() for _ in range(LASTING)] == [people] * LASTING
            await_true(says(rig, node, 'ERROR', 'people.avi: File too large', '_keypoints.json: File too large'),
                       lambda: f'an ERROR; {rig.diagnostics.reports(node)[-3:]}')
            # within the limit, as saving lags behind the answers
            await_true(lambda: rig.diagnostics.count(node, 'saving, failed') == 2 * LASTING,
                       lambda: f'{2 * LASTING} files and frames are not saved; {rig.diagnostics.reports(node)[-1:]}')
        assert detect() == people
        await_true(says(rig, node, 'OK'), lambda: f'OK again; {rig.diagnostics.reports(node)[-3:]}')
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
        frames = cv2.VideoCapture(str(video))
        assert [frames.read()[0] for _ in range(3)] == [True, True, False]
        assert sorted(int(path.name[:12]) for path in folder.iterdir()) == [0, LASTING + 1]


def nothing_can_be_written(rig: Any) -> None:
    """A node needs neither log nor cache."""
    with tempfile.TemporaryDirectory() as folder:
        process, detect = started(rig, 'full/service', {'compiled_cache': folder}, 'prlimit', '--fsize=0')
        assert detect() > 0
        rig.session.stop(process)


FAULTS = [
    Scenario('no room for what is saved, for 10 frames', no_room_for_results, 'openpose_ros_node',
             '`frame not saved`: FILE: File too large (ERROR); answers as before; '
             'saves on when there is room'),
    Scenario('no room for log, cache of compiled networks and temporary files', nothing_can_be_written,
             'openpose_ros_node', 'starts and answers'),
]
