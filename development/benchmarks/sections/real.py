"""Real data, one figure each, and pictures.

Photographs with annotated joints, calibrated cameras, and recordings of depth cameras without truth: there, people who
are seen were marked by hand, and what is wrong in their pictures was found by looking at them.
"""
import json
from contextlib import ExitStack
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import count
from pathlib import Path
from typing import Callable, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.detect.detector import Detector, create_detector
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED
from openpose_ros_pkg.detect.network_detection import NetworkDetection, people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_tools.alignment.people import pair_people
from results import IMAGES, NeedsDataError, Options, Picture, Section, Table
from scoring.coco import average_precision
from scoring.counts import Counts
from scoring.figures import Figure, figures, of_sums
from sections import mvor, real_cameras
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import INFERRED, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

MODES = ('fast', 'balanced')
# Depths of the first and the last colour [m]; size of an image in a picture [px]; quality of JPEG.
NEAR, FAR, SIZE, QUALITY = 0.5, 6.0, (480, 360), 70
SLOP = 0.5  # [s] between image and depth of the bags
# Cameras of five_people.pcd, by its points, and of DeepDeform's T-shirts, by their intrinsics.txt.
KINECT = CameraModel(640, 480, np.array([525.0, 0, 319.5, 0, 525.0, 239.5, 0, 0, 1]))
STRUCTURE = CameraModel(640, 480, np.array([575.548, 0, 323.172, 0, 577.46, 236.417, 0, 0, 1]))
# Joints whose mean is compared with a mark; those of the Leeds Sports Poses, in the order of joints.mat.
UPPER = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'right_shoulder', 'left_shoulder')
HIPS = ('right_hip', 'left_hip')
LIMBS = ('right_ankle', 'right_knee', 'right_hip', 'left_hip', 'left_knee', 'left_ankle', 'right_wrist', 'right_elbow',
         'right_shoulder', 'left_shoulder', 'left_elbow', 'left_wrist')
# PCK: share of the torso, and the least torso [px].
NEAR_ENOUGH, LEAST_TORSO = 0.2, 10.0
TEXT = '''`--data real=FOLDER`, with a folder of each. COCO: AP in 80 photographs, on which modes were tuned. Leeds
Sports Poses: share of visible limb joints within 0.2 of the torso (PCK), best person in each of 200 photographs of
athletes. In recordings, people with a third of head or trunk visible were marked by hand, and are found where head
and shoulders of one are at the mark.

Limbs are drawn in full, those with an INFERRED end dashed, INFERRED joints as circles; right: over the depth, red
near, black missing. [Licences of the pictures](results/real_licences.txt).'''
# A person who is seen: place between chin and shoulders, and how far the skeleton's may be from it [px].
Mark = Tuple[float, float, float]


class Recording(NamedTuple):
    """A recording: place in the data folder, frames, people in each (or in all), frames that are shown, what is wrong.

    cloth: by frame, depth of the far end of a cloth that is held before the body [m].
    """

    path: str
    frames: Callable[[Path], Iterator[Frame]]
    seen: Sequence[Sequence[Mark]]
    shown: Sequence[int] = ()
    text: str = ''
    cloth: Sequence[float] = ()


def frames_of_bag(path: Path) -> Iterator[Frame]:
    """Yield the frames of a bag."""
    from openpose_ros_tools.ros.process_bag.input import FrameReader, RecordedFrame, open_camera  # others need no ROS
    from openpose_ros_tools.ros.process_bag.job import Input, build_settings
    from skeleton_extract_3d.ros.frames import points_from_message
    settings = build_settings({'slop': SLOP})
    with ExitStack() as stack:
        points = partial(points_from_message, params=replace(settings.extractor, points_source='depth_image'))
        for frame in FrameReader(open_camera(Input(path), stack), settings.pairing, points, False):
            if isinstance(frame, RecordedFrame):
                yield Frame('', frame.points_header.stamp.to_sec(), frame.bgr, frame.points,
                            image_stamp=frame.header.stamp.to_sec())


