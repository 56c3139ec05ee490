"""One camera without depth, in space."""
from itertools import combinations
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

import chain_runs
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import from_image
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import values_in
from openpose_ros_pkg.skeletons import COCO_18
from results import Options, Section, Table
from results.counting import QUICK_FRAMES, QUICK_SCENES
from scoring.counts import Counts
from scoring.figures import Quantile, figures, of_rows, values_of
from sections import real_cameras
from skeleton_extract_3d.body.body import HIPS
from skeleton_extract_3d.chain_settings import ChainSettings, create_chain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import NoDepth

# A person is found by the median distance in the image, in half diagonals; one who shows fewer joints does not count.
SAME_IN_IMAGE, LEAST_SHOWN = 0.3, 4
# People whose distances differ by less [m] have no order.
SAME_DISTANCE = 0.2
JOINT = np.dtype([('relative', 'f4'), ('error', 'f4'), ('sigma', 'f4'), ('label', 'u1')])
PERSON = np.dtype([('shown', '?'), ('found', '?'), ('distance', 'f4')])
RIGHT = np.dtype([('right', '?')])

STATISTICS = {
    'found': of_rows('people found', 'people', lambda rows: rows['found'], lambda rows: rows['shown']),
    'real': of_rows('people with a keypoint who are there', 'given', lambda rows: rows['right']),
    'relative_150': of_rows('joints within 150 mm, from the middle of the hips', 'joints',
                            lambda rows: rows['relative'] < 0.15),
    'visible_150': of_rows('the same, visible joints', 'joints', lambda rows: rows['relative'] < 0.15,
                           lambda rows: rows['label'] == chain_runs.VISIBLE),
    'relative': Quantile('error from the middle of the hips, median [mm]', values_of('joints', 'relative'), 0.5, 'mm',
                         0, 1e3),
    'distance_10': of_rows('distances within 10 %', 'people', lambda rows: np.abs(rows['distance']) < 0.1,
                           lambda rows: rows['found']),
    'distance': Quantile('error of the distance, median [%]', lambda counts: np.abs(values_of(
        'people', 'distance', lambda rows: rows['found'])(counts)), 0.5, '%', 1, 100.0),
    'order': of_rows('pairs of people in the right order', 'pairs', lambda rows: rows['right']),
    'within_2_sigma': of_rows('errors within 2 sigma', 'joints', lambda rows: rows['error'] < 2 * rows['sigma']),
}
TEXT = '''The scenes of the section on accuracy without their depth: people in space by images and calibration, mode
balanced. Joints in the image, visible or hidden, of found people. Nothing tells the size of a person, unless the floor
is known and the feet are on it. Last: the first camera of the section on four real cameras, against the people that are
fused from all of them.'''


class Truth(NamedTuple):
    """The P people of a frame: joints (P, 18, 3) [m], their pixels (P, 18, 2), and labels (P, 18); 0: not in view."""

    xyz: np.ndarray
    uv: np.ndarray
    labels: np.ndarray


def measure(options: Options) -> Section:
    """Run mode balanced on images and calibration alone, with and without the true plane of the floor."""
    folders = list(options.scenes)[:QUICK_SCENES] if options.quick else list(options.scenes)
    settings = build(ChainSettings, {'mode': 'balanced', **options.settings})
    backend, model_folder = settings.detector.backend, settings.detector.detector.model_folder
    networks = chain_runs.CountedNetworks(backend, model_folder, cached=True)
    finder = chain_runs.Finder(settings, networks=networks, monocular=True)
    counts: Dict[str, List[Counts]] = {'floor_unknown': [], 'floor_known': []}
    for folder in folders:
        camera = chain_runs.open_sequence(folder).camera
        for name, each in counts.items():
            floors = chain_runs.camera_poses(folder)[:, 2] if name == 'floor_known' else None
            run = finder.run(folder, floors, QUICK_FRAMES if options.quick else None)
            each.append(count(folder.name, true_frames(folder), [people for _, people in run.frames], camera))
        networks.forget()
    try:
        counts['real'] = [real_camera(options)]
    except BadInputError as error:
        print(f'monocular: without the real camera: {error}')
    found = {name: figures(each, STATISTICS) for name, each in counts.items()}
    rows = [['', *(name.replace('_', ' ') for name in found)]]
    rows += [[each.text, *(figures[key] for figures in found.values())] for key, each in STATISTICS.items()]
    return Section(TEXT, {f'{key}_{name}': figure for name, each in found.items() for key, figure in each.items()},
                   [Table('', rows)])


