"""The floor in scenes whose floor is known, and over time."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from openpose_ros_nodelets.floor import Floor, FloorParams, FloorTracker, find_floor
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import build

IMAGE_UP = np.array([0.0, -1, 0])
# How well a floor is to be found [rad], [m].
ANGLE, HEIGHT = np.radians(1), 0.03
ROOM = ((-2, -1, 0), (2, 5, 2.5))
BED = ((-2, 2, 0), (-0.2, 4, 0.5))
PEOPLE = tuple(((x, 2.5, 0), (x + 0.4, 2.8, 1.8)) for x in (0.2, 0.8, 1.4))


class Scene:
    """A camera of 160 x 120 pixels and 70 degrees in a room with boxes; axes: x right, y ahead, z up [m]."""

    def __init__(self, height, pitch, roll=0, boxes=()):
        # from the optical frame: x right, y down, z forward
        turn = Rotation.from_euler('XZ', (-pitch, roll), degrees=True).apply(np.eye(3)).T
        self._rotation = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) @ turn
        self._origin, self._boxes = np.array([0, 0, height]), boxes
        self.up, self.height = self._rotation[2], height

    def points(self, rows=120):
        """Return the points with noise of 1 cm along the rays, of the upper rows."""
        v, u = np.mgrid[:rows, :160]
        rays = np.stack([(u - 79.5) / 114, (v - 59.5) / 114, np.ones(u.shape)], axis=-1).reshape(-1, 3)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        distance = self._crossing(ROOM, rays)[1]
        for box in self._boxes:
            enter, leave = self._crossing(box, rays)
            distance = np.where((enter > 0) & (enter < leave), np.minimum(distance, enter), distance)
        return rays * (distance + np.random.RandomState(1).normal(0, 0.01, len(rays)))[:, None]

    def _crossing(self, box, rays):
        ends = [(np.array(corner) - self._origin) / (rays @ self._rotation.T) for corner in box]
        return np.minimum(*ends).max(axis=1), np.maximum(*ends).min(axis=1)


def find(scene, rows=120, tolerance=40):
    return find_floor(scene.points(rows), IMAGE_UP, np.radians(tolerance), FloorParams())


@pytest.mark.parametrize('scene', [
    *(Scene(height, pitch, roll) for height in (0.4, 0.9, 1.4) for pitch in (0, 15, 35) for roll in (-15, 0)),
    Scene(1.4, 25, boxes=[((-2, 0.6, 0.7), (0.7, 1.9, 0.75))]), Scene(1.3, 12, boxes=[BED, *PEOPLE])],
    ids=[*(f'empty room {number}' for number in range(18)), 'a table larger than the floor', 'a bed and people'])
def test_the_floor_is_found(scene):
    floor, fault = find(scene)
    assert fault == ''
    assert np.arccos(min(floor.normal @ scene.up, 1)) < ANGLE
    assert abs(floor.height - scene.height) < min(HEIGHT, 3 * floor.height_sigma + 0.01)
    np.testing.assert_allclose(floor.frame[:3, :3] @ (0, 0, 1), floor.normal)
    np.testing.assert_allclose(floor.frame[:3, 3], -floor.height * floor.normal)
    assert floor.frame[2, 0] > 0.5 and abs(np.linalg.det(floor.frame) - 1) < 1e-6  # x is forward


@pytest.mark.parametrize('scene, rows, tolerance, why', [
    (Scene(1.3, 10, boxes=[((-2, 0.3, 0.7), (2, 3.5, 0.75))]), 120, 40, 'points lie below'),
    (Scene(1.3, 0), 0, 40, 'too few'), (Scene(1.3, -10), 70, 40, 'no plane'), (Scene(1.3, -35), 120, 40, 'no plane'),
    (Scene(1.3, 5), 88, 40, 'narrow'), (Scene(1.3, 35), 120, 20, 'no plane')],
    ids=['a table', 'no points', 'walls alone', 'a ceiling', 'a narrow strip', 'tilt beyond the tolerance'])
def test_what_is_no_floor(scene, rows, tolerance, why):
    floor, fault = find(scene, rows, tolerance)
    assert floor is None and why in fault


def plane(height, tilt=0.0):
    tilt = np.radians(tilt)
    return Floor(np.array([0, -np.cos(tilt), np.sin(tilt)]), height, 0.5, 4.0, 0.01, 0.003)


# Planes in a row, each with how often it comes, 0.2 s apart; None: none is found. Then the height at the end.
@pytest.mark.parametrize('planes, expected', [
    ([(plane(1.3), 1)], None),
    ([(plane(1.3), 2)], 1.3),
    ([(plane(1.30), 2), (plane(1.34), 1)], 1.30 + 0.04 * (1 - np.exp(-0.2 / 0.5))),
    ([(plane(1.30), 2), (plane(1.34), 31)], 1.34),
    ([(plane(1.3), 5), (None, 1)], None),
    ([(plane(1.3), 5), (None, 1), (plane(1.3), 1)], 1.3),
    ([(plane(1.3), 5), (plane(0.6), 9)], None),
    ([(plane(1.3), 5), (plane(0.6), 9), (plane(1.3), 1)], 1.3),
    ([(plane(1.3), 5), (plane(0.6), 12)], 0.6),
    ([(plane(0.6), 5), (plane(1.3), 2)], 1.3),
    ([(plane(1.3), 5), (plane(1.3, 20), 2)], 1.3),
], ids=['one alone', 'two', 'smoothed', 'in the end', 'nothing is seen', 'and is seen again', 'a table for a moment',
        'and the floor again', 'the camera was raised', 'a lower plane', 'a tilted camera'])
def test_the_floor_over_time(planes, expected):
    tracker, stamp = FloorTracker(), 100.0
    for found, times in planes:
        for _ in range(times):
            floor = tracker.update(found, stamp)
            stamp += 0.2
    assert (None if floor is None else floor.height) == (expected and pytest.approx(expected, abs=1e-3))


def test_time_that_goes_back_is_another_recording():
    tracker = FloorTracker()
    for stamp in (100, 100.2):
        tracker.update(plane(1.3), stamp)
    assert tracker.update(plane(0.6), 10) is None
    assert tracker.update(plane(0.6), 10.2).height == 0.6


def test_parameters_of_before(caplog):
    assert build(FloorParams, {'up': [0.0, -2.0, 0.0]}).upwards.tolist() == [0, -1, 0]
    assert build(FloorParams, {'thickness': 0.03, 'most_height': 2}) == FloorParams(most_height=2.0)
    assert 'thickness' in caplog.text
    with pytest.raises(ParameterError, match="'up' = '0 0 0' is not allowed"):
        FloorParams(up='0 0 0')
