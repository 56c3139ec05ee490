"""Checks of the nodes that find people: load, and subscribers of their results."""
import os
from contextlib import suppress
from typing import Iterator

from openpose_ros_bringup.doctor.findings import BRINGUP, Finding, launch_line, right, wrong
from openpose_ros_bringup.doctor.snapshot import ChainNode, Snapshot
from skeleton_extract_3d.points.plausibility import NO_DEPTH

# Least rate of results, as a share of the images that come, or of target_rate.
_LEAST_SHARE = 0.6
_LEAST_MEMORY = 500.0  # available [MB]
# A warning that a bag in a loop causes.
_NORMAL = 'time jumped back'
_RESULTS = '/openpose_ros/skeleton_3d/detected_poses_3d'
_MARKERS = 'visualization_markers'


def check_load(seen: Snapshot) -> Iterator[Finding]:
    """Whether the machine keeps up with the images."""
    found = [_rate_of(seen, node) for node in seen.nodes if not node.rests]
    if seen.memory < _LEAST_MEMORY:
        found.append(wrong(f'{seen.memory:.0f} MB of memory are available', 'top -o %MEM'))
    yield from found or [right(f'{seen.load:.1f} programs run on {os.cpu_count()} cores')]


def _rate_of(seen: Snapshot, node: ChainNode) -> Finding:
    """Tell whether a node gives results as often as images come, or as `target_rate` says."""
    # its own rate, of the last 5 s, or that which came, where it began a moment ago
    working = sum(not other.rests for other in seen.nodes)
    rate = len(seen.people) / seen.seconds / working if seen.people is not None else 0.0
    with suppress(ValueError):
        rate = max(float(node.values.get('rate [Hz]', '0')), rate)
    camera = next((camera for camera in seen.cameras if camera.node == node.name), None)
    wanted, target = camera.image.rate if camera else 0.0, node.parameters.get('target_rate')
    if isinstance(target, (int, float)) and target > 0:
        wanted = min(wanted, target)
    if camera is None or rate == 0 or rate >= _LEAST_SHARE * wanted:
        return right(f'{node.name}: {rate:.1f} Hz')
    return wrong(f'{node.name}: {rate:.1f} results per second of {wanted:.1f} that are wanted; {seen.load:.1f} '
                 f'programs want to run on {os.cpu_count()} cores', launch_line(camera, mode='fast', target_rate='10'))


def check_subscribers(seen: Snapshot) -> Iterator[Finding]:
    """Whether the chain runs, its results are wanted, and there are people in them."""
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
    # nodes that wait for people as markers, which no node publishes
    wanted = {topic: nodes for topic, nodes in sorted(seen.subscribed.items()) if topic.endswith(_MARKERS) and nodes}
    if wanted and not any(topic in seen.published for topic in wanted):
        topic, nodes = next(iter(wanted.items()))
        yield wrong(f'{", ".join(nodes)} waits for {topic}, which no node publishes',
                    'rosrun skeleton_extract_3d skeleton_extract_3d_visualization_node')


def _is_over(node: ChainNode, seen: Snapshot) -> bool:
    """Return whether a node warns of frames without depth, and depth has come since: its camera was covered."""
    points = [camera.points for camera in seen.cameras if camera.node == node.name]
    return node.text.startswith(NO_DEPTH) and bool(points) and all(
        each is not None and each.points is not None and each.doubt is None for each in points)


def _demand_of(node: ChainNode, seen: Snapshot) -> Finding:
    if node.text.startswith('disabled'):
        return wrong(f'{node.name} is disabled', f'rosservice call {node.name}/enable true')
    if node.rests:
        return wrong(f'{node.name} rests: no node subscribes to its results',
                     f'rostopic hz {node.results or _RESULTS}    # or RViz: rosrun openpose_ros_bringup view')
    if node.level != 0 and not node.text.startswith(_NORMAL) and not _is_over(node, seen):
        return wrong(f'{node.name}: {node.text}', f'rosnode info {node.name}')
    if seen.people is None:
        return right(f'{node.name} works')
    most = max(seen.people, default=0)
    return right(f'{node.name} works; {most} {"person" if most == 1 else "people"} in {len(seen.people)} results'
                 + ('' if most else ': are people in view?'))
