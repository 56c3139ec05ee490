"""Tensors as pose networks give them, by seed: what the makers' own code made of them is in makers_outputs.npz.

The stream of NumPy's RandomState is the same in all versions.
"""
import numpy as np

# Points and (width, height) of the input of SimCC networks.
SIMCC = {'body': (17, (192, 256)), 'feet': (26, (192, 256)), 'whole_body': (133, (192, 256)), 'large': (17, (288, 384))}
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


def heat_maps():
    """(1, 17, 64, 48): Gaussians at chance places in noise, some at the border and some with another person's."""
    random = np.random.RandomState(6)
    y, x = np.mgrid[:64, :48]
    maps = np.abs(random.normal(0, 0.01, (1, 17, 64, 48)))
    for one, (column, row, height) in zip(maps[0], random.random_sample((17, 3)) * (48, 64, 1)):
        one += height * np.exp(-((x - column) ** 2 + (y - row) ** 2) / 2 / 1.7 ** 2)
        one += 0.7 * height * np.exp(-((x - column - 9) ** 2 + (y - row + 4) ** 2) / 2 / 2.2 ** 2)
    return maps.astype(np.float32)
