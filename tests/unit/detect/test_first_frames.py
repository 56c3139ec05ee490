"""Frames without a usable history are searched in full, and what is remembered of other images stays out of them."""
from pathlib import Path

import cv2
import numpy as np
import pytest
from test_following import BEGIN, CROWD, IMAGE, LEFT, PACE, RATE, RIGHT, Scene, near, right_of

from openpose_ros_pkg.detect.detection import DepthView, ImageFrame
from openpose_ros_pkg.detect.detector import Detector, create_detector
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from optional_weights import need_weights
from stand_in_networks import MovenetNetwork, PafNetwork, ThunderNetwork, Together, chart, in_order

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
FOLLOWING = FollowingParams(following='always')
PACES = {**PACE, 'mobilenet_thin': 1e-7}


def assert_same(found, expected):
    np.testing.assert_array_equal(found.keypoints, expected.keypoints)
    np.testing.assert_array_equal(found.scores, expected.scores)


def make_stream(networks, pace=None, **params):
    detector = Detector(build(DetectorSettings, {'mode': 'balanced', 'target_rate': 30.0, **params}), networks,
                        FOLLOWING)
    return NetworkDetection(detector, TrackingParams(), FOLLOWING, pace or SLOW)


def slower(factor):
    """Return what the networks take for a pixel on a machine that is slower by a factor."""
    return {name: factor * seconds for name, seconds in PACES.items()}


# Every pass is cut, and a full search takes longer than 20 frames.
SLOW = slower(100)


def balanced(people, size=(640, 480)):
    """Return networks of the modes balanced and fast that see people truly."""
    return Together(mobilenet_thin=PafNetwork(people, size), movenet_multipose=MovenetNetwork(people, size),
                    movenet_thunder=ThunderNetwork(people, size))


@pytest.mark.parametrize('interval, params', [(0.7, {'target_rate': RATE}), (0.9, {}), (2.0, {'target_rate': RATE})])
def test_images_far_apart_show_all_people(interval, params):
    """They walk on between the images, so that none is where the last image lets expect."""
    scene = Scene([], pace=slower(10), **params)
    for i in range(6):
        found = scene.frame(interval * i, [right_of(person, 40.0 * (i % 2)) for person in CROWD])[0]
        assert len(found) == len(CROWD)
        assert_same(found, scene.stream.detector.detect(IMAGE))


def test_shipped_images_far_apart_show_the_people_of_a_full_search():
    """With the networks themselves, and the depth of the images."""
    for model in (MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER):
        need_weights(model)
    settings = build(DetectorSettings, {'mode': 'balanced', 'target_rate': 30.0})
    full = create_detector(build(DetectorSettings, {'mode': 'balanced'}))
    stream = NetworkDetection(create_detector(settings, FOLLOWING), TrackingParams(), FOLLOWING, slower(20))
    for i, name in enumerate(('000', '005', '030')):
        image = cv2.imread(str(SHIPPED / 'rgb' / f'{name}.jpg'))
        depth = cv2.imread(str(SHIPPED / 'depth' / f'{name}.png'), cv2.IMREAD_UNCHANGED).astype(np.float32) / 1000
        view = DepthView(np.where(depth > 0, depth, np.float32(np.nan)), 540.7 * depth.shape[1] / image.shape[1])
        found = stream.detect(ImageFrame('camera', BEGIN + 2.0 * i, image, view))
        assert len(found) >= 1
        assert_same(found, full.detect(image, view))


@pytest.mark.parametrize('interval', [np.inf, 0.9], ids=['first', 'after a gap'])
def test_the_first_image_of_a_stream_is_searched_by_one_network_alone(interval):
    networks = balanced([LEFT, RIGHT])
    stream = make_stream(networks, slower(3))
    prepared = stream.prepare(ImageFrame('camera', BEGIN, IMAGE, interval=interval))
    with stream.lock:
        computed = stream.compute(prepared)
    assert len(stream.finish(computed)) == 2
    searched = [len(networks.networks[name].inputs) > 0 for name in ('mobilenet_thin', 'movenet_multipose')]
    assert sorted(searched) == [False, True]


@pytest.mark.parametrize('factor, pause', [(8, 0.05), (32, 0.5), (80, 0.3)])
def test_a_client_that_waits_for_each_answer_is_shown_all_people(factor, pause):
    """Full searches take 0.25, 1.0 and 2.5 s, the last longer than tracks are kept."""
    scene = Scene(CROWD, pace=slower(factor), target_rate=RATE)
    time = 0.0
    for _ in range(8):
        found, *_, seconds = scene.frame(time)
        assert len(found) == len(CROWD)
        time += factor * seconds + pause


@pytest.mark.parametrize('cameras, factor', [(1, 30), (3, 20)])
def test_a_live_chain_on_a_slow_machine_lags_for_two_frames_of_each_camera(cameras, factor):
    """The gap that full searches make does not let the search of each frame make the next gap."""
    scene = Scene([LEFT, RIGHT], pace=slower(factor), target_rate=RATE)
    time, taken = 0.0, []
    for i in range(20 * cameras):  # the networks work on the newest image at any time
        stamp = np.ceil(time * RATE) / RATE
        taken.append(factor * scene.frame(stamp, camera=i % cameras)[3])
        time = stamp + max(taken[-1], 1e-3)
    assert min(taken[:cameras]) == pytest.approx(0.016 * factor, rel=0.01)
    long = np.array(taken[cameras:]) > 0.7 * min(taken[:cameras])
    assert not long[cameras:2 * cameras].any() and long.mean() <= 0.06


