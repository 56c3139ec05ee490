"""The compiled functions of the lifting give what the numpy ones give, but for rounding.

Tolerances: both compute in the same precision, but numpy adds up in another order, and its exponentials and logarithms
may differ in the last bit. Costs reach about 100 in float32, whose steps are 1e-5 there: 1e-3 is allowed. Depths are
means of candidates by the exponentials of costs: 1e-4 m is allowed, a hundredth of what a depth camera is off. What is
computed in float64 throughout agrees up to 1e-9, as far as the matrices that are inverted allow.
"""
import importlib.machinery
import importlib.util
import shutil
import subprocess
import sys
import sysconfig
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d import compiled
from skeleton_extract_3d.body import measures as body_measures
from skeleton_extract_3d.body.body import BONE_LENGTHS, HEAD, TRUNK
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.lift import depth_inference, head_pose, occluders, pose_lifting, surfaces
from skeleton_extract_3d.points import camera
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import (
    Person,
    joints_of,
    moved_pixels,
    pinhole,
    render,
    standing,
    with_holes,
    without_joints,
)

ROOT = Path(__file__).parents[3]
SOURCES = ROOT / 'skeleton_extract_3d/src/cpp/lifting'
MODULE = 'skeleton_extract_3d_lifting'
JOINTS, SAMPLES = len(COCO_18.joints), 25
COST, DEPTH, DOUBLE = 1e-3, 1e-4, 1e-9
FOCAL = 500.0
PEOPLE = pytest.mark.parametrize('people', [0, 1, 2, 5, 20])


# --- the module -----------------------------------------------------------------------------------------------------

def built_by_catkin():
    """Return the module in the devel space, unless there is none for this Python that is newer than its sources."""
    changed = max(path.stat().st_mtime for path in SOURCES.iterdir())
    for suffix in importlib.machinery.EXTENSION_SUFFIXES:
        for path in (ROOT / 'devel/lib').glob(f'python3*/*-packages/{MODULE}{suffix}'):
            if path.stat().st_mtime > changed:
                return path
    return None


def compile_into(folder):
    """Compile the module as CMakeLists.txt does."""
    python = sysconfig.get_path('include')
    headers = ['/usr/include']
    package = importlib.util.find_spec('pybind11')
    if package is not None:
        headers.append(str(Path(package.origin).parent / 'include'))
    if shutil.which('c++') is None:
        pytest.skip('there is no C++ compiler to build the compiled functions with')
    if not any((Path(path) / 'pybind11/pybind11.h').exists() for path in headers):
        pytest.skip('there is no pybind11 to build the compiled functions with (pybind11-dev)')
    if not (Path(python) / 'Python.h').exists():
        pytest.skip(f'there is no {python}/Python.h to build the compiled functions with (python3-dev)')
    # /usr/include is searched anyway; named here, it would come before the headers of Python
    includes = [f'-I{path}' for path in [python, *headers[1:]]]
    # all at once, as the headers of pybind11 take most of the time
    together = ''.join(f'#include "{path}"\n' for path in sorted(SOURCES.glob('*.cpp')))
    subprocess.run(['c++', '-std=c++17', '-O3', '-ffp-contract=off', '-fno-math-errno', '-fvisibility=hidden', '-fPIC',
                    '-shared', *includes, '-x', 'c++', '-',
                    '-o', str(folder / (MODULE + importlib.machinery.EXTENSION_SUFFIXES[0]))],
                   input=together.encode(), check=True, timeout=300)


def forget_module():
    sys.modules.pop(MODULE, None)
    compiled.load.cache_clear()