def frames_of_folder(path: Path) -> Iterator[Frame]:
    """Yield the frames of the RealSense; its matrix is written column by column, its rate is not known."""
    values = json.loads((path / 'cam_params_realsense.json').read_text())
    camera = CameraModel(values['width'], values['height'], np.reshape(values['intrinsic_matrix'], (3, 3)).T)
    for frame in RgbdSequence.read(path, camera, Fraction(15)):
        yield Frame('', 1.0 + frame.time, frame.bgr, DepthImage(frame.depth, camera))


def frames_of_cloud(path: Path) -> Iterator[Frame]:
    """Yield the frame of the Kinect, whose cloud was written as images."""
    yield Frame('', 1.0, cv2.imread(str(path / 'rgb.png')),
                DepthImage(cv2.imread(str(path / 'depth_mm.png'), cv2.IMREAD_UNCHANGED), KINECT))


def frames_of_shirts(path: Path) -> Iterator[Frame]:
    """Yield the frames of a T-shirt that is held up, too far apart to be followed."""
    for second, image in zip(count(1, 100), sorted(path.glob('example_data/*/*/color/*.jpg'))):
        depth = image.parents[1] / 'depth' / f'{image.stem}.png'
        yield Frame('', float(second), cv2.imread(str(image)), DepthImage(cv2.imread(str(depth), -1), STRUCTURE))


RECORDINGS = {
    'hsr_1': Recording('hsr_bags/2019-05-03-12-41-38.bag', frames_of_bag, [[
        (302, 131, 50), (12, 235, 30), (30, 235, 15), (54, 245, 10), (72, 240, 25), (100, 245, 15), (145, 252, 18),
        (166, 255, 14), (568, 227, 22)]], (0,), (
            "A robot's Xtion. Wrong: the wrist with the phone is INFERRED; people who sit have legs that stand.")),
    'hsr_2': Recording('hsr_bags/2019-05-03-12-42-18.bag', frames_of_bag, [[
        (348, 116, 55), (10, 240, 30), (33, 240, 18), (48, 215, 12), (70, 240, 25), (104, 242, 20), (146, 255, 18),
        (168, 255, 14), (282, 238, 14), (570, 227, 22)]], (0,), 'Two of the sitting people are found.'),
    'hsr_3': Recording('hsr_bags/2019-05-03-12-42-30.bag', frames_of_bag, [[
        (345, 118, 55), (12, 235, 30), (35, 230, 18), (62, 242, 25), (146, 255, 18), (168, 255, 14), (234, 247, 14),
        (282, 240, 14), (515, 232, 16), (574, 227, 22)]], (0,), (
            'Wrong: the runner, beyond the range of the sensor, is put at 12 m, the greatest depth considered.')),
    'realsense': Recording('rs_two_people_n40', frames_of_folder, [[(268, 234, 35), (453, 120, 40)]], (0, 20, 39), (
        'A RealSense; frames 1, 21 and 40 of 40. Wrong: in the last, the right elbow of the man who stands is INFERRED.'
    )),
    'kinect': Recording('pcl_five_people', frames_of_cloud, [[
        (82, 115, 45), (188, 150, 35), (335, 150, 32), (420, 145, 35), (542, 118, 50)]], (0,), (
            'A Kinect, five people from behind; forearms before the bodies are INFERRED.')),
    'shirt': Recording('deepdeform_shirt', frames_of_shirts, [
        [(312, 142, 40)], [(268, 142, 45)], [(282, 100, 40)], [(330, 142, 40)]], cloth=(1.9, 1.8, 1.45, 1.45))}


