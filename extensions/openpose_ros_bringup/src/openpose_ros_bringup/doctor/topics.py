"""Checks of the master, the topics and their rates."""
from typing import Iterator, Optional

from openpose_ros_bringup.doctor.findings import (
    BRINGUP,
    Finding,
    launch_line,
    other_topic_line,
    others_like,
    right,
    unknown,
    wrong,
)
from openpose_ros_bringup.doctor.snapshot import Camera, Master, Snapshot, Stream
from openpose_ros_pkg.params.camera_presets import COMPRESSED, IMAGE
from openpose_ros_pkg.stream.silent_topic import why_clock_stands, why_silent

# Least rate of images and points [Hz]: at less, people are not followed from one image to the next.
LEAST_RATE = 2.0
# Where the camera is not known.
DRIVER = f'{BRINGUP} camera:=NAME driver:=true'
_TRANSPORTS = {'image': 'compressed', 'depth': 'compressedDepth'}


def check_master(seen: Snapshot) -> Iterator[Finding]:
    """Whether the master answers, nodes can be called, and time passes."""
    master = seen.master
    if not master.is_online:
        yield wrong(f'the ROS master {master.uri} does not answer', 'roscore')
        return
    for node, uri in master.unreachable.items():
        yield wrong(f'{node} is registered at {uri}, where it takes no calls: it has ended, or its machine has another '
                    'name here (ROS_IP and ROS_HOSTNAME there)', 'rosnode cleanup')
    fault = _clock_fault(master, seen)
    if fault is not None:
        yield fault
    elif not master.unreachable:
        time = f'simulated time, {master.clock:.1f} s' if master.sim_time else 'time of the machine'
        yield right(f'{master.uri} answers; {time}')


def _clock_fault(master: Master, seen: Snapshot) -> Optional[Finding]:
    """Return what is wrong with simulated time."""
    if not master.sim_time:
        return None if master.ticks == 0 else wrong(
            '/clock is published, but use_sim_time is false: nodes take the time of the machine',
            'rosparam set use_sim_time true    # then start the nodes again')
    if '/clock' in seen.published and master.ticks >= 2:
        return None
    newest = master.clock if '/clock' in seen.published else 0
    return wrong(why_clock_stands(newest), 'rosbag play --clock FILE.bag    # ' + (
        'a paused one goes on with the space bar' if newest else 'without a bag: rosparam set use_sim_time false'))


def check_topics(seen: Snapshot) -> Iterator[Finding]:
    """Whether the topics are published with the right types."""
    if not seen.cameras:
        images = others_like(Stream('image', '/rgb/image_color', IMAGE), seen)
        yield (wrong(f'no camera of cameras.yaml is published; there are {", ".join(images)}',
                     f'rosrun openpose_ros_bringup doctor --image {images[0]}    # and --depth, or --points') if images
               else wrong('no node publishes a colour image', DRIVER))
    for camera in seen.cameras:
        for stream in camera.streams:
            there = seen.published.get(stream.topic)
            if there is not None and there.kind == stream.kind:
                yield right(f'{stream.topic} ({stream.kind}) by {", ".join(there.nodes)}')
            else:
                why = why_silent(stream.topic, stream.kind, seen.published, stream.is_connected, '')
                yield wrong(f'{stream.topic}: {why}', _line_of_topic(camera, stream, seen))


def _line_of_topic(camera: Camera, stream: Stream, seen: Snapshot) -> str:
    """Return what to type where a topic is not published, or with another type."""
    base, transport = stream.topic, _TRANSPORTS.get(stream.role, '')
    if stream.kind == COMPRESSED:
        base, transport = base.rpartition('/')[0], 'raw'
    if stream.role in _TRANSPORTS and (base if transport == 'raw' else f'{base}/{transport}') in seen.published:
        return launch_line(camera, **{stream.role: base, f'{stream.role}_transport': transport})
    line = other_topic_line(camera, stream, seen) or camera.driver
    published = [each is not None and each.topic in seen.published for each in (camera.image, camera.points)]
    if not line and camera.points is not None and published == [True, False]:
        line = launch_line(camera, points='none') + '    # people in the image alone; in space they need depth'
    return line or DRIVER


def check_rates(seen: Snapshot) -> Iterator[Finding]:
    """Whether messages come, and often enough."""
    for camera in seen.cameras:
        for stream in camera.streams:
            there = seen.published.get(stream.topic)
            if there is None or there.kind != stream.kind:
                yield unknown('a topic is missing')
            elif not stream.arrivals:
                why = why_silent(stream.topic, stream.kind, seen.published, stream.is_connected, '')
                node = there.nodes[0] if there.nodes else 'NODE'
                yield wrong(f'no message on {stream.topic}: {why.partition("; ")[0]}',
                            camera.driver or f'rosnode info {node}' if stream.is_connected else f'rosnode ping {node}')
            elif stream is camera.info:
                yield right(f'{stream.topic} came')
            elif stream.rate < LEAST_RATE:
                came = f'{stream.rate:.2g} Hz' if stream.rate else f'one message in {seen.seconds:g} s'
                yield wrong(f'{stream.topic}: {came}, expected {LEAST_RATE:g} Hz or more: dim light, a slow bus or '
                            'network, or a slow driver', f'rostopic bw {stream.topic}')
            else:
                yield right(f'{stream.topic}: {stream.rate:.1f} Hz')
