"""Lives of people: born, kept, not looked at, given up. Networks are exact here, and tell which people they look at."""
from dataclasses import replace

import numpy as np
import pytest

from estimating import new_estimator, update
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED
from synthetic_scene import VISIBLE, Box, Person, Room, pinhole, render, standing, without_joints, without_people

RATE = 15.0
CAMERA = pinhole(320, 180)
NECK = COCO_18.index['neck']
GREEN = {'shirt': (50, 180, 50), 'trousers': (30, 30, 90)}
COVERED = np.zeros((CAMERA.height, CAMERA.width), np.uint16)


class Life:
    """What an estimator tells of people while time passes."""

    def __init__(self, room=None, rate=RATE):
        self.estimator, self.room, self.rate, self.stamp = new_estimator(), room or Room(), rate, 100.0

    def sees(self, *people, found=None, missed=None, depth=None, score=1.0, seconds=None):
        """Return the people of the last of some frames, of one if no time is given.

        found: numbers of the people that a network finds, of all if None; missed: see `update`.
        """
        frame = render(CAMERA, people, self.room)
        shown = replace(frame, people=without_joints(frame.people, frame.vis != VISIBLE))
        detected = without_people(shown, ~np.isin(frame.ids, frame.ids if found is None else found))
        return self.shows(replace(frame, people=replace(detected, scores=np.full(len(detected), score))), depth, missed,
                          1 if seconds is None else round(seconds * self.rate))

    def shows(self, frame, depth=None, missed=None, frames=1):
        for _ in range(frames):
            self.stamp += 1 / self.rate
            people = update(self.estimator, frame, self.stamp, depth=depth, missed=missed).people
        return people


def at(x, z=2.6, number=1, **values):
    return Person(number, x, z, standing(), **values)


# --- born -----------------------------------------------------------------------------------------------------------

def test_a_person_before_a_wall_is_reported_at_once():
    life = Life(Room(wall=3.1))
    assert 0.5 < life.sees(at(0.1)).existence[0] < 0.9
    assert life.sees(at(0.1), seconds=0.2).existence[0] > 0.95


def test_an_unsure_detection_is_reported_once_more_follow():
    life = Life(Room(wall=3.1))
    assert not len(life.sees(at(0.1), score=0.25))
    assert 0.5 < life.sees(at(0.1), seconds=0.5, score=0.25).existence[0] < 0.95


@pytest.mark.parametrize('about, turned', [('x', 0), ('y', 45), ('y', -60), ('x', 30)])
@pytest.mark.parametrize('z', [1.5, 4.0])
def test_a_picture_of_a_person_is_no_person(z, about, turned):
    """On a wall that is turned about an axis [deg], or on a screen, for 2 s."""
    cos, sin = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    right, down = ((1.0, 0, 0), (0, cos, -sin)) if about == 'x' else ((cos, 0, -sin), (0, 1.0, 0))
    normal = np.cross(right, down)
    frame = render(CAMERA, [at(0.1, z)], Room(wall=None, has_floor=False))
    body = frame.xyz[0] - (0.1, 0.0, 0.0)
    uv = CAMERA.project((0.1, 0.0, z) + body[:, :1] * right + body[:, 1:2] * down)
    inside = ((uv > 0) & (uv < (CAMERA.width - 1, CAMERA.height - 1))).all(axis=1)
    keypoints = np.where(inside[:, None], np.column_stack([uv, np.ones(18)]), (np.nan, np.nan, 0))
    wall = normal @ (0.1, 0.0, z) / (CAMERA.ray_grid() @ normal)
    depth = np.where((wall > 0) & (wall < 20), 1000 * wall, 0).astype(np.uint16)
    picture, life = replace(frame, people=People2D(COCO_18, keypoints[None], [1.0], [-1])), Life()
    assert all(len(life.shows(picture, depth)) == 0 for _ in range(round(2 * RATE)))


@pytest.mark.parametrize('z', [2.5, 5.5])
def test_a_person_who_lies_on_the_floor_is_one(z):
    """A camera at the ceiling: the surfaces of the body are 0.15 m above the floor."""
    life = Life(Room(wall=z + 0.1, has_floor=False))
    assert all(life.sees(at(0.1, z)).ids.tolist() == [1] for _ in range(5))


# --- kept -----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('rate', [5.0, 15.0, 30.0])
def test_a_person_behind_a_nearer_person_is_reported_and_keeps_the_id(rate):
    """One second long, in which the places beside the nearer person are seen to be empty."""
    life, behind = Life(rate=rate), at(0.0, 3.2)
    life.sees(behind, at(1.0, 2.0, 2, **GREEN), seconds=0.5)
    for x in np.linspace(1.0, 0.05, 10):
        life.sees(behind, at(x, 2.0, 2, **GREEN), found=[1, 2] if x > 0.3 else [2])
    for _ in range(round(rate)):
        people = life.sees(behind, at(0.05, 2.0, 2, **GREEN), found=[2])
        assert people.ids.tolist() == [2, 1]
    assert (people.status[1] == INFERRED).all() and people.existence[1] < people.existence[0]
    assert np.linalg.norm(people.xyz[1, NECK] - (0.0, -0.02, 3.2)) < people.sigma[1, NECK]
    for x in np.linspace(0.05, -1.0, 10):
        people = life.sees(behind, at(x, 2.0, 2, **GREEN), found=[1, 2] if x < -0.3 else [2])
    assert people.ids.tolist() == [1, 2] and people.existence[0] > 0.9


