"""The people of several cameras, out of bags, tables and running topics, for the calibration of the cameras."""
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np
import rosgraph
import roslib.message
import rospy
from sensor_msgs.msg import CameraInfo

from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.camera_presets import CAMERA_INFO
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.ros.topics import DIMENSIONS, IN_IMAGE, IN_SPACE, is_within, people_topics
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.calibration.recording import CameraRecording
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.ros.bag_files import open_bag, parts_of_recordings, topic_types
from openpose_ros_tools.ros.keypoints.keypoint_bag import bag_messages, read_keypoint_bag, rows_of
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import KeypointTable, PersonRow, measured_people, table_of
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera
from skeleton_extract_3d.ros.convert import camera_from_message

# Topics of people below the namespace of a camera.
_EXPECTED = f'NAMESPACE/{IN_SPACE}/detected_poses_3d or {IN_IMAGE}/detected_poses'
_COLUMNS = [MESSAGE_JOINTS.index(joint) for joint in COCO_18.joints]
_NO_PEOPLE = ('rosrun openpose_ros_tools process_bag BAG finds the people of images and depth images; '
              'calibrate_cameras reads what it writes')
# A running topic is looked for in this period [s].
_PAUSE = 0.2


class CameraOptions(NamedTuple):
    """What the user says of the cameras.

    Attributes:
        names: cameras that count, the first one is the root; empty: all, by name.
        calibrations: files by camera, where no CameraInfo is recorded.
        rectified: images without depth are rectified.
    """

    names: Sequence[str] = ()
    calibrations: Mapping[str, Path] = {}
    rectified: bool = False


def recordings_of_files(paths: Sequence[Path], options: CameraOptions) -> List[CameraRecording]:
    """Return the people of all cameras in bags and CSV files.

    A camera is named by the namespace of its topics; where this is the root, or in a CSV, by the file, of parts of one
    recording by the first. Bags with the same camera are parts of one recording.

    Raises:
        BadInputError: a file can not be read, or holds no people; the text says how to get them.
    """
    tables: Dict[str, List[KeypointTable]] = {}
    models: Dict[str, CameraModel] = {}
    bags = [path for path in paths if is_bag(path)]
    names = {path: parts[0].stem for parts in parts_of_recordings(bags) for path in parts}
    for path in paths:
        if path not in names:
            tables.setdefault(path.stem, []).append(read_keypoint_csv(path))
            continue
        with open_bag(path) as bag:
            types = topic_types(bag)
        topics = people_topics(types)
        if not topics:
            raise BadInputError(f'{path} has no people of a camera ({_EXPECTED}); '
                                f'{_NO_PEOPLE}')
        for namespace, topic in topics.items():
            name = namespace or names[path]
            table = read_keypoint_bag(path, topic)
            tables.setdefault(name, []).append(table)
            model = _model_of_bag(path, types, namespace, table, options.rectified)
            if model is not None:
                models.setdefault(name, model)
    return _recordings({name: _joined(name, parts) for name, parts in tables.items()}, models, options)


def recordings_of_topics(seconds: float, options: CameraOptions) -> List[CameraRecording]:
    """Return the people of all cameras that publish them, of some time [s] from the first message on.

    Raises:
        BadInputError: there is no master, or no person was seen.
    """
    if not rosgraph.is_master_online():
        raise BadInputError(f'there is no ROS master at {rosgraph.get_master_uri()}; start one, or give bags')
    rospy.init_node('calibrate_cameras', anonymous=True, disable_signals=True)
    types = dict(rospy.get_published_topics())
    topics = {namespace or 'camera': topic for namespace, topic in people_topics(types).items()}
    if not topics:
        raise BadInputError(f'no camera publishes people ({_EXPECTED})')
    messages: Dict[str, List[Any]] = {name: [] for name in topics}
    infos: List[Tuple[str, CameraInfo]] = []
    with ExitStack() as stack:
        for name, topic in topics.items():
            kind = roslib.message.get_message_class(types[topic])
            stack.callback(rospy.Subscriber(topic, kind, messages[name].append).unregister)
        for topic in (topic for topic, kind in types.items() if kind == CAMERA_INFO):
            stack.callback(rospy.Subscriber(topic, CameraInfo, lambda info, topic=topic: infos.append((topic, info))
                                            ).unregister)
        begin: Optional[float] = None
        while begin is None or time.monotonic() - begin < seconds:
            time.sleep(_PAUSE)
            if begin is None and any(messages.values()):
                begin = time.monotonic()
    tables, models = {}, {}
    for name, topic in topics.items():
        dimensions = DIMENSIONS[types[topic]]
        rows: List[PersonRow] = [row for message in list(messages[name]) for row in rows_of(message, dimensions)]
        tables[name] = table_of(rows, dimensions)
        model = _model_of(infos, '' if name == 'camera' else name, tables[name], options.rectified)
        if model is not None:
            models[name] = model
    return _recordings(tables, models, options)


