"""MVOR: people in an operating theatre, seen by three cameras without depth.

The data set (https://github.com/CAMMA-public/MVOR, CC BY-NC-SA 4.0) has detections of OpenPose in the images, and true
joints, good to about 40 mm. The folder holds camma_mvor_2018.json and openpose_kps.json.
"""
import json
from collections import defaultdict
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import from_image
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_17, COCO_18
from openpose_ros_tools.alignment.people import pair_people
from results import Options, Section, Table
from scoring.counts import Counts
from scoring.figures import Quantile, figures, mean_of, of_sums, values_of
from sections.real_cameras import Camera, pixels
from skeleton_extract_3d.points.camera import CameraModel

# Joints that are scored, by their rows in the truth; hips are defined differently there.
TRUTH = {'left_shoulder': 2, 'right_shoulder': 3, 'left_elbow': 6, 'right_elbow': 7, 'left_wrist': 8, 'right_wrist': 9}
ORDER = [COCO_18.index[joint] for joint in TRUTH]
# Maximum median distance of a person from the true one, in space [m] and in an image [px].
SAME_PERSON, SAME_DETECTION = 0.3, 40.0
# Frames that are drawn together for the intervals: 25 minutes.
BLOCK = 20
TEXT = f'''732 frames of three calibrated cameras, each fused by itself, as they are 75 s apart. OpenPose's detections,
which are part of the data set, are fused as those of cameras without depth. A person is found if the median distance of
the joints is within {SAME_PERSON:g} m. Shoulders, elbows and wrists are scored, by the number of cameras whose
detections of the joint were fused. The distance within which rays belong to one person was chosen on these detections,
so these figures are not blind: with what rendered scenes had suggested, 0.48 were found. The images are treated as free
of distortion: with the distortion that is given, the truth fits its own images worse. Intervals: blocks of
{BLOCK} frames are drawn.'''
PEOPLE = {
    'people': of_sums('people in the truth', 'truth', digits=0),
    'two_views': of_sums('detected by two cameras or more', 'two_views', 'truth'),
    'found': of_sums('found', 'found', 'truth'), 'twice': of_sums('found twice', 'twice', digits=0),
    'others': of_sums('fused people who are not in the truth', 'others', digits=0)}
ERRORS = {'mean': mean_of('mean', values_of('joints', 'error'), 'mm', 0, 1e3),
          'median': Quantile('median', values_of('joints', 'error'), 0.5, 'mm', 0, 1e3)}


# People in the image of each camera (COCO_18), and true joints (P, 6, 3) [m].
Frame = Tuple[List[People2D], np.ndarray]


