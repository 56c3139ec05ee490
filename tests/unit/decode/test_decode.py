"""The decoder on synthetic confidence maps and affinity fields with known people."""
import dataclasses

import numpy as np
import pytest

from known_fields import NET, STRIDE, render_fields, standing_person
from openpose_ros_pkg.decode.paf import (
    DECODE,
    LIMB_CANDIDATE,
    PEAK,
    DecodeParams,
    assemble,
    decode_fields,
    score_limbs,
)
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN
from openpose_ros_pkg.skeletons import COCO_18, SKELETONS, Limb, SkeletonModel

# Two joints are a person.
PAIRS = dataclasses.replace(DECODE, person_joints=2)


def in_order(keypoints):
    """Sort decoded people by the x of their neck, so that they compare with the drawn ones."""
    return keypoints[np.argsort(keypoints[:, COCO_18.index['neck'], 0])]


def decoded(fields, **constants):
    return decode_fields(fields, MOBILENET_THIN, DecodeParams(), constants=dataclasses.replace(DECODE, **constants))


def assert_found(fields, people, atol=0.5, **constants):
    """Every person is found, whole, no other one, to half a network pixel (a sixteenth of a cell)."""
    keypoints, scores, *_ = decoded(fields, **constants)
    assert keypoints.shape == (len(people), 18, 3) and keypoints.dtype == np.float32
    assert scores.shape == (len(people),) and ((scores > 0.8) & (scores <= 1)).all()
    for found, person in zip(in_order(keypoints), sorted(people, key=lambda person: person[1, 0])):
        np.testing.assert_allclose(found[:, :2], person, atol=atol)
        assert (found[:, 2] > 0.8).all() and (found[:, 2] <= 1).all()


# --- none, one, several ---------------------------------------------------------------------------------------------

@pytest.mark.parametrize('fields', [
    np.zeros((57, 46, 82), np.float32), render_fields([]), np.ones((57, 46, 82), np.float32),
    np.full((57, 46, 82), np.nan, np.float32), np.zeros((57, 1, 1), np.float32)],
    ids=['zero', 'background', 'constant', 'NaN', 'one cell'])
def test_no_person(fields):
    keypoints, scores, *_ = decoded(fields)
    assert keypoints.shape == (0, 18, 3) and keypoints.dtype == np.float32 and scores.shape == (0,)


@pytest.mark.parametrize('upsample', [1, 2, 4])
def test_one_person(upsample):
    person = standing_person(300.3, 60.7, 250)
    assert_found(render_fields([person]), [person], heatmap_upsample=upsample)