@pytest.mark.parametrize('params', [{'target_rate': RATE}, {}, {'look_closer': 0}],
                         ids=['with a rate', 'without', 'not followed'])
def test_without_a_stamp_there_is_no_history(params):
    """Each image has the people of a full search, with new ids, and streams beside know nothing of it."""
    scene = Scene([LEFT, RIGHT], pace=SLOW, **params)
    ids = scene.frame(1.0)[0].ids.tolist()
    for i in range(3):
        found, *_ = scene.frame(0.0 - BEGIN, [right_of(LEFT, 10.0 * i), RIGHT])
        assert_same(found, scene.stream.detector.detect(IMAGE))
        ids += found.ids.tolist()
    assert sorted(ids) == list(range(1, 9))
    assert scene.frame(1.02, [LEFT, RIGHT])[0].ids.tolist() == ids[:2]


def frame_of(scene, stamp, size, people, camera='camera'):
    """Return the people of a frame of another size, and the number of searches; `people` are in its pixels."""
    scene.searching.size = scene.looking.size = size
    return scene.frame(stamp, people, chart(*size), camera)[:2]


def ids_in_order(people):
    """Return the ids of People2D by the x of the neck."""
    return people.ids[np.argsort(people.xy[:, COCO_18.index['neck'], 0])].tolist()


@pytest.mark.parametrize('params', [{'target_rate': RATE}, {'look_closer': 0}], ids=['followed', 'searched'])
def test_another_resolution_keeps_the_ids_and_finds_people_there(params):
    scene = Scene([], **params)
    ids = [ids_in_order(scene.frame(0.02 * i, [LEFT, RIGHT])[0]) for i in range(3)][-1]
    for i in range(3, 6):
        found, _ = frame_of(scene, 0.02 * i, (320, 240), [LEFT / 2, RIGHT / 2])
        assert ids_in_order(found) == ids
        assert all(near(one, person) for one, person in zip(in_order(found), (LEFT / 2, RIGHT / 2)))
    found, _ = frame_of(scene, 0.14, (320, 180), [LEFT * (0.5, 0.375)])
    assert found.ids.tolist() == [3]  # another aspect shows another view


@pytest.mark.parametrize('sizes', [((640, 480), (320, 240)), ((640, 480), (480, 270))], ids=['one aspect', 'two'])
def test_cameras_of_one_frame_id_and_different_sizes_do_not_disturb_each_other(sizes):
    """Each is searched in full once, and its people keep their ids."""
    scene = Scene([], pace=slower(3), target_rate=RATE)
    people = [[person * (size[0] / 640, size[1] / 480) for person in (LEFT, RIGHT)] for size in sizes]
    frames = [[frame_of(scene, 0.02 * i, size, shown) for size, shown in zip(sizes, people)] for i in range(10)]
    for camera in zip(*frames):
        assert {tuple(sorted(found.ids)) for found, _ in camera} == {tuple(sorted(camera[0][0].ids))}
        assert sum(searches for _, searches in camera[1:]) <= 4
    assert all(len(found) == 2 for frame in frames for found, _ in frame)


@pytest.mark.parametrize('size, rate', [((1, 1), 0.0), ((1, 2000), 30.0), ((2000, 1), 0.0), ((2, 3), 30.0),
                                        ((17, 1), 30.0)])
def test_tiny_images_show_no_person_or_are_refused_as_too_thin(size, rate):
    stream = make_stream(balanced([]), target_rate=rate)
    for i in range(3):
        try:
            image = np.full((size[1], size[0], 3), 100, np.uint8)
            assert len(stream.detect(ImageFrame('camera', BEGIN + 0.1 * i, image))) == 0
        except BadInputError as error:
            assert f'{size[0]}x{size[1]}' in str(error) and 'at most' in str(error)


def test_a_frame_is_computed_as_it_was_prepared_whatever_is_reconfigured_meanwhile():
    """The modes have one and two passes."""
    networks = balanced([LEFT, RIGHT])
    stream = make_stream(networks)
    stamps = iter(BEGIN + 0.03 * np.arange(100))

    def prepare():
        return stream.prepare(ImageFrame('camera', next(stamps), IMAGE))

    def compute(prepared):
        with stream.lock:
            computed = stream.compute(prepared)
            stream.search(computed)
        return stream.finish(computed)

    def reconfigure(mode, between):
        stream.detector.reconfigure(build(DetectorSettings, {'mode': mode, 'target_rate': 30.0}))
        between()
        stream.reconfigure(TrackingParams())

    for mode in ('fast', 'balanced') * 2:
        before, during = prepare(), []
        reconfigure(mode, lambda during=during: during.append(prepare()))
        for prepared in (before, *during, *(prepare() for _ in range(5))):
            assert sorted(compute(prepared).ids) == [1, 2]
    before = [len(network.inputs) for network in networks.networks.values()]
    for _ in range(60):
        compute(prepare())
    assert all(len(network.inputs) > count for network, count in zip(networks.networks.values(), before))
