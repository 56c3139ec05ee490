"""Rendered depth of a RealSense against real depth.

What is lost is compared on the same shapes: holes of the real depth are filled with their nearest depth, and the sensor
of `./run bench render` measures the result.
"""
from typing import Dict, List, NamedTuple

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from development.benchmark_data.rendering.depth_sensors import Stereo
from development.benchmark_data.rendering.renderer import Frame
from results import Options, Section, Table
from scoring.figures import Figure
from sections.real import place

# Near surfaces are up to here, what is far begins there [m]; largest hole [px]; step of disparity that counts [px].
NEAR, HOLE, STEP = 2.5, 400, 1.5
TEXT = '''Raw depth of people by a D415 (VCL3D, two images) and depth of a D435 after its filters (`rs_two_people_n40`),
`--data real=FOLDER`; beside each, what the rendered sensor makes of the same shapes. Scenes draw theirs between the
two. Gaps: pixels lost between a surface within 2.5 m and one behind it, by 1.5 px of disparity or more; the shadow of
the second camera is on the left. The raw images have no colour and end within the heads: hair is not told.'''
ROWS = {'lost': 'lost, of all', 'holes': 'small holes in near surfaces', 'far': 'lost beyond 2.5 m',
        'left': 'gap on the left, median [px]', 'right': 'gap on the right', 'vertical': 'gap above and below',
        'closed': 'steps without a gap'}


class Camera(NamedTuple):
    """Images of a camera, a pattern in a folder, focal length of the images and of the sensor [px], baseline [m].

    `raw`: of the model.
    """

    title: str
    folder: str
    images: str
    focal: float
    sensor_focal: float
    baseline: float
    raw: float


CAMERAS = {'d415': Camera('D415, raw', 'vcl_rs_depth', '*.png', 482, 482, 0.055, 1),
           'd435': Camera('D435, filtered', 'rs_two_people_n40', 'depth/*0.png', 617, 383, 0.050, 0)}


def measure(options: Options) -> Section:
    """Compare each camera with its model."""
    found: Dict[str, Figure] = {}
    columns: List[List[object]] = [['', *ROWS.values()]]
    for name, camera in CAMERAS.items():
        folder = place(options, name, camera.folder)
        depths = [cv2.imread(str(path), -1)[2:-2] / np.float32(1000) for path in sorted(folder.glob(camera.images))]
        shapes = [filled(depth) for depth in depths]
        for part, title, images in (('real', camera.title, depths),
                                    ('model', 'rendered', [rendered(camera, shape) for shape in shapes])):
            values = compared(images, shapes, camera.sensor_focal * camera.baseline)
            part_found = {f'{name}_{part}_{key}': Figure(value, n=len(images), text=ROWS[key],
                                                         digits=0 if key in ('left', 'right', 'vertical') else 3)
                          for key, value in values.items()}
            columns.append([title, *part_found.values()])
            found.update(part_found)
    return Section(TEXT, found, [Table('', list(zip(*columns)))])


def filled(depth: np.ndarray) -> np.ndarray:
    """Return depth (H, W) [m] with the nearest one where it is 0."""
    return depth[tuple(distance_transform_edt(depth == 0, return_distances=False, return_indices=True))]


def rendered(camera: Camera, shape: np.ndarray) -> np.ndarray:
    """Return what the model of a camera measures of a shape [m]."""
    sensor = Stereo(camera.focal, 0)
    sensor.raw = camera.raw
    sensor.model = Stereo.model._replace(focal=camera.sensor_focal, baseline=camera.baseline)
    nothing = np.zeros(shape.shape, bool)
    frame = Frame(np.zeros((*shape.shape, 3)), shape, nothing, np.ones_like(shape), nothing)
    return sensor.measure(frame) / np.float32(1000)


def compared(depths: List[np.ndarray], shapes: List[np.ndarray], product: float) -> Dict[str, float]:
    """Return the values of ROWS; product: focal length times baseline [px m]."""
    lost, shape = np.concatenate(depths) == 0, np.concatenate(shapes)
    kernel = np.ones((13, 13), np.uint8)
    flat = np.concatenate([cv2.dilate(product / each, kernel) - cv2.erode(product / each, kernel) < STEP
                           for each in shapes]) & (shape < NEAR)
    _, labels, areas, _ = cv2.connectedComponentsWithStats((lost & flat).astype(np.uint8))
    small = (areas[:, cv2.CC_STAT_AREA] <= HOLE)[labels] & (labels > 0)
    left, right, above, below = (np.concatenate([gaps(turned(each), product) for each in depths]) for turned in (
        np.fliplr, np.asarray, np.transpose, lambda each: np.fliplr(each.T)))
    steps = np.concatenate([left, right, above, below])
    return {'lost': lost.mean(), 'holes': small.sum() / flat.sum(), 'far': lost[shape > NEAR].mean(),
            'left': np.median(left), 'right': np.median(right), 'vertical': np.median([*above, *below]),
            'closed': np.mean(steps < 2)}


def gaps(depth: np.ndarray, product: float) -> np.ndarray:
    """Return the widths [px] of what is lost to the right of near surfaces, before a farther one, of all rows."""
    rows, columns = np.nonzero(depth)
    near, far = depth[rows[:-1], columns[:-1]], depth[rows[1:], columns[1:]]
    step = (np.diff(rows) == 0) & (near < NEAR) & (product / near - product / far > STEP)
    return np.diff(columns)[step] - 1
