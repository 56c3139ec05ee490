"""Recordings of real cameras, as pictures.

The chain runs over public recordings without truth; what is wrong in their pictures was found by looking at them.
"""
import json
import re
from contextlib import ExitStack
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Callable, Dict, Iterator, List, NamedTuple, Sequence

import cv2
import numpy as np

from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from results import IMAGES, NeedsDataError, Options, Picture, Section, Table
from scoring.figures import Figure
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

# Depths of the first and the last colour [m]; size of an image in a picture [px]; quality of JPEG.
NEAR, FAR, SIZE, QUALITY = 0.5, 6.0, (480, 360), 70
# Camera of five_people.pcd, by its points.
KINECT = CameraModel(640, 480, np.array([525.0, 0, 319.5, 0, 525.0, 239.5, 0, 0, 1]))
TEXT = '''No truth: these recordings are for looking at. Limbs are drawn in full, those with an INFERRED end dashed,
INFERRED joints as circles; on the right the same people over the depth: red near, blue far, black missing. {pairing}
[Licences of the pictures](results/real_recordings_licences.txt).'''


class Recording(NamedTuple):
    """A recording: place in the data folder, frames, those that are shown, what is in it, and what is wrong."""

    path: str
    frames: Callable[[Path], Iterator[Frame]]
    shown: Sequence[int]
    text: str


def frames_of_bag(path: Path) -> Iterator[Frame]:
    """Yield the frames of a bag; where stamps differ too much, with the slop that process_bag suggests."""
    from openpose_ros_tools.ros.process_bag.input import FrameReader, RecordedFrame, open_camera  # others need no ROS
    from openpose_ros_tools.ros.process_bag.job import Input, build_settings
    from skeleton_extract_3d.ros.frames import points_from_message
    values: Dict[str, float] = {}
    while True:
        settings = build_settings(values)
        with ExitStack() as stack:
            points = partial(points_from_message, params=replace(settings.extractor, points_source='depth_image'))
            reader = FrameReader(open_camera(Input(path), stack), settings.pairing, points, False)
            frames = [frame for frame in reader if isinstance(frame, RecordedFrame)]
        advice = re.search(r'slop=([\d.]+)', reader.report.advice)
        if frames or values or advice is None:
            break
        values = {'slop': float(advice[1])}
    for frame in frames:
        yield Frame('', frame.points_header.stamp.to_sec(), frame.bgr, frame.points,
                    image_stamp=frame.header.stamp.to_sec(), source=values.get('slop'))


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


RECORDINGS = {
    'hsr_1': Recording('hsr_bags/2019-05-03-12-41-38.bag', frames_of_bag, (0,), (
        "A robot's Xtion. The person behind the counter, with the head behind a shelf, is right. Wrong: the hand "
        'with the phone is seen and its wrist is INFERRED; of the row of people who sit two are found, with the '
        'legs of standing people, and the skeleton of one has joints of a neighbour.')),
    'hsr_2': Recording('hsr_bags/2019-05-03-12-42-18.bag', frames_of_bag, (0,), (
        'The same room. Wrong: the network puts the right elbow and wrist of the near person on a man 10 m away; '
        'no depth agrees, and they are INFERRED. Both skeletons of the row of people who sit have joints of two '
        'of them, and one a shin MEASURED on a jacket over a chair.')),
    'hsr_3': Recording('hsr_bags/2019-05-03-12-42-30.bag', frames_of_bag, (0,), (
        'The same room. The right elbow of the near person is hidden by the belly and INFERRED. Wrong: a runner '
        'beyond the range of the sensor is put at 12 m, the greatest depth that is considered; one who sits has a '
        'leg MEASURED on a chair with a jacket.')),
    'realsense': Recording('rs_two_people_n40', frames_of_folder, (0, 20, 39), (
        'A RealSense; frames 1, 21 and 40 of 40. Wrong: in the first, the right forearm of the man who stands is '
        'seen before the chest and INFERRED; in the last, his right elbow.')),
    'kinect': Recording('pcl_five_people', frames_of_cloud, (0,), (
        'A Kinect, five people from behind; arms before the bodies are INFERRED rightly. Wrong: the right wrist '
        'of person 2, hidden by person 1, is MEASURED on the left wrist of person 1, which is INFERRED.'))}


def measure(options: Options) -> Section:
    """Run the chain over the recordings that are there and draw their pictures."""
    folder = options.folder('real_recordings')
    there = {name: each for name, each in RECORDINGS.items() if (folder / each.path).exists()}
    if not there:
        raise NeedsDataError('--data real_recordings=FOLDER, with hsr_bags, rs_two_people_n40 or pcl_five_people')
    settings = build(ChainSettings, options.settings)
    detector = create_detector(settings.detector)
    figures: Dict[str, Figure] = {}
    rows: List[List[object]] = [['recording', 'frames', 'people', 'ids', 'MEASURED', 'INFERRED']]
    pictures, slops = [], []
    for name, recording in there.items():
        chain = PeopleChain(NetworkDetection(detector, NEVER_FOLLOWED), settings.estimator)
        found, drawn = [], []
        for number, frame in enumerate(recording.frames(folder / recording.path)):
            found.append(chain.update(frame).people_3d)
            slops += [f'{frame.source:g}'] if frame.source else []
            if number in recording.shown:
                drawn.append(picture(frame, found[-1]))
        file = f'results_real_{name}.jpg'
        cv2.imwrite(str(IMAGES / file), np.vstack(drawn), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        pictures.append(Picture(file, recording.text))
        figures.update(figures_of(name, found))
        rows.append([recording.path, len(found), *(figures[f'{name}_{part}'] for part in (
            'people', 'ids', 'measured', 'inferred'))])
    pairing = f"Images and depth of the bags pair with the slop that process_bag suggests: {', '.join(slops)} s."
    return Section(TEXT.format(pairing=pairing if slops else ''), figures, [Table('', rows)], pictures)


def figures_of(name: str, found: Sequence[People3D]) -> Dict[str, Figure]:
    """Return the numbers of people, ids, and joints by status."""
    status = np.concatenate([people.status.ravel() for people in found])
    values = {'people': sum(map(len, found)), 'ids': len({one for people in found for one in people.ids.tolist()}),
              'measured': (status == MEASURED).sum(), 'inferred': (status == INFERRED).sum()}
    return {f'{name}_{key}': Figure(int(value), n=len(found), digits=0, text=f'{key}, {RECORDINGS[name].path}')
            for key, value in values.items()}


def picture(frame: Frame, people: People3D) -> np.ndarray:
    """Return the people over the image and over the depth, side by side, uint8 BGR."""
    matrix = frame.grid.camera_model().matrix
    seen = people.xyz @ matrix.T
    uv = seen[..., :2] / seen[..., 2:]
    given = np.isfinite(uv).all(axis=2)
    keypoints = np.where(given[..., None], np.dstack([uv, given]), (np.nan, np.nan, 0)).astype(np.float32)
    in_image = People2D(people.skeleton, keypoints, np.ones(len(people)), people.ids)
    depth = frame.grid.depths(*np.meshgrid(np.arange(frame.grid.width), np.arange(frame.grid.height)))
    shade = np.nan_to_num((FAR - depth) / (FAR - NEAR)).clip(0, 1)
    colours = cv2.applyColorMap(np.uint8(255 * shade), cv2.COLORMAP_TURBO)
    colours[np.isnan(depth)] = 0
    return np.hstack([cv2.resize(draw_people(canvas, in_image, DrawParams(alpha_pose=1.0), people.status == INFERRED),
                                 SIZE, interpolation=cv2.INTER_AREA) for canvas in (frame.image, colours)])
