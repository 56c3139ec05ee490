"""Bodies are found again by the points alone: rendered people who move in a known way between two frames."""
from dataclasses import replace

import numpy as np
import pytest

from skeleton_extract_3d.body.body import CHAINS, HEAD
from skeleton_extract_3d.lift.registration import (
    SeenBodies,
    grids_of,
    neighbours,
    places_of,
    radii_of,
    register,
    surfaces_of,
)
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import VISIBLE, Box, Person, Room, pinhole, pointing, render, standing, walking, with_noise

CAMERA = pinhole(480, 270)
# Standard deviation per axis of where a track expects a joint some frames after its last detection [m].
SPREAD = 0.08


def frame_of(*people, room=None):
    frame = render(CAMERA, people, room or Room())
    return replace(frame, depth=with_noise(frame.depth, np.random.default_rng(1)))


def places_in(frame):
    return places_of(frame.xyz, np.ones(frame.vis.shape, bool))


def visible_in(frame):
    seen = frame.vis == VISIBLE
    return np.column_stack([seen[:, CHAINS], seen[:, HEAD].any(axis=1)])


def surface_of(frame, row=0):
    """Return the surface of a person in a frame; ids are rows."""
    count = len(frame.xyz)
    seen = SeenBodies(DepthImage(frame.depth, CAMERA), CAMERA, None, 10.0, np.arange(count), np.ones(count, bool),
                      places_in(frame), radii_of(np.full(count, 1.75)), frame.vis == VISIBLE, np.ones((count, 18)))
    return surfaces_of(seen, np.array([row]))[row]


def found_in(frame, surface, expected, row=0, change=None):
    """Return a person registered with a frame; `expected` are the places of all people, (T, 13, 3)."""
    grid = grids_of(DepthImage(frame.depth, CAMERA), CAMERA, expected[[row]])[0]
    covariance = np.broadcast_to(SPREAD ** 2 * np.eye(3), (13, 3, 3))
    return register(surface, grid, (expected[row], covariance), neighbours(expected)[row], change)


def errors(places, truth, visible):
    return np.linalg.norm(places - truth, axis=1)[visible]


def raised(person, degrees):
    """Return the person with the left arm swung outwards."""
    arms = [person.pose.upper_arms.copy(), person.pose.forearms.copy()]
    for arm in arms:
        arm[1] = pointing(0, degrees, 1)
    return replace(person, pose=replace(person.pose, upper_arms=arms[0], forearms=arms[1]))


STANDING = Person(1, 0.2, 2.5, standing(25))
MOTIONS = {
    'at rest': (STANDING, STANDING),
    'a step to the side': (STANDING, replace(STANDING, x=0.3)),
    'a step nearer': (STANDING, replace(STANDING, z=2.38)),
    'a turn': (STANDING, replace(STANDING, yaw=0.25)),
    'an arm goes up': (raised(STANDING, 40), raised(STANDING, 58)),
    'a stride': (replace(STANDING, pose=walking(0.0)), replace(STANDING, pose=walking(0.5), x=0.26)),
}


@pytest.mark.parametrize('motion', MOTIONS)
def test_a_known_motion_is_recovered_from_where_the_person_was(motion):
    before, after = (frame_of(person) for person in MOTIONS[motion])
    places, sigma = found_in(after, surface_of(before), places_in(before))
    visible = visible_in(before)[0] & visible_in(after)[0]
    missed = errors(places_in(before)[0], places_in(after)[0], visible)
    left = errors(places, places_in(after)[0], visible)
    # flat surfaces tell little along themselves: 35 mm, or a third of the motion
    assert left.max() < max(0.035, 0.34 * missed.max())
    assert np.sqrt((left ** 2).mean()) < 0.025
    # errors are those of all three axes: two standard deviations of one hold 99 % of them where they are independent
    assert (left < 2 * np.sqrt(3) * sigma[visible]).mean() > 0.8


def test_the_camera_moves():
    """It goes 0.5 m to the right and turns by 0.1 rad: for the points, the person goes to the left."""
    frame = frame_of(STANDING)
    cos, sin = np.cos(0.1), np.sin(0.1)
    rotation, translation = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]), np.array([-0.5, 0.0, 0.1])
    expected = places_in(frame) @ rotation.T + translation
    hips = expected[0, 2:4].mean(axis=0)
    elsewhere = render(CAMERA, [replace(STANDING, x=hips[0], z=hips[2], yaw=-0.1)])
    places, _ = found_in(elsewhere, surface_of(frame), expected, change=(rotation, translation))
    assert errors(places, expected[0], visible_in(frame)[0]).max() < 0.03


@pytest.mark.parametrize('frame', [
    frame_of(), frame_of(room=Room(furniture=(Box((-0.6, -1.0, 1.5), (0.9, 1.2, 1.7)),))),
    frame_of(replace(STANDING, x=1.0))], ids=['gone', 'behind a cupboard', 'too far away'])
def test_a_body_that_does_not_fit_is_dropped(frame):
    assert found_in(frame, surface_of(frame_of(STANDING)), places_in(frame_of(STANDING))) is None


def test_points_of_another_person_are_not_taken():
    """The person has gone, and another one, who is tracked, stepped just before that place."""
    before, other = frame_of(STANDING), replace(STANDING, id=2, z=2.42)
    after = frame_of(other)
    expected = np.concatenate([places_in(before), places_in(after)])
    assert found_in(after, surface_of(before), expected[:1]) is not None
    assert found_in(after, surface_of(before), expected) is None


def test_people_side_by_side_are_not_drawn_to_each_other():
    people = [STANDING, Person(2, 0.75, 2.5, standing(25))]
    before, after = frame_of(*people), frame_of(replace(STANDING, x=0.27), people[1])
    for row in range(2):
        places, _ = found_in(after, surface_of(before, row), places_in(before), row)
        visible = visible_in(before)[row] & visible_in(after)[row]
        assert np.sqrt((errors(places, places_in(after)[row], visible) ** 2).mean()) < 0.025


def test_a_grid_holds_the_points_of_its_pixels():
    frame = frame_of(STANDING)
    depth, ray = grids_of(DepthImage(frame.depth, CAMERA), CAMERA, places_in(frame))[0]
    rows, columns = np.nonzero(depth)
    xy = np.column_stack([columns, rows, np.ones(len(rows))]) @ ray.T
    uv = CAMERA.project(np.column_stack([xy, np.ones(len(xy))]))
    np.testing.assert_allclose(uv, np.rint(uv), atol=1e-6)
    pixels = np.rint(uv).astype(int)
    np.testing.assert_allclose(depth[rows, columns], frame.depth[pixels[:, 1], pixels[:, 0]] / 1000, rtol=1e-6)
