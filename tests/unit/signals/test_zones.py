"""Whether people are inside zones: files, shapes, and who walks through, reaches in or may be there."""
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from animated_skeleton import STANDING, Limb, held, people_of, without
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import capsules_of
from openpose_ros_signals.zones import EMPTY, OCCUPIED, UNKNOWN, ZoneWatch, distances_to, read_zones
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.transform import IDENTITY

BOX = '- {name: cell, frame_id: /room, box: [[3, -1, 0], [2, 1, 2.5]]}\n'
ELL = '- {name: ell, frame_id: room, polygon: [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], z: [0, 1]}\n'
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
RATE = 15
EXAMPLE = Path(__file__).resolve().parents[3] / 'examples/zones.yaml'


def zones_of(tmp_path, text=BOX):
    path = tmp_path / 'zones.yaml'
    path.write_text(text)
    return read_zones(path)


def standing(*places, name=1, sigma=None, **how):
    people = people_of([replace(STANDING, place=place, **how) for place in places], range(name, name + len(places)),
                       np.random.RandomState(1))
    return people if sigma is None else replace(people, sigma=np.full_like(people.sigma, sigma))


def extent(people):
    """Return the least and greatest x of the capsules."""
    capsules = capsules_of(people)
    x, radii = capsules.ends[..., 0], capsules.radii
    return (x.min(axis=1) - radii).min(), (x.max(axis=1) + radii).max()


def test_the_example_is_a_file_of_zones():
    assert [zone.frame_id for zone in read_zones(EXAMPLE)] == ['base_link']


def test_distances_are_those_of_the_shape(tmp_path):
    (zone,) = zones_of(tmp_path, ELL)
    points = {(0.5, 0.5, 0.5): -0.5, (0.2, 1.5, 0.5): -0.2, (1.5, 1.5, 0.5): 0.5, (1.3, 1.4, 0.5): 0.3, (-3, 0, -4): 5,
              (1.5, 0.5, 1.2): 0.2, (1.5, 0.5, 0.9): -0.1, (3, 2, 3): 6 ** 0.5, (0.9, 0.9, 0.5): -2 ** 0.5 / 10}
    np.testing.assert_allclose(distances_to(zone, np.array(list(points))), list(points.values()), atol=1e-9)


@pytest.mark.parametrize('pose', [IDENTITY, (QUARTER, np.array([5.0, -2.0, 0.5]))], ids=['room', 'turned'])
def test_a_person_enters_and_leaves_at_the_true_times(tmp_path, pose):
    """Walks through a box at 1 m/s; `pose` takes the room, in which box and truth are, to the frame of the people."""
    watch, motion = ZoneWatch(zones_of(tmp_path)), held((0.0, replace(STANDING, place=(0, 0))),
                                                        (6.0, replace(STANDING, place=(6, 0))))
    back, front = extent(people_of([motion(0.0)], [1], np.random.RandomState(1)))
    states = []
    for stamp in np.arange(6 * RATE) / RATE:
        people = people_of([motion(stamp)], [1], np.random.RandomState(int(stamp * RATE)))
        moved = replace(people, xyz=people.xyz @ pose[0].T + pose[1])
        states += watch.update(moved, stamp, [pose])
    inside = np.array([state.inside == (1,) for state in states])
    assert [state.state == OCCUPIED for state in states] == inside.tolist()
    assert (np.diff(inside.astype(int)) != 0).sum() == 2, 'it enters and leaves once'
    entered, left = np.flatnonzero(inside)[[0, -1]] / RATE + (0, 1 / RATE)
    assert abs(entered - (2.0 - front)) <= 1 / RATE
    assert abs(left - (3.0 - back)) <= 1 / RATE
    assert {state.since for state in states} == {0.0, entered, left}
    assert states[int(RATE * (entered + left) / 2)].probability > 0.99
    assert states[0].probability < 0.01 and states[0].person == 1


def test_a_hand_reaches_in(tmp_path):
    reaching = STANDING.with_arm('right', Limb((0.0, 1.0, 0.0), (0.0, 1.0, 0.0)))
    people = people_of([reaching, STANDING], [7, 8], np.random.RandomState(1))
    wrist = people.xyz[0, COCO_18.index['right_wrist']]
    low, high = ((wrist + corner).tolist() for corner in ((0.04, -0.2, -0.2), (0.5, 0.2, 0.2)))
    (state,) = ZoneWatch(zones_of(tmp_path, f'- {{name: a, frame_id: r, box: [{low}, {high}]}}')).update(
        people, 0.0, [IDENTITY])
    assert (state.state, state.inside, state.person, state.part) == (OCCUPIED, (7,), 7, 'right_hand')


