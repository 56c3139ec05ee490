"""The compiled decoder gives what the numpy decoder gives, to the last bit.

There is no tolerance: both do the same floating-point operations in the same order and precision (the confidence maps
are enlarged by the same function), and the compiler is told not to fuse or reorder them.
"""
import importlib.machinery
import importlib.util
import shutil
import subprocess
import sys
import sysconfig
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_decode import STRIDE, render_fields, standing_person

from openpose_ros_pkg.decode import DecodeParams, compiled, decode
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.skeletons import COCO_18, SKELETONS, Limb, SkeletonModel

ROOT = Path(__file__).parents[3]
SOURCE = ROOT / 'openpose_ros_pkg/src/cpp/openpose_ros_decode.cpp'
MODULE = 'openpose_ros_decode'
# Limbs that run against the order of the joints, joints without a limb, and one limb that starts nobody.
ODD_SKELETON = SkeletonModel(
    name='ODD', joints=('tail', 'body', 'head', 'nothing', 'paw'), drawn_limbs=(), colours=((0, 0, 0),) * 5,
    limbs=(Limb('head', 'body', (5, 2)), Limb('body', 'tail', (0, 1)),
           Limb('paw', 'tail', (4, 3), starts_person=False)))
PAF_SKELETONS = [ODD_SKELETON, *(skeleton for skeleton in SKELETONS.values() if skeleton.limbs)]


# --- the module -----------------------------------------------------------------------------------------------------

def built_by_catkin():
    """Return the module in the devel space, unless there is none for this Python that is newer than its source."""
    for suffix in importlib.machinery.EXTENSION_SUFFIXES:
        for path in (ROOT / 'devel/lib').glob(f'python3*/*-packages/{MODULE}{suffix}'):
            if path.stat().st_mtime > SOURCE.stat().st_mtime:
                return path
    return None


def build(folder):
    """Compile the module as CMakeLists.txt does."""
    python = sysconfig.get_path('include')
    headers = ['/usr/include']
    package = importlib.util.find_spec('pybind11')
    if package is not None:
        headers.append(str(Path(package.origin).parent / 'include'))
    if shutil.which('c++') is None:
        pytest.skip('there is no C++ compiler to build the compiled decoder with')
    if not any((Path(path) / 'pybind11/pybind11.h').exists() for path in headers):
        pytest.skip('there is no pybind11 to build the compiled decoder with (pybind11-dev)')
    if not (Path(python) / 'Python.h').exists():
        pytest.skip(f'there is no {python}/Python.h to build the compiled decoder with (python3-dev)')
    # /usr/include is searched anyway; named here, it would come before the headers of Python
    includes = [f'-I{path}' for path in [python, *headers[1:]]]
    subprocess.run(['c++', '-std=c++17', '-O3', '-ffp-contract=off', '-fno-math-errno', '-fvisibility=hidden', '-fPIC',
                    '-shared', *includes, str(SOURCE),
                    '-o', str(folder / (MODULE + importlib.machinery.EXTENSION_SUFFIXES[0]))], check=True, timeout=300)


def forget_module():
    sys.modules.pop(MODULE, None)
    compiled.load.cache_clear()


