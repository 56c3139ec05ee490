"""Things that people hold with both hands: sheets of cloth, and rigid ones of boxes."""
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from .body import COCO18, Cloth, Material
from .geometry import rotation, unit
from .hand_poses import hand_angles
from .motion import Keys, track
from .rig import SIDES, Pose, Posed, Rig

Point = Tuple[float, float, float]
WRISTS = [COCO18.index('left_wrist'), COCO18.index('right_wrist')]
PALM = 0.08  # [m] from the wrist to what the hand holds
SHEET = (21, 15)  # columns and rows of a sheet's vertices
WIND = 0.45  # [Hz] of the folds that go along a sheet
# Corners of a unit cube, four for each face.
_CUBE = np.array([np.insert(corner, axis, end) for axis in range(3) for end in (-0.5, 0.5)
                  for corner in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))])


class Thing(NamedTuple):
    """A sheet of (width, height) that hangs from the hands, or boxes (centre, size), left, forward and up [m]."""

    cloth: Cloth
    sheet: Tuple[float, float] = (0.0, 0.0)
    boxes: Sequence[Tuple[Point, Point]] = ()


THINGS: Dict[str, Thing] = {
    'shirt': Thing(Cloth((96, 98, 104)), (0.66, 0.70)),
    'towel': Thing(Cloth((206, 184, 150), 'stripes', (150, 60, 60), 0.11), (0.86, 1.05)),
    'box': Thing(Cloth((168, 128, 86)), boxes=[((0, 0.11, 0.02), (0.44, 0.36, 0.38))]),
    'tray': Thing(Cloth((188, 188, 196)), boxes=[
        ((0, 0.12, 0.03), (0.46, 0.34, 0.02)), ((0.1, 0.14, 0.09), (0.09, 0.09, 0.11)),
        ((-0.1, 0.1, 0.07), (0.18, 0.18, 0.06))]),
    'trolley': Thing(Cloth((70, 104, 140), 'check', (190, 190, 190), 0.2), boxes=[
        ((0, 0.02, 0.0), (0.56, 0.04, 0.04)), ((0, 0.50, -0.30), (0.54, 0.80, 0.56)),
        ((0, 0.12, -0.78), (0.50, 0.05, 0.30)), ((0, 0.88, -0.78), (0.50, 0.05, 0.30))])}


class Mesh(NamedTuple):
    """What a renderer reads of a body, of a thing."""

    rest: np.ndarray
    faces: np.ndarray
    face_materials: np.ndarray
    materials: List[Material]


class Holder:
    """A mover who holds a thing: hands at (outward, forward, up as a share of the stature), both or per side."""

    def __init__(self, rig: Rig, mover: Any, thing: str, left: Keys, right: Keys = ()) -> None:
        self.rig, self.mover, self.thing = rig, mover, THINGS[thing]
        self.hands = {'L': track(left), 'R': track(right or left)}
        corners = np.arange(SHEET[1] * SHEET[0]).reshape(SHEET[::-1])
        squares = np.stack([corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]], -1).reshape(-1, 4)
        if self.thing.boxes:
            squares = np.arange(24 * len(self.thing.boxes)).reshape(-1, 4)
        faces = squares[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
        self.mesh = Mesh(self._shape(0.0), faces, np.zeros(len(faces), int), [Material('cloth', self.thing.cloth)])

    def at(self, t: float) -> Pose:
        """Return the pose of the mover at t [s], with the hands at the thing."""
        pose, fingers = self.mover.at(t), hand_angles('relax' if self.thing.boxes else 'fist')
        turn, wrists, hands = rotation('z', pose.yaw), {}, {}
        for side, sign in SIDES:
            outward, forward, up = self.hands[side](t)
            place = [pose.x, pose.y, self.rig.hip[2] - self.rig.standing_hip + up * self.rig.body.stature]
            place = np.array(place) + turn @ [sign * outward, -forward, 0]
            wrists[side] = (place, np.array([0.8, -0.5, -0.6]), 1.0)
            hands[side] = (turn @ [0, -1, 0], turn @ [-sign, 0, 0], 0.8)
        return pose._replace(wrists=wrists, hands=hands, fingers={'L': fingers, 'R': fingers})

    def vertices(self, posed: Posed, t: float) -> np.ndarray:
        """Return the (V, 3) vertices of the thing [m], world, in the hands of its holder."""
        left, right = posed.joints[WRISTS]
        across = unit(left - right)
        forward = unit(np.cross(across, [0.0, 0.0, 1.0]))
        up = [0.0, 0.0, 1.0] if not self.thing.boxes else np.cross(forward, across)
        return (left + right) / 2 + PALM * forward + self._shape(t) @ np.array([across, forward, up])

    def _shape(self, t: float) -> np.ndarray:
        """Return the (V, 3) vertices to the left, forwards and up from the middle of the hands [m]."""
        if self.thing.boxes:
            return np.concatenate([centre + _CUBE * size for centre, size in np.array(self.thing.boxes)])
        (width, height), (columns, rows) = self.thing.sheet, SHEET
        across, down = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, columns), np.linspace(0, 1, rows)))
        phase = 2 * np.pi * WIND * t
        folds = 0.018 * np.sin(7 * across + phase) * np.sqrt(down) + 0.05 * down * np.sin(phase + 1.3 * down)
        sag = 0.05 * (1 - across ** 2) * (1 - down)
        return np.stack([across * width / 2 * (1 - 0.12 * down), folds, 0.03 - height * down - sag], 1)