@pytest.fixture(scope='module', autouse=True)
def module(tmp_path_factory):
    """The compiled module of these very sources, for the tests of this file only."""
    folder = tmp_path_factory.mktemp('compiled')
    built = built_by_catkin()
    if built is not None:
        shutil.copy(str(built), str(folder))
    else:
        compile_into(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        forget_module()
        loaded, reason = compiled.load()
        assert loaded is not None, reason
        assert Path(loaded.__file__).parent == folder
        yield loaded
    forget_module()


def by_numpy(function, *args):
    """Return what a function gives where nothing is built."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled, 'load', lambda: (None, 'not wanted'))
        return function(*args)


def both(function, *args, tolerance=0.0):
    """Compute in both ways, demand equal results and untouched arguments, and return the compiled one's."""
    before = [np.array(value) for value in args if isinstance(value, np.ndarray)]
    actual, expected = function(*args), by_numpy(function, *args)
    for value, old in zip([value for value in args if isinstance(value, np.ndarray)], before):
        np.testing.assert_array_equal(value, old)
    assert (actual is None) == (expected is None)
    if actual is not None:
        each = zip(*((result if isinstance(result, tuple) else (result,)) for result in (actual, expected)))
        for one, other in each:
            assert one.dtype == other.dtype and one.shape == other.shape
            np.testing.assert_allclose(one, other, rtol=0, atol=tolerance)
    return actual


# --- random people --------------------------------------------------------------------------------------------------

def keypoints(random, people, missing=0.2):
    """Keypoints [px] of people who are about 300 px tall and stand in one another's way; NaN where missing."""
    uv = random.uniform(-60, 60, (people, JOINTS, 2)) * (1, 3) + random.uniform(300, 700, (people, 1, 2))
    uv[random.random((people, JOINTS)) < missing] = np.nan
    return uv


def windows(random, people, missing=0.3):
    """Surfaces [m] around joints: two per window, and holes; some windows are all holes."""
    near = random.uniform(0.5, 8.0, (people, JOINTS, 1))
    depth = near + random.choice([0.0, 0.5, 3.0], (people, JOINTS, SAMPLES)) + random.normal(0, 0.05, (
        people, JOINTS, SAMPLES))
    depth[random.random(depth.shape) < missing] = np.nan
    depth[random.random((people, JOINTS)) < missing] = np.nan
    return depth


def scores_of(random, people):
    scores = random.random((people, JOINTS))
    scores[random.random((people, JOINTS)) < 0.2] = 0.0
    return scores


def bodies(random, people, error=0.03):
    """Joints [m] of adults and children who stand upright, somewhere before the camera."""
    of_one = joints_of(Person(0, 0.0, 3.0, standing()), floor=1.0)
    joints = np.array([of_one[name] for name in COCO_18.joints])
    scale = random.uniform(0.6, 1.2, (people, 1, 1))
    return joints * scale + random.normal(0, error, (people, JOINTS, 3)) + random.uniform(-0.5, 0.5, (people, 1, 3))


def some_of(random, people, share=0.8):
    """A choice of joints."""
    return random.random((people, JOINTS)) < share


def inference(random, people, amplitude=20.0):
    """Arguments of infer_depths: people who stand upright, with noise in their rays and in what surfaces say."""
    outline = np.array([[0.18, -0.3], [-0.18, -0.3], [0.1, 0.2], [-0.1, 0.2], [0.3, 0.0], [-0.3, 0.0], [0.12, 0.6],
                        [-0.12, 0.6], [0.3, 0.2], [-0.3, 0.2], [0.12, 1.0], [-0.12, 1.0]])
    root = random.uniform(0.4, 10.0, people)
    places = (outline + random.normal(0, 0.05, (people, 12, 2)) + random.uniform(-1, 1, (people, 1, 2)))
    rays = np.concatenate([places / root[:, None, None], np.ones((people, 12, 1))], axis=2)
    head = np.concatenate([rays[:, :2, :2].mean(axis=1) - (0.0, 0.2) / root[:, None], np.ones((people, 1))], axis=1)
    candidates = (np.arange(surfaces.STEPS) - random.uniform(0, surfaces.STEPS, (people, 13, 1))) ** 2
    costs = np.minimum(random.uniform(0, 0.3, (people, 13, 1)) * candidates, random.uniform(0, 1, (people, 13, 1)) *
                       amplitude).astype(np.float32)
    costs[random.random((people, 13)) < 0.2] = 0.0
    stature = random.uniform(0.8, 2.1, people)
    lengths = BONE_LENGTHS * stature[:, None] / 1.7
    bones = depth_inference.bones_of(lengths, random.uniform(0.02, 0.15, lengths.shape),
                                     random.random((people, 12)) < 0.2)
    left = random.normal(0, 1, (people, 3))
    left[random.random(people) < 0.3] = np.nan
    return costs[:, :12], costs[:, 12], rays, head, root, bones, stature, left


# --- depths of all joints -------------------------------------------------------------------------------------------

def both_inferred(args):
    beliefs = both(depth_inference.infer_depths, *args, tolerance=COST)
    assert isinstance(beliefs, depth_inference.Beliefs)
    both(depth_inference.read_depths, beliefs.joints, tolerance=DEPTH)
    both(depth_inference.read_depths, beliefs.head, tolerance=DEPTH)
    return beliefs


@PEOPLE
def test_infer_depths(people):
    beliefs = both_inferred(inference(np.random.default_rng(people), people))
    assert beliefs.joints.shape == (people, 12, surfaces.STEPS) and beliefs.left.shape == (people, 3)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 2 ** 32 - 1), people=st.integers(1, 4), amplitude=st.sampled_from([0.0, 1.0, 20.0, 100.0]))