def test_a_crowd():
    """Twenty people in rows of ten, who overlap their neighbours."""
    people = [standing_person(40 + 60 * (i % 10) + 0.3 * i, 20 + 175 * (i // 10), 140 + i % 5) for i in range(20)]
    keypoints, *_ = decoded(render_fields(people))
    assert len(keypoints) == 20
    for person in people:
        nearest = keypoints[np.abs(keypoints[:, 1, :2] - person[1]).sum(axis=1).argmin()]
        np.testing.assert_allclose(nearest[:, :2], person, atol=2)


def test_the_surest_person_comes_first():
    weak, strong = render_fields([standing_person(150, 60, 240)]), render_fields([standing_person(480, 60, 240)])
    weak[:18] *= 0.5
    weak[19:] *= 0.5
    keypoints, scores, *_ = decoded(weak + strong)
    assert keypoints[0, 1, 0] > keypoints[1, 1, 0]
    assert scores[0] > 0.9 and 0.4 < scores[1] < 0.6


@pytest.mark.parametrize('networks, users, found', [
    (0.0, 0.05, 1), (0.6, 0.05, 0), (0.3, 0.05, 1), (0.3, 0.6, 0)],
    ids=['none of its own', 'too high', 'low enough', "the user's is higher"])
def test_networks_have_a_threshold_of_their_own_and_the_higher_one_counts(networks, users, found):
    """Peaks of 0.5; MPI's networks see joints everywhere below 0.6."""
    fields = render_fields([standing_person(300, 60, 250)], sharpness=0.5)
    model = dataclasses.replace(MOBILENET_THIN, peak_threshold=networks)
    assert len(decode_fields(fields, model, DecodeParams(peak_threshold=users))[0]) == found


# --- borders --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('x, inside', [(0.0, 'left'), (655.0, 'right')])
def test_person_cut_in_half_by_a_side(x, inside):
    """Joints within the picture are found; those beyond are missing, not clamped to its border."""
    person = standing_person(x, 40, 280)
    seen = (person[:, 0] >= 0) & (person[:, 0] <= NET[1] - 1)
    keypoints, *_ = decoded(render_fields([person]))
    assert len(keypoints) == 1
    np.testing.assert_allclose(keypoints[0, seen, :2], person[seen], atol=STRIDE / 2)
    # The Gaussian of a joint just outside reaches into the picture, and so has a peak at the border.
    far = (person[:, 0] < -24) | (person[:, 0] > NET[1] - 1 + 24)
    assert far.any() and np.isnan(keypoints[0, far, :2]).all() and (keypoints[0, far, 2] == 0).all()


# --- limbs ----------------------------------------------------------------------------------------------------------

def peak_records(joints, xy, scores):
    return np.array([(joint, *place, score) for joint, place, score in zip(joints, xy, scores)],
                    PEAK)


def limb_scores(pafs, elbow, wrist):
    joints = [COCO_18.index['right_elbow'], COCO_18.index['right_wrist']]
    return score_limbs(pafs, peak_records(joints, [elbow, wrist], [0.9, 0.8]), MOBILENET_THIN)


def test_foreshortened_limb_joins_without_a_field_but_proves_nothing():
    limbs = limb_scores(np.zeros((38, 46, 82), np.float32), (100, 100), (102, 101))
    assert limbs['score'].tolist() == [0]
    assert len(limb_scores(np.zeros((38, 46, 82), np.float32), (100, 100), (104, 100))) == 0


# --- assembly -------------------------------------------------------------------------------------------------------

def people_from(joints, limbs, heights=None):
    """Assemble peaks, given by joint name, and limbs, given as (start, end, score) in peak numbers."""
    peaks = peak_records([COCO_18.index[joint] for joint in joints], [(i, i) for i in range(len(joints))],
                         heights or [0.5] * len(joints))
    names = [(limb.start, limb.end) for limb in COCO_18.limbs]
    candidates = np.array([(names.index((joints[start], joints[end])), start, end, score)
                           for start, end, score in limbs], LIMB_CANDIDATE)
    keypoints, *_ = assemble(candidates, peaks, COCO_18, DecodeParams(person_min_score=0.0), PAIRS)
    return [{joint: int(person[COCO_18.index[joint], 0]) for joint in COCO_18.joints
             if person[COCO_18.index[joint], 2] > 0} for person in keypoints]


@pytest.mark.parametrize('joints, limbs, heights, expected', [
    (['right_shoulder', 'right_ear'], [(0, 1, 0.9)], None, []),
    (['neck', 'right_shoulder', 'nose', 'right_eye', 'right_ear'], [(0, 1, 0.9), (2, 3, 0.9), (3, 4, 0.9), (1, 4, 0.3)],
     None, [{'neck': 0, 'right_shoulder': 1, 'nose': 2, 'right_eye': 3, 'right_ear': 4}]),
    (['neck', 'right_shoulder', 'right_elbow'], [(0, 1, 0.0), (1, 2, 0.0)], None, []),
    (['neck', 'neck', 'right_shoulder'], [(0, 2, 0.4), (1, 2, 0.8)], None, [{'neck': 1, 'right_shoulder': 2}]),
    # the field ends beside the true neck, so that the line from a weak peak nearby fits a little better
    (['neck', 'neck', 'nose'], [(0, 2, 0.83), (1, 2, 0.92)], [0.54, 0.05, 0.81], [{'neck': 0, 'nose': 2}])],
    ids=['ear to shoulder starts no person', 'but joins head and body', 'nearness starts no person', 'the better limb',
         'a speck of noise'])
def test_people_of_limbs(joints, limbs, heights, expected):
    assert people_from(joints, limbs, heights) == expected


# --- other networks, layouts and threads ----------------------------------------------------------------------------

# Limbs that run against the order of the joints, joints without a limb, and one limb that starts no person.
ODD_SKELETON = SkeletonModel(
    name='ODD', joints=('tail', 'body', 'head', 'nothing', 'paw'), drawn_limbs=(), colours=((0, 0, 0),) * 5,
    limbs=(Limb('head', 'body', (5, 2)), Limb('body', 'tail', (0, 1)),
           Limb('paw', 'tail', (4, 3), starts_person=False)))
PAF_SKELETONS = [ODD_SKELETON, *(skeleton for skeleton in SKELETONS.values() if skeleton.limbs)]


@pytest.mark.parametrize('skeleton', PAF_SKELETONS, ids=lambda skeleton: skeleton.name)
def test_people_of_all_skeletons(skeleton):
    """Every joint that a limb reaches is where it was drawn."""
    model = dataclasses.replace(MOBILENET_THIN, skeleton=skeleton, heatmaps=len(skeleton.joints) + 1)
    random = np.random.default_rng(1)
    people = [np.array([x, 180]) + random.uniform(-80, 80, (len(skeleton.joints), 2)) for x in (120, 330, 540)]
    keypoints, *_ = decode_fields(render_fields(people, skeleton=skeleton), model, DecodeParams(), None, PAIRS)
    assert len(keypoints) == 3
    reached = [skeleton.index[name] for name in {end for limb in skeleton.limbs for end in (limb.start, limb.end)}]
    for person in people:
        found = min(keypoints, key=lambda found: np.abs(found[reached, :2] - person[reached]).max())
        np.testing.assert_allclose(found[reached, :2], person[reached], atol=1)