@pytest.mark.parametrize('seconds, kept', [(0.5, True), (1.2, True), (3.5, False)])
def test_existence_of_a_person_who_is_not_looked_at_stays_for_the_time_of_a_track(seconds, kept):
    """The depth tells nothing either."""
    life = Life()
    before = life.sees(at(0.1), seconds=0.5).existence[0]
    people = life.sees(at(0.1), found=[], missed=(), depth=COVERED, seconds=seconds)
    assert people.existence.tolist() == [before] * kept


@pytest.mark.parametrize('stops', [False, True])
def test_the_error_of_a_walker_who_becomes_hidden_is_known(stops):
    """Whether the person walks on or stops; 0.5 s after nothing is seen any more."""
    life, hidden = Life(Room(furniture=(Box((-0.3, -1.5, 1.5), (2.0, 1.2, 1.6)),))), []
    for i in range(40):
        x = -1.4 + 1.2 * i / RATE if not (stops and hidden) else hidden[0]
        frame = render(CAMERA, [at(x)], life.room)
        share = (frame.vis == VISIBLE).mean()
        people = life.sees(at(x), found=[1] if share > 0.4 else [])
        hidden += [x] if share == 0 else []
        off = np.linalg.norm(people.xyz[0] - frame.xyz[0], axis=1)
        if len(hidden) == 1:
            assert people.velocity[0, NECK, 0] > 0.8, 'no person stops at once'
        if hidden:
            assert (off < 2 * people.sigma[0]).mean() > 0.9
        if len(hidden) == 8:
            assert off[NECK] < 0.4 and people.sigma[0, NECK] < 0.65
            return


# --- given up -------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('missed', [None, ()], ids=['looked at in vain', 'the points tell'])
@pytest.mark.parametrize('seconds, rate', [(0.3, 15.0), (1.0, 15.0), (1.0, 4.0)])
def test_a_place_that_was_seen_empty_does_not_come_back_as_hidden(seconds, rate, missed):
    life = Life(rate=rate)
    life.sees(at(-0.6, 3.5), at(1.0, 2.5, 2, **GREEN), seconds=1.0)
    assert life.sees(at(1.0, 2.5, 2, **GREEN), missed=missed, seconds=seconds).ids.tolist() == [2]
    for x in np.linspace(1.0, -1.2, 25):
        assert life.sees(at(x, 2.5, 2, **GREEN), missed=missed).ids.tolist() == [2]


def test_a_body_in_free_view_in_which_no_look_finds_a_person_is_given_up():
    """Such as a coat on a stand, in which a network saw a person."""
    life = Life()
    assert life.sees(at(0.1), seconds=0.5).ids.tolist() == [1]
    assert len(life.sees(at(0.1), found=[], seconds=0.3)) == 1
    assert len(life.sees(at(0.1), found=[], seconds=0.6)) == 0


def test_the_track_of_a_place_that_is_seen_empty_ends_long_before_its_time():
    """It is asked for no more looks; `track_timeout` is 2 s."""
    life = Life()
    life.sees(at(0.1), seconds=1)
    life.sees(seconds=1)
    tracker = life.estimator._tracker
    assert len(tracker.memory.tracks) == 0 and tracker.memory.gone.ids.tolist() == [1]


def test_a_person_who_leaves_the_image_is_not_reported_outside():
    life = Life()
    for i in range(20):
        people = life.sees(at(1.2 + 0.1 * i))
    assert len(people) == 0


@pytest.mark.parametrize('seconds, reported', [(0.5, [1, 2]), (1.8, []), (4.0, [])])
def test_before_a_covered_camera_people_are_given_up_and_keep_their_ids(seconds, reported):
    life, people = Life(), (at(-0.6, 3.0), at(0.7, 2.6, 2, **GREEN))
    assert life.sees(*people, seconds=0.5).ids.tolist() == [1, 2]
    assert life.sees(*people, found=[], depth=COVERED, seconds=seconds).ids.tolist() == reported
    assert life.sees(*people, seconds=0.2).ids.tolist() == [1, 2]


# --- one place ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize('frames', [3, 5, 8])
def test_a_person_who_is_put_on_another_for_a_moment_keeps_the_id(frames):
    life, frame = Life(), render(CAMERA, [at(-0.25), at(0.25, number=2)], Room())
    life.shows(frame, frames=15)
    life.shows(replace(frame, people=frame.people.select(np.array([0, 0]))), frames=frames)
    people = life.shows(frame, frames=4)
    assert people.ids.tolist() == [1, 2]
    assert np.median(np.linalg.norm(people.xyz - frame.xyz, axis=2)) < 0.04


def test_two_who_touch_for_a_moment_keep_their_ids():
    life, way = Life(), np.concatenate([np.linspace(0.8, 0.15, 10), [0.15] * 3, np.linspace(0.15, 0.8, 10)])
    for x in way:
        assert life.sees(at(-x), at(x, 2.7, 2, **GREEN)).ids.tolist() == [1, 2]