def test_infer_depths_of_any_people(seed, people, amplitude):
    both_inferred(inference(np.random.default_rng(seed), people, amplitude))


def test_infer_depths_where_no_keypoint_is_known():
    """All rays are one guess, and no surface says anything."""
    costs, head_costs, rays, head_ray, root, bones, stature, left = inference(np.random.default_rng(0), 3)
    both_inferred((0 * costs, 0 * head_costs, np.full_like(rays, (0, 0, 1)), head_ray, root, bones, stature,
                   np.full_like(left, np.nan)))


def test_infer_depths_next_to_the_camera():
    """Candidates behind the camera are moved in front of it."""
    args = inference(np.random.default_rng(1), 3)
    both_inferred((*args[:4], np.full(3, 0.2), *args[5:]))


@pytest.mark.parametrize('shape', [(0,), (), (7,), (3, 12)])
def test_read_depths(shape):
    random = np.random.default_rng(0)
    mean, sigma = both(depth_inference.read_depths,
                       random.uniform(0, 30, (*shape, surfaces.STEPS)).astype(np.float32), tolerance=DEPTH)
    assert mean.shape == sigma.shape == shape


def test_read_depths_with_candidates_that_are_ruled_out():
    beliefs = np.full((1, surfaces.STEPS), np.inf, np.float32)
    beliefs[0, [10, 11]] = 0.0
    mean, sigma = both(depth_inference.read_depths, beliefs, tolerance=DEPTH)
    assert mean[0] == pytest.approx((10.5 - surfaces.HALF) * surfaces.STEP)
    assert sigma[0] == pytest.approx(surfaces.STEP / 2)


def test_read_depths_takes_the_first_of_equal_candidates():
    both(depth_inference.read_depths, np.zeros((2, surfaces.STEPS), np.float32), tolerance=DEPTH)


# --- what the surfaces say ------------------------------------------------------------------------------------------

def foreign_of(random, depth, share):
    return None if share is None else random.random(depth.shape) < share


@pytest.mark.parametrize('share', [None, 0.0, 0.3, 1.0])
@PEOPLE
def test_root_evidence(people, share):
    random = np.random.default_rng(people)
    depth = windows(random, people)
    both(surfaces.root_evidence, depth, scores_of(random, people), foreign_of(random, depth, share), tolerance=1e-9)


def both_costs(random, depth, scores, foreign):
    people = len(depth)
    return both(surfaces.depth_costs, depth, random.uniform(-0.1, 0.2, (people, JOINTS)),
                random.uniform(-0.1, 0.4, (people, JOINTS)), random.uniform(0.5, 8.0, people), scores,
                random.choice([0.03, 1.0], (people, JOINTS)), random.random((people, JOINTS)) < 0.3, foreign,
                tolerance=COST)


@pytest.mark.parametrize('share', [None, 0.0, 0.3, 1.0])
@PEOPLE
def test_depth_costs(people, share):
    random = np.random.default_rng(people)
    depth = windows(random, people)
    both_costs(random, depth, scores_of(random, people), foreign_of(random, depth, share))


