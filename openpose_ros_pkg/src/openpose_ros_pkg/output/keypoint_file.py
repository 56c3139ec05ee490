"""OpenPose's keypoint files (`write_keypoint`): the numbers of a frame as one matrix, XML, YAML or JSON of OpenCV.

Source: OpenPose src/openpose/filestream/keypointSaver.cpp (node `pose_0`: the first view) and fileStream.cpp
(saveData), include/openpose/filestream/wPoseSaver.hpp (file name).
"""
import re
from pathlib import Path

import cv2
import numpy as np

from openpose_ros_pkg.output.files import write_whole
from openpose_ros_pkg.output.joint_order import to_rows
from openpose_ros_pkg.people import People2D

FORMATS = ('yml', 'yaml', 'xml', 'json')
_NODE = 'pose_0'
_FLAGS = {'yml': cv2.FILE_STORAGE_FORMAT_YAML, 'yaml': cv2.FILE_STORAGE_FORMAT_YAML,
          'xml': cv2.FILE_STORAGE_FORMAT_XML, 'json': cv2.FILE_STORAGE_FORMAT_JSON}
_SIZES = re.compile(r'(sizes"?: \[ \d+, \d+, \d+), 1( \])|(<sizes>\s*\d+ \d+ \d+) 1(</sizes>)')


def write_keypoint(path: Path, people: People2D) -> None:
    """Write the people of a frame, without ids and scores, as OpenPose's --write_keypoint; the suffix is the format.

    The matrix is P x K x 3 float32, missing joints 0, 0, 0; it is empty without people.

    Raises:
        OSError: the file can not be written.
        ValueError: the suffix is none of `FORMATS`.
    """
    file_format = path.suffix[1:]
    if file_format not in FORMATS:
        raise ValueError(f'{path}: expected a file ending in one of {", ".join(FORMATS)}')
    rows = to_rows(people)
    # Python's OpenCV writes a third axis as channels, unlike OpenPose; a fourth axis prevents that and is removed.
    matrix = rows[..., np.newaxis] if len(rows) else np.zeros((0, 0), np.uint8)
    storage = cv2.FileStorage('', cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY | _FLAGS[file_format])
    storage.write(_NODE, matrix)
    write_whole(path, _SIZES.sub(r'\1\2\3\4', storage.releaseAndGetString(), count=1).encode())
