"""People from image to image: what crops and earlier searches tell of them, and life stories."""
from dataclasses import replace

import numpy as np
import pytest

from followed_stream import FollowedStream
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import (
    FollowingParams,
    Opinion,
    Person,
    PersonMemory,
    voted,
    with_crop,
    without_shared_crops,
)
from openpose_ros_pkg.detect.recipes import MODES, DetectorParams, DetectorSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import Poses
from stand_in_networks import MovenetNetwork, ThunderNetwork, Together, chart, in_order, person_at

RECIPE, BEGIN = MODES['fast'], 1000.0
CROP = RECIPE.pass_opinions  # number of the source that sees crops
IMAGE = chart(640, 480)
LEFT, RIGHT = person_at(130, 120, 250), person_at(480, 150, 220)
CROWD = [person_at(x, 150, 200) for x in (80, 195, 310, 425, 540)]
PACE = {'movenet_multipose': 0.0175 / (512 * 288), 'movenet_thunder': 0.007 / 256 ** 2}


def scored(pose, score=0.9):
    return np.insert(pose, 2, score, axis=1).astype(np.float32)


def right_of(person, pixels):
    """Return the (K, 2) or (K, 3) person, moved to the right."""
    return person + np.eye(person.shape[1], dtype=person.dtype)[0] * pixels


@pytest.mark.parametrize('following, detector, wanted', [
    ('auto', {}, False), ('auto', {'target_rate': 10.0}, True),
    ('auto', {'target_rate': 10.0, 'mode': 'accurate'}, False),
    ('never', {'target_rate': 10.0}, False), ('always', {'mode': 'accurate'}, True)], ids=str)
def test_frames_are_published_before_the_search_where_that_is_wanted(following, detector, wanted):
    assert FollowingParams(following=following).wanted(DetectorParams(**detector)) == wanted


# --- opinions ---------------------------------------------------------------------------------------------------------

POSE = scored(LEFT)


def remembered(opinions, score=0.9):
    return PersonMemory(np.full(18, score), opinions, BEGIN)


def looked_at(person, *poses):
    """Return a person after a look at a crop that shows these poses, beside no other person."""
    found = Poses(np.array(poses, np.float32).reshape(-1, 18, 3), np.ones(len(poses)))
    return with_crop(person, CROP, found, np.ones(18, bool), person.expected[None], RECIPE)


def test_joints_that_an_earlier_search_alone_knows_move_with_the_person_and_end():
    """A crop shows the person without the first joints: what the search told of these fades, and is forgotten."""
    crop = right_of(POSE, 12.0)
    crop[:4] = np.nan, np.nan, 0
    memory = remembered({0: Opinion(POSE, POSE[:, :2], BEGIN)})
    person = Person(right_of(POSE, 12.0), 1, memory, crop=crop, opinions={CROP: crop})
    soon = voted([person], RECIPE, BEGIN + 0.1).keypoints[0]
    np.testing.assert_allclose(soon[:, :2], right_of(LEFT, 12.0), atol=0.1)
    later = voted([person], RECIPE, BEGIN + 1.0).keypoints[0]
    assert not (later[:4, 2] > 0).any() and (later[4:, 2] > 0).all()


def test_a_source_that_did_not_find_the_person_counts_until_it_looks_again():
    """And one that never looked does not count."""
    def score(opinions, memory=None):
        person = Person(POSE, 1, memory, crop=POSE, opinions={CROP: POSE, **opinions})
        return voted([person], RECIPE, BEGIN + 9).scores[0]

    alone, missed = score({}), score({0: None})
    assert missed < 0.9 * alone
    assert score({}, remembered({0: Opinion(None, POSE[:, :2], BEGIN)})) == missed
    assert score({}, remembered({0: Opinion(POSE, POSE[:, :2], BEGIN)})) == alone  # forgotten


def test_on_a_crop_a_known_person_is_who_is_near_the_expected_place():
    person, near = Person(POSE, 1, remembered({})), right_of(POSE, 20.0)
    looked, size = looked_at(person, near), np.linalg.norm(np.ptp(LEFT, 0)) / 2
    assert looked.error == pytest.approx(20 / size, rel=0.01) and not looked.elsewhere
    no_one = looked_at(person, scored(LEFT, 0.1))
    assert no_one.crop is None and no_one.opinions == {CROP: None} and not no_one.found


