"""Life stories: people appear, stay, hide, cross and leave, and keep their ids, which are not used again."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.tracking import (
    TRACKING,
    ImageTracks,
    KeypointTracker,
    PerCamera,
    PersonIds,
    TrackingParams,
)
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18

K = len(COCO_18.joints)
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


def ids(tracker, people, stamp):
    return tracker.update(people, stamp).ids.tolist()


@pytest.fixture()
def tracker():
    return KeypointTracker(TrackingParams())


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


def test_stamps_that_stand_still_do_not_add_people_for_ever():
    """As of a client that fills in no stamps."""
    tracks, ids = ImageTracks(TrackingParams()), PersonIds()
    for number in range(TRACKING.most_tracks + 50):
        tracks, _ = tracks.updated(frame((1e4 * number, 200)), 0.0, ids)
    ids, _ = tracks.expected(0.0)
    assert len(ids) == TRACKING.most_tracks and max(ids) == TRACKING.most_tracks + 50


def test_a_person_found_later_in_a_frame_gets_no_id_that_another_one_has():
    tracks, given = ImageTracks(TrackingParams()), PersonIds()
    tracks, people = tracks.updated(frame((100, 200)), 1.0, given)
    tracks, later = tracks.updated(frame((120, 200), (600, 200)), 1.0, given, people.ids.tolist())
    assert people.ids.tolist() == [1] and later.ids.tolist() == [2, 3]
    _, people = tracks.updated(frame((100, 200), (120, 200), (600, 200)), 1.1, given)
    assert people.ids.tolist() == [1, 2, 3]
