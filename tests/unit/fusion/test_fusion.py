"""Life stories: what becomes of people in several cameras."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_pkg.skeletons import COCO_18
from simulated_mocap import STANDING
from simulated_rig import Room, around, walking
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

RATE = 15.0
# Keypoints lie up to 20 mm beside the joints, which the simulated cameras see exactly; their noise comes to that [m].
NEAR = 0.05


def paths(*people, seconds=4.0):
    """Return people who stand, or walk at a constant speed: each given by (x, y) at the start and at the end [m]."""
    times = np.arange(0, seconds + 0.5, 1 / 60)
    body = np.array([STANDING[joint] for joint in COCO_18.joints])
    share = np.minimum(times / seconds, 1)[:, np.newaxis]
    joints = []
    for start, end in people:
        place = np.array(start) + share * (np.array(end) - np.array(start))
        joints.append(body + np.concatenate([place, np.zeros((len(times), 1))], axis=1)[:, np.newaxis])
    return Room(times, np.array(joints))


def live(room, cameras, seconds=3.0, sees=lambda camera, time: None, fusion=None, start=0.1, missing=()):
    """Let the cameras see people, without some joints, and return time, fused people and truth of each frame.

    `sees` tells which people a camera sees at a time: their numbers, or None for all.
    """
    fusion, story = PeopleFusion() if fusion is None else fusion, []
    for time in start + np.arange(int(seconds * RATE)) / RATE:
        sightings = [without_joints(camera.see(room, time, sees(camera.name, time)), missing) for camera in cameras]
        story.append((time, fusion.update(sightings, time), room.at(time)))
    return story


def identities(people, truth):
    """Return the id of the fused person at the place of each true one; there are no others."""
    apart = np.array([np.linalg.norm(people.xyz - joints, axis=2).mean(axis=1) for joints in truth])
    assert apart.shape == (len(truth), len(truth)) and (apart.min(axis=1) < NEAR).all()
    return people.ids[apart.argmin(axis=1)].tolist()


def ids_of(story, settled=0.3):
    """Return the ids of the true people, which do not change once the story has settled."""
    found = [identities(people, truth) for time, people, truth in story if time > story[0][0] + settled]
    assert all(ids == found[0] for ids in found)
    return found[0]


def test_cameras_that_see_no_person_give_none():
    assert not any(len(people) for _, people, _ in live(walking(1, 1), around(3), 0.5, sees=lambda camera, time: ()))
    assert len(PeopleFusion().update([], 0.0)) == 0


def test_people_in_all_cameras_are_there_once_from_the_first_frame_on():
    story = live(walking(4, 4), around(3))
    assert len(story[0][1]) == 4 and sorted(ids_of(story, settled=0)) == [1, 2, 3, 4]
    assert all((people.status == MEASURED).all() for _, people, _ in story)


def test_fused_joints_are_nearer_than_those_of_a_camera():
    def error(count):
        story = live(walking(4, 1), around(count, noise=0.06))[5:]
        return np.mean([np.linalg.norm(people.xyz[0] - truth[0], axis=1).mean() for _, people, truth in story])

    assert error(4) < 0.8 * error(1)


@pytest.mark.parametrize('first, second, noise', [
    (((-1, 0), (1, 0)), ((1, 0.5), (-1, 0.5)), 0.02), (((0, 0), (0, 0)), ((0.3, 0), (0.3, 0)), 0.005)])
def test_two_people_near_each_other_keep_their_ids(first, second, noise):
    """They pass 0.5 m apart; or stand nearer than the greatest distance at which two fused people become one."""
    assert ids_of(live(paths(first, second), around(3, noise=noise)))


def test_a_person_walks_through_cameras_that_do_not_overlap():
    room = paths(((-2, 0), (2, 0)))
    views = {'camera0': (-9, -0.5), 'camera1': (-0.4, 0.4), 'camera2': (0.5, 9)}

    def sees(camera, time):
        low, high = views[camera]
        return None if low < room.at(time)[0, 1, 0] < high else ()

    found = [people.ids.tolist() for time, people, _ in live(room, around(3), 4.0, sees) if time > 0.4]
    assert all(ids in ([1], []) for ids in found) and found.count([1]) > 0.9 * len(found)


def test_a_camera_that_dies_and_comes_back_with_new_ids_changes_no_id():
    cameras, room = around(3), walking(5, 3)
    fusion = PeopleFusion()
    before = ids_of(live(room, cameras, 1.0, fusion=fusion))
    assert ids_of(live(room, cameras[1:], 1.0, fusion=fusion, start=1.1), settled=0) == before
    cameras[0].swapped = True
    assert ids_of(live(room, cameras, 1.0, fusion=fusion, start=2.1), settled=0) == before


@pytest.mark.parametrize('start', [2.2, 0.1], ids=['a pause of all cameras', 'time jumps back'])
def test_after_a_gap_people_get_new_ids(start):
    room, cameras, fusion = paths(((0, 0), (0, 0))), around(2), PeopleFusion()
    first = ids_of(live(room, cameras, 0.5, fusion=fusion, start=0.3))
    if start > 1:
        assert len(fusion.update([], 2.0)) == 0
    again = ids_of(live(room, cameras, 0.5, fusion=fusion, start=start), settled=0)
    assert len(again) == 1 and again != first


def test_a_camera_at_a_wrong_place_doubles_no_person():
    cameras = around(3)
    cameras[2].moved = (0.1, 0.0, 0.0)
    story = live(walking(4, 3), cameras)
    for _, people, truth in story[5:]:
        assert len(people) == 3
        # two cameras out of three are right
        assert np.median(np.linalg.norm(people.xyz[:, np.newaxis] - truth, axis=3).min(axis=1)) < NEAR


def with_joints(sighting, joints, **values):
    """Return a sighting of which some joints have other values, by attribute."""
    rows = [COCO_18.index[joint] for joint in joints]
    arrays = {name: getattr(sighting, name).copy() for name in values}
    for name, value in values.items():
        arrays[name][:, rows] = value
    return replace(sighting, **arrays)


def without_joints(sighting, joints):
    """Return a sighting of which some joints are missing."""
    return with_joints(sighting, joints, positions=np.nan, directions=np.nan, sigma=np.nan, status=MISSING)


def test_joints_are_measured_by_one_camera_or_inferred_or_missing():
    left, right = (without_joints(with_joints(camera.see(paths(((0, 0), (0, 0))), 0.5), ['right_wrist'],
                                              status=INFERRED, sigma=0.2), ['left_ankle']) for camera in around(2))
    right = with_joints(right, ['left_wrist'], status=INFERRED, sigma=0.15)
    people = PeopleFusion().update([left, right], 0.5)
    status = dict(zip(COCO_18.joints, people.status[0]))
    assert (status.pop('left_ankle'), status.pop('right_wrist')) == (MISSING, INFERRED)
    assert set(status.values()) == {MEASURED}
    assert np.isnan(people.xyz[0, COCO_18.index['left_ankle']]).all()
    assert people.sigma[0, COCO_18.index['right_wrist']] > 2 * np.nanmedian(people.sigma[0])


def test_frames_that_come_late_and_out_of_step_double_no_person():
    """As on an overloaded computer: cameras send every 0.1 to 0.3 s, and every tenth frame is up to 0.8 s late."""
    random, room, cameras, fusion = np.random.RandomState(0), walking(8, 4), around(4), PeopleFusion()
    arrivals = []
    for number in range(len(cameras)):
        stamps = np.cumsum(random.uniform(0.1, 0.3, 35))
        delays = np.where(random.rand(35) < 0.1, random.uniform(0.2, 0.8, 35), random.uniform(0, 0.1, 35))
        arrivals += [(arrival, stamp, number) for arrival, stamp in zip(stamps + delays, stamps)]
    newest, counts = 0.0, []
    for _, stamp, number in sorted(arrivals):
        newest = max(newest, stamp)
        people = fusion.update([cameras[number].see(room, stamp)], newest)
        counts.append(len(people))
    assert max(counts) == 4
    assert np.mean(np.array(counts[10:]) == 4) > 0.95
    assert sorted(people.ids) == [1, 2, 3, 4]


HIDDEN = [joint for joint in COCO_18.joints if joint not in ('nose', 'left_eye', 'right_eye')]


def test_a_person_with_three_joints_takes_no_id_but_keeps_the_one_it_has():
    room, fusion, cameras = paths(((0, 0), (0, 0))), PeopleFusion(), around(2)
    assert all(len(people) == 0 for _, people, _ in live(room, cameras, 1.9, fusion=fusion, missing=HIDDEN))
    assert ids_of(live(room, cameras, 0.5, fusion=fusion, start=2.1), settled=0) == [1]
    _, people, _ = live(room, cameras, 2.4, fusion=fusion, start=2.6, missing=HIDDEN)[-1]
    assert people.ids.tolist() == [1]
    assert ids_of(live(room, cameras, 0.5, fusion=fusion, start=5.0), settled=0) == [1]
