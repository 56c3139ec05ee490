"""Toes and heels in space: of rendered people by their true pixels with noise, through the estimator."""
import json
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from estimating import new_estimator
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import BODY_25
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.track.feet import FEET

SCENES = Path(__file__).resolve().parents[3] / 'development/benchmark_data/scenes'
ROWS = [BODY_25.index[name] for name in FEET]
ANKLES = [BODY_25.index[f'{name.split("_")[0]}_ankle'] for name in FEET]
LEFT_LENGTH = [BODY_25.index['left_big_toe'], BODY_25.index['left_heel']]
VISIBLE, BY_SELF = 2, 1
# Error of the pixels [m], and the share of hidden joints that are told all the same, with more of it.
NOISE, TOLD, GUESSED = 0.012, 0.4, 2.5
START = 1.0


@lru_cache(maxsize=None)
def truth(scene):
    """Return the camera, the floor and of each frame stamp, depth and people: ids, (P, 25, 2) px, xyz [m], labels."""
    contents, meta = (json.loads((SCENES / scene / name).read_text()) for name in ('gt.json', 'meta.json'))
    camera, pose = CameraModel(meta['width'], meta['height'], meta['K']), np.array(meta['T_world_camera'])
    names = contents['joints'] + contents['feet']
    order = [names.index(name) if name in names else -1 for name in BODY_25.joints]
    frames = []
    for frame in contents['frames']:
        depth = cv2.imread(str(SCENES / scene / f'depth/{frame["i"]:03d}.png'), cv2.IMREAD_UNCHANGED)
        values = [[np.concatenate([person[key], person['feet'][key]])[order] for person in frame['people']]
                  for key in ('uv', 'xyz', 'vis')]
        for one in values[2]:
            one[BODY_25.index['mid_hip']] = 0
        frames.append((START + frame['t'], depth, [person['id'] for person in frame['people']], *map(np.array, values)))
    return camera, np.array([*pose[2, :3], pose[2, 3]]), frames


def people_2d(scene, frame, random, without=()):
    """Return what a network finds: visible joints, and some that are hidden."""
    camera, (*_, uv, xyz, labels) = truth(scene)[0], truth(scene)[2][frame]
    visible = labels == VISIBLE
    told = visible | ((labels > 0) & (random.random(labels.shape) < TOLD))
    told[:, list(without)] = False
    spread = NOISE * camera.focal_in((camera.width, camera.height)) / np.maximum(xyz[..., 2], 0.3)
    noise = random.normal(size=uv.shape) * (spread * np.where(visible, 1, GUESSED))[..., np.newaxis]
    scores = np.where(told, np.where(visible, 0.85, 0.45), 0)
    places = np.where(told[..., np.newaxis], uv + noise, np.nan)
    return People2D(BODY_25, np.concatenate([places, scores[..., np.newaxis]], axis=2), np.ones(len(uv)),
                    np.full(len(uv), -1))


@lru_cache(maxsize=None)
def estimated(scene, without=(), first_without=0):
    """Return estimates of the frames of a scene; `without`: joints that are not told from a frame on."""
    camera, floor, frames = truth(scene)
    estimator, random = new_estimator(), np.random.default_rng(0)
    size = (camera.width, camera.height)
    return [estimator.update(people_2d(scene, number, random, without if number >= first_without else ()),
                             Frame('', stamp, None, DepthImage(depth, camera), floor=floor, size=size))
            for number, (stamp, depth, *_) in enumerate(frames)]


