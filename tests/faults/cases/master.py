"""The ROS master goes and comes, and a second node takes a service."""
import socket
import subprocess
from typing import Any

from faults.fault import Scenario

# Within this time after the master is back the whole chain is registered again [s].
FOUND_AGAIN = 10.0
SERVICE = '/two/detect_poses_3d'


def await_text(rig: Any, node: str, text: str) -> None:
    """Wait until a node has said this in /diagnostics."""
    from session import await_true
    await_true(lambda: any(text in said for said in rig.diagnostics.texts(node)), f'{node} says {text!r}')


def restarted_master(rig: Any) -> None:
    """Stop the master and start it again; then a new subscriber gets results, over the service of another node."""
    import rosgraph
    import rospy

    from session import await_true
    chain = rig.chain('two/service')
    master = rosgraph.Master('/faults')
    known = {name for kind in master.getSystemState() for name, _ in kind if name.startswith('/two/')}
    parameters = rospy.get_param('/two/service')
    rig.session.stop(rig.session.master)
    chain.send(chain.frame())
    await_text(rig, 'two/extractor', 'does not answer')
    rig.session.start_master()

    def missing() -> Any:
        return known - {name for kind in master.getSystemState() for name, _ in kind}
    await_true(lambda: not missing(), lambda: f'registered anew: {missing()}', FOUND_AGAIN)
    topic = chain.topic('openpose_ros/skeleton_3d/detected_poses_3d')
    listener = subprocess.Popen(['rostopic', 'echo', '-n', '1', f'{topic}/header'])
    try:
        await_true(lambda: chain.result_of_good_frame() and listener.poll() is not None, f'a new subscriber of {topic}')
    finally:
        listener.kill()
        listener.wait()
    assert rospy.get_param('/two/service') == parameters
    await_text(rig, 'two/service', 'registered anew')


def second_server(rig: Any) -> None:
    """Let somebody else register a service of a node, who runs for a while and ends."""
    import rosgraph

    from session import await_true
    chain, master = rig.chain('two/service'), rosgraph.Master('/second')
    before = rig.diagnostics.count('two/service', 'registered anew')
    with socket.socket() as listener:
        listener.bind(('localhost', 0))
        listener.listen(20)
        uri = f'rosrpc://localhost:{listener.getsockname()[1]}'
        master.registerService(SERVICE, uri, 'http://localhost:1/')
        await_text(rig, 'two/service', f'another running node gets the requests for {SERVICE}')
        assert master.lookupService(SERVICE) == uri  # nobody fights over it
        master.unregisterService(SERVICE, uri)
    await_true(lambda: rig.diagnostics.count('two/service', 'registered anew') > before, 'the service is found again')
    chain.result_of_good_frame()


FAULTS = [
    Scenario('roscore ends and starts again', restarted_master, 'all', 'a new subscriber gets results within 10 s'),
    Scenario('a second node serves detect_poses_3d, and ends', second_server, 'openpose_ros_node_3d',
             'says so as long as it runs, then serves again: `registered anew`'),
]