def test_sigma_makes_it_unsure_and_the_state_lasts(tmp_path):
    near = 2.0 - extent(standing((0.0, 0.0)))[1] - 0.1  # 0.1 m before the box
    sure, unsure = standing((near, 0.0)), standing((near, 0.0), sigma=1.0)
    watch = ZoneWatch(zones_of(tmp_path))

    def states(*frames):
        watch = ZoneWatch(zones_of(tmp_path))
        return [watch.update(people, number / RATE, [IDENTITY])[0] for number, people in enumerate(frames)]

    inside = standing((2.5, 0.0))
    first, last = states(unsure, sure)
    assert first.probability == pytest.approx(stats.t(3).sf(0.1 / (1.0 / 3)), abs=0.01)  # and between 0.3 and 0.7
    assert (first.state, last.state) == (UNKNOWN, EMPTY)
    assert [each.state for each in states(sure, unsure)] == [EMPTY, EMPTY]
    assert [each.state for each in states(inside, unsure, sure)] == [OCCUPIED, OCCUPIED, EMPTY]
    assert watch.update(inside, 0.0, [IDENTITY])[0].state == OCCUPIED
    assert watch.update(unsure, 5.0, [IDENTITY])[0].state == UNKNOWN, 'a gap'
    assert watch.update(inside, 5.1, [IDENTITY])[0].state == OCCUPIED
    assert watch.update(inside, 5.2, [None])[0].state == UNKNOWN
    assert watch.update(unsure, 5.3, [IDENTITY])[0].state == UNKNOWN, 'what was known before is not'


def test_what_is_not_known_is_not_empty(tmp_path):
    zones, far = zones_of(tmp_path, BOX + ELL), standing((9.0, 0.0))

    def state(people, *poses):
        return [each.state for each in ZoneWatch(zones).update(people, 0.0, poses or (IDENTITY, IDENTITY))]

    assert state(People3D.empty(COCO_18)) == [EMPTY, EMPTY]
    assert state(far) == [EMPTY, EMPTY]
    assert state(far, None, IDENTITY) == [UNKNOWN, EMPTY]
    assert state(without(far, COCO_18.joints)) == [UNKNOWN, UNKNOWN], 'a person that may be anywhere'
    near = 2.0 - extent(standing((0.0, 0.0)))[1] - 0.1  # 0.1 m before the box
    armless = without(standing((3.5, 0.0)), ('right_elbow', 'right_wrist'))
    assert state(armless) == [UNKNOWN, EMPTY], 'a hidden arm within reach'
    watch, unsure = ZoneWatch(zones[:1]), without(standing((near, 0.0), sigma=1.0), ('right_elbow', 'right_wrist'))
    assert watch.update(standing((9.0, 0.0)), 0.0, [IDENTITY])[0].state == EMPTY
    assert watch.update(unsure, 0.1, [IDENTITY])[0].state == UNKNOWN, 'that it was outside tells nothing of the arm'
    both = standing((2.5, 0.0), (9.0, 0.0))
    assert state(both) == [OCCUPIED, EMPTY]
    assert ZoneWatch(()).update(both, 0.0, ()) == ()


def test_people_who_are_gone_are_not_inside(tmp_path):
    watch = ZoneWatch(zones_of(tmp_path))
    assert watch.update(standing((2.5, 0.0), (2.5, 0.5)), 0.0, [IDENTITY])[0].inside == (1, 2)
    assert watch.update(standing((2.5, 0.5), name=2), 0.1, [IDENTITY])[0].inside == (2,)
    assert watch.update(People3D.empty(COCO_18), 0.2, [IDENTITY])[0].state == EMPTY


@pytest.mark.parametrize('text, names', [
    ('', 'None is not allowed: a list of zones'), ('cell: 3', 'a list'), ('- [a, r]', 'name, frame_id, and box'),
    ('- {name: a, frame_id: r}', 'name, frame_id, and box'), (BOX[:-2] + ', colour: red}', 'colour'),
    ('- {name: a, frame_id: 3, box: [[0, 0, 0], [1, 1, 1]]}', 'frame_id 3 is not allowed: a text'),
    ('- {frame_id: r, box: [[0, 0, 0], [1, 1, 1]]}', 'name None is not allowed'), (BOX + BOX, "name 'cell'"),
    ('- {name: a, frame_id: r, box: [[0, 0, 0], [1, 1, 0]]}', r"box \[\[0, 0, 0\], \[1, 1, 0\]\] of 'a'.*two corners"),
    ('- {name: a, frame_id: r, box: [[0, 0], [1, 1]]}', 'two corners'),
    ('- {name: a, frame_id: r, box: [[0, 0, 0], [1, 1, .inf]]}', 'two corners'),
    ('- {name: a, frame_id: r, box: [[0, 0, 0], [1, 1, x]]}', 'two corners'),
    ('- {name: a, frame_id: r, polygon: [[0, 0], [1, 1]], z: [0, 1]}', 'polygon .*three or more'),
    ('- {name: a, frame_id: r, polygon: [[0, 0], [1, 1], [2, 2]], z: [0, 1]}', 'polygon .*area'),
    ('- {name: a, frame_id: r, polygon: [[0, 0], [0, 0], [1, 0], [1, 1]], z: [0, 1]}', 'polygon'),
    ('- {name: a, frame_id: r, polygon: [[0, 0], [1, 0], [1, 1]]}', 'box or polygon and z'),
    ('- {name: a, frame_id: r, polygon: [[0, 0], [1, 0], [1, 1]], z: [1, 0]}', 'z .*lowest and highest'),
    ('- {', 'can')])
def test_wrong_files_name_key_value_and_what_is_allowed(tmp_path, text, names):
    with pytest.raises(BadInputError, match=f'zones {tmp_path}/zones.yaml.*{names}'):
        zones_of(tmp_path, text)
