"""Clothed bodies: Anny's model (code Apache-2.0, data CC0) in MakeHuman's garments.

Anny gives the rest shape of a phenotype and its bones; posing and skinning are done here, which takes a few ms.
"""
import os
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, vstack
from scipy.sparse.csgraph import connected_components

from .garments import Garment, offsets_in_metres, read_garment

COCO18 = ['nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow', 'left_wrist',
          'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle', 'right_eye', 'left_eye',
          'right_ear', 'left_ear']
FEET = [f'{side}_{part}' for side in ('left', 'right') for part in ('big_toe', 'small_toe', 'heel')]
SKIN_VERTICES = 13380  # those of MakeHuman's base mesh below this index are skin, the others are helpers
BASE_VERTICES = 19158
SCALP_ABOVE_EYES = 0.075  # [m] skin above this height is covered by hair
GARMENTS = Path(os.environ.get('MH_BASE', 'makehuman-assets/base'))  # MakeHuman's
Color = Tuple[float, float, float]


class Cloth(NamedTuple):
    """Colour and pattern of cloth: RGB 0..255; size and height [m] in the rest pose."""

    color: Color
    pattern: str = ''  # stripes, columns, check, block, logo, camouflage
    second: Color = (0, 0, 0)
    size: float = 0.06
    height: float = 1.1


class PersonSpec(NamedTuple):
    """What a person looks like. Anny's phenotype values are 0..1; gender 0 male, 1 female; stature [m]."""

    gender: float
    stature: float
    age: float
    muscle: float
    weight: float
    proportions: float
    outfit: str
    shoes: str
    hair: str
    skin: Color
    hair_color: Color
    top: Cloth
    bottom: Cloth
    shoe_color: Color = (60, 48, 40)
    accent: Color = (70, 62, 58)


class Material(NamedTuple):
    """Surface of some faces: kind cloth, hair or skin."""

    kind: str
    cloth: Cloth
    hair_color: Color = (0, 0, 0)
    nose: Optional[np.ndarray] = None  # (3,) in the rest pose [m]
    eyes: Optional[np.ndarray] = None  # (2, 3)


class AnnyModel(NamedTuple):
    """Anny's model and what is read from it once."""

    model: Any
    row_of: np.ndarray  # row of each vertex of the base mesh, -1 where it has none
    bones: Dict[str, int]
    parents: List[int]
    skinning: csr_matrix  # (V, bones)
    key_points: Dict[str, np.ndarray]  # (V,) weights of the vertices
    faces: np.ndarray  # (F, 3)


@lru_cache(maxsize=1)
def anny_model() -> AnnyModel:
    """Load the model.

    Raises:
        ImportError: this is not the environment for rendering.
    """
    import anny
    model = anny.Anny(topology='makehuman-full')
    regressor = anny.KeypointsRegressor.coco(model)
    base = model.base_mesh_vertex_indices.numpy()
    row_of = np.full(BASE_VERTICES, -1)
    row_of[base] = np.arange(len(base))
    indices, weights = model.vertex_bone_indices.numpy(), model.vertex_bone_weights.numpy()
    rows = np.repeat(np.arange(len(indices)), indices.shape[1])
    skinning = coo_matrix((weights.ravel(), (rows, indices.ravel())), (len(indices), model.bone_count)).tocsr()
    key_points = dict(zip(regressor.labels, regressor.regression_weights.numpy().astype(float)))
    return AnnyModel(model, row_of, {bone: i for i, bone in enumerate(model.bone_labels)},
                     [int(parent) for parent in model.bone_parents], skinning, key_points,
                     model.get_triangular_faces().numpy())


