"""People in space by one image: bodies on the rays of keypoints, their scale by the floor, what they are when lost."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.detect.detection import KnownPeople
from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarks
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, COCO_18
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.lift.monocular import worlds_of
from skeleton_extract_3d.people import INFERRED
from skeleton_extract_3d.points.depth import NoDepth
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, standing, walking

SETTINGS = build(EstimatorSettings, {})
CAMERA, ROOM = pinhole(640, 360), Room(floor=1.2)
GREY = np.full((360, 640, 3), 90, np.uint8)
# The room's floor in the frame of the camera: normal up, height of the camera [m].
FLOOR = np.array([0.0, -1.0, 0.0, ROOM.floor])
HIPS = [COCO_18.index['right_hip'], COCO_18.index['left_hip']]
ANKLES, WRIST = [COCO_18.index['right_ankle'], COCO_18.index['left_ankle']], COCO_18.index['left_wrist']
# Size of the synthetic adult by the adult of mean stature.
SCALE = 1.02


def body_of(xyz, size=1.0):
    """Return what a network says of a person whose true joints are (18, 3) [m]: the size of all is the mean adult's."""
    world = np.full((33, 3), 0.0)
    middle = xyz[HIPS].mean(axis=0)
    for joint, name in enumerate(COCO_18.joints):
        if name in BLAZEPOSE_33.index:
            world[BLAZEPOSE_33.index[name]] = (xyz[joint] - middle) / (size * SCALE * METHOD.monocular.scale)
    return BodyLandmarks(np.zeros((33, 2)), np.ones(33), 1.0, world)


class Bodies:
    """A network that knows the bodies of the people of the newest image."""

    def __init__(self):
        self.found = []

    def observe(self, bgr, keypoints, skeleton):
        assert len(keypoints) == len(self.found) and skeleton == COCO_18
        return self.found


class Watched:
    """A chain that gets images of known people before a camera without depth."""

    def __init__(self):
        self.bodies, self.stamp = Bodies(), 0.9
        self.chain = PeopleChain(KnownPeople(COCO_18, lambda frame: frame.source), SETTINGS, bodies=self.bodies)

    def see(self, people, bodies, floor=None, bgr=GREY):
        """Return the result of the next image."""
        self.bodies.found, self.stamp = bodies, self.stamp + 0.1
        return self.chain.update(Frame('', self.stamp, bgr, NoDepth(CAMERA), floor=floor, source=people))


def scene(*people):
    return render(CAMERA, list(people), ROOM)


def moved(people, joint, by):
    """Return people with one keypoint of the first one elsewhere [px]."""
    keypoints = people.keypoints.copy()
    keypoints[0, joint, :2] += by
    return replace(people, keypoints=keypoints)


def distance(xyz):
    return float(np.linalg.norm(xyz[HIPS].mean(axis=0)))


def test_nobody_is_nobody():
    assert worlds_of([]).shape == (0, 18, 3)
    result = Watched().see(People2D.empty(COCO_18), [])
    assert len(result.people_3d) == 0 and result.doubts == ()


def test_bodies_by_the_names_of_joints():
    truth = scene(Person(1, 0.0, 3.0, walking(0.7))).xyz[0]
    bodies = worlds_of([None, body_of(truth)])
    assert np.isnan(bodies[0]).all()
    expected = (truth - truth[HIPS].mean(axis=0)) / (SCALE * METHOD.monocular.scale)
    apart = np.linalg.norm(bodies[1] - expected, axis=1)
    assert np.delete(apart, COCO_18.index['neck']).max() < 1e-9
    assert apart[COCO_18.index['neck']] < 0.1  # the middle of the shoulders


@pytest.mark.parametrize('yaw', [0.0, 1.0, np.pi])
def test_a_body_of_known_size_is_put_where_it_is(yaw):
    frame, watched = scene(Person(1, 0.6, 3.0, walking(0.7), yaw)), Watched()
    results = [watched.see(frame.people, [body_of(frame.xyz[0])]) for _ in range(5)]
    people = results[-1].people_3d
    assert people.ids.tolist() == [results[0].people_3d.ids[0]]
    assert (people.status == INFERRED).all() and np.isfinite(people.xyz).all()
    # the skeleton's stature is 1.02 of the expected one: so is its distance
    assert distance(people.xyz[0]) == pytest.approx(distance(frame.xyz[0]) / SCALE, rel=0.03)
    relative = (people.xyz[0] - people.xyz[0][HIPS].mean(axis=0)) - (frame.xyz[0] - frame.xyz[0][HIPS].mean(axis=0))
    assert np.median(np.linalg.norm(relative, axis=1)) < 0.05
    assert (np.linalg.norm(people.xyz[0] - frame.xyz[0], axis=1) < 2 * people.sigma[0]).all()
    assert people.sigma[0].min() > 0.1 * distance(frame.xyz[0])  # nothing tells the stature


