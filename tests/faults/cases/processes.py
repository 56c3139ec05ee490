"""Nodes that are started wrongly, stopped or killed, and parameters that are changed wrongly."""
import os
import signal
from contextlib import suppress
from typing import Any

from faults.fault import Fault, Scenario
from faults.injectors import NAN, Injector, refused

NODE, SERVICE = 'two/extractor', 'two/service'
PEOPLE = 'skeleton_extract_3d/scripts/people_3d_node'


def until_counted(chain: Any) -> None:
    """Send frames until the extractor has counted one that the service did not answer."""
    from session import await_true
    before = chain.diagnostics.count(NODE, 'service call failed')
    chain.send(chain.frame())
    await_true(lambda: chain.diagnostics.count(NODE, 'service call failed') > before, 'the call fails')


def hang(chain: Any) -> None:
    os.kill(chain.processes[SERVICE].pid, signal.SIGSTOP)
    try:
        until_counted(chain)
    finally:
        os.kill(chain.processes[SERVICE].pid, signal.SIGCONT)


def kill(chain: Any) -> None:
    import rospy
    chain.processes[SERVICE].kill()
    chain.processes[SERVICE].wait()
    until_counted(chain)
    chain.restart(SERVICE)
    rospy.wait_for_service(chain.topic('detect_poses_3d'), 60.0)


def set_live(**values: Any) -> Injector:
    """Return what sets parameters by the service of dynamic_reconfigure, without the checks of its client.

    It is refused by an error, or the answer shows that nothing was changed.
    """
    def inject(chain: Any) -> None:
        import rospy
        from dynamic_reconfigure.encoding import decode_config, encode_config
        from dynamic_reconfigure.srv import Reconfigure
        set_parameters = rospy.ServiceProxy(chain.topic('people/set_parameters'), Reconfigure)
        before = decode_config(set_parameters(encode_config({})).config)
        with suppress(rospy.ServiceException):
            set_parameters(encode_config(values))
        assert decode_config(set_parameters(encode_config({})).config) == before
    return inject


FAULTS = [
    Scenario('unknown name of a parameter', refused(PEOPLE, {'no_such_parameter': 1}, "'no_such_parameter'"),
             'people_3d_node', 'ends with 1 and names it'),
    Scenario('value that is not allowed', refused(PEOPLE, {'mode': 'fastest'}, "'mode'", "'fastest'"), 'people_3d_node',
             'ends with 1 and names key, value and what is allowed'),
    Fault('service hangs for more than service_timeout, then goes on', hang, NODE, 'service call failed',
          ('/two/detect_poses_3d: no answer within 1 s',)),
    Fault('service is killed, and started again', kill, NODE, 'service call failed', ('/two/detect_poses_3d',)),
    Fault('live parameter set to NaN', set_live(person_min_score=NAN), event=''),
    Fault('unknown live parameter', set_live(no_such_parameter=1.0), event=''),
]
