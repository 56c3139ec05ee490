"""The console report names what the original's did: people, range of the cloud, pixel and position of each joint."""
import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.show.report import frame_report

K = len(COCO_18.joints)


def cloud():
    v, u = np.mgrid[:6, :8].astype(np.float32)
    return OrganizedCloud(u / 10, v / 10, np.where(u > 5, np.nan, 2))


def test_hidden_people_and_inferred_joints_are_reported():
    keypoints = np.full((1, K, 3), np.nan)
    keypoints[..., 2] = 0
    keypoints[0, 0], keypoints[0, 1] = (3, 2, 0.9), (1, 1, 0.5)
    status = np.full((2, K), MISSING)
    status[0, :3], status[1, 1] = (MEASURED, INFERRED, INFERRED), INFERRED
    xyz = np.where(status[..., None] == MISSING, np.nan, (0.5, 0.25, 2.0))
    people = People3D(COCO_18, xyz, np.zeros((2, K)), status, np.full((2, K), np.nan), [4, 9])
    lines = frame_report(People2D(COCO_18, keypoints, [1], [4]), people, cloud()).splitlines()
    assert lines[0] == 'Detected 1 person, 1 hidden'
    assert lines[2:7] == [
        'Person 4',
        '  Nose: pixel (3.0, 2.0), world (0.5000, 0.2500, 2.0000) m, confidence 0.00, measured',
        '  Neck: pixel (1.0, 1.0), world (0.5000, 0.2500, 2.0000) m, confidence 0.00, inferred',
        '  Right shoulder: not detected, world (0.5000, 0.2500, 2.0000) m, inferred',
        '  Right elbow: not detected']
    assert lines[3 + K:] == ['Person 9, hidden', '  Nose: not detected',
                             '  Neck: not detected, world (0.5000, 0.2500, 2.0000) m, inferred',
                             *[line for line in lines[3 + K:] if line.endswith(': not detected')][1:]]
    assert len(lines) == 2 + 2 * (1 + K)
