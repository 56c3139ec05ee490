"""Each camera is followed for itself, and no two people have one id."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.tracking import TRACKING
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.depth_view import depth_view
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, standing

SETTINGS = build(EstimatorSettings, {})
FRAME_PEOPLE = [Person(0, 0.1, 2.6, standing())]
FRAME = render(pinhole(320, 180), FRAME_PEOPLE, Room(wall=4.0))
POINTS = DepthImage(FRAME.depth, FRAME.camera)


@pytest.fixture
def chain():
    return PeopleChain(COCO_18, SETTINGS)


def in_space(chain, people, camera, stamp=0.0):
    return chain.in_space(people, Frame(camera, stamp, FRAME.bgr, POINTS))


def test_nobody_is_seen(chain):
    nobody = chain.in_image(People2D.empty(COCO_18), 'left', 0.0)
    assert len(nobody) == len(in_space(chain, nobody, 'left').people) == 0


def test_it_gives_what_an_estimator_gives(chain):
    alone = PeopleEstimator(SETTINGS)
    for stamp in (0.0, 0.1):
        expected = alone.update(FRAME.people, Frame('', stamp, FRAME.bgr, POINTS))
        np.testing.assert_array_equal(in_space(chain, FRAME.people, 'left', stamp).people.xyz, expected.people.xyz)


def test_ids_in_space_are_unique_over_all_cameras(chain):
    ids = [in_space(chain, FRAME.people, camera).people.ids.tolist() for camera in ('left', 'right', 'left')]
    assert ids == [[1], [2], [1]]


def test_people_keep_their_ids_in_the_images_of_a_camera(chain):
    first = chain.in_image(FRAME.people, 'left', 0.0)
    assert chain.in_image(FRAME.people, 'left', 0.1).ids.tolist() == first.ids.tolist() and (first.ids > 0).all()


def test_people_in_space_are_expected_in_the_next_image(chain):
    size = FRAME.size
    assert chain.expected('left', 0.0, size) is None
    ids = in_space(chain, FRAME.people, 'left').people.ids
    expected, larger = chain.expected('left', 0.1, size), chain.expected('left', 0.1, (2 * size[0], 2 * size[1]))
    assert expected.ids.tolist() == ids.tolist()
    both = expected.present & FRAME.people.present
    assert both.sum() > 10 and np.abs(expected.xy - FRAME.people.xy)[both].max() < 3
    np.testing.assert_allclose(larger.xy[both] + 0.5, 2 * (expected.xy[both] + 0.5), atol=1e-3)
    assert chain.expected('right', 0.1, size) is None


@pytest.mark.parametrize('stamp, told', [(99.6, True), (100.2, True), (99.0, False), (0.0, False), (103.0, False)])
def test_no_person_is_expected_after_a_gap_or_where_the_clock_was_reset(chain, stamp, told):
    in_space(chain, FRAME.people, 'left', 100.0)
    assert (chain.expected('left', stamp, FRAME.size) is not None) == told


def test_a_driver_may_change_size_and_aspect_ratio_of_its_images(chain):
    ids = in_space(chain, FRAME.people, 'left').people.ids.tolist()
    wide = render(pinhole(320, 240, focal=0.6), FRAME_PEOPLE, Room(wall=4.0))
    # where people will be in the new image is not known before its points say of which camera it is
    assert chain.expected('left', 0.1, wide.size) is None
    estimate = chain.in_space(wide.people, Frame('left', 0.1, wide.bgr, DepthImage(wide.depth, wide.camera)))
    assert estimate.people.ids.tolist() == ids, 'in space, no person has moved'
    expected = chain.expected('left', 0.2, wide.size)
    both = expected.present & wide.people.present
    assert both.sum() > 10 and np.abs(expected.xy - wide.people.xy)[both].max() < 3
    assert chain.expected('left', 0.2, FRAME.size) is None


@pytest.mark.parametrize('of_image, of_depth', [(1, 0), (0, 1), (1, 1)])
def test_image_and_depth_may_change_their_resolutions(chain, of_image, of_depth):
    sizes = FRAME, render(pinhole(640, 360), FRAME_PEOPLE, Room(wall=4.0))
    for number, (image, depth) in enumerate([(0, 0)] * 5 + [(of_image, of_depth)] * 5 + [(0, 0)] * 5):
        seen, measured = sizes[image], sizes[depth]
        points, stamp = DepthImage(measured.depth, measured.camera), number / 15
        estimate = chain.in_space(seen.people, Frame('left', stamp, seen.bgr, points))
        assert estimate.people.ids.tolist() == [1] and estimate.doubts == ()
        known = estimate.people.status[0] != MISSING
        assert np.abs(estimate.people.xyz - FRAME.xyz)[0, known].max() < 0.1 and known.sum() == 18
        # a person who stands
        assert number == 0 or np.abs(estimate.people.velocity[0]).max() < 0.3
        expected = chain.expected('left', stamp + 1 / 15, seen.size)
        assert np.abs(expected.xy - seen.people.xy).max() < 0.02 * seen.size[0]


def test_points_of_another_size_without_depth_are_seen_by_the_same_camera(chain):
    ids = in_space(chain, FRAME.people, 'left').people.ids.tolist()
    covered = OrganizedCloud.without_points(2 * FRAME.size[0], 2 * FRAME.size[1])
    estimate = chain.in_space(FRAME.people, Frame('left', 0.1, FRAME.bgr, covered))
    assert estimate.people.ids.tolist() == ids
    # nor is there a camera for covered points of another view
    narrow = Frame('left', 0.2, None, OrganizedCloud.without_points(240, 320), size=(240, 320))
    estimate = chain.in_space(FRAME.people, narrow)
    assert len(estimate.people) == 0 and len(estimate.unplaced) == 1


def test_people_are_found_where_the_chain_has_networks():
    class Stream:
        def detect(self, frame, expected):
            self.given = (frame.camera, frame.stamp, expected, frame.depth)
            return FRAME.people

    stream = Stream()
    chain = PeopleChain(COCO_18, SETTINGS, stream=stream)
    in_space(chain, FRAME.people, 'left')
    depth = depth_view(POINTS)
    assert chain.detect(FRAME.bgr, 'left', 0.1, depth) is FRAME.people
    assert stream.given[:2] == ('left', 0.1) and len(stream.given[2]) == 1 and stream.given[3] is depth


def test_without_tracking_in_space_the_ids_are_those_of_the_image():
    chain = PeopleChain(COCO_18, build(EstimatorSettings, {'tracking': False}))
    people = chain.in_image(FRAME.people, 'left', 0.0)
    assert in_space(chain, people, 'left').people.ids.tolist() == people.ids.tolist()


def test_new_settings_hold_for_all_cameras(chain):
    in_space(chain, FRAME.people, 'left')
    chain.reconfigure(build(EstimatorSettings, {'tracking': False, 'lifting': 'mean3x3'}))
    for camera in ('left', 'new'):
        people = in_space(chain, FRAME.people, camera, 0.1).people
        # the ids are those of the detections
        assert people.ids.tolist() == FRAME.people.ids.tolist()
        assert np.isnan(people.velocity).all()


def test_of_a_thousand_cameras_the_newest_are_remembered(chain):
    in_space(chain, FRAME.people, 'first')
    for camera in range(1000):
        chain.expected(camera, 0.0, FRAME.size)
        chain.in_image(FRAME.people, camera, 0.0)
        if camera == 998:
            in_space(chain, FRAME.people, 'last')
    assert chain.expected('last', 0.1, FRAME.size) is not None
    assert chain.expected('first', 0.1, FRAME.size) is None
    assert len(chain._estimators.all()) == len(chain._trackers.all()) == TRACKING.most_cameras