def true_frames(folder: Path) -> List[Truth]:
    """Return the people of the frames of a scene."""
    truth, order = chain_runs.read_truth(folder)
    return [Truth(*(np.array([np.array(person[key], np.float64)[order] for person in frame['people']])
                    for key in ('xyz', 'uv', 'vis'))) for frame in truth['frames']]


def real_camera(options: Options) -> Counts:
    """Return the counts of one of four real cameras, against the people that are fused from all."""
    seen, _ = real_cameras.found_people(real_cameras.cameras(), QUICK_FRAMES if options.quick else 1000)
    fusion, camera, true, found = PeopleFusion(), seen[0], [], []
    chain = create_chain(options.settings, monocular=True)
    rotation, origin = camera.pose
    for number, (people, image) in enumerate(zip(zip(*(each.people for each in seen)), camera.frames(1000))):
        stamp = real_cameras.BEGIN + number / real_cameras.RATE
        fused = fusion.update([from_image(each.name, stamp, one, each.model, each.pose)
                               for each, one in zip(seen, people)], stamp)
        xyz = (fused.xyz - origin) @ rotation
        uv = camera.model.project(xyz.reshape(-1, 3)).reshape(*xyz.shape[:2], 2)
        inside = ((uv > 0) & (uv < (camera.model.width, camera.model.height))).all(axis=2)
        true.append(Truth(xyz, uv, np.where(inside, chain_runs.VISIBLE, 0)))
        found.append(chain.update(Frame('', stamp, image, NoDepth(camera.model))).people_3d)
    return count(camera.name, true, found, camera.model)


def count(name: str, truth: Sequence[Truth], frames: Sequence[People3D], camera: CameraModel) -> Counts:
    """Return the counts of the people that were found in the first frames of a scene with a name."""
    joints, people, pairs, given = ([np.zeros(0, kind)] for kind in (JOINT, PERSON, RIGHT, RIGHT))
    for true, found in zip(truth, map(_in_coco_18, frames)):
        pixels = camera.project(found.xyz.reshape(-1, 3).astype(np.float64)).reshape(*found.xyz.shape[:2], 2)
        apart = np.array([[chain_runs.apart_in_image(each, *one) for each in pixels]
                          for one in zip(true.uv, true.labels)])
        people.append(np.zeros(len(true.xyz), PERSON))
        people[-1]['shown'] = [(each == chain_runs.VISIBLE).sum() >= LEAST_SHOWN for each in true.labels]
        given.append(np.zeros(len(found), RIGHT))
        distances = []
        for number, row in match(apart, apart < SAME_IN_IMAGE) if apart.size else []:
            middles = true.xyz[number][HIPS].mean(axis=0), found.xyz[row][HIPS].mean(axis=0)
            distances.append(np.linalg.norm(middles, axis=1))
            people[-1]['found'][number], given[-1]['right'][row] = True, True
            people[-1]['distance'][number] = distances[-1][1] / distances[-1][0] - 1
            joints.append(_joints(found, row, true, number, middles))
        pairs.append(_pairs(distances))
        given[-1] = given[-1][found.confidence.any(axis=1)]
    tables = {'joints': joints, 'people': people, 'pairs': pairs, 'given': given}
    return Counts(name, {}, {}, {key: np.concatenate(rows) for key, rows in tables.items()})


def _in_coco_18(people: People3D) -> People3D:
    xyz, sigma, score, status = (values_in(values, people.skeleton, COCO_18, missing) for values, missing in (
        (people.xyz, np.nan), (people.sigma, np.nan), (people.confidence, 0.0), (people.status, MISSING)))
    return People3D(COCO_18, xyz, score, status, sigma, people.ids)


def _joints(found: People3D, row: int, true: Truth, number: int, middles: Tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the rows of the joints of a person, a row of those that were found and a number of the true ones, with the
    true and the found middle of the hips [m].
    """
    rows, off = np.zeros(len(found.skeleton.joints), JOINT), found.xyz[row] - true.xyz[number]
    rows['relative'] = np.linalg.norm(off - (middles[1] - middles[0]), axis=1)
    rows['error'], rows['sigma'] = np.linalg.norm(off, axis=1), found.sigma[row]
    rows['label'] = true.labels[number]
    return rows[(rows['label'] > 0) & np.isfinite(rows['error'])]


def _pairs(distances: Sequence[np.ndarray]) -> np.ndarray:
    """Return the rows of the pairs of people with true and found distances, (2,) each [m]."""
    return np.array([((one < other)[0] == (one < other)[1],) for one, other in combinations(distances, 2)
                     if abs(one - other)[0] > SAME_DISTANCE], RIGHT)
