"""Two rigs of four real cameras without depth.

--data pose2sim=FOLDER: Pose2Sim/Demo_MultiPerson of PyPI's wheel pose2sim 0.10.49 (`pip download --no-deps`, unzipped),
four calibrated RGB cameras, 1.67 s at 60 Hz. BSD-3-Clause, Copyright (c) 2022, perfanalytics. 1088 x 1920 px. A person
balances on a treadmill, one stands far behind; the one at the edge of the treadmill was rendered into the images.

--data caliscope=FOLDER: tests/sessions/post_optimization of https://github.com/mprib/caliscope (BSD-2-Clause), four
webcams of 1280 x 720 px, 57 frames in 9.5 s, calibrated by the ChArUco board that a seated person holds.
"""
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np
import pandas as pd

from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import from_image
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.alignment.people import pair_people
from openpose_ros_tools.calibration.calibrate import CalibrationParams, calibrate
from openpose_ros_tools.calibration.known_cameras import read_known_cameras
from openpose_ros_tools.calibration.recording import CameraRecording, keypoint_sigma
from results import IMAGES, Options, Picture, Section, Table
from scoring.figures import Figure
from simulated_room import rig_errors
from skeleton_extract_3d.chain_settings import create_chain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera
from skeleton_extract_3d.points.transform import Transform

RATE = 60.0  # [Hz]
# Stamp of the first frame [s], and the frame of the picture.
BEGIN, SHOWN = 1000.0, 60
PICTURE = 'results_real_cameras.jpg'
# Frames of a second of the webcams; number of the first one in the tables of the board.
WEBCAM_RATE, FIRST_FRAME = 6.0, 35
# Wrists farther from all corners of the board do not hold it [m].
HOLDS = 0.3
WRISTS = ('left_wrist', 'right_wrist')
LICENCE = 'Images: Pose2Sim, BSD-3-Clause, Copyright (c) 2022, perfanalytics.'
TEXT = '''The multi-person demo of Pose2Sim 0.10.49: four cameras, 1.67 s at 60 Hz, calibrated by Qualisys. Three people
stay where they are: one far behind, one rendered into the images, and one that all four see. Caliscope (BSD-2-Clause):
four webcams at 6 Hz, a metre from a seated person of unknown stature with a ChArUco board, which calibrates them.

The calibration by the people alone, with the mean stature of adults, is compared to the first camera, as is what it
states (1 sigma). The file of Qualisys does not fit its images exactly: reflectors and bolts of the treadmill are up to
15 px beside their pixels; 29 px are one degree.'''


class Camera(NamedTuple):
    """A camera as it is calibrated, z of the room is up; and its people by frame."""

    name: str
    model: CameraModel
    pose: Transform
    video: Path = Path()
    rate: float = 1.0
    people: Sequence[Any] = ()

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
    most = SHOWN // 2 if options.quick else 1000
    seen, images = found_people(cameras(options), most)
    fused = fuse(seen)
    people = fused[min(SHOWN, len(fused) - 1)]
    drawn = [draw_people(image, in_image(people, pixels(camera, people.xyz)), DrawParams())
             for camera, image in zip(seen, images)]
    small = [cv2.resize(image, None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA) for image in drawn]
    cv2.imwrite(str(IMAGES / PICTURE), np.hstack(small), [cv2.IMWRITE_JPEG_QUALITY, 80])
    table, found = _reprojection(seen, fused)
    # the other two pairs of rate and clocks gave the same within 3 mm and 0.1 degrees
    made = [('60hz', '60 Hz', seen, 1, True), ('15hz_clocks', '15 Hz, clocks searched for', seen, 4, False)]
    if 'caliscope' in options.data:
        folder = options.data['caliscope'] / 'post_optimization'
        webcams = found_people(_cameras(folder / 'config.toml', folder / 'calibration/extrinsic', WEBCAM_RATE), most)[0]
        made.append(('caliscope', 'caliscope', webcams, 1, True))
    rows: List[List[object]] = [['recording', 'camera', 'distance [m]', 'scale', 'angle [degrees]', 'stated',
                                 'position [mm]', 'stated']]
    for each in made:
        more, figures, placed = _calibrated(*each)
        rows, found = [*rows, *more], {**found, **figures}
    tables = [table, Table('Calibration by the people alone', rows)]
    if 'caliscope' not in options.data:
        print('real_cameras: the webcams of caliscope are left out; they need --data caliscope=FOLDER', flush=True)
    elif placed:
        board = pd.read_csv(folder / 'calibration/extrinsic/CHARUCO/xyz_CHARUCO.csv').groupby('sync_index')
        table, figures = _hands(webcams, placed, {
            number - FIRST_FRAME: corners[['x_coord', 'y_coord', 'z_coord']].to_numpy() for number, corners in board})
        tables, found = [*tables, table], {**found, **figures}
    return Section(TEXT, found, tables, [Picture(PICTURE, f'Fused people in the images of four cameras. {LICENCE}')])