@lru_cache(maxsize=None)
def errors(scene, **without):
    """Return label, status, error and sigma [m], error of the ankle, id of toes and heels of people in the image."""
    rows = []
    for (*_, ids, uv, xyz, labels), result in zip(truth(scene)[2], estimated(scene, **without)):
        for row, seen in enumerate(result.people_2d.xy):
            person = int(np.nanargmin(np.nanmedian(np.linalg.norm(uv - seen, axis=2), axis=1)))
            off = np.linalg.norm(result.people.xyz[row] - xyz[person], axis=1)
            rows += [(labels[person, joint], result.people.status[row, joint], off[joint],
                      result.people.sigma[row, joint], off[ankle], ids[person]) for joint, ankle in zip(ROWS, ANKLES)]
    return np.array(rows).T


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize('scene, median', [('10_lie', 0.04), ('11_group', 0.03), ('23_group', 0.03)])
def test_visible_toes_and_heels_are_where_they_are(scene, median):
    labels, status, off, sigma, ankle, _ = errors(scene)
    measured = (labels == VISIBLE) & (status == MEASURED)
    assert measured.sum() > 0.7 * (labels == VISIBLE).sum()
    assert np.median(off[measured]) < median and np.median(off[labels == VISIBLE]) < 1.5 * median
    # sigma is honest: where the ankle is known, errors are neither much larger nor much smaller
    sure = measured & (ankle < 0.1)
    assert 0.5 < rms(off[sure] / sigma[sure]) < 1.5


def test_hidden_toes_and_heels_are_inferred_from_ankle_and_shin_with_a_larger_sigma():
    labels, status, off, sigma, ankle, _ = errors('23_group')
    hidden = ~np.isin(labels, [VISIBLE, BY_SELF])
    assert (status[hidden] != MEASURED).mean() > 0.95
    inferred = hidden & (status == INFERRED)
    assert inferred.sum() > 100 and np.median(sigma[inferred]) > 2 * np.median(sigma[status == MEASURED])
    # no further off than the ankle, and what a foot may turn
    assert np.median(off[inferred] - ankle[inferred]) < 0.06


def test_a_foot_keeps_its_person_and_its_length():
    lengths, ids = [], []
    for (*_, known, uv, _, _), result in zip(truth('23_group')[2], estimated('23_group')):
        ends = result.people.xyz[:, LEFT_LENGTH]
        for row, seen in enumerate(result.people_2d.xy):
            person = int(np.nanargmin(np.nanmedian(np.linalg.norm(uv - seen, axis=2), axis=1)))
            if (result.people.status[row, LEFT_LENGTH] == MEASURED).all():
                lengths.append(np.linalg.norm(ends[row, 0] - ends[row, 1]))
                ids.append((known[person], int(result.people.ids[row])))
    assert len(lengths) > 20 and np.std(lengths) < 0.03
    assert len({one for one, _ in ids}) == len(set(ids))  # one id for each person


def test_feet_that_are_lost_stay_on_their_ankles():
    _, status, off, sigma, *_ = errors('10_lie', without=tuple(ROWS), first_without=20)
    later = np.arange(len(status)) >= 6 * 25
    assert (status[later] == INFERRED).all()
    assert np.median(off[later]) < 0.12 and (sigma[later] > 0.05).mean() > 0.9


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('seed', range(12))
def test_any_keypoints_and_depths_give_feet_with_ankles_and_errors(seed):
    random, size = np.random.default_rng(seed), (160, 120)
    camera, estimator = CameraModel(*size, [120.0, 0, 79.5, 0, 120.0, 59.5, 0, 0, 1]), new_estimator()
    for frame in range(4):
        there = random.random((3, 25)) < random.choice([0.1, 0.5, 0.95], (3, 1))
        there[:, 0] = True
        places = random.uniform((0, 0), size, (3, 1, 2)) + random.normal(0, random.choice([5, 500]), (3, 25, 2))
        keypoints = np.insert(np.clip(places, 0, np.subtract(size, 1)), 2, random.uniform(0.01, 1), axis=2)
        people = People2D(BODY_25, np.where(there[..., np.newaxis], keypoints, (np.nan, np.nan, 0)), np.ones(3),
                          np.full(3, -1))
        depth = random.choice([0, 500, 1500, 8000], (6, 8)).astype(np.uint16).repeat(20, axis=0).repeat(20, axis=1)
        floor = np.array([0, -1, 0, 1.0]) if random.random() < 0.5 else None
        result = estimator.update(people, Frame('', START + frame / 15, None, DepthImage(depth, camera), floor=floor,
                                                size=size)).people
        np.testing.assert_array_equal(result.status[:, ROWS] == MISSING, result.status[:, ANKLES] == MISSING)
        assert (result.sigma[result.status != MISSING] > 0).all()
