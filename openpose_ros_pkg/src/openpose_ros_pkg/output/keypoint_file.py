"""OpenPose's keypoint files (`write_keypoint`): the numbers of a frame as one matrix, XML, YAML or JSON of OpenCV.

Source: OpenPose src/openpose/filestream/keypointSaver.cpp (node `pose_0`: the first view) and fileStream.cpp
(saveData), include/openpose/filestream/wPoseSaver.hpp (file name).
"""
import re
from pathlib import Path
from typing import Optional

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import write_whole
from openpose_ros_pkg.output.joint_order import from_rows, to_rows
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SkeletonModel

FORMATS = ('yml', 'yaml', 'xml', 'json')
_NODE = 'pose_0'
_FLAGS = {'yml': cv2.FILE_STORAGE_FORMAT_YAML, 'yaml': cv2.FILE_STORAGE_FORMAT_YAML,
          'xml': cv2.FILE_STORAGE_FORMAT_XML, 'json': cv2.FILE_STORAGE_FORMAT_JSON}
_SIZES = re.compile(r'(sizes"?: \[ \d+, \d+, \d+), 1( \])|(<sizes>\s*\d+ \d+ \d+) 1(</sizes>)')


def people_to_storage(people: People2D, file_format: str) -> str:
    """Return the text of a keypoint file: a P x K x 3 matrix of float32, missing joints 0, 0, 0; empty without people.

    Args:
        file_format: one of `FORMATS`.
    """
    rows = to_rows(people)
    # Python's OpenCV writes a third axis as channels, unlike OpenPose; a fourth axis prevents that and is removed.
    matrix = rows[..., np.newaxis] if len(rows) else np.zeros((0, 0), np.uint8)
    storage = cv2.FileStorage('', cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY | _FLAGS[file_format])
    storage.write(_NODE, matrix)
    return _SIZES.sub(r'\1\2\3\4', storage.releaseAndGetString(), count=1)


def write_keypoint(path: Path, people: People2D) -> None:
    """Write the people of a frame, without ids and scores, as OpenPose's --write_keypoint; the suffix is the format.

    Raises:
        OSError: the file can not be written.
        ValueError: the suffix is none of `FORMATS`.
    """
    file_format = path.suffix[1:]
    if file_format not in FORMATS:
        raise ValueError(f'{path}: expected a file ending in one of {", ".join(FORMATS)}')
    write_whole(path, people_to_storage(people, file_format).encode())


def read_keypoint(path: Path, skeleton: Optional[SkeletonModel] = None) -> People2D:
    """Read a file of `write_keypoint` or OpenPose.

    Args:
        skeleton: joint set; None: the one with as many joints.

    Returns:
        People without ids. Their score is the mean of their joints', as the file holds none.

    Raises:
        BadInputError: the file holds no such matrix, or another joint set; or no person while no joint set is named.
        OSError: the file can not be read.
    """
    text = Path(path).read_text(errors='replace')
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        node = storage.getNode(_NODE)
        there, matrix = not node.empty(), node.mat()
    except (cv2.error, SystemError) as error:
        raise BadInputError(f'{path} is not a file of OpenCV: {error}') from error
    if not there:
        raise BadInputError(f"{path}: expected a matrix '{_NODE}', there is none")
    if matrix is None or matrix.size == 0:
        matrix = np.zeros((0, 0, 3), np.float32)
    if matrix.ndim != 3 or matrix.shape[2] != 3:
        raise BadInputError(f"{path}: expected a matrix '{_NODE}' of people x joints x 3, got {matrix.shape}")
    return from_rows(matrix.astype(np.float32), np.full(len(matrix), -1), skeleton, str(path))
