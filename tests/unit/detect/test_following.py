"""Life stories of people who are followed: networks look where they are expected, and search the rest now and then."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.crops import CROP, CrowdImage, prepare_crops
from openpose_ros_pkg.detect.detection import ImageFrame, never_wanted
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import FollowedPerson, FollowingParams, Opinion, PersonMemory, voted
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import MODES, DetectorSettings
from openpose_ros_pkg.detect.schedule import SCHEDULE
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import MovenetNetwork, ThunderNetwork, Together, chart, in_order, person_at

IMAGE, PERIOD, BEGIN = chart(640, 480), 4, 1000.0
LEFT, RIGHT = person_at(130, 120, 250), person_at(480, 150, 220)
# Of a pixel of the networks' inputs: the whole image takes MoveNet 10 ms, a crop 3 ms.
PACE = {'movenet_multipose': 0.010 / (384 * 288), 'movenet_thunder': 0.003 / 256 ** 2}
RATE, BUDGET = 50.0, SCHEDULE.followed_share / 50


class Scene:
    """A camera before people, and networks that see them truly."""

    def __init__(self, people, pace=PACE, **params):
        self.searching, self.looking = MovenetNetwork(), ThunderNetwork()
        settings = build(DetectorSettings, {'mode': 'fast', **params})
        networks = Together(movenet_multipose=self.searching, movenet_thunder=self.looking)
        following = FollowingParams(following='always', search_period=PERIOD)
        self.stream = NetworkDetection(Detector(settings, networks, following), TrackingParams(), following, pace)
        self.people = people

    def frame(self, stamp, people=None, image=IMAGE, camera='camera', **kwargs):
        """Return the people of the next frame, searches and looks at crops, and what they took [s].

        Args:
            stamp: since `BEGIN` [s].
        """
        return self._watched(people, lambda: self.stream.detect(ImageFrame(camera, BEGIN + stamp, image), **kwargs))

    def answered(self, stamp, people=None, **kwargs):
        """Return what `frame` does, before the search, and a function that searches and returns the same again."""
        prepared = self.stream.prepare(ImageFrame('camera', BEGIN + stamp, IMAGE, **kwargs))
        with self.stream.lock:
            computed, *_ = answer = self._watched(people, lambda: self.stream.compute(prepared))

        def search(wanted=never_wanted):
            with self.stream.lock:
                return self._watched(None, lambda: self.stream.search(computed, wanted))
        return (self.stream.finish(computed), *answer[1:]), search

    def _watched(self, people, act):
        self.people = self.people if people is None else people
        self.searching.people = self.looking.people = self.people
        before = len(self.searching.inputs), len(self.looking.inputs)
        found = act()
        searches, looks = self.searching.inputs[before[0]:], self.looking.inputs[before[1]:]
        seconds = sum(one.shape[0] * one.shape[1] * PACE['movenet_multipose'] for one in searches)
        return found, len(searches), len(looks), seconds + 0.003 * len(looks)


def right_of(person, pixels):
    """Return the (K, 2) or (K, 3) person, moved to the right."""
    return person + np.eye(person.shape[1])[0] * pixels


def near(found, person):
    return np.abs(found - person)[:14].max() < 4


def test_between_searches_people_are_followed_on_crops():
    scene = Scene([LEFT, RIGHT])
    first, searches, looks, _ = scene.frame(0.0)
    assert (searches, looks) == (1, 2) and sorted(first.ids) == [1, 2]
    for i in range(1, PERIOD):
        people = [right_of(LEFT, 10.0 * i), right_of(RIGHT, -8.0 * i)]
        found, searches, looks, _ = scene.frame(0.1 * i, people)
        assert (searches, looks) == (0, 2)
        assert all(near(one, person) for one, person in zip(in_order(found), people))
        assert found.ids.tolist() == first.ids.tolist() or sorted(found.ids) == [1, 2]


def test_a_lost_person_is_searched_for_at_once_and_not_reported():
    scene = Scene([LEFT, RIGHT])
    scene.frame(0.0)
    scene.frame(0.1)
    found, searches, _, _ = scene.frame(0.2, [LEFT])
    assert len(found) == 1 and near(found.xy[0], LEFT) and searches == 1
    found, searches, looks, _ = scene.frame(0.3)
    assert len(found) == 1 and (searches, looks) == (0, 2)  # it is looked for on a crop
    for i in range(4, 10):
        looks = scene.frame(0.1 * i)[2]
    assert looks == 1


def test_a_lost_person_is_looked_for_where_a_track_in_space_tells():
    """The person walks on behind something, and comes out far from where the image alone lets expect."""
    def story(tells):
        scene = Scene([LEFT, RIGHT])
        scene.frame(0.0)
        for stamp in (0.1, 0.2, 0.3):
            scene.frame(stamp, [LEFT])
        away = right_of(RIGHT, -90.0)
        keypoints = np.concatenate([away, np.ones((18, 1))], axis=1)[None]
        there = People2D(COCO_18, keypoints, np.ones(1), np.ones(1)) if tells else None
        return len(scene.frame(0.35, [LEFT, away], expected=there)[0])

    assert story(tells=True) == 2 and story(tells=False) == 1


def test_a_crop_that_slid_to_another_person_is_refused():
    """Two people come close, one passes behind the other: then both crops show the one in front."""
    scene = Scene([LEFT, right_of(LEFT, 150.0)])
    scene.frame(0.0)
    scene.frame(0.1, [LEFT, right_of(LEFT, 100.0)])
    found, _, looks, _ = scene.frame(0.2, [LEFT])
    assert looks >= 2
    assert len(found) == 1 and near(found.xy[0], LEFT)


@pytest.mark.parametrize('after', [-1.0, 5.0], ids=['back', 'gap'])
def test_stamps_that_jump_begin_anew(after):
    scene = Scene([LEFT])
    for i in range(2):
        scene.frame(10 + 0.1 * i)
    found, searches, _, _ = scene.frame(10.2 + after, [RIGHT])
    assert searches == 1 and len(found) == 1 and near(found.xy[0], RIGHT)


def test_the_budget_is_kept_and_all_people_are_reported():
    """The search takes more than a frame has: it is spread."""
    people = [person_at(x, 150, 200) for x in (70, 190, 320, 450, 570)]
    scene = Scene(people, target_rate=RATE)
    scene.frame(1.0)
    frames = [scene.frame(1.0 + 0.02 * i) for i in range(1, 40)]
    assert all(len(found) == len(people) for found, *_ in frames)
    assert np.mean([seconds for *_, seconds in frames]) <= 1.05 * BUDGET
    assert max(seconds for *_, seconds in frames) <= 1 / RATE
    assert sum(searches for _, searches, *_ in frames) >= 3
    assert all(found.looked.sum() == looks < len(people) for found, searches, looks, _ in frames if not searches)


def test_a_newcomer_is_found_within_a_third_of_a_second():
    scene = Scene([LEFT], target_rate=RATE)
    stamps = 1.0 + 0.02 * np.arange(30)
    for stamp in stamps[:10]:
        scene.frame(stamp)
    image = IMAGE.copy()
    image[200:260, 470:500, 2] += 60  # the person changes the image
    found = [len(scene.frame(stamp, [LEFT, RIGHT], image)[0]) for stamp in stamps[10:25]]
    assert found[-1] == 2 and found == sorted(found)


def test_people_are_returned_before_the_search_and_who_is_found_by_it_in_the_next_frame():
    scene = Scene([LEFT])
    for i in range(PERIOD):
        scene.frame(0.1 * i)
    (found, searches, looks, _), search = scene.answered(0.1 * PERIOD, [LEFT, RIGHT])
    assert (len(found), searches, looks) == (1, 0, 1)
    _, searches, looks, _ = search()
    assert (searches, looks) == (1, 1)  # the new person is confirmed on a crop
    (found, searches, looks, _), _ = scene.answered(0.1 * PERIOD + 0.1)
    assert (searches, looks) == (0, 2) and sorted(found.ids) == [1, 2]
    assert all(near(one, person) for one, person in zip(in_order(found), (LEFT, RIGHT)))


def test_an_image_that_waits_ends_the_search_at_the_next_part_but_does_not_put_it_off_for_ever():
    scene = Scene([LEFT], pace={name: 5 * seconds for name, seconds in PACE.items()}, target_rate=RATE)
    scene.frame(1.0)
    searched = []
    for i in range(1, 40):
        _, search = scene.answered(1.0 + 0.02 * i)
        searched.append(search(wanted=lambda seconds: True)[1])
    assert max(searched) == 1
    waits = np.diff(np.flatnonzero(searched)) * 0.02
    assert (waits >= SCHEDULE.patience - 0.001).all() and waits.max() <= SCHEDULE.patience + 0.04


@pytest.mark.parametrize('interval', [np.inf, 0.9], ids=['first', 'after a gap'])
def test_the_first_image_of_a_stream_shows_all_people_and_the_next_ones_take_a_crop_or_a_part(interval):
    scene = Scene(CROWD, pace={name: 20 * seconds for name, seconds in PACE.items()}, target_rate=RATE)
    taken, counts = [], []
    for i in range(50):
        (found, *_, first), search = scene.answered(1.0 + i / RATE, interval=1 / RATE if i else interval)
        taken.append(20 * (first + search(wanted=lambda seconds: True)[3]))
        counts.append(len(found))
    assert min(counts) == len(CROWD)
    assert max(taken[1:]) < 20 * (0.003 + 0.4 * 0.010)


def test_where_no_person_is_found_on_a_crop_the_search_is_done_at_once():
    scene = Scene([LEFT])
    scene.frame(0.0)
    scene.frame(0.1)
    (found, searches, _, _), search = scene.answered(0.2, [RIGHT])
    assert searches == 1 and len(found) == 1 and near(found.xy[0], RIGHT)
    assert search()[1] == 0


def test_the_search_of_an_image_that_is_no_longer_the_newest_is_left_out():
    scene = Scene([LEFT])
    for i in range(PERIOD):
        scene.frame(0.1 * i)
    _, search = scene.answered(0.1 * PERIOD)
    scene.answered(0.1 * PERIOD + 0.1)
    assert search()[1] == 0
    _, search = scene.answered(0.1 * PERIOD + 0.2)
    scene.answered(-5.0)  # the recording begins again
    assert search()[1] == 0


CROWD = [person_at(x, 150, 200) for x in (70, 190, 320, 450, 570)]


def test_people_far_beyond_a_thin_image_get_a_crop_that_fits_into_memory():
    person = np.full((1, 18, 3), 0.9, np.float32)
    person[0, :, :2] = np.linspace((0, -1e6), (40, 1e6), 18)
    refinement = next(iter(Scene([]).stream.detector.setup.recipe.refinements))
    crop, = prepare_crops(CrowdImage(np.zeros((6000, 40, 3), np.uint8), person, COCO_18), person, refinement)
    assert np.prod(crop.view.plan.image_size) <= 1.01 * CROP.most_area * 6000 * 40


def test_joints_that_an_earlier_search_alone_knows_end():
    """A crop shows the person without the first joints: what the search told of these fades, and is forgotten."""
    recipe = MODES['fast']
    pose = np.insert(LEFT[:, :2], 2, 0.9, axis=1).astype(np.float32)
    crop = pose.copy()
    crop[:4] = np.nan, np.nan, 0
    memory = PersonMemory(pose[:, 2], BEGIN, 0.0, {0: Opinion(pose, pose[:, :2], BEGIN)}, BEGIN)
    person = FollowedPerson(pose, 1, memory, crop=crop, opinions={recipe.pass_opinions: crop})
    assert (voted([person], recipe, BEGIN + 0.1).keypoints[0, :, 2] > 0).all()
    later = voted([person], recipe, BEGIN + 1.0).keypoints[0, :, 2]
    assert not (later[:4] > 0).any() and (later[4:] > 0).all()


def test_a_person_who_is_looked_for_in_vain_does_not_take_the_crops_of_others():
    """There is time for one crop in an image: all people get theirs in turn."""
    scene = Scene(CROWD[:3], pace={name: 5 * seconds for name, seconds in PACE.items()}, target_rate=RATE)
    scene.frame(1.0)
    looked = np.array([found.looked.sum() for found, *_ in (
        scene.answered(1.0 + i / RATE, CROWD[:2])[0] for i in range(1, 20))])
    assert looked.max() == 1 and looked.sum() >= 11
