"""Images have the same people in any number of processes."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.detector import DetectorSettings
from openpose_ros_pkg.errors import BadInputError, ModelError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.parallel.detector_pool import DetectorPool

DEFAULTS = build(DetectorSettings, {})
REFUSED = 67


class LevelDetector:
    """Finds one person, at x = the depth, or else the grey level of the image."""

    def detect(self, bgr, depth=None):
        level = int(bgr[0, 0, 0])
        if level == REFUSED:
            raise BadInputError('not this one')
        keypoints = np.full((1, 18, 3), 0.5, np.float32)
        keypoints[..., 0] = level if depth is None else depth.depth[0, 0]
        return People2D(COCO_18, keypoints, np.array([0.5]), np.array([-1]))


def level_detector(_settings):
    return LevelDetector()


def broken(_settings):
    raise ModelError('weights are missing')


def image(level):
    return np.full((4, 6, 3), level, np.uint8)


@pytest.mark.parametrize('jobs', [1, 2])
def test_every_image_has_its_result(jobs):
    with DetectorPool(jobs, DEFAULTS, level_detector) as pool:
        found = [pool.submit(image(level)) for level in range(20)]
        deep = pool.submit(image(9), DepthView(np.full((4, 6), 1.5, np.float32), 5.0))
        assert [people.result(30).xy[0, 0, 0] for people in (*found, deep)] == [*range(20), 1.5]
        assert pool.skeleton is COCO_18
        with pytest.raises(BadInputError, match='not this one'):
            pool.submit(image(REFUSED)).result(30)


@pytest.mark.parametrize('jobs', [1, 2])
def test_a_detector_that_can_not_be_made_says_why(jobs):
    with pytest.raises(ModelError, match='weights are missing'), DetectorPool(jobs, DEFAULTS, broken) as pool:
        pool.submit(image(1)).result(30)
