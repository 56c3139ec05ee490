"""Confidence maps and part affinity fields of people whose joints are known, as a perfect network would give them."""
import numpy as np
import pytest

from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MODELS
from openpose_ros_pkg.skeletons import COCO_18

STRIDE = MOBILENET_THIN.stride
NET = (368, 656)  # height, width
# One network of each table of part affinity fields.
NETWORKS = pytest.mark.parametrize('model', [MODELS[name] for name in ('mobilenet_thin', 'body_25', 'mpi')],
                                   ids=lambda model: model.skeleton.name)
# Half of a body that faces the camera, x to the person's left and y down in units of the height from nose to ankle.
MIDDLE = {'head_top': (0.0, -0.10), 'nose': (0.0, 0.0), 'neck': (0.0, 0.14), 'chest': (0.0, 0.28),
          'mid_hip': (0.0, 0.5)}
SIDE = {'eye': (0.03, -0.03), 'ear': (0.07, -0.01), 'shoulder': (0.11, 0.15), 'elbow': (0.16, 0.32),
        'wrist': (0.19, 0.47), 'hip': (0.07, 0.50), 'knee': (0.08, 0.76), 'ankle': (0.09, 1.00), 'heel': (0.05, 1.05),
        'big_toe': (0.12, 1.08), 'small_toe': (0.18, 1.06)}
BODY = {**MIDDLE, **{f'left_{joint}': at for joint, at in SIDE.items()},
        **{f'right_{joint}': (-x, y) for joint, (x, y) in SIDE.items()}}
# A person who faces the camera: x, y of the 18 joints; its right is at the picture's left.
FRONT = np.array([BODY[joint] for joint in COCO_18.joints])


def standing_person(x: float, y: float, height: float) -> np.ndarray:
    """Return (18, 2) float64 network pixels of a person whose nose is at x, y."""
    return FRONT * height + (x, y)


def person_of(skeleton, x, y, height):
    """Return (K, 2) pixels of a person with the right hand up and the left knee bent: no mirror image of itself."""
    place = {**BODY, 'right_elbow': (-0.26, 0.10), 'right_wrist': (-0.33, -0.12), 'left_knee': (0.21, 0.70)}
    return np.array([place[joint] for joint in skeleton.joints]) * height + (x, y)


def two_people(skeleton, size):
    """Both are asymmetric, in an asymmetric place."""
    width, height = size
    scale = min(0.75 * height, 0.9 * width)
    return [person_of(skeleton, 0.34 * width, 0.15 * height, scale), person_of(skeleton, 0.78 * width, 0.3 * height,
                                                                               0.6 * scale)]


def render_fields(people, net=NET, missing=(), sharpness=1.0, skeleton=COCO_18):
    """Draw the fields that a perfect network would give, (57, h, w) float32 for COCO_18.

    Joints are Gaussians of 8 network pixels as in training; a limb's field is a unit vector within one cell of the
    limb's line, averaged where limbs of several people cross. People are (K, 2) pixels of a network's input of a size
    (height, width); missing joints are not drawn, nor limbs that end there; sharpness is the height of the Gaussians.
    """
    height, width = net[0] // STRIDE, net[1] // STRIDE
    v, u = np.mgrid[:height, :width].astype(float)
    heat = np.zeros((len(skeleton.joints) + 1, height, width))
    paf = np.zeros((2 * len(skeleton.limbs), height, width))
    index = skeleton.index
    count = np.zeros((len(skeleton.limbs), height, width))
    for person in people:
        cells = (np.asarray(person) + 0.5) / STRIDE - 0.5
        for joint, name in enumerate(skeleton.joints):
            if name not in missing:
                squared = (u - cells[joint, 0]) ** 2 + (v - cells[joint, 1]) ** 2
                heat[joint] = np.maximum(heat[joint], sharpness * np.exp(-squared / 2))
        for i, limb in enumerate(skeleton.limbs):
            if limb.start in missing or limb.end in missing:
                continue
            start, vector = cells[index[limb.start]], cells[index[limb.end]] - cells[index[limb.start]]
            length = max(np.hypot(*vector), 1e-9)
            unit = vector / length
            along = (u - start[0]) * unit[0] + (v - start[1]) * unit[1]
            across = (u - start[0]) * unit[1] - (v - start[1]) * unit[0]
            inside = (along >= -1) & (along <= length + 1) & (np.abs(across) <= 1)
            paf[list(limb.paf)] += inside * unit[:, None, None]
            count[i] += inside
    for i, limb in enumerate(skeleton.limbs):
        paf[list(limb.paf)] /= np.maximum(count[i], 1)
    heat[-1] = 1 - heat[:-1].max(axis=0)
    return np.concatenate([heat, paf]).astype(np.float32)