def fuse(seen: Sequence[Camera]) -> List[People3D]:
    """Return the people of the cameras together, by frame."""
    fusion, fused = PeopleFusion(), []
    for number, people in enumerate(zip(*(camera.people for camera in seen))):
        stamp = BEGIN + number / seen[0].rate
        fused.append(fusion.update([from_image(camera.name, stamp, one, camera.model, camera.pose)
                                    for camera, one in zip(seen, people)], stamp))
    return fused


def found_people(given: Sequence[Camera], most: int) -> Tuple[List[Camera], List[np.ndarray]]:
    """Return the cameras with the people of all images, and the image of each camera that is shown."""
    chain, seen, images = create_chain({}), [], []
    for camera in given:
        people = []
        for number, image in enumerate(camera.frames(most)):
            people.append(chain.update(Frame(camera.name, BEGIN + number / camera.rate, image)).people_2d)
            images += [image] if number == min(SHOWN, most - 1) else []
        seen.append(camera._replace(people=people))
    return seen, images


def reprojection(camera: Camera, people: Sequence[People3D]) -> List[float]:
    """Return the distances of fused joints, by frame, from a camera's keypoints [px]."""
    errors: List[float] = []
    for image, joints in zip(camera.people, people):
        uv, given = pixels(camera, joints.xyz), _keypoints(image)[..., :2]
        for row, true in pair_people(uv, given, np.inf):
            apart = np.linalg.norm(uv[row] - given[true], axis=1)
            errors += apart[np.isfinite(apart)].tolist()
    return errors


def _reprojection(seen: Sequence[Camera], fused: Sequence[People3D]) -> Tuple[Table, Dict[str, Figure]]:
    """Return the distances of fused joints from keypoints."""
    rows: List[List[object]] = [['camera', 'keypoints', 'median [px]', '90 % [px]']]
    found: Dict[str, Figure] = {}
    for camera in seen:
        errors = reprojection(camera, fused)
        middle, most = np.percentile(errors, (50, 90))
        rows.append([camera.name, len(errors), f'{middle:.1f}', f'{most:.1f}'])
        found[f'reprojection_{camera.name}'] = Figure(float(middle), n=len(errors), unit='px', digits=1,
                                                      text=f'median reprojection error, {camera.name}')
    counts, ids = [len(people) for people in fused], {number for people in fused for number in people.ids.tolist()}
    found['ids'] = Figure(len(ids), n=len(fused), digits=0, text='ids')
    found['three_people'] = Figure(float(np.mean([count == 3 for count in counts])), n=len(counts), digits=2,
                                   text='frames with three people')
    people = f'{min(counts)} to {max(counts)} people in each of {len(fused)} frames, {len(ids)} ids'
    return Table(f'Reprojection; {people}', rows), found


def _calibrated(key: str, name: str, seen: Sequence[Camera], step: int, clocks_agree: bool) -> Tuple[
        List[List[object]], Dict[str, Figure], List[Camera]]:
    """Calibrate cameras by the people of every `step`-th frame.

    Returns:
        Rows and figures of their poses; the cameras, none where that is refused.
    """
    try:
        result = calibrate([_recording(camera, step) for camera in seen], CalibrationParams(clocks_agree=clocks_agree))
    except BadInputError as error:
        return [[name, f'refused: {error}', *['-'] * 6]], {}, []
    references = [SimpleNamespace(pose=camera.pose, clock=0.0) for camera in seen]
    values = {'error': rig_errors(result.rig, references)[:, :2] * (1, 1e3), 'stated': result.std[1:, :2] * (1, 1e3)}
    (turn, begin), (root, first) = result.rig.cameras[0].pose, seen[0].pose
    to_truth = root @ turn.T
    placed = [camera._replace(pose=(to_truth @ pose[0], to_truth @ (pose[1] - begin) + first))
              for camera, pose in zip(seen, (one.pose for one in result.rig.cameras))]
    away = [[float(np.linalg.norm(camera.pose[1] - first)) for camera in some[1:]] for some in (seen, placed)]
    rows: List[List[object]] = []
    for number, camera in enumerate(seen[1:]):
        rows.append([name, camera.name, f'{away[0][number]:.1f}', f'{away[1][number] / away[0][number]:.3f}',
                     *(f'{one[number, 0]:.1f}' for one in values.values()),
                     *(f'{one[number, 1]:.0f}' for one in values.values())])
    found = {f'scale_{key}': Figure(sum(away[1]) / sum(away[0]), n=len(away[0]), digits=3)}
    for kind, one in values.items():
        found[f'angle_{key}_{kind}'] = Figure(float(one[:, 0].max()), n=len(one), unit='degrees', digits=1)
        found[f'position_{key}_{kind}'] = Figure(float(one[:, 1].max()), n=len(one), unit='mm', digits=0)
    return rows, found, placed


