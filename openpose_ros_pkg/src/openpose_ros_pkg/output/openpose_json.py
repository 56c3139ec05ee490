"""OpenPose's JSON files, one per frame, layout 1.3.

Source: OpenPose src/openpose/filestream/fileStream.cpp (savePeopleJson, addKeypointsToJson) and
include/openpose/filestream/wPeopleJsonSaver.hpp; doc/02_output.md.
"""
import json
from typing import Dict, List, Mapping, Optional

import numpy as np

from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.people import People2D

JSON_SUFFIX = '_keypoints.json'
_VERSION = 1.3
# Arrays of points, by the key of a field, by the id of a person.
Fields = Mapping[int, Mapping[str, np.ndarray]]
_MORE_FIELDS = ('face_keypoints_2d', 'hand_left_keypoints_2d', 'hand_right_keypoints_2d', 'pose_keypoints_3d',
                'face_keypoints_3d', 'hand_left_keypoints_3d', 'hand_right_keypoints_3d')


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

    Numbers have as many digits as float32 needs (up to nine).

    Args:
        in_space: (P, K, 4) float32 for pose_keypoints_3d: x, y, z [m] and the score of each joint, finite; None: empty.
        more: finite float32 values of other fields, as of `landmark_fields`; missing people and fields are empty lists.
            Ids below -1 belong to people without an id, and are written as -1.
    """
    entries, rows = [], np.where(people.present[..., None], people.keypoints, np.float32(0))
    for p, (row, person_id) in enumerate(zip(rows, people.ids)):
        entry = {'person_id': [max(int(person_id), -1)], 'pose_keypoints_2d': _numbers(row)}
        own = {} if more is None else more.get(int(person_id), {})
        entry.update((key, _numbers(own[key]) if key in own else []) for key in _MORE_FIELDS)
        if in_space is not None:
            entry['pose_keypoints_3d'] = _numbers(in_space[p])
        entries.append(entry)
    return json.dumps({'version': _VERSION, 'people': entries}, separators=(',', ':'))


def _numbers(values: np.ndarray) -> List[float]:
    """Return float32 values as the shortest numbers that read as the same."""
    return [float(text) for text in values.ravel().astype('U')]
