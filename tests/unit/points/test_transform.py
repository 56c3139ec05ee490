"""People in another frame: x' = R x + t, and nothing else changes."""
import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.transform import transform_people

K = len(COCO_18.joints)
# From the optical frame (x right, y down, z forward) to one with x forward, y left, z up.
UPRIGHT = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def people(count):
    """People whose joints are random and move, but one missing and one inferred each."""
    random = np.random.default_rng(0)
    xyz, status = random.uniform(-4, 4, (count, K, 3)), np.full((count, K), MEASURED)
    status[:, 3], status[:, 5] = MISSING, INFERRED
    xyz[status == MISSING] = np.nan
    velocity = np.where(np.isnan(xyz), np.nan, random.uniform(-2, 2, (count, K, 3)))
    return People3D(COCO_18, xyz, random.uniform(0, 1, (count, K)), status, np.where(status == INFERRED, 0.1, np.nan),
                    np.arange(count) + 5, velocity)


def test_no_people():
    assert len(transform_people(people(0), UPRIGHT, np.ones(3))) == 0


def test_axes_go_where_they_belong():
    moved = transform_people(people(2), UPRIGHT, np.array([10.0, 20.0, 30.0]))
    x, y, z = np.moveaxis(people(2).xyz, -1, 0)
    np.testing.assert_allclose(moved.xyz, np.stack([z + 10, 20 - x, 30 - y], axis=-1), atol=1e-5)