@pytest.mark.parametrize('depth', [np.nan, np.inf, 1e-3, 1e3])
def test_windows_that_show_nothing_near(depth):
    random = np.random.default_rng(0)
    windows_there = np.full((2, JOINTS, SAMPLES), depth)
    both(surfaces.root_evidence, windows_there, np.ones((2, JOINTS)), tolerance=1e-9)
    costs = both_costs(random, windows_there, np.ones((2, JOINTS)), None)
    if not np.isfinite(depth):
        assert (costs == 0).all(), 'a hole says nothing'


def test_depths_on_the_edges_of_bins():
    """Halves are rounded alike."""
    depth = 2.0 + np.arange(-100, 350).reshape(1, JOINTS, SAMPLES) / 50
    zero, one = np.zeros((1, JOINTS)), np.ones((1, JOINTS))
    both(surfaces.depth_costs, depth, zero, one / 50, np.array([2.0]), one, one, zero > 0, None, tolerance=COST)


@PEOPLE
def test_lower_median(people):
    depth = windows(np.random.default_rng(people), people)
    both(surfaces.lower_median, depth)
    both(surfaces.lower_median, depth[:, 0])


@PEOPLE
def test_size_depth(people):
    random = np.random.default_rng(people)
    xyz = bodies(random, people)
    rays = np.where(some_of(random, people)[..., None], xyz / xyz[..., 2:], np.nan)
    both(surfaces.size_depth, rays, scores_of(random, people), tolerance=DOUBLE)


@PEOPLE
def test_size_evidence(people):
    random = np.random.default_rng(people)
    size = random.uniform(0.3, 12.0, people)
    size[:1] = np.inf
    evidence = both(surfaces.size_evidence, size, random.uniform(0.03, 0.15, people), tolerance=DOUBLE)
    assert (evidence[:1] == 0).all(), 'an unknown size says nothing'


@pytest.mark.parametrize('share', [None, 0.0, 0.3, 1.0])
@PEOPLE
def test_mean_within(people, share):
    random = np.random.default_rng(people)
    depth = windows(random, people)
    for joints in (TRUNK, HEAD):
        both(surfaces.mean_within, depth, random.uniform(-0.1, 0.1, (people, len(joints))),
             random.uniform(0.5, 8.0, people), 2.0, some_of(random, people), foreign_of(random, depth, share), joints,
             tolerance=DOUBLE)


# --- who covers whom ------------------------------------------------------------------------------------------------

@PEOPLE
def test_others(people):
    random = np.random.default_rng(people)
    uv, depths = keypoints(random, people), random.uniform(1.0, 4.0, (people, JOINTS))
    others = both(occluders.others_depths, uv, depths, FOCAL, tolerance=1e-9)
    assert np.isfinite(others).any() == (people > 1)
    foreign = None
    for expected in (depths, depths[:, :1]):
        foreign = both(occluders.foreign_samples, windows(random, people), others, expected)
    assert (foreign is not None) == (people > 1)


def test_nobody_else_is_there():
    random = np.random.default_rng(0)
    nobody = np.full((3, JOINTS, 3), np.inf)
    assert both(occluders.foreign_samples, windows(random, 3), nobody, np.full((3, 1), 2.0)) is None


def test_own_samples_are_nobody_elses():
    depth = np.full((1, JOINTS, SAMPLES), 2.0)
    assert both(occluders.foreign_samples, depth, np.full((1, JOINTS, 2), 2.0), np.full((1, 1), 2.0)) is None


@PEOPLE
def test_covered_by_self(people):
    random = np.random.default_rng(people)
    covered = both(occluders.covered_by_self, keypoints(random, people), random.uniform(1.0, 4.0, people), FOCAL)
    assert covered.any() == (people > 0)


@PEOPLE
def test_doubtful_surfaces(people):
    random = np.random.default_rng(people)
    doubted = both(occluders.doubtful_surfaces, keypoints(random, people), windows(random, people),
                   random.uniform(1.0, 8.0, people), some_of(random, people, 0.5), FOCAL, tolerance=1e-6)
    assert bool(len(doubted[0])) == (people > 0)


def test_nobody_has_keypoints():
    nowhere = np.full((3, JOINTS, 2), np.nan)
    assert not both(occluders.covered_by_self, nowhere, np.ones(3), FOCAL).any()
    assert np.isinf(both(occluders.others_depths, nowhere, np.ones((3, JOINTS)), FOCAL)).all()


