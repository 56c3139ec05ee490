"""Checks of the nodes that find people: load, and subscribers of their results."""
from contextlib import suppress
from typing import Iterator

from openpose_ros_bringup.doctor.findings import BRINGUP, Finding, launch_line, right, wrong
from openpose_ros_bringup.doctor.snapshot import Camera, ChainNode, Snapshot

# Least rate of results, as a share of the images that come, or of target_rate.
_LEAST_SHARE = 0.6
_LEAST_MEMORY = 500.0  # available [MB]
# A warning that a bag in a loop causes.
_NORMAL = 'time jumped back'
_RESULTS = '/openpose_ros/skeleton_3d/detected_poses_3d'
_MARKERS = 'visualization_markers'


def check_load(seen: Snapshot) -> Iterator[Finding]:
    """Whether the machine keeps up with the images."""
    machine = seen.machine
    faults = [fault for camera in seen.cameras for node in [seen.node_of(camera)] if node is not None and not node.rests
              for fault in _rate_fault(seen, camera, node)]
    if machine.memory < _LEAST_MEMORY:
        faults.append(wrong(f'{machine.memory:.0f} MB of memory are available', 'top -o %MEM'))
    yield from faults
    if not faults:
        yield right('; '.join([f'this machine: {machine.load:.1f} programs run on {machine.cores} cores',
                               f'{machine.memory:.0f} MB of memory are available',
                               *(f'{node.name}: {_rate(seen, node):.1f} Hz' for node in seen.nodes
                                 if not node.rests)]))


def _rate_fault(seen: Snapshot, camera: Camera, node: ChainNode) -> Iterator[Finding]:
    rate, wanted = _rate(seen, node), camera.image.rate
    target = node.parameters.get('target_rate')
    if isinstance(target, (int, float)) and target > 0:
        wanted = min(wanted, target)
    if 0 < rate < _LEAST_SHARE * wanted:
        uses_cloud = camera.points is not None and camera.points.role == 'points'
        yield wrong(f'{node.name}: {rate:.1f} results per second of {wanted:.1f} that are wanted, '
                    f'{node.skipped:.1f} images skipped per second; {seen.machine.load:.1f} programs want to run on '
                    f'{seen.machine.cores} cores', launch_line(camera, mode='fast', target_rate='10') + (
                        '    # a depth image (depth:=TOPIC) helps more, where there is one' if uses_cloud else ''))


def _rate(seen: Snapshot, node: ChainNode) -> float:
    """Return the rate of results [Hz]: that of the last 5 s, or that which came, where the node began a moment ago."""
    working = sum(not other.rests for other in seen.nodes)
    came = seen.people.frames / seen.seconds / working if seen.people is not None else 0.0
    with suppress(ValueError):
        return max(float(node.values.get('rate [Hz]', '0')), came)
    return came


def check_subscribers(seen: Snapshot) -> Iterator[Finding]:
    """Whether the chain runs, its results are wanted, there are people in them, and recorders write."""
    for level, text, folder in seen.recorders:
        yield wrong(text, f"df -h '{folder}'") if level else right(text)
    for name in seen.unresponsive:
        yield wrong(f'{name} publishes results, but no status on /diagnostics: it hangs, or has ended',
                    f'rosnode ping -c 1 {name} || rosnode cleanup')
    for name in seen.starting:
        yield wrong(f'{name} is not ready: it loads its networks, or waits for its camera',
                    'rostopic echo /rosout_agg/msg    # its log; then ask the doctor again')
    if not seen.nodes:
        if not (seen.unresponsive or seen.starting):
            yield wrong('no node finds people: the chain does not run',
                        launch_line(seen.cameras[0], rviz='true') if seen.cameras
                        else f'{BRINGUP} camera:=NAME rviz:=true')
        return
    for camera in seen.cameras:
        if not camera.node:
            yield wrong(f'{", ".join(node.name for node in seen.nodes)} reads other topics than {camera.image.topic}',
                        launch_line(camera))
    for node in seen.nodes:
        yield _demand_of(node, seen)
    yield from _viewers(seen)


def _demand_of(node: ChainNode, seen: Snapshot) -> Finding:
    if node.text.startswith('disabled'):
        return wrong(f'{node.name} is disabled', f'rosservice call {node.name}/enable true')
    if node.rests:
        return wrong(f'{node.name} rests: no node subscribes to its results',
                     f'rostopic hz {node.results or _RESULTS}    # or RViz: rosrun openpose_ros_bringup view')
    if node.level != 0 and not node.text.startswith(_NORMAL):
        return wrong(f'{node.name}: {node.text}', f'rosnode info {node.name}')
    people = '' if seen.people is None else (f'; {seen.people.most} people in {seen.people.frames} results'
                                             + ('' if seen.people.most else ': is anyone in view?'))
    return right(f'{node.name} works{people}')


def _viewers(seen: Snapshot) -> Iterator[Finding]:
    """Tell where nodes wait for people as markers, and no node publishes any."""
    wanted = {topic: nodes for topic, nodes in sorted(seen.subscribed.items()) if topic.endswith(_MARKERS) and nodes}
    if wanted and not any(topic in seen.published for topic in wanted):
        topic, nodes = next(iter(wanted.items()))
        yield wrong(f'{", ".join(nodes)} waits for {topic}, which no node publishes',
                    'rosrun skeleton_extract_3d skeleton_extract_3d_visualization_node')
