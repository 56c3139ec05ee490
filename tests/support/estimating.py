"""An estimator, and frames of a depth camera for it."""
from openpose_ros_pkg.params.parameters import build
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings


def new_estimator(**values):
    """Return an estimator with other parameters than the defaults."""
    return PeopleEstimator(build(EstimatorSettings, values))


def update(estimator, frame, stamp, people=None, depth=None, **values):
    """Return the estimate of a frame of synthetic_scene, with other people or depth if given, and values of `Frame`."""
    points = DepthImage(frame.depth if depth is None else depth, frame.camera)
    values = {'bgr': frame.bgr, 'size': frame.size, **values}
    return estimator.update(frame.people if people is None else people, Frame('', stamp, points=points, **values))