def _wrists(seen: Sequence[Camera]) -> np.ndarray:
    """Return the measured wrists of the person with most measured joints, (frames, 2, 3) [m]; NaN: there is none."""
    places = np.full((len(seen[0].people), len(WRISTS), 3), np.nan)
    for number, people in enumerate(fuse(seen)):
        if len(people):
            person = int((people.status == MEASURED).sum(axis=1).argmax())
            for column, joint in enumerate(COCO_18.index[name] for name in WRISTS):
                if people.status[person, joint] == MEASURED:
                    places[number, column] = people.xyz[person, joint]
    return places


def _hands(webcams: Sequence[Camera], placed: Sequence[Camera], corners: Dict[int, np.ndarray]) -> Tuple[
        Table, Dict[str, Figure]]:
    """Return where the wrists of hands are that hold the board, by the given cameras and by those from people.

    Args:
        corners: of the board by frame, (N, 3) [m].
    """
    rows: List[List[object]] = [['caliscope', 'frames', 'corner [mm]', '10 %', '90 %', 'by people', 'apart']]
    found: Dict[str, Figure] = {}
    given, by_people = _wrists(webcams), _wrists(placed)
    for column, name in enumerate(WRISTS):
        near = np.array([[1e3 * np.linalg.norm(corners[frame] - wrists[frame, column], axis=1).min()
                          for wrists in (given, by_people)] for frame in sorted(corners) if frame < len(given)])
        held = near[:, 0] < 1e3 * HOLDS
        apart = float(np.nanmedian(1e3 * np.linalg.norm(by_people - given, axis=2)[:len(held), column][held]))
        values = [*np.percentile(near[held, 0], (50, 10, 90)), np.nanmedian(near[held, 1]), apart]
        rows.append([name.replace('_', ' '), int(held.sum()), *(f'{value:.0f}' for value in values)])
        found[f'{name}_corner'] = Figure(float(values[0]), n=int(held.sum()), unit='mm', digits=0)
        found[f'{name}_apart'] = Figure(apart, n=int(held.sum()), unit='mm', digits=0)
    return Table('Wrists from the nearest corner of the board, and from the same by the people', rows), found


def _recording(camera: Camera, step: int) -> CameraRecording:
    """Return every so many frames of a camera for the calibration."""
    frames = [(round(1e9 * (BEGIN + number / camera.rate)), people)
              for number, people in enumerate(camera.people)][::step]
    points = np.concatenate([_keypoints(people) for _, people in frames])
    rays = camera.model.rays(points[..., :2].reshape(-1, 2)).reshape(points.shape)
    stamps = np.concatenate([np.full(len(people), stamp, np.int64) for stamp, people in frames])
    return CameraRecording(camera.name, camera.name, stamps, np.concatenate([each.ids for _, each in frames]), rays,
                           keypoint_sigma(points[..., 2]), False, float(camera.model.matrix[0, 0]))


def _keypoints(people: People2D) -> np.ndarray:
    return keypoints_in(people.keypoints, people.skeleton, COCO_18).astype(np.float64)


def pixels(camera: Camera, xyz: np.ndarray) -> np.ndarray:
    """Return where joints (P, K, 3) [m] are in the image of a camera, (P, K, 2) [px]."""
    rotation, origin = camera.pose
    return camera.model.project((xyz - origin) @ rotation).reshape(*xyz.shape[:2], 2)


def in_image(people: People3D, uv: np.ndarray) -> People2D:
    """Return people to be drawn, of whom joints are at these pixels (P, K, 2)."""
    is_there = np.isfinite(uv).all(axis=2, keepdims=True)
    keypoints = np.where(is_there, np.insert(uv, 2, 1, axis=2), (np.nan, np.nan, 0)).astype(np.float32)
    return People2D(people.skeleton, keypoints, np.ones(len(people)), people.ids)


def cameras(options: Options) -> List[Camera]:
    """Return the cameras of Qualisys; NeedsDataError: they are not given."""
    folder = options.folder('pose2sim')
    return _cameras(folder / 'calibration/Calib.qca.txt', folder / 'videos', RATE)


def _cameras(file: Path, videos: Path, rate: float) -> List[Camera]:
    found = read_known_cameras([file])
    return [Camera(each.name, calibrated_camera(each.calibration), (
        each.rotation.T, -found.unit * each.rotation.T @ each.translation), videos / f'{each.name}.mp4', rate)
            for each in found.cameras]