class Body:
    """A person's mesh: garments, hair and skin with materials, and its binding to the bones.

    Attributes
    ----------
    rest : (V, 3) vertices in the rest pose [m]; faces : (F, 3); face_materials : (F,) index into materials
    skinning : (V, bones) sparse; rest_inverse, reference : (bones, 4, 4) bones at rest inverted, and without a pose
    regressor : (24, R) weights of the vertices that COCO_18 and the feet are regressed from, `regressed_rest`,
        `regressed_skinning`
    skin_rest, skin_skinning, is_skin : Anny's own vertices, with its helpers, and which of them are skin
    """

    def __init__(self, spec: PersonSpec) -> None:
        self.spec = spec
        anny = anny_model()
        phenotype = {'gender': spec.gender, 'age': spec.age, 'muscle': spec.muscle, 'weight': spec.weight,
                         'proportions': spec.proportions, 'height': 0.4}
        shape = self._fit_stature(phenotype, spec.stature)
        vertices = shape['rest_vertices']
        self.stature = float(np.ptp(vertices[anny.row_of[:SKIN_VERTICES], 2]))
        self.rest_inverse, self.reference = np.linalg.inv(shape['rest_bone_poses']), shape['bone_poses']
        self.materials: List[Material] = []
        parts: List[np.ndarray] = []
        faces: List[np.ndarray] = []
        face_materials: List[np.ndarray] = []
        weights = []
        hidden = np.zeros(len(vertices), bool)
        for kind, name in (('outfit', spec.outfit), ('shoes', spec.shoes), ('hair', spec.hair)):
            if not name:
                continue
            garment = read_garment(GARMENTS / ('hair' if kind == 'hair' else 'clothes') / name)
            rows = anny.row_of[[row for row in garment.hidden if row < BASE_VERTICES]]
            hidden[rows[rows >= 0]] = True
            corners = anny.row_of[garment.corners]
            fitted = np.einsum('nk,nki->ni', garment.weights, vertices[corners]) + offsets_in_metres(
                garment, vertices, anny.row_of)
            face_materials.append(self._materials_of(kind, fitted, garment, vertices))
            faces.append(garment.faces + sum(map(len, parts)))
            parts.append(fitted)
            weights.append(_bone_weights(corners, garment.weights, anny.skinning))
        is_skin = np.zeros(len(vertices), bool)
        skin_rows = anny.row_of[:SKIN_VERTICES]
        is_skin[skin_rows[skin_rows >= 0]] = True
        self.first_skin = sum(map(len, parts))
        shown = anny.faces[(is_skin & ~hidden)[anny.faces].all(1)]
        faces.append(shown + self.first_skin)
        self.key_points = {name: values @ vertices for name, values in anny.key_points.items()}
        eyes = np.array([self.key_points['left_eye'], self.key_points['right_eye']])
        face_materials.append(np.full(len(shown), self._add(
            Material('skin', Cloth(spec.skin), spec.hair_color, self.key_points['nose'], eyes))))
        self.rest = np.concatenate([*parts, vertices])
        self.faces, self.face_materials = np.concatenate(faces), np.concatenate(face_materials)
        self.skinning = vstack([*weights, anny.skinning]).tocsr()
        self.is_skin = is_skin
        self._keep_surface()

    @staticmethod
    def _fit_stature(phenotype: Dict[str, float], stature: float) -> Dict[str, np.ndarray]:
        """Set the height value that gives a stature, within what Anny has; return the shape."""
        low, high = 0.0, 1.0
        for _ in range(9):
            phenotype['height'] = (low + high) / 2
            output = anny_model().model(phenotype_kwargs=phenotype)
            shape = {name: value[0].detach().numpy() for name, value in output.items()}
            tall = np.ptp(shape['rest_vertices'][anny_model().row_of[:SKIN_VERTICES], 2])
            low, high = (phenotype['height'], high) if tall < stature else (low, phenotype['height'])
        return shape

    def _add(self, material: Material) -> int:
        self.materials.append(material)
        return len(self.materials) - 1

    def _materials_of(self, kind: str, fitted: np.ndarray, garment: Garment, vertices: np.ndarray) -> np.ndarray:
        """Return the material of each face. Shells of an outfit are top, bottom or accent by size and height."""
        spec, faces = self.spec, garment.faces
        if kind != 'outfit':
            material = Material('hair', Cloth(spec.hair_color)) if kind == 'hair' else \
                Material('cloth', Cloth(spec.shoe_color))
            return np.full(len(faces), self._add(material))
        edges = np.r_[faces[:, [0, 1]], faces[:, [1, 2]]]
        _, shell_of = connected_components(
            coo_matrix((np.ones(len(edges)), edges.T), shape=(len(fitted),) * 2), False)
        size = np.bincount(shell_of)
        height = np.bincount(shell_of, fitted[:, 2]) / size
        top, bottom, accent = (self._add(Material('cloth', cloth))
                               for cloth in (spec.top, spec.bottom, Cloth(spec.accent)))
        hip = vertices[:, 2].min() + 0.52 * np.ptp(vertices[:, 2])
        return np.where(size < 60, accent, np.where(height < hip, bottom, top))[shell_of[faces[:, 0]]]

    def _keep_surface(self) -> None:
        """Keep the vertices that faces use; the regressors of key points get rows of their own."""
        anny = anny_model()
        used = np.unique(self.faces)
        renumbered = np.full(len(self.rest), -1)
        renumbered[used] = np.arange(len(used))
        self.skin_skinning, self.skin_rest = self.skinning[self.first_skin:], self.rest[self.first_skin:]
        self.regressor = np.array([
            anny.key_points[name] if name != 'neck' else
            0.5 * (anny.key_points['left_shoulder'] + anny.key_points['right_shoulder']) for name in (*COCO18, *FEET)])
        self.regressed = np.flatnonzero(np.abs(self.regressor).max(0) > 0)
        self.regressor = self.regressor[:, self.regressed]
        self.regressed_skinning, self.regressed_rest = (
            self.skin_skinning[self.regressed], self.skin_rest[self.regressed])
        self.faces, self.rest, self.skinning = renumbered[self.faces], self.rest[used], self.skinning[used]


def skin(bones: np.ndarray, skinning: csr_matrix, rest: np.ndarray) -> np.ndarray:
    """Return the (V, 3) vertices moved by (bones, 4, 4) transforms."""
    blended = (skinning @ bones[:, :3].reshape(-1, 12)).reshape(-1, 3, 4)
    return (blended[:, :, :3] * rest[:, None]).sum(2) + blended[:, :, 3]


def _bone_weights(corners: np.ndarray, weights: np.ndarray, skinning: csr_matrix) -> csr_matrix:
    """Return the (N, bones) weights of a garment's vertices: those of their corners, blended, the six largest."""
    dense = sum(weights[:, k:k + 1] * skinning[corners[:, k]].toarray() for k in range(3)).clip(0)
    sixth = np.partition(dense, -6, axis=1)[:, -6:-5]
    dense[dense < sixth] = 0
    return csr_matrix(dense / dense.sum(1, keepdims=True))