def measure(options: Options) -> Section:
    """Return the figures of all data; NeedsDataError: some are not there."""
    found: Dict[str, Figure] = {}
    rows: List[List[object]] = [['data', 'figure', '']]
    pictures: List[Picture] = []
    for title, work in WORK.items():
        part, drawn = work(options)
        found.update(part)
        rows += [[title, figure.text, figure] for figure in part.values()]
        pictures += drawn
        print(*rows[-1], flush=True)
    return Section(TEXT, found, [Table('', rows)], pictures)


def place(options: Options, name: str, folder: str) -> Path:
    """Return the folder of a data set, --data NAME=FOLDER or one in --data real=FOLDER; NeedsDataError: not there."""
    path = options.data[name] if name in options.data else options.folder('real') / folder
    if not path.exists():
        raise NeedsDataError(str(path))
    return path


Part = Tuple[Dict[str, Figure], Sequence[Picture]]


def detectors() -> Iterator[Tuple[str, Detector]]:
    """Yield the modes with their detectors."""
    return ((mode, create_detector(build(DetectorSettings, {'mode': mode}))) for mode in MODES)


def coco(options: Options) -> Part:
    """Return AP in photographs."""
    folder = place(options, 'coco', 'coco_people_dev')
    return {f'coco_{mode}_ap': average_precision(folder, detector, 4 if options.quick else 1000)._replace(
        text=f'AP, {mode}') for mode, detector in detectors()}, ()


def athletes(options: Options) -> Part:
    """Return PCK in photographs of athletes."""
    from scipy.io import loadmat
    folder = place(options, 'lsp200', 'lsp200')
    joints = loadmat(str(folder / 'joints.mat'))['joints'].transpose(2, 0, 1)[:, :len(LIMBS)]
    paths = sorted((folder / 'images').glob('*.jpg'))[:4 if options.quick else None]
    truth = [joints[int(path.stem[2:]) - 1] for path in paths]
    found = {}
    for mode, detector in detectors():
        right = [_right(people_in(cv2.imread(str(path)), detector), true) for path, true in zip(paths, truth)]
        counts = [Counts('', {}, {'right': each, 'all': number}, {}) for each, number in right]
        found.update(figures(counts, {f'athletes_{mode}_pck': of_sums(f'PCK, {mode}', 'right', 'all')}))
    return found, ()


def _right(people: People2D, truth: np.ndarray) -> Tuple[int, int]:
    """Return how many visible joints (12, 3) the best person has right, and how many there are."""
    visible, joints = truth[:, 2] > 0, {name: truth[k, :2] for k, name in enumerate(LIMBS)}
    torso = max(LEAST_TORSO, *(np.linalg.norm(joints[f'{side}_shoulder'] - joints[f'{other}_hip'])
                               for side, other in (('right', 'left'), ('left', 'right'))))
    found = people.xy[:, [people.skeleton.index[name] for name in LIMBS]]
    near = np.nan_to_num(np.linalg.norm(found - truth[:, :2], axis=2), nan=np.inf) < NEAR_ENOUGH * torso
    return int((near & visible).sum(axis=1).max(initial=0)), int(visible.sum())


def theatre(options: Options) -> Part:
    """Return what MVOR's people are found by OpenPose's detections, and their errors."""
    counts = mvor.counted_blocks(place(options, 'mvor', 'mvor'), options.quick)
    return {'mvor_found': figures(counts, mvor.PEOPLE)['found']._replace(text='people found'),
            'mvor_median': figures(counts, mvor.ERRORS)['median']._replace(text='median error [mm]')}, ()


def cameras(options: Options) -> Part:
    """Return the reprojection error of the people of Pose2Sim's four cameras."""
    seen, _ = real_cameras.found_people(real_cameras.cameras(options), 2 if options.quick else 1000)
    fused = real_cameras.fuse(seen)
    errors = np.concatenate([real_cameras.reprojection(camera, fused) for camera in seen])
    return {'pose2sim_reprojection': Figure(float(np.median(errors)), n=len(errors), unit='px', digits=1,
                                            text='median reprojection [px]')}, ()


