"""OpenPose's files of keypoints, one per frame: JSON of layout 1.3, and the matrix of `write_keypoint`.

Source: OpenPose src/openpose/filestream/fileStream.cpp (savePeopleJson, addKeypointsToJson, saveData) and
keypointSaver.cpp (node `pose_0`: the first view), include/openpose/filestream/wPeopleJsonSaver.hpp and wPoseSaver.hpp.
"""
import json
import re
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Union

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.files import write_whole
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SKELETONS, SkeletonModel
from openpose_ros_pkg.structured_text import json_value

JSON_SUFFIX = '_keypoints.json'
_VERSION = 1.3
# Arrays of points, by the key of a field, by the id of a person.
Fields = Mapping[int, Mapping[str, np.ndarray]]
_MORE_FIELDS = ('face_keypoints_2d', 'hand_left_keypoints_2d', 'hand_right_keypoints_2d', 'pose_keypoints_3d',
                'face_keypoints_3d', 'hand_left_keypoints_3d', 'hand_right_keypoints_3d')
# Formats of the matrix, by the suffix of the file.
FORMATS = {'yml': cv2.FILE_STORAGE_FORMAT_YAML, 'yaml': cv2.FILE_STORAGE_FORMAT_YAML,
           'xml': cv2.FILE_STORAGE_FORMAT_XML, 'json': cv2.FILE_STORAGE_FORMAT_JSON}
_SIZES = re.compile(r'(sizes"?: \[ \d+, \d+, \d+), 1( \])|(<sizes>\s*\d+ \d+ \d+) 1(</sizes>)')


def landmark_fields(landmarks: Landmarks2D) -> Dict[int, Dict[str, np.ndarray]]:
    """Return the points of hands and faces as `people_to_json` takes them."""
    hands, faces = landmarks.hands, landmarks.faces
    found: Dict[int, Dict[str, np.ndarray]] = {}
    for person, left, points in zip(hands.people.tolist(), hands.left.tolist(), hands.keypoints):
        found.setdefault(person, {})[f'hand_{"left" if left else "right"}_keypoints_2d'] = np.nan_to_num(points)
    for person, points in zip(faces.people.tolist(), faces.keypoints):
        found.setdefault(person, {})['face_keypoints_2d'] = np.nan_to_num(points)
    return found


def people_to_json(people: People2D, in_space: Optional[np.ndarray] = None, more: Optional[Fields] = None) -> str:
    """Return the text of OpenPose's JSON file: joints in the order of the people's joint set, missing ones 0, 0, 0.

    Numbers have as many digits as float32 needs (up to nine), so that reading gives the same people to the last bit.

    Args:
        in_space: (P, K, 4) float32 for pose_keypoints_3d: x, y, z [m] and the score of each joint, finite; None: empty.
        more: finite float32 values of other fields, as of `landmark_fields`; missing people and fields are empty lists.
            Ids below -1 belong to people without an id, and are written as -1.
    """
    entries = []
    for p, (row, person_id) in enumerate(zip(_rows(people), people.ids)):
        entry = {'person_id': [max(int(person_id), -1)], 'pose_keypoints_2d': _numbers(row)}
        own = {} if more is None else more.get(int(person_id), {})
        entry.update((key, _numbers(own[key]) if key in own else []) for key in _MORE_FIELDS)
        if in_space is not None:
            entry['pose_keypoints_3d'] = _numbers(in_space[p])
        entries.append(entry)
    return json.dumps({'version': _VERSION, 'people': entries}, separators=(',', ':'))


def people_from_json(text: Union[str, bytes], skeleton: Optional[SkeletonModel] = None,
                     place: str = 'JSON text') -> People2D:
    """Return the people in the text of a JSON file of OpenPose.

    Args:
        skeleton: joint set; None: the one with as many joints.
        place: origin of the text, for errors.

    Returns:
        People in the units of the file. Their score is the mean of their joints', as the layout holds none.

    Raises:
        BadInputError: not such a text, another joint set, or no person while no joint set is named.
    """
    try:
        entries = json_value(text)['people']
        people = [np.array(entry['pose_keypoints_2d'], np.float32).reshape(-1, 3) for entry in entries]
        ids = np.array([entry.get('person_id', [-1])[0] for entry in entries], np.int64)
        rows = np.stack(people) if people else np.zeros((0, 0, 3), np.float32)
    except (ValueError, TypeError, OverflowError, KeyError, IndexError, AttributeError) as error:
        raise BadInputError(f'{place} does not have the layout of OpenPose: {error!r}') from error
    if skeleton is None:
        skeleton = _skeleton_with(rows.shape[1], place)
    joints = len(skeleton.joints)
    if not people:
        return People2D.empty(skeleton)
    if rows.shape[1] != joints:
        raise BadInputError(f'{place}: expected {joints} joints x, y, score of {skeleton.name}, got {rows.shape[1:]}')
    present = np.isfinite(rows).all(axis=2) & (rows[..., 2] > 0)
    keypoints = np.where(present[..., None], rows, np.array([np.nan, np.nan, 0], np.float32)).astype(np.float32)
    return People2D(skeleton, keypoints, keypoints[..., 2].sum(axis=1) / np.maximum(present.sum(axis=1), 1), ids)


def read_json(path: Path, skeleton: Optional[SkeletonModel] = None) -> People2D:
    """Read a file of OpenPose, or one of `people_to_json`; see `people_from_json`.

    Raises:
        BadInputError: the file does not hold what is expected.
        OSError: the file can not be read.
    """
    return people_from_json(Path(path).read_bytes(), skeleton, str(path))


def write_keypoint(path: Path, people: People2D) -> None:
    """Write the people of a frame as OpenPose's --write_keypoint, without ids; the suffix is one of `FORMATS`.

    The matrix is P x K x 3 float32, missing joints 0, 0, 0; it is empty without people.

    Raises:
        OSError: the file can not be written.
    """
    # Python's OpenCV writes a third axis as channels, unlike OpenPose; a fourth axis prevents that and is removed.
    matrix = _rows(people)[..., np.newaxis] if len(people) else np.zeros((0, 0), np.uint8)
    storage = cv2.FileStorage('', cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY | FORMATS[path.suffix[1:]])
    storage.write('pose_0', matrix)
    write_whole(path, _SIZES.sub(r'\1\2\3\4', storage.releaseAndGetString(), count=1).encode())


def _rows(people: People2D) -> np.ndarray:
    """Return (P, K, 3) float32 x, y, score as OpenPose writes it: missing joints are 0, 0, 0."""
    return np.where(people.present[..., None], people.keypoints, np.float32(0))


def _numbers(values: np.ndarray) -> List[float]:
    """Return float32 values as the shortest numbers that read as the same."""
    return [float(text) for text in values.ravel().astype('U')]


def _skeleton_with(joints: int, place: str) -> SkeletonModel:
    if joints == 0:
        raise BadInputError(f'{place} has no person, so its joint set is unknown: name one ({", ".join(SKELETONS)})')
    for skeleton in SKELETONS.values():
        if len(skeleton.joints) == joints:
            return skeleton
    known = ', '.join(f'{name}: {len(skeleton.joints)}' for name, skeleton in SKELETONS.items())
    raise BadInputError(f'{place}: expected the number of joints of a known joint set ({known}), got {joints}')
