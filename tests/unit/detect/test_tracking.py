"""Life stories: people appear, stay, hide, cross and leave, and keep their ids, which are not used again."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.detect.detection import Looks
from openpose_ros_pkg.detect.existence import EXISTENCE, of_miss
from openpose_ros_pkg.detect.tracking import TRACKING, ImageTracker, Mounting, PerCamera, TrackingParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18

K = len(COCO_18.joints)
SIZE, BEGIN = (1200, 400), 1000.0
# A standing body of 80 x 240 px about its middle; the joints' places are arbitrary but all different.
BODY = np.stack([np.linspace(-40, 40, K), np.linspace(-120, 120, K)[np.arange(K) * 7 % K]], axis=-1)
ALL = range(K)


def frame(*places, joints=ALL):
    """People at (x, y), each with the given joints."""
    keypoints = np.full((len(places), K, 3), np.nan)
    keypoints[..., 2] = 0
    for row, place in zip(keypoints, places):
        for joint in joints:
            row[joint] = (*(BODY[joint] + place), 0.8)
    return People2D(COCO_18, keypoints, np.ones(len(places)), np.full(len(places), -1))


class Tracker:
    """Tracks people whose images are searched in full at stamps [s] after `BEGIN`."""

    def __init__(self, params=None):
        self.tracker = ImageTracker(params or TrackingParams())

    def expected(self, stamp, size=SIZE):
        return self.tracker.expected(BEGIN + stamp, size, COCO_18)

    def update(self, people, stamp, size=SIZE):
        return self.tracker.update(Looks.of_all(people, self.expected(stamp, size)), BEGIN + stamp, size)


def looks(people, missed=()):
    return Looks(people, np.array(missed, np.int64))


def ids(tracker, people, stamp):
    return tracker.update(people, stamp).ids.tolist()


@pytest.fixture()
def tracker():
    return Tracker()


def test_a_person_who_stays_keeps_the_id_and_a_new_one_gets_the_next(tracker):
    assert ids(tracker, frame((100, 200)), 0.0) == [1]
    assert ids(tracker, frame((104, 200), (600, 200)), 0.1) == [1, 2]
    assert ids(tracker, frame((108, 200), (600, 200), (900, 200)), 0.2) == [1, 2, 3]


def test_a_short_drop_out_is_bridged_at_walking_speed(tracker):
    # 200 px/s: 100 px in the half second behind a pillar, more than the body is wide
    for i in range(15):
        assert ids(tracker, frame((100 + 200 * i / 15, 200)), i / 15) == [1]
    for i in range(15, 22):
        tracker.update(frame(), i / 15)
    assert ids(tracker, frame((100 + 200 * 22 / 15, 200)), 22 / 15) == [1]


def test_after_the_timeout_the_same_place_is_a_person_new(tracker):
    assert ids(tracker, frame((300, 200)), 0.0) == [1]
    assert ids(tracker, frame((300, 200)), 1.99) == [1]
    assert ids(tracker, frame((300, 200)), 1.99 + 2.01) == [2]


def test_two_who_pass_each_other_keep_their_ids(tracker):
    # both at 150 px/s, 40 px apart in height; no frame shows one of them alone
    for i in range(60):
        left, right = (100 + 10 * i, 200), (700 - 10 * i, 240)
        assert ids(tracker, frame(left, right), i / 15) == [1, 2]


def test_two_who_cross_while_one_is_hidden_keep_their_ids(tracker):
    for i in range(60):
        left, right = (100 + 10 * i, 200), (700 - 10 * i, 200)
        hidden = abs(left[0] - right[0]) < 80
        expected = [1] if hidden else [1, 2]
        assert ids(tracker, frame(left) if hidden else frame(left, right), i / 15) == expected


def test_one_joint_that_jumps_does_not_change_who_it_is(tracker):
    tracker.update(frame((300, 200)), 0.0)
    keypoints = frame((300, 200)).keypoints.copy()
    keypoints[0, 4, :2] = (900, 10)
    assert ids(tracker, People2D(COCO_18, keypoints, [1], [-1]), 0.1) == [1]
    assert ids(tracker, frame((300, 200)), 0.2) == [1]


def test_the_same_frame_twice_and_a_late_one_keep_the_ids(tracker):
    for i in range(10):
        people = frame((100 + 10 * i, 200), (500, 200))
        assert ids(tracker, people, i / 15) == [1, 2]
        assert ids(tracker, people, i / 15) == [1, 2]
    assert ids(tracker, frame((500, 200), (170, 200)), 7 / 15) == [2, 1]
    assert ids(tracker, frame((200, 200), (500, 200)), 10 / 15) == [1, 2]


def test_of_too_many_cameras_the_longest_unused_is_forgotten():
    values = PerCamera(list)
    first, second = values.of(0), values.of(1)
    for camera in range(2, TRACKING.most_cameras):
        values.of(camera)
    assert values.of(0) is first
    values.of('one more')
    assert len(values.all()) == TRACKING.most_cameras
    assert values.of(0) is first and values.of(1) is not second


def test_without_a_stamp_people_have_new_ids_and_no_track(tracker):
    assert ids(tracker, frame((100, 200)), 0.1) == [1]
    assert [ids(tracker, frame((100, 200)), stamp) for stamp in (-BEGIN, -BEGIN - 1)] == [[2], [3]]
    assert ids(tracker, frame((100, 200)), 0.2) == [1]


def test_stamps_that_jump_back_begin_anew_and_ids_are_not_used_again(tracker):
    assert ids(tracker, frame((100, 200)), 5.0) == [1]
    assert len(tracker.expected(1.0)) == 0
    assert ids(tracker, frame((100, 200)), 1.0) == [2]


def test_another_resolution_shows_the_same_people_and_another_aspect_does_not(tracker):
    tracker.update(frame((100, 200), (600, 200)), 0.0)
    half = frame((100, 200), (600, 200)).keypoints / (2, 2, 1)
    people = People2D(COCO_18, half, np.ones(2), np.full(2, -1))
    assert tracker.update(people, 0.1, (600, 200)).ids.tolist() == [1, 2]
    assert tracker.update(people, 0.2, (600, 400)).ids.tolist() == [3, 4]


# --- what is expected, and what looks tell of it ----------------------------------------------------------------------

def test_people_are_expected_where_they_walk_to(tracker):
    for i in range(10):
        tracker.update(frame((100 + 10 * i, 200)), 0.1 * i)
    there = tracker.expected(1.0)
    assert there.ids.tolist() == [1] and there.spread == pytest.approx([0.1 * TRACKING.spread_growth])
    np.testing.assert_allclose(there.keypoints[0, :, :2], BODY + np.array([200, 200]), atol=1)
    # after the time for which people are expected to walk on, they stand
    assert tracker.expected(1.6).keypoints[0, 0, 0] == tracker.expected(1.7).keypoints[0, 0, 0]


def test_a_person_at_the_border_is_less_visible_and_more_likely_to_leave(tracker):
    tracker.update(frame((600, 200), (-10, 200)), 0.0)
    inside, border = tracker.expected(0.0).visibility
    assert inside == TRACKING.open_view and border < 0.5 * inside
    middle, leaving = tracker.expected(1.0).existence / tracker.expected(0.0).existence
    assert middle == pytest.approx(np.exp(-1 / TrackingParams().track_timeout))
    assert leaving == pytest.approx(np.exp(-1 / EXISTENCE.leaving))


def test_a_person_who_was_missed_is_not_reported_and_one_whose_look_is_not_due_is():
    tracker = ImageTracker(TrackingParams())
    people = tracker.update(looks(frame((100, 200), (500, 200), (900, 200))), BEGIN, SIZE)
    seen, missed, waiting = people.ids.tolist()
    named = replace(frame((104, 200)), ids=np.array([seen]))
    found = tracker.update(looks(named, [missed]), BEGIN + 0.1, SIZE)
    assert found.ids.tolist() == [seen, waiting] and found.looked.tolist() == [True, False]
    np.testing.assert_allclose(found.xy[1], BODY + np.array([900, 200]), atol=1e-3)
    expected = tracker.expected(BEGIN + 0.1, SIZE, COCO_18)
    there = dict(zip(expected.ids.tolist(), expected.existence))
    assert there[seen] > there[waiting] > there[missed]
    # not looked at again, the one who was missed is not reported either
    again = tracker.update(looks(named), BEGIN + 0.2, SIZE)
    assert again.ids.tolist() == [seen, waiting]


def test_a_person_who_is_looked_for_in_vain_ends():
    tracker = ImageTracker(TrackingParams(track_timeout=60.0))
    tracker.update(looks(frame((600, 200))), BEGIN, SIZE)
    stamps, lived = BEGIN + 0.1 * np.arange(1, 100), 0
    born = tracker.expected(BEGIN, SIZE, COCO_18).existence[0]
    while len(tracker.expected(stamps[lived], SIZE, COCO_18)):
        assert len(tracker.update(looks(frame(), [1]), stamps[lived], SIZE)) == 0
        lived += 1
    odds = [np.log(one / (1 - one)) for one in (born, EXISTENCE.ended)]
    seconds = (odds[0] - odds[1]) / -of_miss(TRACKING.open_view, 1.0) * EXISTENCE.independent
    assert 0.1 * lived == pytest.approx(seconds, abs=0.11)


def test_new_limits_hold_at_once():
    tracker = ImageTracker(TrackingParams())
    tracker.update(looks(frame((600, 200))), BEGIN, SIZE)
    tracker.params = TrackingParams(track_timeout=0.5)
    assert tracker.update(looks(frame((600, 200))), BEGIN + 0.6, SIZE).ids.tolist() == [2]


def people_turned(*angles, length=80):
    """Return people whose heads are turned clockwise by angles [degrees], with a trunk of a length [px]."""
    people = frame(*((200 * number, 200) for number in range(1, len(angles) + 1)), joints=())
    for number, angle in enumerate(np.radians(angles)):
        trunk = np.array([np.sin(angle), -np.cos(angle)]) * length / 2
        across = np.array([-trunk[1], trunk[0]]) * 25 / length
        for part, side in (('shoulder', 1), ('hip', -1)):
            for name, sign in (('left', 1), ('right', -1)):
                people.keypoints[number, COCO_18.index[f'{name}_{part}']] = (*(side * trunk + sign * across + 200), 0.8)
    return replace(people, ids=np.arange(len(angles)))


@pytest.mark.parametrize('angles, turn', [
    ((), ''), ((0,), ''), ((180,), 180), ((170, 190), 180), ((90, 90), 270), ((-90, -80), 90), ((90,), ''),
    ((0, 180), ''), ((0, 0, 0, 0, 180), ''), ((0, 180, 180, 180, 180), 180), ((90, -90), '')], ids=str)
def test_heads_of_most_people_tell_how_the_camera_is_turned(angles, turn):
    mounting = Mounting()
    faults = [mounting.fault(people_turned(*angles)) for _ in range(TRACKING.turned_images)]
    assert not any(faults[:-1])
    assert faults[-1].endswith(f'rotate_image: {turn}' if turn else '')
    assert bool(faults[-1]) == bool(turn)


def test_people_who_bend_or_are_seen_from_the_head_tell_nothing_of_the_camera():
    """Nor do those without a trunk."""
    mounting, lying = Mounting(), Mounting()
    for angle in [0] * 9 + [180] * 30:
        assert not mounting.fault(people_turned(angle))
        assert not lying.fault(people_turned(180, length=20))
        assert not lying.fault(replace(frame((200, 200), joints=[0, 1]), ids=np.array([3])))
