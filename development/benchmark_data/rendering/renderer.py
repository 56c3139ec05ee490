"""Ray casting (embree) of a room and people: colour, exact depth, ids, incidence.

The room is cast once per camera pose. Each frame casts one ray per pixel in the people's boxes, which gives depth and
colour at once, and more rays only where the surface changes (silhouettes, borders of cloth), against jagged edges.
"""
from typing import Any, List, NamedTuple, Sequence, Tuple, Union

import cv2
import numpy as np

from ..people.body import Body, Material
from ..people.held import Mesh
from . import materials
from .camera import Camera
from .room import Room

NOTHING = 1000.0  # [m] depth where a ray hits nothing
SUB_PIXELS = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))
AMBIENT_TINT, SUN_TINT = np.array([0.96, 1, 1.05], np.float32), np.array([1.04, 1, 0.93], np.float32)
SHADOW_SPREAD = 0.04  # standard deviation of the direction to the light: soft shadows


class Light(NamedTuple):
    """Direction to one light that casts shadows, its strength and that of the light from everywhere; RGB tint."""

    direction: Tuple[float, float, float] = (-0.22, -0.75, 0.9)
    ambient: float = 0.45
    sun: float = 0.62
    tint: Tuple[float, float, float] = (1.0, 1.0, 1.0)


class Frame(NamedTuple):
    """What a camera sees without noise; all (H, W), colour (H, W, 3) float RGB 0..1.

    depth [m], 0: nothing; ids: 0 room, -1 furniture or held, k the k-th person; cosine of the angle of incidence;
    dark: reflects little infrared.
    """

    color: np.ndarray
    depth: np.ndarray
    ids: np.ndarray
    cosine: np.ndarray
    dark: np.ndarray


class _People(NamedTuple):
    scene: Any
    rest: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    person: np.ndarray  # (F,) 1, 2 ...; -1: held
    material: np.ndarray  # (F,)
    materials: List[Material]


class _Hits(NamedTuple):
    """Where rays hit people: indices of the rays, depths, faces, places at rest (N, 3), normals (N, 3)."""

    rays: np.ndarray
    depth: np.ndarray
    faces: np.ndarray
    rest: np.ndarray
    normals: np.ndarray


