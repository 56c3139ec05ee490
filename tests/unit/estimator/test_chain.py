"""Each camera is tracked for itself, no two people have one id, and a frame passes all stages of the chain."""
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from openpose_ros_pkg.detect.detection import KnownPeople, Looks, NextPart
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, standing

SETTINGS = build(EstimatorSettings, {})
FRAME_PEOPLE = [Person(0, 0.1, 2.6, standing())]
FRAME = render(pinhole(320, 180), FRAME_PEOPLE, Room(wall=4.0))
POINTS = DepthImage(FRAME.depth, FRAME.camera)


class Recorded(KnownPeople):
    """A detection that knows the people, who are the `source` of the frame, and records what it is asked and told."""

    def __init__(self):
        super().__init__(COCO_18, lambda frame: frame.source)
        self.asked, self.told, self.searched = [], [], []

    def look(self, frame, expected, in_full=True):
        self.asked.append((frame, expected, in_full))
        return super().look(frame, expected, in_full)

    def remember(self, frame, ids):
        self.told.append((frame.stamp, ids.tolist()))

    def search(self, frame):
        self.searched.append(frame.stamp)
        yield NextPart(0.1)


def make_chain(settings=SETTINGS):
    return PeopleChain(Recorded(), settings)


@pytest.fixture
def chain():
    return make_chain()


def frame_of(camera, stamp=1.0, people=FRAME.people, frame=FRAME, points=POINTS):
    return Frame(camera, stamp, frame.bgr, points, source=people)


def seen(chain, camera, *args, **values):
    return chain.update(frame_of(camera, *args, **values))


def expected(chain, camera, stamp, frame=FRAME):
    """Return the people that the detection is asked for in an image."""
    seen(chain, camera, stamp, frame.people, frame, DepthImage(frame.depth, frame.camera))
    return chain.detection.asked[-1][1]


def assert_near(people, frame, limit=3.0):
    """Fail unless most joints of expected people are near [px] to those of the frame."""
    both = (people.keypoints[..., 2] > 0) & frame.people.present
    assert both.sum() > 10 and np.abs(people.keypoints[..., :2] - frame.people.xy)[both].max() < limit


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
    def located(frame, x):
        assert chain.detection.asked[-1][0].stamp == frame.stamp
        return replace(frame, tracking_from_points=(np.eye(3), np.array([x, 0.0, 0.0])))

    moved = render(pinhole(320, 180), [replace(FRAME_PEOPLE[0], x=FRAME_PEOPLE[0].x - 0.3)], Room(wall=4.0))
    for number, (view, x) in enumerate(((FRAME, 0.0), (FRAME, 0.0), (moved, 0.3))):
        frame = frame_of('left', 1 + number / 15, view.people, view, DepthImage(view.depth, view.camera))
        result = chain.look(frame, locate=partial(located, x=x))
    assert result.people_3d.ids.tolist() == [1]
    # 0.3 m within a fifteenth of a second would be 4.5 m/s
    assert np.nanmax(np.abs(result.people_3d.velocity)) < 1.0


def test_points_of_another_aspect_ratio_are_refused_before_the_networks_see_the_image(chain):
    with pytest.raises(BadInputError, match='aspect'):
        chain.look(Frame('left', 1.0, FRAME.bgr[:, :160], POINTS))
    assert chain.detection.asked == []


def test_people_in_space_are_expected_in_the_next_image(chain):
    assert len(expected(chain, 'left', 1.0)) == 0
    people = expected(chain, 'left', 1.1)
    assert people.ids.tolist() == [1] and people.existence[0] > 0.5 and people.visibility[0] > 0.9
    assert_near(people, FRAME)
    larger = expected(chain, 'left', 1.2, render(pinhole(640, 360), FRAME_PEOPLE, Room(wall=4.0)))
    there = people.keypoints[..., 2] > 0
    np.testing.assert_allclose(larger.keypoints[there][:, :2] + 0.5, 2 * (people.keypoints[there][:, :2] + 0.5), atol=2)
    assert len(expected(chain, 'right', 1.2)) == 0


