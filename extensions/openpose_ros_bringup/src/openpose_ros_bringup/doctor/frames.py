"""Checks of tf, and of the axes of frames."""
from difflib import get_close_matches
from typing import Iterator, List, Set

from openpose_ros_bringup.doctor.findings import Finding, launch_line, other_topic_line, right, unknown, wrong
from openpose_ros_bringup.doctor.snapshot import Camera, Lookup, Snapshot, Tf
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name

# x, y, z [m] and yaw, pitch, roll, to begin with, in a room with z up: of an optical frame and of another frame of a
# camera 1.35 m high and level, and of a robot.
_OPTICAL_MOUNT, _CAMERA_MOUNT, _NO_MOUNT = '0 0 1.35 -1.5708 0 -1.5708', '0 0 1.35 0 0 0', '0 0 0 0 0 0'
# A camera looks straight up where the vertical part of its axis is greater.
_UPRIGHT = 0.9


def frames_needed(seen: Snapshot, camera: Camera) -> List[str]:
    """Return the frames in which the people of a camera are wanted, without that of the points."""
    node = seen.node_of(camera)
    frames = [seen.tf.fixed_frame] + [frame_name(str(node.parameters.get(key, '')))
                                     for key in ('tracking_frame', 'target_frame') if node is not None]
    return [frame for frame in dict.fromkeys(frames) if frame and frame != _frame_of(camera)]


def _frame_of(camera: Camera) -> str:
    return (camera.points or camera.image).frame_id


def check_tf(seen: Snapshot) -> Iterator[Finding]:
    """Whether tf connects the frame of the points with those that are wanted, at their stamp."""
    for camera in seen.cameras:
        stream, frame = camera.points or camera.image, _frame_of(camera)
        if not stream.arrivals:
            yield unknown('no message came')
            continue
        if not frame:
            yield wrong(f'{stream.topic} has no frame_id: tf can not place it', f'rostopic echo -n 1 {stream.topic}/'
                                                                                'header    # a parameter of the driver')
            continue
        needed = frames_needed(seen, camera)
        for target in needed:
            found = seen.tf.lookups.get((target, frame), Lookup(error='not looked up'))
            yield (_tf_fault(seen.tf, camera, target, found.error) if found.rotation is None
                   else right(f'{target} <- {frame} at the stamp of the points'))
        if not needed:
            yield right(f"people are in frame '{frame}'; no other frame is named (--fixed-frame FRAME checks one)")


def _tf_fault(tf: Tf, camera: Camera, target: str, error: str) -> Finding:
    frame = _frame_of(camera)
    known = {*tf.parents, *tf.parents.values()}
    names, close = ', '.join(sorted(known)), get_close_matches(target, known, 1)
    if target not in known and close:
        return wrong(f"tf does not know '{target}'; it knows {names}",
                     launch_line(camera, fixed_frame=close[0]))
    root, other = _root(tf, frame), _root(tf, target)
    if root != other:
        why = f'tf has {names}' if known else 'nothing comes on /tf and /tf_static'
        mount = (_OPTICAL_MOUNT if root == frame or 'optical' in root else
                 _CAMERA_MOUNT if 'camera' in root else _NO_MOUNT)
        return wrong(f"tf does not connect '{target}' and '{frame}': {why}",
                     f'rosrun tf2_ros static_transform_publisher {mount} {target} {root}    # x y z yaw pitch roll of '
                     f'{root}')
    return wrong(f"tf connects '{target}' and '{frame}', but not at the stamp of the points: {error}",
                 f'rosrun tf tf_monitor {target} {frame}')


def _root(tf: Tf, frame: str) -> str:
    """Return the frame at the root of a frame's tree."""
    passed: Set[str] = set()
    while frame in tf.parents and frame not in passed:
        passed.add(frame)
        frame = tf.parents[frame]
    return frame


def check_frames(seen: Snapshot) -> Iterator[Finding]:
    """Whether points are in an optical frame, and the camera looks along the floor in the fixed frame.

    A camera that is turned in the image is the node's own warning.
    """
    for camera in seen.cameras:
        points = camera.points
        if points is None or points.points is None:
            yield right('no depth is used') if points is None else unknown('no points came')
            continue
        try:
            points.points.camera_model()
        except BadInputError as error:
            yield wrong(f"{points.topic}, frame '{points.frame_id}': {error}", other_topic_line(camera, points, seen) or
                        f'rostopic echo -n 1 {points.topic}/header    # use the cloud of the driver')
            continue
        fixed = seen.tf.fixed_frame
        pose = seen.tf.lookups.get((fixed, points.frame_id), Lookup())
        if pose.rotation is not None and 'optical' not in fixed and pose.rotation[2, 2] > _UPRIGHT:
            parent = seen.tf.parents.get(points.frame_id, fixed)
            yield wrong(f"by tf, in '{fixed}', the camera looks straight up: is '{points.frame_id}' turned as an "
                        'optical frame (x right, y down, z forward)?', 'rosrun tf2_ros static_transform_publisher '
                        f'0 0 0 -1.5708 0 -1.5708 {parent} {points.frame_id}')
        else:
            yield right(f"'{points.frame_id}' is an optical frame: x right, y down, z forward")
