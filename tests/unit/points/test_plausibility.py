"""Points that can be read and are no depth of the view all the same, and people who do not fit their depth."""
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimating import new_estimator
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage, cloud_from_depth
from skeleton_extract_3d.points.plausibility import summarize
from synthetic_scene import Person, Room, pinhole, render, standing

CAMERA = pinhole(320, 180)
FRAME = render(CAMERA, [Person(0, -0.6, 2.6, standing()), Person(1, 0.6, 3.0, standing())], Room(wall=6.0))
SEVERAL = 12
# Finite or not, tiny, huge, in metres or not, of either sign.
ANY_NUMBER = st.floats() | st.sampled_from([0.0, -0.0, 1e-310, 1e-300, 1e-30, 1e30, 1e300, -50.0, 0.5, 500.0, 65535.0])


def cloud(factor=1.0):
    """Return the points of the scene, in metres with factor 1."""
    points = cloud_from_depth(FRAME.depth * 0.001, CAMERA, FRAME.bgr)
    return OrganizedCloud(*(points[axis] * np.float32(factor) for axis in 'xyz'))


def metres(depth):
    return DepthImage(np.asarray(depth, np.float32), CAMERA)


def estimates(points, values=None, bgr=FRAME.bgr, camera=CAMERA, frames=SEVERAL):
    """Return what comes of frames in a row with the same keypoints; `points` is called with the number of each."""
    estimator = new_estimator(**values or {})
    return [estimator.update(FRAME.people, Frame('', i / 15, bgr(i) if callable(bgr) else bgr, points(i),
                                                 size=(camera.width, camera.height))) for i in range(frames)]


def events(estimate):
    return [doubt.event for doubt in estimate.doubts]


# ---------------------------------------------------------------------------------------------------- no depth

@pytest.mark.parametrize('value, said', [(np.nan, 'NaN'), (0, '0'), (np.inf, 'infinite'), (-1, 'negative')])
def test_no_valid_point_is_said_with_what_is_there_instead(value, said):
    summary = summarize(metres(np.full((180, 320), value)))
    assert summary.valid == 0 and np.isnan(summary.depth)
    assert summary.doubt.event == 'no depth'
    assert f'0 % of the points are valid, the others are {said}:' in summary.doubt.text


def test_a_view_in_metres_is_not_doubted():
    for points in (cloud(), metres(FRAME.depth * 0.001), DepthImage(FRAME.depth, CAMERA)):
        summary = summarize(points)
        assert summary.doubt is None
        assert summary.valid == pytest.approx(np.count_nonzero(FRAME.depth) / FRAME.depth.size, abs=0.05)
        assert summary.depth == pytest.approx(np.median(FRAME.depth[FRAME.depth > 0]) * 0.001, abs=0.2)


@pytest.mark.parametrize('points', [
    cloud(1000), metres(FRAME.depth), cloud(1e25), cloud(1e-3), metres(FRAME.depth * 1e-42),
    DepthImage(np.full((180, 320), 65535, np.uint16), CAMERA)], ids=[
        'cloud in mm', 'float depth in mm', 'huge', 'cloud in km', 'denormal', '65535 everywhere'])
@pytest.mark.parametrize('values', [{}, {'lifting': 'mean3x3'}, {'lifting': 'mean3x3', 'tracking': False},
                                    {'occlusion': False}], ids=str)
def test_another_unit_is_reported_and_gives_people_in_the_image_alone(points, values):
    for estimate in estimates(lambda i: points, values):
        assert 'implausible depth' in events(estimate)
        assert len(estimate.people) == 0 and len(estimate.people_2d) == 0
        np.testing.assert_array_equal(estimate.in_image.keypoints, FRAME.people.keypoints)
        assert (estimate.in_image.ids == -1).all()


def test_people_are_inferred_while_the_depth_is_gone_until_the_timeout():
    nothing = OrganizedCloud.without_points(320, 180)
    seen = estimates(lambda i: cloud() if i < 5 or i > 115 else nothing, frames=120)
    assert events(seen[4]) == [] and (seen[4].people.status == MEASURED).any()
    assert len(seen[5].people) == 2 and not (seen[5].people.status == MEASURED).any()
    assert (seen[5].people.status == INFERRED).any() and events(seen[5]) == ['no depth']
    # track_timeout is 2 s
    assert len(seen[115].people) == 0 and len(seen[115].in_image) == 2
    assert (seen[119].people.status == MEASURED).any() and events(seen[119]) == []