def test_without_points_people_are_expected_by_the_image_and_a_look_in_vain_counts(chain):
    for stamp, people, existence in ((1.0, FRAME.people, 0.5), (1.3, People2D.empty(COCO_18), 0.6),
                                     (1.6, People2D.empty(COCO_18), 0.0)):
        assert len(seen(chain, 'left', stamp, people, points=None).people_2d) == len(people)
        known = chain.detection.asked[-1][1]
        assert known.ids.tolist() == ([] if stamp == 1.0 else [1]) and (known.existence > existence).all()
    assert chain.detection.asked[-1][1].existence < chain.detection.asked[-2][1].existence


def test_the_detection_gets_image_and_depth_and_learns_the_ids(chain):
    twice = FRAME.people.joined(FRAME.people)  # the second one is the same person
    seen(chain, 'left', people=twice)
    seen(chain, 'left', 1.1)
    image, _, _ = chain.detection.asked[-1]
    assert (image.camera, image.stamp) == ('left', 1.1)
    assert np.nanmedian(image.depth.depth) == pytest.approx(np.median(FRAME.depth) / 1000, abs=0.01)
    (first, ids), second = chain.detection.told
    assert first == 1.0 and len(ids) == 2 and ids[0] == 1 != ids[1] and second == (1.1, [1])


def test_a_stream_publishes_before_the_rest_of_the_image_is_searched(chain):
    assert list(chain.search()) == []
    result = chain.look(frame_of('left'))
    assert len(result.people_3d) == 1 and not chain.detection.asked[-1][2] and chain.detection.searched == []
    assert [part.seconds for part in chain.search()] == [0.1] and chain.detection.searched == [1.0]
    chain.update(frame_of('left', 1.1))
    assert chain.detection.asked[-1][2], 'recordings are searched in full'


@pytest.mark.parametrize('stamp, told', [(99.6, True), (100.2, True), (99.0, False), (0.0, False), (103.0, False)])
def test_no_person_is_expected_after_a_gap_or_where_the_clock_was_reset(chain, stamp, told):
    seen(chain, 'left', 100.0)
    assert len(expected(chain, 'left', stamp)) == told


def test_a_driver_may_change_size_and_aspect_ratio_of_its_images(chain):
    ids = seen(chain, 'left').people_3d.ids.tolist()
    wide = render(pinhole(320, 240, focal=0.6), FRAME_PEOPLE, Room(wall=4.0))
    # where people will be in the new image is not known before its points say of which camera it is
    assert len(expected(chain, 'left', 1.1, wide)) == 0
    assert chain.detection.told[-1] == (1.1, ids), 'in space, no person has moved'
    assert_near(expected(chain, 'left', 1.2, wide), wide)
    assert len(expected(chain, 'left', 1.3)) == 0


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
        if number:
            assert_near(chain.detection.asked[-1][1], view, 0.02 * view.size[0])


def test_without_tracking_in_space_the_ids_are_those_of_the_image():
    chain = make_chain(build(EstimatorSettings, {'tracking': False}))
    results = [seen(chain, 'left', stamp) for stamp in (1.0, 1.1, 100.0)]
    assert [result.people_3d.ids.tolist() for result in results] == [[1], [1], [2]]
    assert [result.people_2d.ids.tolist() for result in results] == [[1], [1], [2]]


def test_ids_of_a_detection_that_gives_them_stay_without_tracking_in_space():
    chain = make_chain(build(EstimatorSettings, {'tracking': False}))
    chain.detection.gives_ids, chain.detection.look = True, lambda frame, *_: Looks(
        replace(FRAME.people, ids=[7]), np.zeros(0, np.int64))
    assert seen(chain, 'left').people_3d.ids.tolist() == [7]
    assert seen(chain, 'left', 9.0, points=None).people_2d.ids.tolist() == [7]


def test_ids_of_another_tracker_are_no_crops_of_tracks_in_space(monkeypatch, chain):
    chain.detection.gives_ids, chain.detection.look = True, lambda frame, *_: Looks(
        replace(FRAME.people, ids=[1]), np.zeros(0, np.int64))
    given, update = [], PeopleEstimator.update
    monkeypatch.setattr(PeopleEstimator, 'update', lambda self, people, *others: given.append(people.ids.tolist())
                        or update(self, people, *others))
    assert [seen(chain, 'left', stamp).people_3d.ids.tolist() for stamp in (1.0, 1.1)] == [[1], [1]]
    assert given == [[-1], [-1]]
