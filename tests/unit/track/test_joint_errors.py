"""Sigma of the joints of a track is honest at any rate, however long the errors of the camera last."""
from dataclasses import replace

import numpy as np
import pytest

from simulated_errors import SETTLED, ErringCamera, looking_at_the_middle, standing, striding
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.settings import SmoothingParams
from skeleton_extract_3d.track.correction import joint_errors
from skeleton_extract_3d.track.joint_filter import along_rays
from skeleton_extract_3d.track.tracks import Tracks

CORRECTION = METHOD.track.correction


def shares(room, rate, correlation, seconds=4.0):
    """Return the shares of joints within 1 and 2 sigma; errors are as great as the tracker takes them to be."""
    camera = ErringCamera('', looking_at_the_middle(0.0), 0.0, correlation)
    count, ratios, tracks = len(room.joints), [], None
    for stamp in 0.1 + np.arange(int(seconds * rate)) / rate:
        truth = room.at(stamp)
        covariance = along_rays(truth - camera.pose[1], np.full((count, 18), CORRECTION.across),
                                np.full((count, 18), CORRECTION.along))
        xyz = truth + np.einsum('pkij,pkj->pki', np.linalg.cholesky(covariance), camera.errors(stamp, count))
        all_of_them = np.ones((count, 18), bool)
        if tracks is None:
            tracks = Tracks.begun(np.arange(count), stamp, xyz, np.tile([1.0, 0, 0], (count, 1)), np.full(count, 1.7))
        tracks = tracks.predicted(stamp - tracks.last_seen[0], SmoothingParams())
        joints = tracks.joints.corrected(xyz, covariance, all_of_them)
        innovations, errors = joint_errors(tracks, joints, (xyz, covariance), all_of_them, stamp)
        tracks = replace(tracks, joints=joints, errors=errors, innovations=innovations, last_seen=np.full(count, stamp))
        if stamp > SETTLED:
            ratios.append(np.linalg.norm(joints.position - truth, axis=2) / np.sqrt(errors))
    return np.mean(np.array(ratios) <= 1), np.mean(np.array(ratios) <= 2)


@pytest.mark.parametrize('correlation', [0.0, 0.5])
@pytest.mark.parametrize('rate', [5.0, 15.0, 60.0])
@pytest.mark.parametrize('people', [standing, striding])
def test_any_rate(people, rate, correlation):
    within_1, within_2 = shares(people(5.0, 6), rate, correlation)
    assert 0.53 < within_1 < 0.74
    assert within_2 > 0.96