def test_all_keypoints_in_one_place():
    both(occluders.covered_by_self, np.full((2, JOINTS, 2), 7.0), np.ones(2), FOCAL)
    both(occluders.others_depths, np.full((2, JOINTS, 2), 7.0), np.ones((2, JOINTS)), FOCAL)


# --- the camera -----------------------------------------------------------------------------------------------------

def test_nothing_is_fitted_to_one_row_of_points():
    pixels = np.stack([np.arange(100), np.full(100, 7)])
    points = np.stack([pixels[0] - 50.0, np.full(100, 3.0), np.full(100, 2.0)])
    for row, column in ((0, 1), (1, 0)):
        turned = points[[row, column, 2]], pixels[[row, column]]
        assert camera.fit_pinhole(*turned) is None and by_numpy(camera.fit_pinhole, *turned) is None


@pytest.mark.parametrize('missing', [0.0, 0.5, 0.99, 1.0])
def test_fitted_pinhole(missing):
    random = np.random.default_rng(0)
    pixels = random.integers(0, 960, (2, 576))
    z = random.uniform(0.5, 8.0, 576)
    points = np.stack([(pixels[0] - 480.0) / 500 * z, (pixels[1] - 270.0) / 510 * z, z])
    points += random.normal(0, 1e-3, points.shape)
    points[:, random.random(576) < missing] = random.choice([np.nan, np.inf, 0.0])
    fit = camera.fit_pinhole(points, pixels)
    expected = by_numpy(camera.fit_pinhole, points, pixels)
    assert (fit is None) == (expected is None) == (missing > 0.9)
    if fit is not None:
        np.testing.assert_allclose(fit, expected, rtol=0, atol=1e-6)
        np.testing.assert_allclose(fit[:4], (500, 510, 480, 270), rtol=0, atol=1.0)


# --- which way a head looks, and who was seen ------------------------------------------------------------------------

@pytest.mark.parametrize('share', [0.0, 0.2, 0.7, 1.0])
@PEOPLE
def test_head_pose(people, share):
    random = np.random.default_rng(people)
    xyz = bodies(random, people)
    known = some_of(random, people, share)
    rays = np.where(known[..., None], xyz / xyz[..., 2:], np.nan)
    pose = both(head_pose.estimate_head_pose, rays, np.where(known, random.random(known.shape), 0.0), xyz[:, 1, 2],
                random.uniform(0.6, 1.2, people), random.uniform(-1, 1, people), tolerance=DOUBLE)
    assert (pose.known == known[:, HEAD].any(axis=1)).all()


@pytest.mark.parametrize('share', [None, 0.0, 0.3, 1.0])
@PEOPLE
def test_measured_joints(people, share):
    random = np.random.default_rng(people)
    xyz = bodies(random, people)
    z = xyz[..., 2]
    depth = z[..., None] - 0.08 + random.normal(0, 0.05, (people, JOINTS, SAMPLES))
    depth -= np.where(random.random((people, JOINTS, 1)) < 0.2, 0.3, 0.0)
    depth[random.random(depth.shape) < 0.3] = np.nan
    limbs = random.uniform(0.2, 0.5, (2, people, 4)).astype(np.float32)
    *_, measured, plausible = both(
        pose_lifting.measure, xyz / z[..., None], scores_of(random, people), some_of(random, people), depth, z,
        random.uniform(0.0, 0.15, (people, JOINTS)), random.choice([0.03, 1.0], (people, JOINTS)),
        foreign_of(random, depth, share), *limbs, tolerance=DOUBLE)
    if people == 20:
        assert plausible.any() and not plausible.all()
        assert not measured.all() and measured.any() == (share != 1.0)


@PEOPLE
def test_costs_with_memory(people):
    random = np.random.default_rng(people)
    depth = random.uniform(1.0, 4.0, (people, JOINTS))
    depth[~some_of(random, people)] = np.nan
    both(pose_lifting.with_memory, random.uniform(0, 12, (people, JOINTS, surfaces.STEPS)).astype(np.float32),
         random.uniform(1.0, 4.0, people), depth, random.uniform(0.05, 0.5, (people, JOINTS)), tolerance=COST)


