"""A room with wall things and furniture: textured quads, all from a seed."""
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from ..people.geometry import rotation
from . import textures

BEHIND_CAMERA = -1.5  # [m] y of the front wall
CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
Point = Sequence[float]


class Mesh(NamedTuple):
    """Quads as triangles: (V, 3) vertices, (F, 3) faces, (V, 2) texture coordinates, per face texture and role."""

    vertices: np.ndarray
    faces: np.ndarray
    coordinates: np.ndarray
    textures: np.ndarray
    furniture: np.ndarray  # (F,) bool: hides people and casts shadows


class Box(NamedTuple):
    """Footprint of a piece of furniture: centre, size [m], yaw [deg], lower and upper height [m]."""

    x: float
    y: float
    width: float
    depth: float
    yaw: float
    low: float
    high: float

    def contains(self, points: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """Return for (N, 3) points whether they lie in the box shrunk by a margin [m]."""
        local = (points - [self.x, self.y, 0]) @ rotation('z', self.yaw)
        return ((np.abs(local[:, 0]) < self.width / 2 - margin) & (np.abs(local[:, 1]) < self.depth / 2 - margin)
                & (local[:, 2] > self.low + margin) & (local[:, 2] < self.high - margin))

    def distance(self, x: float, y: float) -> float:
        """Return the distance of a place on the floor from the footprint [m]."""
        local = np.abs((np.array([x - self.x, y - self.y, 0])) @ rotation('z', self.yaw))[:2]
        return float(np.linalg.norm(np.maximum(local - [self.width / 2, self.depth / 2], 0)))


class Room:
    """Textured quads: walls with things on them, and furniture that is added."""

    def __init__(self, seed: int, depth: float = 5.6, left: float = -3.4, right: float = 3.4, height: float = 2.8
                 ) -> None:
        self.rng = np.random.default_rng(seed)
        self.quads: List[Tuple[np.ndarray, np.ndarray, int, bool]] = []  # corners, coordinates, texture, furniture
        self.textures: List[np.ndarray] = []
        self.notes: List[str] = []
        self.boxes: List[Box] = []  # furniture
        self.depth, self.left, self.right, self.height = depth, left, right, height
        self._build()

    def contains(self, place: Point, margin: float) -> bool:
        """Return whether a place is in the room, at least a margin [m] from its walls."""
        x, y, z = place
        return (self.left + margin < x < self.right - margin and BEHIND_CAMERA + margin < y < self.depth - margin
                and 0 < z < self.height - margin)

    def texture(self, image: np.ndarray) -> int:
        self.textures.append(image)
        return len(self.textures) - 1

    def plain(self, color: Sequence[float], *options: float) -> int:
        return self.texture(textures.plain(self.rng, color, *options))

    def wood(self, color: Sequence[float]) -> int:
        return self.texture(textures.wood(self.rng, color))

    def wood_color(self) -> np.ndarray:
        """Draw brown, gray or white."""
        warm = np.array([1, 0.82, 0.62]) if self.rng.random() < 0.65 else np.ones(3)
        return self.rng.uniform(60, 215) * warm * self.rng.uniform(0.92, 1.08, 3)

    def quad(self, corners: Sequence[Point], texture: int, repeat: Tuple[float, float] = (1, 1),
             furniture: bool = False) -> None:
        coordinates = np.array([[0, repeat[1]], repeat, [repeat[0], 0], [0, 0]], float)
        self.quads.append((np.array(corners, float), coordinates, texture, furniture))

    def upright(self, x: float, y: float, z: float, width: float, height: float, texture: int) -> None:
        """Add a rectangle that faces the camera, its lower left corner at x, y, z."""
        self.quad([[x, y, z], [x + width, y, z], [x + width, y, z + height], [x, y, z + height]], texture)

    def box(self, centre: Point, size: Point, texture: int, yaw: float = 0.0, furniture: bool = True) -> None:
        """Add a box with the centre of its base there; furniture hides people."""
        turn, (sx, sy, sz) = rotation('z', yaw), size

        def corner(x: int, y: int, z: int) -> np.ndarray:
            return turn @ [x * sx / 2, y * sy / 2, 0] + np.array(centre) + [0, 0, z * sz]

        for (a, b), width in ((((-1, -1), (1, -1)), sx), (((1, -1), (1, 1)), sy), (((1, 1), (-1, 1)), sx),
                              (((-1, 1), (-1, -1)), sy)):
            self.quad([corner(*a, 0), corner(*b, 0), corner(*b, 1), corner(*a, 1)], texture, (width, sz), furniture)
        for z, order in ((1, ((-1, -1), (1, -1), (1, 1), (-1, 1))), (0, ((-1, 1), (1, 1), (1, -1), (-1, -1)))):
            self.quad([corner(*xy, z) for xy in order], texture, (sx, sy), furniture)
        if furniture:
            self.boxes.append(Box(centre[0], centre[1], sx, sy, yaw, centre[2], centre[2] + sz))

    def part(self, at: Point, offset: Point, size: Point, texture: int, yaw: Optional[float] = None) -> None:
        """Add a box of furniture, its base at an offset in the frame at (x, y, yaw); `yaw`: a turn of its own."""
        x, y, turn = at
        self.box(np.array([x, y, 0]) + rotation('z', turn) @ offset, size, texture, turn if yaw is None else yaw)

    # ---- furniture --------------------------------------------------------------------------------------------

    def table(self, x: float, y: float, size: Point, yaw: float = 0.0, solid: bool = False) -> None:
        """Add a table of (width, depth, height) with four legs, or a solid counter."""
        width, depth, height = size
        texture = self.wood(self.wood_color())
        if solid:
            self.box((x, y, 0), (width, depth, height - 0.04), texture, yaw)
            self.box((x, y, height - 0.04), (width + 0.06, depth + 0.06, 0.04),
                     self.wood(self.wood_color()), yaw)
        else:
            self.box((x, y, height - 0.04), (width, depth, 0.04), texture, yaw)
            for i, j in CORNERS:
                self.part((x, y, yaw), (i * (width / 2 - 0.05), j * (depth / 2 - 0.05), 0), (0.06, 0.06, height - 0.04),
                          texture)
        self.notes.append(f"{'counter' if solid else 'table'} {width:.2f}x{depth:.2f}x{height:.2f} m "
                          f'at ({x:.2f},{y:.2f})')

    def things_on_table(self, x: float, y: float, size: Point, yaw: float, count: int) -> None:
        """Add small boxes on the half of a table that is away from +depth of its own frame."""
        width, depth, height = size
        for _ in range(count):
            place = (self.rng.uniform(-0.42, 0.42) * width, self.rng.uniform(-0.38, 0.0) * depth, height)
            self.part((x, y, yaw), place, self.rng.uniform([0.06, 0.06, 0.05], [0.26, 0.18, 0.22]),
                      self.plain(self.rng.uniform(30, 230, 3), 4, 32), self.rng.uniform(0, 90))

    def chair(self, x: float, y: float, yaw: float, height: float = 0.45, color: Optional[Point] = None) -> None:
        """Add a chair with its seat at (x, y); yaw as of the person who sits on it."""
        texture = self.plain(self.rng.uniform(40, 200, 3) if color is None else color, 5)
        wood = self.wood((120, 84, 56))
        self.box((x, y, height - 0.08), (0.44, 0.42, 0.08), texture, yaw)
        for i, j in CORNERS:
            self.part((x, y, yaw), (i * 0.19, j * 0.18, 0), (0.045, 0.045, height - 0.08), wood)
        self.part((x, y, yaw), (0, 0.235, height + 0.08), (0.44, 0.04, 0.36), wood)
        for i in (-1, 1):
            self.part((x, y, yaw), (i * 0.19, 0.235, height - 0.08), (0.045, 0.04, 0.2), wood)
        self.notes.append(f'chair, seat {height:.2f} m, at ({x:.2f},{y:.2f})')

    def target(self, place: Point, size: float, color: Point) -> None:
        """Add a bright box around a place, on a stand when it would float."""
        x, y, z = place
        self.box((x, y, z - size / 2), (size, size, size), self.plain(color, 3, 32), 20)
        if z - size / 2 > 0.03 and y < self.depth - 0.2:
            self.box((x, y, 0), (0.05, 0.05, z - size / 2), self.plain((90, 90, 92), 3, 16))

    def front_wall(self) -> None:
        """Add the wall behind the usual camera, for cameras that look that way."""
        y, height = BEHIND_CAMERA, self.height
        self.quad([[self.right, y, 0], [self.left, y, 0], [self.left, y, height], [self.right, y, height]],
                  self.plain((176, 172, 160), 4), (5, 2))
        for x in (-2.2, 0.3, 2.0):
            width, tall, z = self.rng.uniform(0.5, 0.9), self.rng.uniform(0.4, 0.8), self.rng.uniform(0.9, 1.5)
            self.quad([[x + width, y + 0.01, z], [x, y + 0.01, z], [x, y + 0.01, z + tall],
                       [x + width, y + 0.01, z + tall]], self.texture(textures.poster(self.rng)))

    # ---- the room -----------------------------------------------------------------------------------------------

    def _build(self) -> None:
        rng, y, left, right, height = self.rng, self.depth, self.left, self.right, self.height
        tint = rng.uniform(150, 222) + rng.uniform(-22, 22, 3)
        kind, floor = textures.floor(rng)
        wall, side_wall = self.plain(tint, 4), self.plain(tint * rng.uniform(0.85, 1.02), 4)
        front = BEHIND_CAMERA
        self.quad([[left, front, 0], [right, front, 0], [right, y, 0], [left, y, 0]], self.texture(floor),
                  ((right - left) / 2.2, (y - front) / 2.2))
        self.quad([[left, y, 0], [right, y, 0], [right, y, height], [left, y, height]], wall, (5, 2))
        self.quad([[left, front, 0], [left, y, 0], [left, y, height], [left, front, height]], side_wall, (5, 2))
        self.quad([[right, y, 0], [right, front, 0], [right, front, height], [right, y, height]], side_wall, (5, 2))
        self.quad([[left, y, height], [right, y, height], [right, front, height], [left, front, height]],
                  self.plain((222, 220, 214), 2), (5, 5))
        self.upright(left, y - 0.012, 0, right - left, 0.09, self.plain(tint * 0.6, 2, 32))
        placed = self._wall_things(left + 0.25, tint)
        self._side_posters()
        self.notes.append(f'room {left:.1f}..{right:.1f} x {y:.1f} m, floor {kind}, back wall: {", ".join(placed)}')

    def _wall_things(self, x: float, tint: np.ndarray) -> List[str]:
        """Fill the back wall from the left in random order; return what is there."""
        builders: Dict[str, Any] = {'door': self._door, 'shelf': self._shelf, 'posters': self._posters,
                                    'more posters': self._posters, 'cabinet': self._cabinet, 'window': self._window}
        placed = []
        for name in self.rng.permutation(sorted(builders)):
            if x > self.right - 0.8:
                break
            x += builders[name](x, tint)
            placed.append(str(name))
        return placed

    def _door(self, x: float, tint: np.ndarray) -> float:
        self.upright(x - 0.06, self.depth - 0.02, 0, 0.97, 2.11, self.plain(tint * 0.5, 2, 32))
        self.upright(x, self.depth - 0.03, 0, 0.85, 2.05, self.plain(self.rng.uniform(60, 190, 3), 4, 64))
        self.box((x + 0.77, self.depth - 0.06, 1.0), (0.09, 0.05, 0.03), self.plain((190, 190, 180), 2, 16),
                 furniture=False)
        return 1.15

    def _shelf(self, x: float, _tint: np.ndarray) -> float:
        rng, y, width, deep = self.rng, self.depth, self.rng.uniform(0.9, 1.4), 0.3
        wood = self.wood(self.wood_color())
        self.box((x + width / 2, y - 0.02, 0), (width, 0.03, 1.9), wood, furniture=False)
        for side in (0.0, width):
            self.box((x + side, y - deep / 2, 0), (0.03, deep, 1.9), wood, furniture=False)
        books = [self.plain(rng.uniform(20, 230, 3), 3, 16) for _ in range(8)]
        for z in np.linspace(0.05, 1.87, 6):
            self.box((x + width / 2, y - deep / 2, z), (width, deep, 0.025), wood, furniture=False)
            book = x + 0.05
            while z < 1.8 and book < x + width - 0.1:
                thick = rng.uniform(0.02, 0.07)
                if rng.random() < 0.87:
                    self.box((book + thick / 2, y - 0.17, z + 0.025),
                             (thick * 0.95, rng.uniform(0.14, 0.24), rng.uniform(0.17, 0.31)),
                             int(rng.choice(books)), furniture=False)
                book += thick
        return width + 0.25

    def _posters(self, x: float, _tint: np.ndarray) -> float:
        rng, used = self.rng, 0.0
        for _ in range(int(rng.integers(1, 4))):
            width, tall, z, shift = *rng.uniform([0.3, 0.3, 0.9], [0.85, 0.8, 1.7]), rng.uniform(0, 0.5)
            self.upright(x + shift, self.depth - 0.01, z, width, tall, self.texture(textures.poster(rng)))
            used = max(used, shift + width)
        return used + 0.2

    def _cabinet(self, x: float, _tint: np.ndarray) -> float:
        rng, width, tall = self.rng, self.rng.uniform(0.7, 1.3), self.rng.uniform(0.6, 1.1)
        self.box((x + width / 2, self.depth - 0.25, 0), (width, 0.45, tall), self.wood(self.wood_color()),
                 furniture=False)
        for _ in range(3):
            self.box((x + rng.uniform(0.1, width - 0.1), self.depth - 0.25, tall),
                     rng.uniform([0.08, 0.08, 0.1], [0.3, 0.2, 0.4]), self.plain(rng.uniform(20, 230, 3), 4, 32),
                     furniture=False)
        return width + 0.25

    def _window(self, x: float, _tint: np.ndarray) -> float:
        width = self.rng.uniform(0.9, 1.4)
        for inset, color in ((0, (235, 235, 232)), (0.05, (200, 220, 240))):
            self.upright(x + inset, self.depth - 0.01 - inset / 9, 1 + inset, width - 2 * inset, 1.15 - 2 * inset,
                         self.plain(color, 6, 64, 12))
        self.box((x + width / 2, self.depth - 0.02, 1), (0.05, 0.02, 1.15), self.plain((235, 235, 232), 1, 16),
                 furniture=False)
        return width + 0.3

    def _side_posters(self) -> None:
        for sign, x in ((1, self.left + 0.01), (-1, self.right - 0.01)):
            for _ in range(int(self.rng.integers(1, 3))):
                width, tall, z = self.rng.uniform([0.4, 0.4, 0.9], [0.9, 0.8, 1.5])
                y = self.rng.uniform(2.0, self.depth - 1)
                corners = [[x, y, z], [x, y + width, z], [x, y + width, z + tall], [x, y, z + tall]]
                order = (0, 1, 2, 3) if sign > 0 else (1, 0, 3, 2)
                self.quad([corners[k] for k in order], self.texture(textures.poster(self.rng)))

    def mesh(self) -> Mesh:
        """Return all quads as triangles."""
        corners, coordinates, texture_of, furniture = zip(*self.quads)
        faces = (np.arange(len(corners))[:, None, None] * 4 + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
        return Mesh(np.concatenate(corners), faces, np.concatenate(coordinates), np.repeat(texture_of, 2),
                    np.repeat(furniture, 2))
