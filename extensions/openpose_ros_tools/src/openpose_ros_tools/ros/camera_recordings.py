"""The people of several cameras, out of bags and tables, for the calibration of the cameras."""
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from sensor_msgs.msg import CameraInfo

from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.camera_presets import CAMERA_INFO
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.ros.topics import IN_IMAGE, IN_SPACE, is_within, people_topics
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.calibration.recording import CameraRecording, keypoint_sigma
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.ros.bag_files import open_bag, parts_of_recordings, topic_types
from openpose_ros_tools.ros.keypoints.keypoint_bag import bag_messages, read_keypoints
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera
from skeleton_extract_3d.ros.convert import camera_from_message

# Topics of people below the namespace of a camera.
_EXPECTED = f'NAMESPACE/{IN_SPACE}/detected_poses_3d or {IN_IMAGE}/detected_poses'
_COLUMNS = [MESSAGE_JOINTS.index(joint) for joint in COCO_18.joints]


def recordings_of_files(paths: Sequence[Path], names: Sequence[str], calibrations: Mapping[str, Path], rectified: bool
                        ) -> List[CameraRecording]:
    """Return the people of all cameras in bags and CSV files.

    A camera is named by the namespace of its topics; where this is the root, or in a CSV, by the file, of parts of one
    recording by the first. Bags with the same camera are parts of one recording.

    Args:
        names: cameras that count, the first one is the root; empty: all, by name.
        calibrations: files by camera, where no CameraInfo is recorded.
        rectified: images without depth are rectified.

    Raises:
        BadInputError: a file can not be read, or holds no people; the text says how to get them.
    """
    tables: Dict[str, List[KeypointTable]] = {}
    models: Dict[str, CameraModel] = {}
    first_part = {path: parts[0] for parts in parts_of_recordings(list(filter(is_bag, paths))) for path in parts}
    for path in paths:
        if path not in first_part:
            tables.setdefault(path.stem, []).append(read_keypoint_csv(path))
            continue
        with open_bag(path) as bag:
            types = topic_types(bag)
            infos = [(topic, next(bag_messages(bag, topic))[0]) for topic, kind in sorted(types.items())
                     if kind == CAMERA_INFO]
        topics = people_topics(types)
        if not topics:
            raise BadInputError(f'{path} has no people of a camera ({_EXPECTED}); process_bag finds the people of '
                                'images and depth images')
        for namespace, topic in topics.items():
            name, table = namespace or first_part[path].stem, read_keypoints(path, topic)[0]
            tables.setdefault(name, []).append(table)
            model = _model_of(infos, namespace, table, rectified)
            if model is not None:
                models.setdefault(name, model)
    for name in (*names, *calibrations):
        if name not in tables:
            raise BadInputError(f"there is no camera '{name}'; there are {', '.join(sorted(tables))}")
    models.update({name: calibrated_camera(read_calibration(path)) for name, path in calibrations.items()})
    return [_recording(name, _joined(name, tables[name]), models.get(name)) for name in names or sorted(tables)]


def _recording(name: str, table: KeypointTable, model: Optional[CameraModel]) -> CameraRecording:
    """Return the recording of a table; in the image, rays through the keypoints."""
    frame = table.frame_id(name) or f'{name.replace("/", "_")}_optical_frame'
    focal = float('nan') if model is None else float(np.sqrt(model.matrix[0, 0] * model.matrix[1, 1]))
    if table.dimensions == 3:
        people = table.measured()
        return CameraRecording(name, frame, people.stamps, people.ids, people.positions[:, _COLUMNS].astype(np.float64),
                               people.sigma[:, _COLUMNS].astype(np.float64), True, focal)
    if model is None:
        raise BadInputError(f'the people of {name} are in the image alone and no CameraInfo is recorded for its frame '
                            f"'{frame}'; give its calibration: --camera-info {name}=FILE")
    points = model.rays(table.positions[:, _COLUMNS].reshape(-1, 2)).reshape(len(table), len(_COLUMNS), 3)
    sigma = keypoint_sigma(table.confidence[:, _COLUMNS].astype(np.float64))
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


def _model_of(infos: Sequence[Tuple[str, CameraInfo]], namespace: str, table: KeypointTable, rectified: bool
              ) -> Optional[CameraModel]:
    """Return the camera of the CameraInfo whose frame is that of the people; of several, one in the same namespace."""
    frames = set(table.frame_ids.tolist())
    fitting = [(topic, info) for topic, info in infos if frame_name(info.header.frame_id) in frames]
    near = [info for topic, info in fitting if namespace and is_within(topic, namespace)]
    chosen = near or [info for _, info in fitting]
    return camera_from_message(chosen[0], rectified) if chosen else None