# --- over time ------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('share', [0.0, 0.5, 0.9, 1.0])
@PEOPLE
def test_learnt_sizes(people, share):
    random = np.random.default_rng(people)
    frames = random.integers(0, 31, (people, 9)).astype(np.float64)
    sizes = body_measures.Sizes(random.uniform(1.0, 1.9, people), frames[:, 0],
                                BONE_LENGTHS * random.uniform(0.8, 1.1, (people, 8)), frames[:, 1:])
    both(body_measures.with_frame, sizes, bodies(random, people), some_of(random, people, share), tolerance=DOUBLE)


# --- all together ---------------------------------------------------------------------------------------------------

def estimates():
    """Return what is estimated of a few frames with three people who walk by one another, with holes and gaps."""
    camera, estimator = pinhole(320, 180), PeopleEstimator(build(EstimatorSettings, {}))
    random, result = np.random.default_rng(0), []
    for i in range(5):
        frame = render(camera, [Person(0, -0.6 + 0.1 * i, 2.6, standing()), Person(1, 0.4 - 0.1 * i, 3.2, standing()),
                                Person(2, 0.9, 3.0, standing())])
        people = moved_pixels(frame.people, random, sigma=1.0)
        people = without_joints(people, random.random((len(people), JOINTS)) < 0.15)
        points = DepthImage(with_holes(frame.depth, 0.2, random), camera)
        result.append(estimator.update(people, CameraFrame(frame.size, points, i / 15, frame.bgr)).people)
    return result


def test_estimated_people():
    for one, other in zip(estimates(), by_numpy(estimates)):
        assert len(one) == len(other) == 3
        np.testing.assert_array_equal(one.status, other.status)
        np.testing.assert_array_equal(one.ids, other.ids)
        np.testing.assert_allclose(one.xyz, other.xyz, rtol=0, atol=DEPTH)
        np.testing.assert_allclose(one.sigma, other.sigma, rtol=0, atol=DEPTH)


# --- robustness -----------------------------------------------------------------------------------------------------

def test_arrays_of_any_layout_are_read():
    args = inference(np.random.default_rng(2), 4)
    both_inferred(tuple(np.asfortranarray(value) if isinstance(value, np.ndarray) else value for value in args))


def test_wrong_shapes_are_refused():
    args = inference(np.random.default_rng(3), 2)
    with pytest.raises(ValueError, match=r'rays must have shape \(2, 12, 3\), got \(2, 11, 3\)'):
        depth_inference.infer_depths(*args[:2], args[2][:, :11], *args[3:])
    with pytest.raises(ValueError, match=r'scores must have shape \(2, 18\), got \(2, 17\)'):
        surfaces.root_evidence(np.ones((2, JOINTS, SAMPLES)), np.ones((2, 17)))
    with pytest.raises(ValueError, match=r'last axis of beliefs must have size 45'):
        depth_inference.read_depths(np.zeros((2, 44), np.float32))


def test_threads_infer_at_once():
    scenes = [inference(np.random.default_rng(i), 1 + i) for i in range(4)]
    expected = [by_numpy(depth_inference.infer_depths, *scene) for scene in scenes]
    wrong = []

    def infer_often(scene, beliefs):
        for _ in range(20):
            joints = depth_inference.infer_depths(*scene).joints
            if not np.allclose(joints, beliefs.joints, rtol=0, atol=COST):
                wrong.append(len(joints))

    threads = [threading.Thread(target=infer_often, args=pair) for pair in zip(scenes, expected)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


# --- the choice -----------------------------------------------------------------------------------------------------

def test_numpy_computes_where_nothing_is_built(monkeypatch):
    monkeypatch.setitem(sys.modules, MODULE, None)  # so an import fails
    compiled.load.cache_clear()
    module, reason = compiled.load()
    assert module is None and MODULE in reason
    beliefs = depth_inference.infer_depths(*inference(np.random.default_rng(0), 2))
    assert beliefs.joints.shape == (2, 12, surfaces.STEPS)
    monkeypatch.undo()
    compiled.load.cache_clear()
