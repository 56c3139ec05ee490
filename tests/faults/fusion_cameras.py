"""Three cameras around two people who stand still: what they send to fusion and signals, and where they stand."""
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Callable, Dict, List, Tuple

import numpy as np
from geometry_msgs.msg import TransformStamped
from openpose_ros_msgs.msg import FaceDetection_3dArray, HandDetection_3dArray
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).parents[1] / 'support'))

from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.convert import bgr_to_image
from simulated_rig import CAMERA, around, walking
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.extractor import NAMESPACE

# Namespaces of the cameras.
WITH_DEPTH, WITHOUT_DEPTH = ('fusion/left', 'fusion/right'), 'fusion/door'
# Topics in the namespace of the chain by the message's place in a frame, in the order in which they are sent.
TOPICS: Dict[str, str] = {'info': 'door/openpose_ros/camera_info', 'door': 'door/openpose_ros/detected_poses',
                          'left': f'left/{NAMESPACE}/detected_poses_3d',
                          'right': f'right/{NAMESPACE}/detected_poses_3d'}
# The same of a frame for the node of signals.
SIGNALS_TOPICS: Dict[str, str] = {'hands': f'{NAMESPACE}/detected_hands_3d',
                                  'faces': f'{NAMESPACE}/detected_faces_3d',
                                  'people': f'{NAMESPACE}/detected_poses_3d'}
_CAMERAS = around(3, noise=0.0)
_NAMES = ('left', 'right', 'door')


def transforms(fixed_frame: str) -> List[TransformStamped]:
    """Return where the cameras stand; their frames have their names."""
    result = []
    for name, camera in zip(_NAMES, _CAMERAS):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = camera.pose
        result.append(convert.transform_from_matrix(matrix, Header(frame_id=fixed_frame), name))
    return result


def good_frame() -> SimpleNamespace:
    """Return what the cameras send at a time, without a stamp."""
    room = walking(2.0, 2, seed=1)
    left, right = (convert.people_to_array(camera.people(room, 1.0), Header(frame_id=name))
                   for name, camera in zip(_NAMES[:2], _CAMERAS))
    header = Header(frame_id='door')
    door = convert_2d.people_to_array(_CAMERAS[2].keypoints(room, 1.0), header)
    return SimpleNamespace(info=convert.camera_to_message(CAMERA, header), door=door, left=left, right=right)


def frame_for_signals() -> SimpleNamespace:
    """Return what the node of signals reads at a time, without a stamp: the people of the left camera."""
    header = Header(frame_id='left')
    return SimpleNamespace(hands=HandDetection_3dArray(header=header), faces=FaceDetection_3dArray(header=header),
                           people=good_frame().left)


def frame_for_pages() -> SimpleNamespace:
    """Return what the node of pages reads at a time, without a stamp: the people of the left camera, and its image."""
    header = Header(frame_id='left')
    image = bgr_to_image(np.full((CAMERA.height, CAMERA.width, 3), 128, np.uint8), header)
    return SimpleNamespace(image=image, people=good_frame().left)


# What makes a frame, and its topics, for the chains that read people.
FRAMES: Dict[str, Tuple[Callable[[], SimpleNamespace], Dict[str, str]]] = {
    'fusion': (good_frame, TOPICS), 'signals': (frame_for_signals, SIGNALS_TOPICS),
    'web': (frame_for_pages, {'image': f'{NAMESPACE}/detected_poses_image',
                              'people': f'{NAMESPACE}/detected_poses_3d'})}
