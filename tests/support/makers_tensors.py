"""Tensors as pose networks give them, by seed: what the makers' own code made of them is in makers_outputs.npz.

The stream of NumPy's RandomState is the same in all versions.
"""
import numpy as np

# Points and (width, height) of the input of SimCC networks.
SIMCC = {'body': (17, (192, 256)), 'feet': (26, (192, 256)), 'whole_body': (133, (192, 256)), 'large': (17, (288, 384))}
DETR_QUERIES, DETR_SIZE = 60, (640, 640)
RF_QUERIES, RF_CLASSES, RF_SIZE = 100, 91, (576, 576)
# (width, height) of images that fill the input, whatever its aspect.
IMAGES = ((640, 480), (1280, 720))
YOLOX_SIZE, YOLOX_CELLS = (416, 416), 3549


def simcc(name):
    """(1, K, bins) along x and along y: a Gaussian at a chance place in noise; some rows have no value above 0."""
    points, size = SIMCC[name]
    random = np.random.RandomState(points + size[0])
    rows = []
    for side in size:
        bins = np.arange(2 * side)
        places, heights = random.random_sample((1, points, 1)) * 2 * side, random.random_sample((1, points, 1)) * 1.1
        values = heights * np.exp(-(bins - places) ** 2 / 2 / 5.0 ** 2) + random.normal(0, 0.02, (1, points, 2 * side))
        values[:, ::7] -= 2.0
        rows.append(values.astype(np.float32))
    return tuple(rows)


def detr_pose():
    """Logits (1, N, 2) and joints (1, N, 17, 2) as shares of the image."""
    random = np.random.RandomState(2)
    return (random.normal(-0.5, 2.0, (1, DETR_QUERIES, 2)).astype(np.float32),
            (0.01 + 0.98 * random.random_sample((1, DETR_QUERIES, 17, 2))).astype(np.float32))


def rf_detr():
    """Boxes (1, N, 4), logits (1, N, classes) and points (1, N, 17, 8)."""
    random = np.random.RandomState(3)
    boxes = random.random_sample((1, RF_QUERIES, 4)).astype(np.float32)
    logits = random.normal(-6.0, 1.5, (1, RF_QUERIES, RF_CLASSES)).astype(np.float32)
    logits[..., 0] += 6
    points = random.normal(0, 1, (1, RF_QUERIES, 17, 8))
    points[..., :2] = 0.01 + 0.98 * random.random_sample((1, RF_QUERIES, 17, 2))
    points[..., [4, 6]] = random.normal(4, 1, (1, RF_QUERIES, 17, 2))
    points[..., 5] *= 20
    return boxes, logits, points.astype(np.float32)


def yolox():
    """Raw rows (1, cells, 85)."""
    random = np.random.RandomState(4)
    rows = random.normal(0, 1, (1, YOLOX_CELLS, 85))
    # Large boxes: rtmlib adds a pixel to the sides before it compares them, which shows in small ones.
    rows[..., 2:4] = 2 + rows[..., 2:4] / 4
    rows[..., 4:] = random.random_sample((1, YOLOX_CELLS, 81)) ** 4
    return rows.astype(np.float32)


def yolox_end_to_end():
    """Boxes (1, N, 5) and classes (1, N)."""
    random = np.random.RandomState(5)
    corner, sides = random.random_sample((50, 2)) * 300, random.random_sample((50, 2)) * 100
    boxes = np.concatenate([corner, corner + sides, random.random_sample((50, 1))], axis=1)[None].astype(np.float32)
    return boxes, np.zeros((1, 50), np.int64)