def _recordings(tables: Mapping[str, KeypointTable], models: Mapping[str, CameraModel],
                options: CameraOptions) -> List[CameraRecording]:
    names = list(options.names) or sorted(tables)
    for name in (*names, *options.calibrations):
        if name not in tables:
            raise BadInputError(f"there is no camera '{name}'; there are {', '.join(sorted(tables))}")
    given = {name: calibrated_camera(read_calibration(path)) for name, path in options.calibrations.items()}
    return [_recording(name, tables[name], given.get(name, models.get(name))) for name in names]


def _recording(name: str, table: KeypointTable, model: Optional[CameraModel]) -> CameraRecording:
    """Return the recording of a table; in the image, rays through the keypoints."""
    frames: Set[str] = set(table.frame_ids.tolist()) - {''}
    if len(frames) > 1:
        raise BadInputError(f'the people of {name} are in several frames: {", ".join(sorted(frames))}')
    frame = frames.pop() if frames else f'{name.replace("/", "_")}_optical_frame'
    focal = float('nan') if model is None else float(np.sqrt(model.matrix[0, 0] * model.matrix[1, 1]))
    if table.dimensions == 3:
        people = measured_people(table)
        return CameraRecording(name, frame, people.stamps, people.ids, people.positions[:, _COLUMNS],
                               people.sigma[:, _COLUMNS], True, focal)
    if model is None:
        raise BadInputError(f'the people of {name} are in the image alone and no CameraInfo is recorded for its frame '
                            f"'{frame}'; give its calibration: --camera-info {name}=FILE")
    points = model.rays(table.positions[:, _COLUMNS].reshape(-1, 2)).reshape(len(table), len(_COLUMNS), 3)
    sigma = np.full(points.shape[:2], np.nan)
    return CameraRecording(name, frame, table.stamps, table.ids, points, sigma, False, focal)


def _joined(name: str, parts: Sequence[KeypointTable]) -> KeypointTable:
    if len({part.dimensions for part in parts}) > 1:
        raise BadInputError(f'camera {name} has depth in some of the files only')
    ids, first = [], 0
    for part in parts:  # ids begin anew in each file
        ids.append(part.ids + first)
        first = int(ids[-1].max()) + 1 if len(part) else first
    joined = {field: np.concatenate([getattr(part, field) for part in parts])
              for field in ('stamps', 'frame_ids', 'positions', 'confidence', 'status', 'sigma')}
    return KeypointTable(ids=np.concatenate(ids), joints=parts[0].joints, **joined)


def _model_of_bag(path: Path, types: Mapping[str, str], namespace: str, table: KeypointTable, rectified: bool
                  ) -> Optional[CameraModel]:
    with open_bag(path) as bag:
        infos = [(topic, next(bag_messages(bag, topic))[0]) for topic, kind in sorted(types.items())
                 if kind == CAMERA_INFO]
    return _model_of(infos, namespace, table, rectified)


def _model_of(infos: Sequence[Tuple[str, CameraInfo]], namespace: str, table: KeypointTable, rectified: bool
              ) -> Optional[CameraModel]:
    """Return the camera of the CameraInfo whose frame is that of the people; of several, one in the same namespace."""
    frames = set(table.frame_ids.tolist())
    fitting = [(topic, info) for topic, info in infos if frame_name(info.header.frame_id) in frames]
    near = [info for topic, info in fitting if namespace and is_within(topic, namespace)]
    chosen = near or [info for _, info in fitting]
    return camera_from_message(chosen[0], rectified) if chosen else None
