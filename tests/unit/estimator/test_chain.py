"""Each camera is tracked for itself, no two people have one id, and a frame passes all stages of the chain."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.detect.detection import IndependentDetection
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, standing

SETTINGS = build(EstimatorSettings, {})
FRAME_PEOPLE = [Person(0, 0.1, 2.6, standing())]
FRAME = render(pinhole(320, 180), FRAME_PEOPLE, Room(wall=4.0))
POINTS = DepthImage(FRAME.depth, FRAME.camera)


def known_people(frame):
    """A search that knows the people: they are the `source` of the frame."""
    return lambda expected: frame.source


def make_chain(settings=SETTINGS):
    return PeopleChain(IndependentDetection(COCO_18, known_people, TrackingParams()), settings)


@pytest.fixture
def chain():
    return make_chain()


def seen(chain, camera, stamp=1.0, people=FRAME.people, frame=FRAME, points=POINTS):
    return chain.update(Frame(camera, stamp, frame.bgr, points, source=people))


def test_an_image_without_people(chain):
    result = seen(chain, 'left', people=People2D.empty(COCO_18))
    assert len(result.people_2d) == len(result.people_3d) == len(result.landmarks.in_image.hands) == 0


def test_it_gives_what_an_estimator_gives(chain):
    alone = PeopleEstimator(SETTINGS)
    for stamp in (1.0, 1.1):
        expected = alone.update(FRAME.people, Frame('', stamp, FRAME.bgr, POINTS))
        np.testing.assert_array_equal(seen(chain, 'left', stamp).people_3d.xyz, expected.people.xyz)


def test_without_points_people_are_found_in_the_image_alone(chain):
    result = seen(chain, 'left', points=None)
    np.testing.assert_array_equal(result.people_2d.keypoints, FRAME.people.keypoints)
    assert result.people_3d is None and result.doubts == () and result.people_2d.ids.tolist() == [1]


def test_ids_in_space_are_unique_over_all_cameras(chain):
    results = [seen(chain, camera) for camera in ('left', 'right', 'left')]
    assert [result.people_3d.ids.tolist() for result in results] == [[1], [2], [1]]
    assert [result.people_2d.ids.tolist() for result in results] == [[1], [2], [1]]


def test_the_pose_of_the_camera_may_be_known_only_after_detection(chain):
    """A camera that moves aside by 0.3 m sees the same person, who stands still in the room."""
    moved = render(pinhole(320, 180), [replace(FRAME_PEOPLE[0], x=FRAME_PEOPLE[0].x - 0.3)], Room(wall=4.0))
    for number, (frame, x) in enumerate(((FRAME, 0.0), (FRAME, 0.0), (moved, 0.3))):
        prepared = chain.prepare(Frame('left', 1 + number / 15, frame.bgr, DepthImage(frame.depth, frame.camera),
                                       source=frame.people))
        with chain.detection.lock:
            result = chain.finish(chain.compute(prepared))
        assert result.people_3d is None
        result = chain.lift(result.located((np.eye(3), np.array([x, 0.0, 0.0]))))
    assert result.people_3d.ids.tolist() == [1]
    # 0.3 m within a fifteenth of a second would be 4.5 m/s
    assert np.nanmax(np.abs(result.people_3d.velocity)) < 1.0


def test_points_of_another_aspect_ratio_are_refused_before_the_networks_see_the_image():
    searched = []
    chain = PeopleChain(IndependentDetection(COCO_18, searched.append, TrackingParams()), SETTINGS)
    with pytest.raises(BadInputError, match='aspect'):
        chain.prepare(Frame('left', 1.0, FRAME.bgr[:, :160], POINTS))
    assert searched == []


def test_people_in_space_are_expected_in_the_next_image(chain):
    size = FRAME.size
    assert chain.expected('left', 1.0, size) is None
    ids = seen(chain, 'left').people_3d.ids
    expected, larger = chain.expected('left', 1.1, size), chain.expected('left', 1.1, (2 * size[0], 2 * size[1]))
    assert expected.ids.tolist() == ids.tolist()
    both = expected.present & FRAME.people.present
    assert both.sum() > 10 and np.abs(expected.xy - FRAME.people.xy)[both].max() < 3
    np.testing.assert_allclose(larger.xy[both] + 0.5, 2 * (expected.xy[both] + 0.5), atol=1e-3)
    assert chain.expected('right', 1.1, size) is None


def test_the_detection_gets_depth_and_expected_people(chain):
    class Recorded(IndependentDetection):
        def compute(self, prepared, expected=None):
            self.given = prepared[0], expected
            return super().compute(prepared, expected)

    detection = Recorded(COCO_18, known_people, TrackingParams())
    chain = PeopleChain(detection, SETTINGS)
    seen(chain, 'left')
    seen(chain, 'left', 1.1)
    image, expected = detection.given
    assert (image.camera, image.stamp) == ('left', 1.1) and len(expected) == 1
    assert np.nanmedian(image.depth.depth) == pytest.approx(np.median(FRAME.depth) / 1000, abs=0.01)


@pytest.mark.parametrize('stamp, told', [(99.6, True), (100.2, True), (99.0, False), (0.0, False), (103.0, False)])
def test_no_person_is_expected_after_a_gap_or_where_the_clock_was_reset(chain, stamp, told):
    seen(chain, 'left', 100.0)
    assert (chain.expected('left', stamp, FRAME.size) is not None) == told


def test_a_driver_may_change_size_and_aspect_ratio_of_its_images(chain):
    ids = seen(chain, 'left').people_3d.ids.tolist()
    wide = render(pinhole(320, 240, focal=0.6), FRAME_PEOPLE, Room(wall=4.0))
    # where people will be in the new image is not known before its points say of which camera it is
    assert chain.expected('left', 1.1, wide.size) is None
    result = seen(chain, 'left', 1.1, wide.people, wide, DepthImage(wide.depth, wide.camera))
    assert result.people_3d.ids.tolist() == ids, 'in space, no person has moved'
    expected = chain.expected('left', 1.2, wide.size)
    both = expected.present & wide.people.present
    assert both.sum() > 10 and np.abs(expected.xy - wide.people.xy)[both].max() < 3
    assert chain.expected('left', 1.2, FRAME.size) is None


@pytest.mark.parametrize('of_image, of_depth', [(1, 0), (0, 1), (1, 1)])
def test_image_and_depth_may_change_their_resolutions(chain, of_image, of_depth):
    sizes = FRAME, render(pinhole(640, 360), FRAME_PEOPLE, Room(wall=4.0))
    for number, (image, depth) in enumerate([(0, 0)] * 5 + [(of_image, of_depth)] * 5 + [(0, 0)] * 5):
        view, measured = sizes[image], sizes[depth]
        stamp = 1 + number / 15
        result = seen(chain, 'left', stamp, view.people, view, DepthImage(measured.depth, measured.camera))
        people = result.people_3d
        assert people.ids.tolist() == [1] and result.doubts == ()
        known = people.status[0] != MISSING
        assert np.abs(people.xyz - FRAME.xyz)[0, known].max() < 0.1 and known.sum() == 18
        # a person who stands
        assert number == 0 or np.abs(people.velocity[0]).max() < 0.3
        expected = chain.expected('left', stamp + 1 / 15, view.size)
        assert np.abs(expected.xy - view.people.xy).max() < 0.02 * view.size[0]


def test_points_of_another_size_without_depth_are_seen_by_the_same_camera(chain):
    ids = seen(chain, 'left').people_3d.ids.tolist()
    covered = OrganizedCloud.without_points(2 * FRAME.size[0], 2 * FRAME.size[1])
    assert seen(chain, 'left', 1.1, points=covered).people_3d.ids.tolist() == ids
    # nor is there a camera for covered points of another view
    narrow = Frame('left', 1.2, np.zeros((320, 240, 3), np.uint8), OrganizedCloud.without_points(240, 320),
                   source=FRAME.people)
    result = chain.update(narrow)
    assert len(result.people_3d) == 0 and len(result.estimate.unplaced) == 1 and result.people_2d.ids.tolist() == [-1]


def test_without_tracking_in_space_the_ids_are_those_of_the_image():
    chain = make_chain(build(EstimatorSettings, {'tracking': False}))
    results = [seen(chain, 'left', stamp) for stamp in (1.0, 1.1, 100.0)]
    assert [result.people_3d.ids.tolist() for result in results] == [[1], [1], [2]]
    assert [result.people_2d.ids.tolist() for result in results] == [[1], [1], [2]]


def test_new_settings_hold_for_all_cameras(chain):
    seen(chain, 'left')
    chain.reconfigure(build(EstimatorSettings, {'tracking': False, 'lifting': 'mean3x3'}))
    for camera in ('left', 'new'):
        people = seen(chain, camera, 1.1).people_3d
        assert people.ids.tolist() == [1], 'the id in the image'
        assert np.isnan(people.velocity).all()