def recordings(options: Options, names: Sequence[str]) -> Part:
    """Return how many people of recordings are found, and the pictures."""
    there = {name: place(options, name, RECORDINGS[name].path) for name in names}
    settings = build(ChainSettings, options.settings)
    detector = create_detector(settings.detector)
    sums, pictures = np.zeros(5, int), []
    for name, path in there.items():
        recording, drawn = RECORDINGS[name], []
        chain = PeopleChain(NetworkDetection(detector, NEVER_FOLLOWED), settings.estimator)
        for number, frame in enumerate(recording.frames(path)):
            people = chain.update(frame).people_3d
            sums += counted(people, frame, recording, number)
            drawn += [picture(frame, people)] if number in recording.shown else []
        if drawn:
            pictures.append(Picture(f'results_real_{name}.jpg', recording.text))
            cv2.imwrite(str(IMAGES / pictures[-1].file), np.vstack(drawn), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    key, (found, seen, others, on_body, hips) = names[0].partition('_')[0], sums.tolist()
    part = {f'{key}_found': Figure(found / seen, n=seen, digits=2,
                                   text=f'{found} of {seen} people; {others} elsewhere')}
    if hips:
        part[f'{key}_hips'] = Figure(on_body / hips, n=hips, digits=2, text=f'hips not on the cloth, of {hips}')
    return part, pictures


def counted(people: People3D, frame: Frame, recording: Recording, number: int) -> Tuple[int, ...]:
    """Return how many people are found, seen, and found beside the marks; hips behind the cloth, and all hips."""
    marks = np.array(recording.seen[number % len(recording.seen)], np.float64)
    upper, hips = (people.xyz[:, [people.skeleton.index[name] for name in names]].astype(np.float64)
                   for names in (UPPER, HIPS))
    pixels = (frame.grid.camera_model().project(one[np.isfinite(one).all(axis=1)]) for one in upper)
    middle = np.array([one.mean(axis=0) if len(one) else (np.nan,) * 2 for one in pixels]).reshape(-1, 1, 2)
    found = len(pair_people(middle, marks[:, np.newaxis, :2], marks[:, 2]))
    depths = hips[..., 2][np.isfinite(hips[..., 2])] if recording.cloth else np.zeros(0)
    behind = int((depths > recording.cloth[number]).sum()) if recording.cloth else 0
    return found, len(marks), len(people) - found, behind, len(depths)


def picture(frame: Frame, people: People3D) -> np.ndarray:
    """Return the people over the image and over the depth, side by side, uint8 BGR."""
    uv = frame.grid.camera_model().project(people.xyz).reshape(len(people), -1, 2)
    depth = frame.grid.depths(*np.meshgrid(np.arange(frame.grid.width), np.arange(frame.grid.height)))
    shade = np.nan_to_num((FAR - depth) / (FAR - NEAR)).clip(0, 1)
    colours = cv2.applyColorMap(np.uint8(255 * shade), cv2.COLORMAP_TURBO)
    colours[np.isnan(depth)] = 0
    there, params = real_cameras.in_image(people, uv), DrawParams(alpha_pose=1.0)
    drawn = [draw_people(canvas, there, params, people.status == INFERRED) for canvas in (frame.image, colours)]
    return np.hstack([cv2.resize(canvas, SIZE, interpolation=cv2.INTER_AREA) for canvas in drawn])


WORK: Dict[str, Callable[[Options], Part]] = {
    'COCO': coco, 'Leeds Sports Poses': athletes, 'MVOR': theatre, 'Pose2Sim': cameras,
    'Xtion, three images': partial(recordings, names=('hsr_1', 'hsr_2', 'hsr_3')),
    'RealSense, 40 images': partial(recordings, names=('realsense',)),
    'Kinect, one image': partial(recordings, names=('kinect',)),
    'DeepDeform, four images': partial(recordings, names=('shirt',))}
