"""Confidence maps and part affinity fields of people whose joints are known, as a perfect network would give them."""
import numpy as np

from openpose_ros_pkg.networks.models import MOBILENET_THIN
from openpose_ros_pkg.skeletons import COCO_18

STRIDE = MOBILENET_THIN.stride
NET = (368, 656)  # height, width
# A person who faces the camera: x, y of the 18 joints in units of the body's height from nose to ankle. The person's
# right is at the picture's left.
FRONT = np.array([
    (0.000, 0.00), (0.000, 0.14), (-0.11, 0.15), (-0.16, 0.32), (-0.19, 0.47), (0.11, 0.15), (0.16, 0.32),
    (0.19, 0.47), (-0.07, 0.50), (-0.08, 0.76), (-0.09, 1.00), (0.07, 0.50), (0.08, 0.76), (0.09, 1.00),
    (-0.03, -0.03), (0.03, -0.03), (-0.07, -0.01), (0.07, -0.01)])


def standing_person(x: float, y: float, height: float) -> np.ndarray:
    """Return (18, 2) float64 network pixels of a person whose nose is at x, y."""
    return FRONT * height + (x, y)


def render_fields(people, net=NET, missing=(), sharpness=1.0, skeleton=COCO_18):
    """Draw the fields that a perfect network would give, (57, h, w) float32 for COCO_18.

    Joints are Gaussians of 8 network pixels as in training; a limb's field is a unit vector within one cell of the
    limb's line, averaged where limbs of several people cross.

    Args:
        people: (K, 2) network pixels each.
        net: (height, width) of the network's input.
        missing: joints that are not drawn, nor limbs that end there.
        sharpness: height of the Gaussians.
        skeleton: joint set; the confidence map of the background and the fields follow its joints.
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