@pytest.fixture(scope='module', autouse=True)
def module(tmp_path_factory):
    """The compiled module of this very source, for the tests of this file only."""
    folder = tmp_path_factory.mktemp('compiled')
    built = built_by_catkin()
    if built is not None:
        shutil.copy(str(built), str(folder))
    else:
        build(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        forget_module()
        loaded, reason = compiled.load()
        assert loaded is not None, reason
        assert Path(loaded.__file__).parent == folder
        yield loaded
    forget_module()


def model_of(skeleton):
    """What the decoder wants to know about a network: confidence maps with one for the background, then the fields."""
    return SimpleNamespace(skeleton=skeleton, heatmaps=len(skeleton.joints) + 1, stride=STRIDE,
                           peak_threshold=0.0)


def both(fields, skeleton=COCO_18, valid_size=None, **params):
    """Decode in both ways, demand equal results, and return them."""
    model = model_of(skeleton)
    expected = decode(fields, model, DecodeParams(decoder='numpy', **params), valid_size)
    actual = decode(fields, model, DecodeParams(decoder='compiled', **params), valid_size)
    for one, other in zip(actual, expected):
        assert one.dtype == other.dtype == np.float32
        np.testing.assert_array_equal(one, other)
    return actual


def noise(shape, amplitude, seed=0):
    return np.random.default_rng(seed).uniform(-amplitude, amplitude, shape).astype(np.float32)


def crowd(count):
    """People in rows of ten, who overlap their neighbours a little."""
    return [standing_person(40 + 60 * (i % 10) + 0.3 * i, 20 + 175 * (i // 10), 140 + i % 5) for i in range(count)]


# --- the same people ------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('fields', [
    np.zeros((57, 46, 82), np.float32), np.ones((57, 46, 82), np.float32), np.full((57, 46, 82), np.nan, np.float32),
    np.zeros((57, 1, 1), np.float32), render_fields([])], ids=['zero', 'constant', 'NaN', 'one cell', 'background'])
def test_nobody(fields):
    keypoints, scores = both(fields)
    assert keypoints.shape == (0, 18, 3) and scores.shape == (0,)


@pytest.mark.parametrize('upsample', [1, 2, 4])
@pytest.mark.parametrize('count', [1, 2, 5, 20])
def test_people(count, upsample):
    fields = render_fields(crowd(count))
    assert len(both(fields, heatmap_upsample=upsample)[0]) == count
    both(fields + noise(fields.shape, 0.05), heatmap_upsample=upsample)


def test_two_people_whose_arms_cross():
    left, right = standing_person(250, 60, 260), standing_person(350, 64, 255)
    index = COCO_18.index
    left[[index['left_elbow'], index['left_wrist']]] = (300, 140), (335, 165)
    right[[index['right_elbow'], index['right_wrist']]] = (302, 170), (280, 135)
    assert len(both(render_fields([left, right]))[0]) == 2


def test_people_in_one_another():
    """Limbs compete, people touch and are merged or kept apart."""
    people = [standing_person(300 + 9 * i, 60 + 5 * i, 250 - 20 * i) for i in range(6)]
    for seed in range(10):
        fields = render_fields(people)
        both(fields + noise(fields.shape, 0.1, seed), person_min_joints=2, person_min_score=0.0)


@pytest.mark.parametrize('skeleton', PAF_SKELETONS, ids=lambda skeleton: skeleton.name)
def test_all_skeletons(skeleton):
    random = np.random.default_rng(1)
    people = [np.array([x, 180]) + random.uniform(-80, 80, (len(skeleton.joints), 2)) for x in (120, 330, 540)]
    fields = render_fields(people, skeleton=skeleton)
    assert len(both(fields, skeleton, person_min_joints=2)[0]) >= 3
    for seed in range(5):
        both(fields + noise(fields.shape, 0.2, seed), skeleton, person_min_joints=2)


@settings(max_examples=80, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 2 ** 32 - 1), count=st.integers(0, 6), amplitude=st.sampled_from([0.0, 0.02, 0.1, 0.5, 2.0]),
       size=st.tuples(st.integers(1, 30), st.integers(1, 40)), upsample=st.sampled_from([1, 2, 3, 4]),
       skeleton=st.sampled_from(PAF_SKELETONS), samples=st.integers(2, 15),
       support=st.sampled_from([0.0, 0.5, 0.8, 1.0]),
       caps=st.sampled_from([(64, 576), (3, 1000), (1000, 11), (1, 1)]), padded=st.booleans())
def test_random_fields(seed, count, amplitude, size, upsample, skeleton, samples, support, caps, padded):
    random = np.random.default_rng(seed)
    net = (size[0] * STRIDE, size[1] * STRIDE)
    people = random.uniform(0, 1, (count, len(skeleton.joints), 2)) * (net[1], net[0])
    fields = render_fields(people, net, skeleton=skeleton)
    fields += random.uniform(-amplitude, amplitude, fields.shape).astype(np.float32)
    both(fields, skeleton, (int(0.7 * net[1]), int(0.8 * net[0])) if padded else None, heatmap_upsample=upsample,
         limb_samples=samples, limb_min_support=support, max_peaks_per_joint=caps[0], max_peaks=caps[1],
         person_min_joints=2, person_min_score=0.0)


@pytest.mark.parametrize('upsample', [1, 2])
@pytest.mark.parametrize('levels', [1, 2, 8])
def test_ties(levels, upsample):
    """Coarse values: plateaus in the maps, peaks of one height, limbs and people of one score."""
    twins = render_fields([standing_person(x, 60, 240) for x in (80, 240, 400, 560)])
    for seed in range(5):
        fields = np.rint((twins + noise(twins.shape, 0.4, seed)) * levels) / np.float32(levels)
        both(fields, heatmap_upsample=upsample, person_min_joints=2, person_min_score=0.0)
        both(fields, heatmap_upsample=upsample, max_peaks=40)
    assert len(both(twins)[0]) == 4


def test_thresholds_of_networks():
    """The higher one of the network's and the user's counts, in both."""
    fields = render_fields(crowd(3), sharpness=0.5)
    for threshold, found in ((0.3, 3), (0.6, 0)):
        model = model_of(COCO_18)
        model.peak_threshold = threshold
        for decoder in ('numpy', 'compiled'):
            assert len(decode(fields, model, DecodeParams(decoder=decoder))[0]) == found


@pytest.mark.parametrize('valid_size', [None, (656, 368), (400, 368), (400, 100), (1, 1)])
def test_padding(valid_size):
    fields = render_fields(crowd(20))
    both(fields + noise(fields.shape, 0.1), valid_size=valid_size)


# --- robustness -----------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('amplitude', [0.2, 1.0, 1e30])
def test_pure_noise_takes_bounded_time(amplitude):
    fields = noise((57, 46, 82), amplitude)
    both(fields)
    params = DecodeParams(decoder='compiled', person_min_score=0.0, person_min_joints=2)
    began = time.process_time()
    decode(fields, model_of(COCO_18), params)
    assert time.process_time() - began < 0.2  # 0.01 s on one core


def test_fields_of_any_layout_are_read_and_left_alone():
    fields = np.asfortranarray(render_fields(crowd(3)))
    fields.flags.writeable = False
    before = fields.copy()
    assert len(both(fields)[0]) == 3
    np.testing.assert_array_equal(fields, before)


@pytest.mark.parametrize('channels', [57 - 1, 19])
def test_too_few_channels_are_refused(channels):
    with pytest.raises(ValueError, match='names a joint or channel that is not there'):
        decode(np.zeros((channels, 4, 4), np.float32), model_of(COCO_18), DecodeParams(decoder='compiled'))


def test_threads_decode_at_once():
    """Each thread gets its own people, and while one computes for long, others run."""
    scenes = [render_fields(crowd(count)) for count in (1, 2, 3, 4)]
    found = [[] for _ in scenes]

    def decode_often(scene, results):
        for _ in range(20):
            results.append(len(decode(scene, model_of(COCO_18), DecodeParams(decoder='compiled'))[0]))

    threads = [threading.Thread(target=decode_often, args=pair) for pair in zip(scenes, found)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [[count] * 20 for count in (1, 2, 3, 4)]


def test_other_threads_run_while_it_computes(module):
    maps = np.full((2, 402, 402), -np.inf, np.float32)
    maps[:, 1:-1, 1:-1] = noise((2, 400, 400), 1.0) + 1
    done = []

    def decode_for_long():  # a million pairs
        module.decode(maps=maps, pafs=np.ones((2, 400, 400), np.float32), limbs=np.array([[0, 1, 0, 1, 1]], np.int32),
                      steps=np.linspace(0, 1, 50, dtype=np.float32), stride=8, upsample=1, peak_threshold=0.0,
                      max_peaks_per_joint=1000, max_peaks=2000, max_x=np.inf, max_y=np.inf, sample_threshold=0.0,
                      min_support=0.0, foreshortened=0.0, min_joints=2, min_score=0.0)
        done.append(True)

    thread = threading.Thread(target=decode_for_long)
    thread.start()
    turns = 0
    while not done:
        time.sleep(0.001)
        turns += 1
    thread.join()
    assert turns > 5  # over 100 where the machine is idle; 1 if Python's lock were held


# --- the choice -----------------------------------------------------------------------------------------------------

@pytest.fixture
def not_built(monkeypatch):
    monkeypatch.setitem(sys.modules, MODULE, None)  # so an import fails
    compiled.load.cache_clear()
    yield
    monkeypatch.undo()
    compiled.load.cache_clear()


def test_auto_takes_the_compiled_decoder(monkeypatch):
    monkeypatch.setattr('openpose_ros_pkg.decode.decode_compiled', lambda *_: 'compiled')
    fields = np.zeros((57, 4, 4), np.float32)
    assert decode(fields, model_of(COCO_18), DecodeParams()) == 'compiled'
    assert decode(fields, model_of(COCO_18), DecodeParams(decoder='numpy')) != 'compiled'


def test_auto_takes_numpy_where_nothing_is_built(not_built):
    keypoints, _ = decode(render_fields(crowd(2)), model_of(COCO_18), DecodeParams())
    assert len(keypoints) == 2


def test_compiled_is_refused_where_nothing_is_built(not_built):
    with pytest.raises(ParameterError, match=r"'decoder' = 'compiled'.*openpose_ros_decode.*pybind11-dev.*'numpy'"):
        DecodeParams(decoder='compiled')


def test_unknown_decoder_is_refused():
    with pytest.raises(ParameterError, match=r"'decoder' = 'cuda'.*'auto', 'compiled', 'numpy'"):
        DecodeParams(decoder='cuda')


