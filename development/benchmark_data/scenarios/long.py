"""Sequences of 10 to 30 s for tracking: people who leave, return, hide, pass and turn round; pictures of people.

At half resolution, to be small. No person leaves the image by passing the camera: people
who are outside of it walk beside its view.
"""
from typing import Any, Callable, Dict, List, Sequence, Tuple, Union

import numpy as np

from ..people.geometry import heading
from ..people.motion import Motion, MotionKeys
from ..people.rig import Rig
from ..rendering.camera import Camera, Intrinsics
from ..rendering.depth_sensors import SENSORS
from ..rendering.renderer import Light, Renderer
from ..rendering.room import Room
from ..sequence import FPS, Scene
from .by_hand import scene
from .cast import rig

Step = Union[float, Tuple[float, float]]  # a time to stand [s], or a place to walk to [m]
SPEED, RAMP, TURN = 1.2, 0.3, 0.4  # of walking [m/s]; to start or stop, and to turn [s]
LIGHT = Light((-0.25, -0.8, 0.9))
PORTRAIT = Camera(Intrinsics(384, 768, 800.0, 800.0, 191.5, 383.5), 0.95, 0)  # 2.2 m away it sees 1.05 x 2.1 m
SCREEN = (0.9, 1.8)  # size of a picture in life size [m]


def route(start: Tuple[float, float], *steps: Step, speed: float = SPEED, facing: float = 0.0) -> MotionKeys:
    """Return the key frames of a person who walks straight from place to place and stands, turned to `facing` [deg]."""
    place, time, yaw = np.array(start, float), 0.0, facing
    path: List[Tuple[float, Any]] = [(0.0, place)]
    turns: List[Tuple[float, Any]] = [(0.0, yaw)]
    for step in steps:
        if isinstance(step, tuple):
            way = np.array(step) - place
            length = float(np.linalg.norm(way))
            ramp, began = way / length * speed * RAMP / 2, time
            time += length / speed + RAMP
            path += [(began + RAMP, place + ramp), (time - RAMP, place + way - ramp)]
            place, aim = place + way, heading(*way)
        else:
            began, time, aim = time, time + step, facing
        path.append((time, place))
        yaw += (aim - yaw + 180) % 360 - 180  # the shorter way round
        turns += [(began + TURN * 0.75, yaw), (time - TURN * 0.25, yaw)]
    return MotionKeys(path, turns)


def long_scene(name: str, room: Room, seconds: float, people: Sequence[Tuple[str, MotionKeys]],
               sensor: str = 'kinect_v2') -> Scene:
    """Return a scene of people of the cast, seen by a camera 1.45 m high at half resolution."""
    rigs = [rig(member) for member, _ in people]
    movers = [Motion(person, keys, 200 + k, seconds + 1) for k, (person, (_, keys)) in enumerate(zip(rigs, people))]
    view = Camera(SENSORS[sensor].intrinsics.halved(), 1.45, 7)
    return scene(name, room, (rigs, movers), view, LIGHT.direction, sensor=sensor,
                 frames=round(seconds * FPS))


def leave() -> Scene:
    """One leaves the image for 2 s, later for 5 s; one on the other side for 5 s; one stays."""
    return long_scene('leave', Room(61, 5.6, -4.4, 4.4), 25, [
        ('adam', route((-0.9, 2.6), 2.0, (-3.1, 2.6), 1.2, (-0.6, 2.8), 5.0, (-3.1, 2.6), 4.2, (-0.9, 2.5), 9.0)),
        ('bea', route((0.9, 3.1), 4.0, (3.6, 3.1), 4.2, (0.7, 3.3), 30.0)),
        ('dora', route((0.1, 4.3), 7.0, (0.6, 4.1), 6.0, (0.0, 4.4), 30.0))])


def away() -> Scene:
    """Adam leaves for 20 s; Finn, in alike clothes, comes meanwhile from the same side and leaves on the other."""
    return long_scene('away', Room(62, 5.6, -4.4, 4.4), 30, [
        ('adam', route((-0.5, 2.9), 2.5, (-3.4, 2.9), 19.0, (-0.3, 2.9), 30.0)),
        ('finn', route((-3.5, 3.0), 6.5, (0.1, 2.9), 9.0, (3.4, 2.9), 30.0)),
        ('hana', route((1.3, 3.9), 30.0, facing=-35.0))])


def behind_people() -> Scene:
    """One stops behind another for 2.5 s: goes on, comes back out on the same side, then on the other."""
    return long_scene('behind_people', Room(63, 5.8, -4.0, 4.0), 22, [
        ('ed', route((0.0, 2.2), 30.0, facing=15.0)),
        ('dora', route((-1.7, 3.9), 1.0, (0.0, 3.9), 2.5, (1.7, 3.9), 0.8, (0.0, 3.9), 2.5, (1.7, 3.8), 0.8,
                       (0.0, 3.9), 2.5, (-1.7, 3.9), 10.0)),
        ('carl', route((1.15, 4.9), 30.0, facing=-20.0))], 'xtion')