def test_who_is_surely_seen_beside_the_expected_place_is_someone_else_unless_expected_there():
    person, away = Person(POSE, 1, remembered({})), right_of(POSE, 150.0)
    looked = looked_at(person, away)
    assert looked.elsewhere and looked.found
    assert looked_at(person, right_of(scored(LEFT, 0.3), 150.0)).crop is None
    both = np.stack([POSE, away])
    found = Poses(away[None], np.ones(1))
    assert with_crop(person, CROP, found, np.ones(18, bool), both, RECIPE).crop is None


def test_the_less_its_place_is_known_the_farther_away_a_person_may_be():
    person, away = Person(POSE, 1, remembered({})), right_of(POSE, 90.0)
    assert looked_at(person, away).elsewhere
    assert not looked_at(replace(person, spread=0.3), away).elsewhere


def test_a_crop_is_of_one_person():
    """Of two the one nearer to the expected place, of a known and a new one the known."""
    near, far = (looked_at(Person(right_of(POSE, off), number, remembered({})), POSE)
                 for number, off in ((1, 4), (2, 20)))
    new = looked_at(Person(POSE), POSE)
    assert [one.crop is not None for one in without_shared_crops([far, near], RECIPE)] == [False, True]
    assert [one.crop is not None for one in without_shared_crops([new, far], RECIPE)] == [False, True]
    beside = looked_at(Person(scored(RIGHT), 2, remembered({})), scored(RIGHT))
    assert all(one.crop is not None for one in without_shared_crops([near, beside], RECIPE))


# --- life stories -----------------------------------------------------------------------------------------------------

class Scene:
    """A camera before people, and networks that see them truly, on a machine that is slower by a factor."""

    def __init__(self, slow=1.0, **values):
        self.searching, self.looking = MovenetNetwork(), ThunderNetwork()
        networks = Together(movenet_multipose=self.searching, movenet_thunder=self.looking)
        pace = {name: slow * seconds for name, seconds in PACE.items()}
        settings = build(DetectorSettings, {'mode': 'fast', 'pose_model': 'COCO', **values})
        self.stream = FollowedStream(Detector(settings, networks), pace)

    def frame(self, stamp, people, image=IMAGE, **options):
        """Return the people of a frame at a stamp since `BEGIN` [s]."""
        self.searching.people = self.looking.people = people
        return self.stream.frame(BEGIN + stamp, image, **options)


@pytest.mark.parametrize('waits', [False, True], ids=['time to search', 'frames wait'])
@pytest.mark.parametrize('rate', [5, 15, 30])
def test_people_who_walk_keep_their_ids(rate, waits):
    scene = Scene()
    for i in range(2 * rate):
        people = [right_of(LEFT, 60.0 * i / rate), right_of(RIGHT, -50.0 * i / rate)]
        found = scene.frame(i / rate, people, waits=waits)
        assert sorted(found.ids) == [1, 2]
        seen = found.select(np.flatnonzero(found.looked))
        assert all(min(np.abs(one - person)[:14].max() for person in people) < 6 for one in seen.xy)


def test_a_person_who_leaves_is_not_reported_any_more_and_the_other_one_is():
    scene = Scene()
    for i in range(5):
        scene.frame(0.1 * i, [LEFT, RIGHT])
    for i in range(5, 40):
        found = scene.frame(0.1 * i, [LEFT])
        assert len(found) == 1 and np.abs(found.xy[0] - LEFT)[:14].max() < 4


def test_a_person_who_was_hidden_for_a_moment_has_the_same_id():
    scene = Scene()
    ids = [scene.frame(i / 15, [LEFT, RIGHT] if not 15 <= i < 25 else [LEFT]).ids.tolist() for i in range(40)]
    assert {number for of_frame in ids for number in of_frame} == {1, 2}
    assert sorted(ids[-1]) == [1, 2] and ids[20] == ids[0][:1] != ids[0]


@pytest.mark.parametrize('slow, waits', [(1, False), (4, True)])
def test_a_newcomer_is_found_within_a_third_of_a_second(slow, waits):
    scene = Scene(slow)
    for i in range(10):
        scene.frame(i / 30, [LEFT], waits=waits)
    image = IMAGE.copy()
    image[200:260, 470:500, 2] += 60  # the person changes the image
    found = [len(scene.frame(i / 30, [LEFT, RIGHT], image, waits=waits)) for i in range(10, 21)]
    assert found[-1] == 2 and found == sorted(found)


@pytest.mark.parametrize('slow', [1, 4])
def test_all_of_a_crowd_are_reported_in_each_image(slow):
    scene = Scene(slow)
    for i in range(30):
        found = scene.frame(i / 15, CROWD, waits=True)
        assert sorted(found.ids) == [1, 2, 3, 4, 5]
        assert all(np.abs(one - person)[:14].max() < 4 for one, person in zip(in_order(found), CROWD))