def test_a_keypoint_that_is_elsewhere_moves_no_other_joint():
    frame, found = scene(Person(1, 0.0, 3.0, walking(0.7))), []
    for people in (frame.people, moved(frame.people, WRIST, 60.0)):
        found.append(Watched().see(people, [body_of(frame.xyz[0])]).people_3d)
    apart = np.linalg.norm(found[0].xyz - found[1].xyz, axis=2)[0]
    assert apart[WRIST] > 0.1 and found[1].sigma[0, WRIST] > 1.05 * found[0].sigma[0, WRIST]
    assert np.delete(apart, [WRIST, COCO_18.index['left_elbow']]).max() < 0.05


@pytest.mark.parametrize('size', [0.7, 1.0, 1.1])
def test_the_floor_tells_how_large_a_person_is_and_so_how_far(size):
    frame = scene(Person(1, 0.3, 3.4, standing(), scale=size))
    known, unknown = (Watched().see(frame.people, [body_of(frame.xyz[0], size)], floor).people_3d
                      for floor in (FLOOR, None))
    true = distance(frame.xyz[0])
    assert distance(known.xyz[0]) == pytest.approx(true, rel=0.06)
    assert distance(unknown.xyz[0]) == pytest.approx(true / (SCALE * size), rel=0.03)
    for people in (known, unknown):
        assert (np.linalg.norm(people.xyz - frame.xyz, axis=2) < 3 * people.sigma).all()
    assert known.sigma.max() < 0.7 * unknown.sigma.max()


def test_a_child_is_known_when_its_feet_are_no_longer_in_view():
    frame, watched = scene(Person(1, 0.3, 3.4, standing(), scale=0.75)), Watched()
    bodies = [body_of(frame.xyz[0], 0.75)]
    for _ in range(30):
        watched.see(frame.people, bodies, FLOOR)
    keypoints = frame.people.keypoints.copy()
    keypoints[:, ANKLES] = (np.nan, np.nan, 0.0)
    for _ in range(10):
        people = watched.see(replace(frame.people, keypoints=keypoints), bodies, FLOOR).people_3d
    assert distance(people.xyz[0]) == pytest.approx(distance(frame.xyz[0]), rel=0.06)


def test_ankles_at_the_border_of_the_image_stand_on_no_floor():
    frame = scene(Person(1, 0.0, 3.0, standing()))
    outside = frame.people.keypoints.copy()
    outside[:, ANKLES, 1] = CAMERA.height - 3  # where networks put those that are below the image
    nearer = frame.xyz[0] * 0.5  # the body is as large in the image as one at half the distance
    people = Watched().see(replace(frame.people, keypoints=outside), [body_of(frame.xyz[0])], FLOOR).people_3d
    assert distance(people.xyz[0]) > 1.3 * distance(nearer)
    assert people.sigma[0].min() > 0.1 * distance(people.xyz[0])


def test_a_person_whose_body_is_not_seen_is_placed_by_size():
    frame = scene(Person(1, -0.8, 3.0, standing()), Person(2, 0.8, 3.5, standing()))
    people = Watched().see(frame.people, [None, body_of(frame.xyz[1])]).people_3d
    assert (people.status == INFERRED).all()
    for found, truth in zip(people.xyz, frame.xyz):
        assert distance(found) == pytest.approx(distance(truth), rel=0.2)


def test_people_are_told_from_each_other_and_forgotten():
    watched, ids = Watched(), []
    for number in range(12):
        frame = scene(Person(1, -0.8 + 0.05 * number, 3.0, walking(number)), Person(2, 0.8, 3.5, standing()))
        order = [1, 0] if number % 2 else [0, 1]
        result = watched.see(frame.people.select(np.array(order)), [body_of(frame.xyz[row]) for row in order])
        ids.append([result.people_3d.ids[order.index(row)] for row in range(2)])
    assert len({tuple(each) for each in ids}) == 1 and len(set(ids[0])) == 2
    for _ in range(30):
        result = watched.see(People2D.empty(COCO_18), [])
    assert len(result.people_3d) == 0


@pytest.mark.parametrize('shirt, is_same', [((60, 60, 200), True), ((200, 120, 20), False)])
def test_people_who_return_are_known_by_their_clothes(shirt, is_same):
    watched = Watched()
    before, after = (scene(Person(1, 0.2, 3.0, standing(), shirt=colour)) for colour in ((60, 60, 200), shirt))
    for _ in range(20):
        result = watched.see(before.people, [body_of(before.xyz[0])], bgr=before.bgr)
    first = result.people_3d.ids.tolist()
    for _ in range(40):
        watched.see(People2D.empty(COCO_18), [])
    for _ in range(5):
        result = watched.see(after.people, [body_of(after.xyz[0])], bgr=after.bgr)
    assert len(first) == len(result.people_3d) == 1
    assert (result.people_3d.ids.tolist() == first) == is_same