def behind_furniture() -> Scene:
    """One stands behind a partition for 3 s and behind a counter that hides the legs; another passes behind both."""
    room = Room(64, 5.8, -4.0, 4.0)
    room.box((-0.7, 2.6, 0), (1.1, 0.25, 2.05), room.wood((150, 120, 90)))
    room.table(1.4, 2.4, (1.3, 0.6, 0.95), solid=True)
    return long_scene('behind_furniture', room, 24, [
        ('gil', route((-2.3, 3.3), 0.8, (-0.85, 3.3), 3.0, (1.4, 3.2), 3.0, (-0.85, 3.3), 2.5, (1.3, 3.2), 2.0,
                      (0.4, 2.3), 10.0)),
        ('hana', route((2.3, 4.7), 3.0, (-2.9, 4.6), 2.0, (-0.95, 4.5), 2.5, (2.2, 4.6), 10.0))], 'realsense')


def passing() -> Scene:
    """Four walk to and fro past each other at 2.2 to 4.3 m; two of them wear alike clothes."""
    def to_and_fro(y: float, left: float, right: float, wait: float) -> MotionKeys:
        return route((left, y), wait, *([(right, y), 0.6, (left, y), 0.6] * 5))

    return long_scene('passing', Room(65, 5.8, -4.2, 4.2), 20, [
        ('hana', to_and_fro(2.2, -1.2, 1.2, 0.5)), ('adam', to_and_fro(2.95, 1.7, -1.7, 0.8)),
        ('finn', to_and_fro(3.6, -2.0, 2.0, 1.5)), ('carl', to_and_fro(4.3, 2.6, -2.4, 0.6))])


def turn_back() -> Scene:
    """One stops and turns round within half a second, in the open and behind another, who turns on the spot."""
    return long_scene('turn_back', Room(66, 5.6, -4.0, 4.0), 16, [
        ('bea', route((-1.8, 3.1), 0.6, (-0.5, 3.1), (-1.9, 3.1), (0.3, 3.1), (-1.5, 3.1), (1.7, 3.1), (0.35, 3.1),
                      (1.9, 3.2), (-1.6, 3.0), 9.0)),
        ('ed', MotionKeys([(0, (0.2, 2.0))], [(0, 0), (4.0, 10), (4.4, 185), (7.0, 180), (7.4, 355), (11, 350),
                                             (11.4, 170)]))])


def posters() -> Scene:
    """No person, but pictures of people, in life size and smaller."""
    return long_scene('posters', picture_room(67), 10, [])


def posters_people() -> Scene:
    """Two people walk and stand before and beside pictures of people."""
    return long_scene('posters_people', picture_room(68), 20, [
        ('adam', route((-2.2, 3.0), 0.5, (0.4, 2.9), 3.0, (1.35, 2.2), 2.0, (-1.3, 3.2), 20.0)),
        ('dora', route((2.9, 3.9), 4.0, (-0.4, 3.9), 3.0, (2.7, 3.8), 20.0))])


def picture_room(seed: int) -> Room:
    """Return a room with a picture in life size before the back wall, a smaller one on it, and one on a stand."""
    room = Room(seed, 4.8, -3.6, 3.6)
    carl, hana, gil = (room.texture(picture(name, facing)) for name, facing in (
        ('carl', 10.0), ('hana', -20.0), ('gil', 0.0)))
    width, height = SCREEN
    room.box((-1.6, 4.5, 0), (1.1, 0.06, 2.0), room.plain((40, 40, 44)), furniture=False)  # a screen before the wall
    room.upright(-2.05, 4.46, 0.1, width, height, carl)
    room.upright(-0.45, 4.45, 1.05, width / 2, height / 2, hana)
    room.box((1.25, 3.2, 0), (1.0, 0.05, 1.9), room.plain((210, 210, 205)))  # a banner on a stand
    room.upright(1.25 - width / 2, 3.17, 0.05, width, height, gil)
    return room


def picture(name: str, facing: float) -> np.ndarray:
    """Return a picture of a standing person of the cast, (H, W, 3) RGB 0..1."""
    person: Rig = rig(name)
    renderer = Renderer(Room(69, 3.4, -1.5, 1.5), LIGHT)
    renderer.aim(PORTRAIT)
    posed = person.pose(Motion(person, MotionKeys([(0, (0.0, 2.2))], [(0, facing)]), 300).at(0.0))
    return renderer.frame([(person.body, person.vertices(posed))]).color.clip(0, 1).astype(np.float32)


SCENARIOS: Dict[str, Callable[[], Scene]] = {build.__name__: build for build in (
    leave, away, behind_people, behind_furniture, passing, turn_back, posters, posters_people)}
