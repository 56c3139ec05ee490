"""Simulated cameras of tests/support/simulated_room.py as the messages of their nodes."""
import sys
from pathlib import Path

import genpy
import numpy as np
from openpose_ros_msgs.msg import BodypartDetection, PersonDetection, PersonDetectionArray
from std_msgs.msg import Header

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from openpose_ros_pkg.skeletons import COCO_18
from simulated_room import FOCAL
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.ros.convert import camera_to_message, people_to_array

MODEL = CameraModel(960, 540, np.array([[FOCAL, 0, 480], [0, FOCAL, 270], [0, 0, 1]]), 'plumb_bob',
                    np.array([-0.2, 0.05, 0.001, -0.001, 0]))
SPACE, IMAGE, INFO = 'openpose_ros/skeleton_3d/detected_poses_3d', 'openpose_ros/detected_poses', 'camera_info'


def frames(recording):
    """Yield the stamp of each frame, and its messages by their topics in the namespace of the camera."""
    make, topic = (in_space, SPACE) if recording.has_depth else (in_image, IMAGE)
    for stamp in np.unique(recording.stamps).tolist():
        time = genpy.Time(stamp // 10 ** 9, stamp % 10 ** 9)
        header = Header(stamp=time, frame_id=recording.frame_id)
        yield time, {topic: make(recording, recording.stamps == stamp, header), INFO: camera_to_message(MODEL, header)}


def in_space(recording, rows, header):
    """The message of a frame of a camera with depth."""
    points = recording.positions[rows]
    known = np.isfinite(points).all(axis=2)
    return people_to_array(People3D(COCO_18, points, known * 1.0, np.where(known, MEASURED, MISSING).astype(np.uint8),
                                    np.where(known, recording.sigma[rows], np.nan), recording.ids[rows],
                                    np.full(points.shape, np.nan)), header)


def in_image(recording, rows, header):
    """The message of a frame of a camera without depth."""
    people = []
    for points, number in zip(recording.positions[rows], recording.ids[rows]):
        pixels = MODEL.project(points)
        parts = {joint: BodypartDetection(*pixel, 0.9) for joint, pixel in zip(COCO_18.joints, pixels)
                 if np.isfinite(pixel).all()}
        people.append(PersonDetection(header=header, num_people_detected=1, person_ID=number, **parts))
    return PersonDetectionArray(header=header, pose_model='COCO_18', persons=people)
