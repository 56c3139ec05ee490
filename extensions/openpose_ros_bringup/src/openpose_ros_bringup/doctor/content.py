"""Checks of what messages hold: encodings, stamps, registration."""
from typing import Iterator, List, Optional, Sequence

from openpose_ros_bringup.doctor.findings import Finding, other_topic_line, right, unknown, wrong
from openpose_ros_bringup.doctor.snapshot import Camera, Master, Snapshot, Stream
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream.pairing import PAIRING
from skeleton_extract_3d.points.camera import check_same_aspect
from skeleton_extract_3d.points.plausibility import registration_fault
from skeleton_extract_3d.points.transform import is_same_place

_DEPTH = ('16UC1', '32FC1')  # encodings of depth images alone
# Ages of messages when they come; others are of another clock, or of a recording without its clock [s].
_AGES, _AGES_IN_RECORDINGS = (-0.05, 1.0), (-10.0, 10.0)
# Ages of images and points that come together differ by less [s].
_APART = 1.0
# A recording is older [s].
_RECORDED = 3600.0
_NO_MESSAGE = 'no message came'


def check_encodings(seen: Snapshot) -> Iterator[Finding]:
    """Whether images, points and calibrations can be read, and depth is in metres."""
    for camera in seen.cameras:
        for stream in camera.streams:
            if not stream.arrivals:
                yield unknown(_NO_MESSAGE)
            else:
                yield _encoding_fault(camera, stream, seen) or right(
                    f'{stream.topic}: {" x ".join(map(str, stream.size))} {stream.encoding}'.rstrip())


def _encoding_fault(camera: Camera, stream: Stream, seen: Snapshot) -> Optional[Finding]:
    look = f'rostopic echo -n 1 --noarr {stream.topic}'
    other = other_topic_line(camera, stream, seen) or camera.driver or look
    if stream.role == 'image' and stream.encoding in _DEPTH:
        return wrong(f'{stream.topic} is a depth image ({stream.encoding}), expected the colour image', other)
    if stream.fault and stream.role == 'camera_info':
        other = f'rosrun camera_calibration cameracalibrator.py --size 8x6 --square 0.025 image:={camera.image.topic}'
    elif 'compressed depth' in stream.fault:
        other = f'rosrun dynamic_reconfigure dynparam set {stream.topic} format png'
    if stream.fault:
        return wrong(f'{stream.topic}: {stream.fault}', other)
    doubt = stream.doubt
    hint = '    # float32 depth is in metres (REP 118): a setting of the driver'
    return doubt and wrong(f'{stream.topic}: {doubt.text}', other_topic_line(camera, stream, seen, registered=True)
                           or look + hint * (doubt.event == 'implausible depth'))


def check_stamps(seen: Snapshot) -> Iterator[Finding]:
    """Whether stamps are set, increase, and are of this time."""
    for camera in seen.cameras:
        came = [stream for stream in camera.streams[:2] if stream.arrivals]
        faults = [fault for stream in came for fault in _stamp_faults(stream, seen)] or [*_apart(came, seen.master)]
        yield from faults
        if not came:
            yield unknown(_NO_MESSAGE)
        elif not faults:
            yield right('; '.join(f'{stream.topic} {stream.age:.3f} s old' for stream in came)
                        if seen.master.time_passes else 'stamps increase')


def _stamp_faults(stream: Stream, seen: Snapshot) -> Iterator[Finding]:
    stamps = [arrival.stamp for arrival in stream.arrivals]
    if not all(stamps):
        yield wrong(f'{stream.topic}: {stamps.count(0)} of {len(stamps)} messages have stamp 0: the driver has to fill '
                    'header.stamp', f'rostopic echo -n 3 {stream.topic}/header    # stamp: secs 0; update the driver')
        return
    backwards = sum(-PAIRING.reset_backstep <= later - earlier <= 0 for earlier, later in zip(stamps, stamps[1:]))
    nodes = seen.published[stream.topic].nodes if stream.topic in seen.published else ()
    if backwards:
        cause = f'two nodes publish it: {", ".join(nodes)}' if len(nodes) > 1 else 'the driver repeats messages'
        yield wrong(f'{stream.topic}: {backwards} of {len(stamps)} stamps are not newer than the one before: {cause}',
                    f'rosnode kill {nodes[-1]}' if len(nodes) > 1 else f'rostopic echo {stream.topic}/header/stamp')
    yield from _age_fault(stream, seen.master, ', '.join(nodes))


def _apart(streams: Sequence[Stream], master: Master) -> Iterator[Finding]:
    if len(streams) == 2 and master.time_passes:
        image, points = streams
        later = image.age - points.age
        if abs(later) > _APART:
            order = 'ahead of' if later > 0 else 'behind'
            yield wrong(f'{points.topic}: stamps are {abs(later):.3g} s {order} those of {image.topic} that come '
                        'at the same time: they are paired by stamp',
                        f'rostopic delay {points.topic}    # of both topics; their drivers need one clock')


def _age_fault(stream: Stream, master: Master, nodes: str) -> Iterator[Finding]:
    age, (least, most) = stream.age, _AGES_IN_RECORDINGS if master.sim_time else _AGES
    if least <= age <= most or not master.time_passes:
        return
    text = f'{stream.topic}: stamps are {abs(age):.3g} s {"behind" if age > 0 else "ahead of"}'
    if master.sim_time:
        yield wrong(f'{text} /clock: {nodes} takes another time', 'rosparam set use_sim_time false    # for a camera; '
                    'with a bag, end the driver that runs beside it')
    elif age > _RECORDED:
        yield wrong(f'{text} the clock: a recording that is played without its own',
                    'rosparam set use_sim_time true && rosbag play --clock FILE.bag')
    else:
        yield wrong(f'{text} the clock of this machine: clocks differ, or messages of {nodes} come late',
                    'chronyc tracking    # on both machines; ROS needs clocks that agree')


def check_registration(seen: Snapshot) -> Iterator[Finding]:
    """Whether the points are those of the image's pixels."""
    for camera in seen.cameras:
        points = camera.points
        if points is None:
            yield right(f'{camera.image.topic}: no depth is used')
        elif not (points.arrivals and camera.image.arrivals):
            yield unknown(_NO_MESSAGE)
        else:
            faults = _registration_faults(camera, points, seen)
            for fault in faults[:1]:  # those that follow are consequences of the first
                yield wrong(f'{points.topic}: {fault}', other_topic_line(camera, points, seen, registered=True)
                            or camera.driver or f'rostopic echo -n 1 --noarr {points.topic}    # '
                                                'depth_image_proc/register registers depth images')
            if not faults:
                yield right(f'{points.topic} has the view and frame of {camera.image.topic}')


def _registration_faults(camera: Camera, points: Stream, seen: Snapshot) -> List[str]:
    faults, image = [], camera.image
    calibration = None if camera.colour_info is None else camera.colour_info.calibration
    fault = '' if points.points is None else registration_fault(points.points, calibration)
    if fault:
        faults.append(fault)
    elif all(image.size) and all(points.size):
        try:
            check_same_aspect('image', image.size, 'depth', points.size)
        except BadInputError as error:
            faults.append(str(error))
    between = seen.lookups.get((image.frame_id, points.frame_id), '')
    if points.frame_id != image.frame_id and (isinstance(between, str) or not is_same_place(*between)):
        faults.append(f"it is in frame '{points.frame_id}', but the image in '{image.frame_id}': it is not registered "
                      'to the colour image')
    node = seen.node_of(camera)
    if node is not None and 'people do not fit the depth' in node.text:
        faults.append(node.text)
    return faults
