"""MakeHuman's garments: geometry bound to the base mesh (.mhclo and .obj files; CC0, textures are not used).

They are read from the folder `base` of the repository makehumancommunity/makehuman-assets (MH_BASE).
"""
import re
from pathlib import Path
from typing import Dict, List, NamedTuple, Set, Tuple

import numpy as np

# The garments of the assets, divided into two sets without a common one.
OUTFITS = {
    'tune': {'female': ('female_casualsuit01', 'female_elegantsuit01'),
             'male': ('male_casualsuit01', 'male_casualsuit03', 'male_casualsuit05', 'male_worksuit01')},
    'report': {'female': ('female_casualsuit02', 'female_sportsuit01'),
               'male': ('male_casualsuit02', 'male_casualsuit04', 'male_casualsuit06', 'male_elegantsuit01')}}
SHOES = {'tune': ('shoes01', 'shoes03', 'shoes05'), 'report': ('shoes02', 'shoes04', 'shoes06')}
HAIR = {'tune': {'female': ('afro01', 'bob01', 'braid01', 'short03'), 'male': ('afro01', 'short01', 'short03')},
        'report': {'female': ('bob02', 'long01', 'ponytail01', 'short04'), 'male': ('short02', 'short04')}}


class Garment(NamedTuple):
    """A garment as read: how its vertices hang on the base mesh."""

    corners: np.ndarray  # (N, 3) int, vertices of the base mesh that bind each vertex
    weights: np.ndarray  # (N, 3), of the corners
    offsets: np.ndarray  # (N, 3), in units of `scales`, MakeHuman's axes
    faces: np.ndarray  # (M, 3) int
    scales: Dict[str, Tuple[int, int, float]]  # axis: two vertices of the base mesh and their distance
    hidden: Set[int]  # vertices of the base mesh below the garment


def read_garment(folder: Path) -> Garment:
    """Read the first .mhclo of a folder, and its .obj.

    Raises:
        FileNotFoundError: there is no such garment.
    """
    files = sorted(folder.glob('*.mhclo'))
    if not files:
        raise FileNotFoundError(f'{folder}: no garment (.mhclo) here')
    scales: Dict[str, Tuple[int, int, float]] = {}
    rows: List[List[float]] = []
    hidden: Set[int] = set()
    section = obj = ''
    for line in files[0].read_text(errors='replace').splitlines():
        words = line.split()
        if not words or line.startswith('#'):
            continue
        if words[0] in ('x_scale', 'y_scale', 'z_scale'):
            scales[words[0][0]] = (int(words[1]), int(words[2]), float(words[3]))
        elif words[0] == 'obj_file':
            obj = words[1]
        elif words[0] in ('verts', 'delete_verts'):
            section = words[0]
        elif section == 'verts' and words[0].isdigit() and len(words) == 9:
            rows.append([float(word) for word in words])
        elif section == 'verts' and words[0].isdigit() and len(words) == 1:
            rows.append([float(words[0])] * 3 + [1, 0, 0, 0, 0, 0])
        elif section == 'delete_verts':
            for first, _, last in re.findall(r'(\d+)(\s*-\s*(\d+))?', line):
                hidden.update(range(int(first), int(last or first) + 1))
    table = np.array(rows)
    return Garment(table[:, :3].astype(int), table[:, 3:6], table[:, 6:9], _read_faces(folder / obj), scales, hidden)


def _read_faces(path: Path) -> np.ndarray:
    faces = []
    for line in path.read_text(errors='replace').splitlines():
        if line.startswith('f '):
            corners = [int(word.split('/')[0]) - 1 for word in line.split()[1:]]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return np.array(faces)


def offsets_in_metres(garment: Garment, rest: np.ndarray, row_of: np.ndarray) -> np.ndarray:
    """Return the (N, 3) offsets of a garment's vertices in the axes of a body whose rest vertices are given [m].

    rest (V, 3); row_of: row in `rest` of each vertex of MakeHuman's base mesh.
    """
    axes = {'x': 0, 'y': 2, 'z': 1}
    scale = {axis: abs(rest[row_of[i], axes[axis]] - rest[row_of[j], axes[axis]]) / unit
             for axis, (i, j, unit) in garment.scales.items()}
    x, y, z = garment.offsets.T
    return np.stack([x * scale.get('x', 0.1), -z * scale.get('z', 0.1), y * scale.get('y', 0.1)], 1)
