"""An estimator, frames of a depth camera for it, and tracks as it keeps them."""
from dataclasses import replace

import numpy as np

from openpose_ros_pkg.params.parameters import build
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.tracks import Tracks


def new_estimator(**values):
    """Return an estimator with other parameters than the defaults."""
    return PeopleEstimator(build(EstimatorSettings, values))


def update(estimator, frame, stamp, people=None, depth=None, missed=None, **values):
    """Return the estimate of a frame of synthetic_scene, with other people or depth if given, and values of `Frame`.

    missed: ids of tracks that were looked at and not found; None: all without a detection.
    """
    points = DepthImage(frame.depth if depth is None else depth, frame.camera)
    values = {'bgr': frame.bgr, 'size': frame.size, **values}
    frame_3d = Frame('', stamp, points=points, **values)
    return estimator.update(frame.people if people is None else people, frame_3d, missed)


def tracks_of(xyz, stamp=0.0, has=True, stature=1.75, **values):
    """Return tracks 0, 1, ... of people (T, 18, 3) [m] who face the camera, with joints of a mask, and other values."""
    count = len(xyz)
    tracks = Tracks.begun(np.arange(count), stamp, np.reshape(xyz, (-1, 18, 3)), np.tile([1.0, 0, 0], (count, 1)),
                          np.full(count, stature))
    return replace(tracks, has=np.full((count, 18), has), **values)