class _Texels:
    """All textures in one array, to look many up at once."""

    def __init__(self, images: List[np.ndarray]) -> None:
        self.values = np.concatenate([image.reshape(-1, 3) for image in images])
        self.height, self.width = (np.array([image.shape[k] for image in images]) for k in (0, 1))
        self.first = np.cumsum(np.r_[0, self.height * self.width])[:-1]

    def at(self, which: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return the (N, 3) colours of textures (N,) at (N, 2) coordinates, which repeat outside 0..1."""
        height, width, place = self.height[which], self.width[which], place % 1
        column, row = (place[:, 0] * width).astype(int) % width, (place[:, 1] * height).astype(int) % height
        return self.values[self.first[which] + row * width + column]


def embree_scene(triangles: np.ndarray) -> Any:
    """Return an embree scene of (F, 3, 3) triangles."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(triangles, np.float32))
    return scene


class Renderer:
    """A room in a light, seen by a camera that is set by `aim`."""

    def __init__(self, room: Room, light: Light, seed: int = 0) -> None:
        self.light, self.rng = light, np.random.default_rng(seed)
        self.to_light = (np.array(light.direction) / np.linalg.norm(light.direction)).astype(np.float32)
        self.mesh, self.texels = room.mesh(), _Texels(room.textures)
        corners = self.mesh.vertices[self.mesh.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.face_normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
        self.room = embree_scene(corners)
        self.furniture = embree_scene(corners[self.mesh.furniture]) if self.mesh.furniture.any() else None

    def aim(self, camera: Camera) -> None:
        """Cast the room from a camera: depth, normals and light at each pixel."""
        self.camera, self.size = camera, (camera.intrinsics.height, camera.intrinsics.width)
        rows, columns = np.indices(self.size, np.float32)
        self.rays = camera.rays(columns.ravel(), rows.ravel())
        self.room_depth, face, weights = self._cast(self.room, self.rays)
        face = np.maximum(face, 0)
        self.room_normals = _towards_camera(self.face_normals[face], self.rays)
        self.room_ids = np.where(self.mesh.furniture[face], -1, 0)
        self.ray_lengths = np.sqrt(_dot(self.rays, self.rays))
        self.room_cosine = np.abs(_dot(self.room_normals, self.rays)) / self.ray_lengths
        self.room_points = camera.origin.astype(np.float32) + self.rays * self.room_depth[:, None]
        self.room_sun_angle = (self.room_normals @ self.to_light).clip(0)
        corners = self.mesh.coordinates.astype(np.float32)[self.mesh.faces[face]]
        color = self.texels.at(self.mesh.textures[face], np.einsum('nk,nki->ni', weights, corners))
        fall = 1.06 - np.float32(0.035) * self.room_depth.clip(0, 7)
        ambient = (np.float32(self.light.ambient) + np.float32(0.16) * np.abs(self.room_normals[:, 2])) * fall
        self.ambient = (color * ambient[:, None] * AMBIENT_TINT).reshape(*self.size, 3)
        sun = self.room_sun_angle * np.float32(self.light.sun) * fall
        if self.furniture is not None:
            sun *= self._shadow(self.furniture, 2).ravel()
        self.sun = (color * sun[:, None] * SUN_TINT).reshape(*self.size, 3)

    def _cast(self, scene: Any, rays: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return depth, triangle (-1: none) and (N, 3) barycentric weights of rays from the camera."""
        origins = np.broadcast_to(self.camera.origin.astype(np.float32), rays.shape)
        hit = scene.run(np.ascontiguousarray(origins), np.ascontiguousarray(rays), output=1)
        u, v = hit['u'], hit['v']
        return np.where(hit['primID'] >= 0, hit['tfar'], NOTHING), hit['primID'], np.stack([1 - u - v, u, v], -1)

    def _lit(self, scenes: Sequence[Any], points: np.ndarray) -> np.ndarray:
        """Return (N,) bool whether the light is seen from points; jittered directions make soft shadows."""
        directions = self.to_light + self.rng.standard_normal(points.shape, np.float32) * np.float32(SHADOW_SPREAD)
        lit, points = np.ones(len(points), bool), np.ascontiguousarray(points, np.float32)
        for scene in scenes:
            lit &= scene.run(points, directions) == -1
        return lit

    def _shadow(self, scene: Any, samples: int = 1) -> np.ndarray:
        """Return (H, W) 0..1, how much of the light a scene leaves to the room: every other pixel, smoothed."""
        height, width = self.size
        pixels = np.arange(height * width).reshape(self.size)[::2, ::2].ravel()
        pixels = pixels[(self.room_sun_angle[pixels] > 0.02) & (self.room_depth[pixels] < NOTHING / 2)]
        start = self.room_points[pixels] + self.room_normals[pixels] * np.float32(5e-3)
        lit = np.ones(height * width, np.float32)
        lit[pixels] = np.mean([self._lit([scene], start) for _ in range(samples)], 0, np.float32)
        coarse = cv2.GaussianBlur(lit.reshape(self.size)[::2, ::2], (0, 0), 1.0)
        return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)

    # ---- people -------------------------------------------------------------------------------------------------

    def frame(self, people: Sequence[Tuple[Body, np.ndarray]], things: Sequence[Tuple[Mesh, np.ndarray]] = ()) -> Frame:
        """Return the view with people and what they hold: bodies, meshes and their (V, 3) vertices in the world."""
        depth, ids, cosine = self.room_depth.copy(), self.room_ids.copy(), self.room_cosine.copy()
        dark, color = np.zeros(len(depth), bool), self.ambient + self.sun
        if people:
            shown = [*people, *things]
            scene = self._people(shown, len(people))
            color = self.ambient + self.sun * self._shadow(scene.scene)[..., None]
            flat = color.reshape(-1, 3)
            pixels = np.flatnonzero(self._boxes([vertices for _, vertices in shown]))
            hits = self._hit(scene, self.rays[pixels], self.room_depth[pixels])
            here = pixels[hits.rays]
            depth[here], ids[here] = hits.depth, scene.person[hits.faces]
            cosine[here] = np.abs(_dot(hits.normals, self.rays[here])) / self.ray_lengths[here]
            surface = np.full(len(depth), -1)
            surface[here] = scene.material[hits.faces]
            dark[here] = materials.is_dark(scene.materials, surface[here], hits.rest)
            room = flat.copy()
            flat[here] = self._shade(scene, hits, self.rays[here])
            self._smooth_edges(scene, color, room, surface.reshape(self.size))
        depth = np.where(depth > NOTHING / 2, 0, depth)
        color = color * np.array(self.light.tint, np.float32)
        return Frame(color, *(values.reshape(self.size) for values in (depth, ids, cosine, dark)))

    def _people(self, people: Sequence[Tuple[Union[Body, Mesh], np.ndarray]], count: int) -> _People:
        """Return people, of whom the first `count` have numbers; the others are things."""
        starts = np.cumsum([0, *(len(vertices) for _, vertices in people)])
        first_material = np.cumsum([0, *(len(body.materials) for body, _ in people)])
        vertices = np.concatenate([vertices for _, vertices in people]).astype(np.float32)
        faces = np.concatenate([body.faces + start for (body, _), start in zip(people, starts)])
        corners = vertices[faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.stack([np.bincount(faces.ravel(), np.repeat(across[:, k], 3), len(vertices)) for k in range(3)],
                           -1)
        normals /= np.sqrt(_dot(normals, normals))[:, None] + 1e-12
        return _People(
            embree_scene(corners), np.concatenate([body.rest for body, _ in people]), faces, normals,
            np.repeat([k + 1 if k < count else -1 for k in range(len(people))],
                      [len(body.faces) for body, _ in people]),
            np.concatenate([body.face_materials + first for (body, _), first in zip(people, first_material)]),
            [material for body, _ in people for material in body.materials])

    def _boxes(self, people: Sequence[np.ndarray]) -> np.ndarray:
        """Return (H, W) bool: pixels in the bounding boxes of people."""
        mask = np.zeros(self.size, bool)
        for vertices in people:
            points = self.camera.to_camera(vertices)
            points = points[points[:, 2] > 0.15]
            if len(points):
                pixels = self.camera.project(points)
                left, top = np.maximum(np.floor(pixels.min(0)).astype(int) - 1, 0)
                right, bottom = np.maximum(np.ceil(pixels.max(0)).astype(int) + 2, 0)
                mask[top:bottom, left:right] = True
        return mask

    def _hit(self, scene: _People, rays: np.ndarray, limit: np.ndarray) -> _Hits:
        depth, faces, weights = self._cast(scene.scene, rays)
        hit = np.flatnonzero((faces >= 0) & (depth < limit))
        depth, faces, weights = depth[hit], faces[hit], weights[hit]
        normals, rest = (np.einsum('nk,nki->ni', weights, values[scene.faces[faces]])
                         for values in (scene.normals, scene.rest))
        normals /= np.sqrt(_dot(normals, normals))[:, None] + 1e-9
        return _Hits(hit, depth, faces, rest, _towards_camera(normals, rays[hit]))

    def _shade(self, scene: _People, hits: _Hits, rays: np.ndarray) -> np.ndarray:
        if not len(hits.rays):
            return np.zeros((0, 3))
        color = materials.albedo(scene.materials, scene.material[hits.faces], hits.rest)
        points = self.camera.origin + rays * hits.depth[:, None]
        casters = [scene.scene, *([] if self.furniture is None else [self.furniture])]
        lit = self._lit(casters, points + hits.normals * 4e-3)
        fall = 1.06 - 0.035 * hits.depth.clip(0, 7)
        ambient = (self.light.ambient + 0.20 * hits.normals[:, 2]) * fall
        sun = (hits.normals @ self.to_light).clip(0) * lit * self.light.sun * fall
        return color * (ambient[:, None] * AMBIENT_TINT + sun[:, None] * SUN_TINT)

    def _smooth_edges(self, scene: _People, color: np.ndarray, room: np.ndarray, surface: np.ndarray) -> None:
        """Cast four rays in the pixels at which the material differs from a neighbour's, and set their mean colour."""
        surface = (surface + 1).astype(np.float32)
        kernel = np.ones((3, 3), np.uint8)
        pixels = np.flatnonzero(cv2.dilate(surface, kernel) != cv2.erode(surface, kernel))
        rows, columns = np.divmod(pixels, self.size[1])
        rays = np.concatenate([self.camera.rays(columns + x, rows + y) for x, y in SUB_PIXELS])
        hits = self._hit(scene, rays, np.tile(self.room_depth[pixels], 4))
        samples = np.tile(room[pixels], (4, 1))
        samples[hits.rays] = self._shade(scene, hits, rays[hits.rays])
        color.reshape(-1, 3)[pixels] = samples.reshape(4, -1, 3).mean(0)


def _towards_camera(normals: np.ndarray, rays: np.ndarray) -> np.ndarray:
    return normals * np.where(_dot(normals, rays) > 0, -1, 1)[:, None].astype(normals.dtype)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum('ij,ij->i', a, b)
