"""One camera without depth, in space."""
from itertools import combinations
from typing import Dict, List, Sequence

import numpy as np

import chain_runs
from ground_truth import OUTSIDE, VISIBLE, TrueFrame, true_frames
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from results import NeedsDataError, Options, Section, Table
from results.counting import QUICK_FRAMES, QUICK_SCENES
from scoring.counts import Counts
from scoring.figures import Quantile, figures_of, of_rows, values_of
from scoring.people import found_of
from sections import real_cameras
from skeleton_extract_3d.body.body import HIPS
from skeleton_extract_3d.chain_settings import ChainSettings, create_chain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import People3D
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
                           lambda rows: rows['label'] == VISIBLE),
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
            # z of the world by the coordinates of the camera
            floors = chain_runs.camera_poses(folder)[:, 2] if name == 'floor_known' else None
            run = finder.run(folder, floors, QUICK_FRAMES if options.quick else None)
            each.append(count(folder.name, true_frames(folder), [people for _, people in run.frames], camera))
        networks.forget()
    try:
        counts['real'] = [real_camera(options)]
    except NeedsDataError as error:
        print(f'monocular: without the real camera; it needs {error}')
    found = figures_of(counts, STATISTICS)
    rows = [['', *(name.replace('_', ' ') for name in found)]]
    rows += [[each.text, *(figures[key] for figures in found.values())] for key, each in STATISTICS.items()]
    return Section(TEXT, {f'{key}_{name}': figure for name, each in found.items() for key, figure in each.items()},
                   [Table('', rows)])


def real_camera(options: Options) -> Counts:
    """Return the counts of one of four real cameras, against the people that are fused from all."""
    seen, _ = real_cameras.found_people(real_cameras.cameras(options), QUICK_FRAMES if options.quick else 1000)
    camera, true, found = seen[0], [], []
    chain, (rotation, origin) = create_chain(options.settings, monocular=True), camera.pose
    for number, (fused, image) in enumerate(zip(real_cameras.fuse(seen), camera.frames(1000))):
        stamp, uv = real_cameras.BEGIN + number / camera.rate, real_cameras.pixels(camera, fused.xyz)
        inside = ((uv > 0) & (uv < (camera.model.width, camera.model.height))).all(axis=2)
        labels = np.where(inside, VISIBLE, OUTSIDE)
        true.append(TrueFrame(stamp, fused.ids, (fused.xyz - origin) @ rotation, labels, uv))
        found.append(chain.update(Frame('', stamp, image, NoDepth(camera.model))).people_3d)
    return count(camera.name, true, found, camera.model)


def count(name: str, truth: Sequence[TrueFrame], frames: Sequence[People3D], camera: CameraModel) -> Counts:
    """Return the counts of the people that were found in the first frames of a scene with a name."""
    joints, people, pairs, given = ([np.zeros(0, kind)] for kind in (JOINT, PERSON, RIGHT, RIGHT))
    for true, each in zip(truth, frames):
        found = found_of(each)
        apart = true.apart_in_image(camera.project(found.xyz).reshape(*found.xyz.shape[:2], 2))
        there, right, distances = np.zeros(len(true.xyz), PERSON), np.zeros(len(found), RIGHT), []
        there['shown'] = (true.labels == VISIBLE).sum(axis=1) >= LEAST_SHOWN
        for number, row in match(apart, apart < SAME_IN_IMAGE):
            middles = [xyz[HIPS].mean(axis=0) for xyz in (true.xyz[number], found.xyz[row])]
            distances.append(np.linalg.norm(middles, axis=1))
            there['found'][number], right['right'][row] = True, True
            there['distance'][number] = distances[-1][1] / distances[-1][0] - 1
            rows, off = np.zeros(len(COCO_18.joints), JOINT), found.xyz[row] - true.xyz[number]
            rows['relative'] = np.linalg.norm(off - (middles[1] - middles[0]), axis=1)
            rows['error'], rows['sigma'] = np.linalg.norm(off, axis=1), found.sigma[row]
            rows['label'] = true.labels[number]
            joints.append(rows[(rows['label'] != OUTSIDE) & np.isfinite(rows['error'])])
        people.append(there)
        pairs.append(np.array([((one < other)[0] == (one < other)[1],) for one, other in combinations(distances, 2)
                               if abs(one - other)[0] > SAME_DISTANCE], RIGHT))
        given.append(right[found.confidence.any(axis=1)])
    tables = {'joints': joints, 'people': people, 'pairs': pairs, 'given': given}
    return Counts(name, {}, {}, {key: np.concatenate(rows) for key, rows in tables.items()})
