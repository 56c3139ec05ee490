"""Checks of tf, and of the axes of frames."""
from typing import Iterator, List, Set

from openpose_ros_bringup.doctor.findings import Finding, other_topic_line, right, unknown, wrong
from openpose_ros_bringup.doctor.snapshot import Camera, Snapshot
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name

# x, y, z [m] and yaw, pitch, roll, to begin with, in a room with z up: of an optical frame and of another frame of a
# camera 1.35 m high and level.
_OPTICAL_MOUNT, _CAMERA_MOUNT = '0 0 1.35 -1.5708 0 -1.5708', '0 0 1.35 0 0 0'
# A camera looks straight up where the vertical part of its axis is greater.
_UPRIGHT = 0.9


def frames_needed(seen: Snapshot, camera: Camera) -> List[str]:
    """Return the frames in which the people of a camera are wanted, without that of the points."""
    node = seen.node_of(camera)
    frames = [seen.fixed_frame] + [frame_name(str(node.parameters.get(key, '')))
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
            found = seen.lookups.get((target, frame), 'not looked up')
            yield (_tf_fault(seen, frame, target, found) if isinstance(found, str)
                   else right(f'{target} <- {frame} at the stamp of the points'))
        if not needed:
            yield right(f"people are in frame '{frame}'; no other frame is named (--fixed-frame FRAME checks one)")


def _tf_fault(seen: Snapshot, frame: str, target: str, error: str) -> Finding:
    root = _root(seen, frame)
    if root == _root(seen, target):
        return wrong(f"tf connects '{target}' and '{frame}', but not at the stamp of the points: {error}",
                     f'rosrun tf tf_monitor {target} {frame}')
    known = sorted({*seen.parents, *seen.parents.values()})
    why = f'tf has {", ".join(known)}' if known else 'nothing comes on /tf and /tf_static'
    mount = _OPTICAL_MOUNT if root == frame or 'optical' in root else _CAMERA_MOUNT
    return wrong(f"tf does not connect '{target}' and '{frame}': {why}",
                 f'rosrun tf2_ros static_transform_publisher {mount} {target} {root}    # x y z yaw pitch roll of '
                 f'{root}')


def _root(seen: Snapshot, frame: str) -> str:
    """Return the frame at the root of a frame's tree."""
    passed: Set[str] = set()
    while frame in seen.parents and frame not in passed:
        passed.add(frame)
        frame = seen.parents[frame]
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
        fixed = seen.fixed_frame
        pose = seen.lookups.get((fixed, points.frame_id), '')
        if not isinstance(pose, str) and 'optical' not in fixed and pose[0][2, 2] > _UPRIGHT:
            parent = seen.parents.get(points.frame_id, fixed)
            yield wrong(f"by tf, in '{fixed}', the camera looks straight up: is '{points.frame_id}' turned as an "
                        'optical frame (x right, y down, z forward)?', 'rosrun tf2_ros static_transform_publisher '
                        f'0 0 0 -1.5708 0 -1.5708 {parent} {points.frame_id}')
        else:
            yield right(f"'{points.frame_id}' is an optical frame: x right, y down, z forward")