def measure(options: Options) -> Section:
    """Fuse the detections of each frame and compare the people with the truth."""
    counts = counted_blocks(options.folder('mvor'), options.quick)
    people = figures(counts, PEOPLE)
    found, rows = dict(people), [['joints', 'number', 'mean [mm]', 'median [mm]']]
    for name, views in (('two', 2), ('three', 3)):
        seen = [each.where('joints', lambda joints, views=views: joints['views'] == views) for each in counts]
        whole = figures(seen, ERRORS)
        found.update({f'{name}_{key}': figure for key, figure in whole.items()})
        rows.append([f'seen by {name} cameras', whole['mean'].n, *whole.values()])
        for number, joint in enumerate(('shoulders', 'elbows', 'wrists')):
            part = figures([each.where('joints', lambda joints, number=number: joints['joint'] // 2 == number)
                            for each in seen], ERRORS)
            rows.append([f'{joint} seen by {name}', part['mean'].n, *part.values()])
    return Section(TEXT, found, [Table('People', [['', 'value'], *([each.text, each] for each in people.values())]),
                                 Table('Errors', rows)])


def counted_blocks(folder: Path, quick: bool) -> List[Counts]:
    """Return the counts of the blocks of frames."""
    cameras, frames = read(folder)
    frames = frames[:2 * BLOCK] if quick else frames
    return [counted(cameras, frames[first:first + BLOCK], first) for first in range(0, len(frames), BLOCK)]


def read(folder: Path) -> Tuple[List[Camera], List[Frame]]:
    """Return the cameras and frames of the data set."""
    data = json.loads((folder / 'camma_mvor_2018.json').read_text())
    detections, truth = defaultdict(list), defaultdict(list)
    for found in json.loads((folder / 'openpose_kps.json').read_text()):
        detections[found['image_id']].append(found)
    for person in data['annotations3D']:
        joints = np.array(person['keypoints3D'], np.float64).reshape(-1, 4)[list(TRUTH.values())]
        truth[person['image_ids']].append(np.where(joints[:, 3:] > 0, joints[:, :3] / 1000.0, np.nan))
    frames = [([_people(detections[image['id']]) for image in frame['images']],
               np.array(truth[frame['id']]).reshape(-1, len(TRUTH), 3)) for frame in data['multiview_images']]
    return _cameras(data['cameras_info']['camParams']), frames


def _cameras(given: Dict[str, Any]) -> List[Camera]:
    cameras = []
    for number, (lens, pose) in enumerate(zip(given['intrinsics'], given['extrinsics']), 1):
        (fx, fy), (cx, cy), (width, height) = lens['focallength'], lens['principalpoint'], lens['imagesize']
        matrix = np.array(pose, np.float64).reshape(4, 4)
        cameras.append(Camera(f'camera_{number}', CameraModel(width, height, [fx, 0, cx, 0, fy, cy, 0, 0, 1]),
                              (matrix[:3, :3], matrix[:3, 3] / 1000.0)))
    return cameras


def _people(found: Sequence[Dict[str, Any]]) -> People2D:
    keypoints = np.array([one['coco_keypoints'] for one in found], np.float32).reshape(-1, len(COCO_17.joints), 3)
    keypoints = np.where(keypoints[..., 2:] > 0, keypoints, np.array([np.nan, np.nan, 0], np.float32))
    return People2D(COCO_18, keypoints_in(keypoints, COCO_17, COCO_18), [one['score'] for one in found],
                    np.arange(len(found)))


def counted(cameras: Sequence[Camera], frames: Sequence[Frame], number: int) -> Counts:
    """Return the counts of a block of frames; number: of the first one."""
    sums: Dict[str, float] = dict.fromkeys(('truth', 'two_views', 'found', 'twice', 'others'), 0.0)
    joints: List[Tuple[float, int, int]] = []
    for images, truth in frames:
        fusion, views = PeopleFusion(), np.zeros(len(truth), int)
        people = fusion.update([from_image(camera.name, 1.0, image, camera.model, camera.pose)
                                for camera, image in zip(cameras, images)], 1.0)
        for camera, image in zip(cameras, images):
            detected = pair_people(image.xy[:, ORDER], pixels(camera, truth), SAME_DETECTION)
            views[[true for _, true in detected]] += 1
        places = people.xyz[:, ORDER].astype(np.float64)
        pairs = pair_people(places, truth, SAME_PERSON)
        rest = np.delete(places, [row for row, _ in pairs], axis=0)
        twice = sum(bool(pair_people(one[np.newaxis], truth, SAME_PERSON)) for one in rest)
        for key, value in (('truth', len(truth)), ('two_views', int((views > 1).sum())), ('found', len(pairs)),
                           ('twice', twice), ('others', len(rest) - twice)):
            sums[key] += value
        for row, true in pairs:
            seen = sum(images[number].present[person, ORDER] for number, camera in enumerate(cameras)
                       for (name, person), track in fusion.known.items()
                       if (name, track) == (camera.name, people.ids[row]))
            errors = np.linalg.norm(places[row] - truth[true], axis=1)
            joints += [(errors[joint], seen[joint], joint) for joint in np.flatnonzero(np.isfinite(errors))]
    table = np.array(joints, [('error', float), ('views', int), ('joint', int)])
    return Counts(f'frames from {number}', {}, sums, {'joints': table})
