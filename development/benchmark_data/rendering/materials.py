"""Colours of surfaces from material and rest-pose position: patterns stick to the cloth, faces are painted."""
from typing import List

import numpy as np

from ..people.body import SCALP_ABOVE_EYES, Cloth, Material


def is_dark(materials: List[Material], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return (N,) whether points (N, 3) in the rest pose of materials[which] reflect little infrared.

    That is hair, also on the skin, and black cloth (every channel below 50).
    """
    dark = np.array([material.kind == 'hair' or max(material.cloth.color) < 50 for material in materials])[which]
    for k, material in enumerate(materials):
        if material.kind == 'skin':
            here = np.flatnonzero(which == k)
            dark[here] = _is_scalp(material, points[here])
    return dark


def _is_scalp(material: Material, points: np.ndarray) -> np.ndarray:
    return points[:, 2] > material.eyes[0, 2] + SCALP_ABOVE_EYES


def albedo(materials: List[Material], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the (N, 3) RGB 0..1 of points (N, 3) in the rest pose of materials[which]."""
    colors = np.zeros((len(which), 3))
    for k in np.unique(which):
        here, material = which == k, materials[k]
        place = points[here]
        if material.kind == 'cloth':
            colors[here] = _cloth(material.cloth, place)
        elif material.kind == 'hair':
            strands = 0.22 * np.sin(place[:, 0] * 900 + 3 * np.sin(place[:, 2] * 60)) + 0.1 * np.sin(place[:, 0] * 310)
            colors[here] = np.array(material.cloth.color) * (1 + strands)[:, None]
        else:
            colors[here] = _skin(material, place)
    return colors / 255.0


def _cloth(cloth: Cloth, p: np.ndarray) -> np.ndarray:
    colors = np.tile(np.array(cloth.color, float), (len(p), 1))
    second, size = np.array(cloth.second, float), cloth.size
    if cloth.pattern == 'stripes':
        colors[(p[:, 2] / size) % 1 < 0.4] = second
    elif cloth.pattern == 'columns':
        colors[(p[:, 0] / size) % 1 < 0.3] = second
    elif cloth.pattern == 'check':
        a, b = (p[:, 0] / size) % 1 < 0.4, (p[:, 2] / size) % 1 < 0.4
        colors[a ^ b] = 0.55 * colors[a ^ b] + 0.45 * second
        colors[a & b] = second
    elif cloth.pattern == 'block':
        colors[p[:, 2] > cloth.height] = second
    elif cloth.pattern == 'logo':
        colors[(np.abs(p[:, 0]) < 0.11) & (np.abs(p[:, 2] - cloth.height) < 0.08) & (p[:, 1] < 0)] = second
    elif cloth.pattern == 'camouflage':
        waves = np.sin(p @ [31, 23, 37.0] + 2 * np.sin(p @ [-17, 29, 13.0])) + np.sin(p @ [-41, 19, -27.0])
        colors[waves > 0.55] = second
        colors[waves < -0.7] *= 0.6
    return colors * (1 + 0.05 * np.sin(p * [210, 190, 230.0]).prod(1)[:, None])


def _skin(material: Material, p: np.ndarray) -> np.ndarray:
    """Return skin with lips, brows, eyes, cheeks and scalp; only the head is looked at closely."""
    skin = np.array(material.cloth.color, float)
    colors = np.tile(skin, (len(p), 1))
    nose, eyes, hair = material.nose, material.eyes, np.array(material.hair_color, float)
    head = np.flatnonzero(p[:, 2] > nose[2] - 0.1)
    front = head[p[head, 1] < eyes[0, 1] + 0.05]
    face, painted = p[front], colors[front]

    def blob(centre: np.ndarray, radii: tuple, color: np.ndarray, opacity: float, power: int = 2) -> None:
        share = np.exp(-(np.abs((face - centre) / np.array(radii)) ** power).sum(1))[:, None] * opacity
        painted[:] = painted * (1 - share) + np.asarray(color, float) * share

    blob(np.add(nose, (0, 0.01, -0.043)), (0.024, 0.06, 0.0075), skin * [0.74, 0.52, 0.54], 0.9, 4)
    blob(np.add(nose, (0, 0.01, -0.043)), (0.023, 0.06, 0.0014), skin * 0.35, 0.8, 4)
    blob(np.add(nose, (0, 0.01, -0.010)), (0.012, 0.03, 0.003), skin * 0.5, 0.6)
    for eye in eyes:
        blob(np.add(eye, (0, 0, 0.021)), (0.018, 0.05, 0.0045), hair * 0.8, 0.85, 4)
        blob(eye, (0.020, 0.05, 0.013), skin * 0.72, 0.55)
        blob(eye, (0.0145, 0.05, 0.0062), (225, 222, 218), 0.95, 4)
        blob(eye, (0.0058, 0.05, 0.0058), (48, 36, 28), 0.97, 4)
        blob(np.add(eye, (0, 0, 0.0066)), (0.016, 0.05, 0.0016), skin * 0.25, 0.8, 4)
        blob(np.array([eye[0] * 1.35, nose[1], nose[2] - 0.005]), (0.022, 0.06, 0.018), skin * [1.02, 0.84, 0.82], 0.45)
    colors[front] = painted
    colors[head[_is_scalp(material, p[head])]] = hair
    return colors