# --------------------------------------------------------------------------------------- image and depth of others

def test_people_fit_the_depth_of_their_own_camera():
    assert not any(map(events, estimates(lambda i: cloud(), frames=40)))


@pytest.mark.parametrize('points', [
    DepthImage(np.roll(FRAME.depth, 40, axis=1), CAMERA), cloud(5), cloud(0.3), cloud(0.5),
    DepthImage(FRAME.depth, CameraModel(320, 180, CAMERA.matrix * [[0.5, 1, 1], [1, 0.5, 1], [1, 1, 1]]))], ids=[
        'beside', '5 times as far', 'a third', 'half', 'K of half the resolution'])
def test_people_who_do_not_fit_the_depth_are_said_over_several_frames_and_no_longer_when_they_do(points):
    seen = estimates(lambda i: points if i < 20 else cloud(), frames=60)
    assert not events(seen[0]), 'a single frame tells nothing'
    assert 'people do not fit the depth' in events(seen[15])
    assert 'm tall in the median' in seen[15].doubts[-1].text
    assert not events(seen[59])


def test_depth_that_stands_still_is_said_while_the_image_moves():
    rng = np.random.default_rng(0)
    moving = [np.roll(FRAME.bgr, 12 * i, axis=1) for i in range(12)]
    noisy = [np.clip(FRAME.bgr + rng.normal(0, 4, FRAME.bgr.shape), 0, 255).astype(np.uint8) for _ in range(12)]
    assert 'depth stands still' in events(estimates(lambda i: cloud(), bgr=lambda i: moving[i])[-1])
    assert not events(estimates(lambda i: cloud(), bgr=lambda i: noisy[i])[-1])
    assert not events(estimates(lambda i: cloud(1 + i * 1e-5), bgr=lambda i: moving[i])[-1])


# ------------------------------------------------------------------------------------------ any camera, any points

# a fisheye with 1e5 folds nothing; but later OpenCVs than 4.2 do not invert it
@pytest.mark.parametrize('model, first', [
    *((model, first) for model in ('plumb_bob', 'fisheye') for first in (-50.0, 1e300, -1e300)), ('plumb_bob', 1e5)])
def test_a_lens_that_folds_the_image_is_refused(model, first):
    with pytest.raises(BadInputError, match='folds the image'):
        CameraModel(320, 180, CAMERA.matrix, model, np.array([first, 0, 0, 0]))


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[ANY_NUMBER] * 4), st.lists(ANY_NUMBER, min_size=4, max_size=4) | st.just([]),
       st.sampled_from(['plumb_bob', 'fisheye', 'rational_polynomial']),
       st.lists(st.tuples(ANY_NUMBER, ANY_NUMBER, ANY_NUMBER), min_size=1, max_size=4), st.booleans())
def test_any_camera_and_points_give_numbers_or_a_clear_error(values, lens, model, patches, as_cloud):
    (fx, cx, fy, cy), depth = values, FRAME.depth * 0.001
    try:
        camera = CameraModel(320, 180, [fx, 0, cx, 0, fy, cy, 0, 0, 1], model, np.array(lens))
    except BadInputError:
        camera = CAMERA
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with np.errstate(over='ignore', invalid='ignore', under='ignore'):
            axes = [np.array(axis, np.float32) for axis in np.moveaxis(CAMERA.ray_grid() * depth[..., None], -1, 0)]
            for i, patch in enumerate(patches):
                for axis, value in zip(axes, patch):
                    axis[:, 80 * i:80 * (i + 1)] = value  # may be infinite in float32
        try:
            points = OrganizedCloud(*axes) if as_cloud else DepthImage(axes[2], camera)
            for estimate in estimates(lambda i: points, frames=3):
                people = estimate.people
                known = people.status != MISSING
                assert np.isfinite(people.xyz[known]).all() and np.isfinite(people.sigma[known]).all()
                assert np.abs(people.xyz[known]).max(initial=0) < 100
        except BadInputError as error:
            assert len(str(error)) > 20
