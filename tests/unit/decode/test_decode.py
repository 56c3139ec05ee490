"""The decoder on synthetic confidence maps and affinity fields with known people."""
import dataclasses
import time

import numpy as np
import pytest

from openpose_ros_pkg.decode import DecodeParams, decode
from openpose_ros_pkg.decode.assembly import assemble
from openpose_ros_pkg.decode.limbs import LimbCandidates, score_limbs
from openpose_ros_pkg.decode.peaks import Peaks, find_peaks
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.models import MOBILENET_THIN
from openpose_ros_pkg.skeletons import COCO_18

STRIDE = MOBILENET_THIN.stride
NET = (368, 656)  # height, width
# A person who faces the camera: x, y of the 18 joints in units of the body's height from nose to ankle. The person's
# right is at the picture's left.
FRONT = np.array([
    (0.000, 0.00), (0.000, 0.14), (-0.11, 0.15), (-0.16, 0.32), (-0.19, 0.47), (0.11, 0.15), (0.16, 0.32),
    (0.19, 0.47), (-0.07, 0.50), (-0.08, 0.76), (-0.09, 1.00), (0.07, 0.50), (0.08, 0.76), (0.09, 1.00),
    (-0.03, -0.03), (0.03, -0.03), (-0.07, -0.01), (0.07, -0.01)])


def standing_person(x: float, y: float, height: float) -> np.ndarray:
    """Return (18, 2) float64 network pixels of a person whose nose is at x, y."""
    return FRONT * height + (x, y)


def render_fields(people, net=NET, missing=(), sharpness=1.0, skeleton=COCO_18):
    """Draw the fields that a perfect network would give, (57, h, w) float32 for COCO_18.

    Joints are Gaussians of 8 network pixels as in training; a limb's field is a unit vector within one cell of the
    limb's line, averaged where limbs of several people cross.

    Args:
        people: (K, 2) network pixels each.
        net: (height, width) of the network's input.
        missing: joints that are not drawn, nor limbs that end there.
        sharpness: height of the Gaussians.
        skeleton: joint set; the confidence map of the background and the fields follow its joints.
    """
    height, width = net[0] // STRIDE, net[1] // STRIDE
    v, u = np.mgrid[:height, :width].astype(float)
    heat = np.zeros((len(skeleton.joints) + 1, height, width))
    paf = np.zeros((2 * len(skeleton.limbs), height, width))
    index = skeleton.index
    count = np.zeros((len(skeleton.limbs), height, width))
    for person in people:
        cells = (np.asarray(person) + 0.5) / STRIDE - 0.5
        for joint, name in enumerate(skeleton.joints):
            if name not in missing:
                squared = (u - cells[joint, 0]) ** 2 + (v - cells[joint, 1]) ** 2
                heat[joint] = np.maximum(heat[joint], sharpness * np.exp(-squared / 2))
        for i, limb in enumerate(skeleton.limbs):
            if limb.start in missing or limb.end in missing:
                continue
            start, vector = cells[index[limb.start]], cells[index[limb.end]] - cells[index[limb.start]]
            length = max(np.hypot(*vector), 1e-9)
            unit = vector / length
            along = (u - start[0]) * unit[0] + (v - start[1]) * unit[1]
            across = (u - start[0]) * unit[1] - (v - start[1]) * unit[0]
            inside = (along >= -1) & (along <= length + 1) & (np.abs(across) <= 1)
            paf[list(limb.paf)] += inside * unit[:, None, None]
            count[i] += inside
    for i, limb in enumerate(skeleton.limbs):
        paf[list(limb.paf)] /= np.maximum(count[i], 1)
    heat[-1] = 1 - heat[:-1].max(axis=0)
    return np.concatenate([heat, paf]).astype(np.float32)


def in_order(keypoints):
    """Sort decoded people by the x of their neck, so that they compare with the drawn ones."""
    return keypoints[np.argsort(keypoints[:, COCO_18.index['neck'], 0])]


def decoded(fields, **params):
    return decode(fields, MOBILENET_THIN, DecodeParams(**params))


def assert_found(fields, people, atol=0.5, **params):
    """Every person is found, whole, nobody else, to half a network pixel (a sixteenth of a cell)."""
    keypoints, scores = decoded(fields, **params)
    assert keypoints.shape == (len(people), 18, 3) and keypoints.dtype == np.float32
    assert scores.shape == (len(people),) and ((scores > 0.8) & (scores <= 1)).all()
    for found, person in zip(in_order(keypoints), sorted(people, key=lambda person: person[1, 0])):
        np.testing.assert_allclose(found[:, :2], person, atol=atol)
        assert (found[:, 2] > 0.8).all() and (found[:, 2] <= 1).all()


# --- nobody, one, several -------------------------------------------------------------------------------------------

@pytest.mark.parametrize('fields', [
    np.zeros((57, 46, 82), np.float32), render_fields([]), np.ones((57, 46, 82), np.float32),
    np.full((57, 46, 82), np.nan, np.float32), np.zeros((57, 1, 1), np.float32)],
    ids=['zero', 'background', 'constant', 'NaN', 'one cell'])
def test_nobody(fields):
    keypoints, scores = decoded(fields)
    assert keypoints.shape == (0, 18, 3) and keypoints.dtype == np.float32 and scores.shape == (0,)


@pytest.mark.parametrize('upsample', [1, 2, 4])
def test_one_person(upsample):
    person = standing_person(300.3, 60.7, 250)
    assert_found(render_fields([person]), [person], heatmap_upsample=upsample)


def test_the_fields_are_not_modified():
    fields = render_fields([standing_person(300, 60, 250)])
    before = fields.copy()
    fields.flags.writeable = False
    decoded(fields)
    np.testing.assert_array_equal(fields, before)


def test_five_people():
    people = [standing_person(x, 50 + 3 * i, 200 + 12 * i) for i, x in enumerate((70, 190, 320, 450, 580))]
    assert_found(render_fields(people), people)


def test_two_people_whose_arms_cross():
    left, right = standing_person(250, 60, 260), standing_person(350, 64, 255)
    index = COCO_18.index
    left[[index['left_elbow'], index['left_wrist']]] = (300, 140), (335, 165)
    right[[index['right_elbow'], index['right_wrist']]] = (302, 170), (280, 135)
    assert_found(render_fields([left, right]), [left, right])


def test_order_of_people_does_not_matter():
    """Nor does the place of a person's peaks in the lists: peak 0 is as good as any."""
    people = [standing_person(90, 60, 240), standing_person(300, 20, 300), standing_person(520, 90, 200)]
    first, _ = decoded(render_fields(people))
    second, _ = decoded(render_fields(people[::-1]))
    np.testing.assert_array_equal(first, second)
    assert len(first) == 3


def test_the_surest_person_comes_first():
    weak, strong = render_fields([standing_person(150, 60, 240)]), render_fields([standing_person(480, 60, 240)])
    weak[:18] *= 0.5
    weak[19:] *= 0.5
    keypoints, scores = decoded(weak + strong)
    assert keypoints[0, 1, 0] > keypoints[1, 1, 0]
    assert scores[0] > 0.9 and 0.4 < scores[1] < 0.6


def test_weak_fields_are_nobody():
    fields = 0.2 * render_fields([standing_person(300, 60, 250)])
    assert len(decoded(fields)[0]) == 0
    assert len(decoded(fields, person_min_score=0.1)[0]) == 1


@pytest.mark.parametrize('decoder', ['auto', 'numpy'])
@pytest.mark.parametrize('networks, users, found', [
    (0.0, 0.05, 1), (0.6, 0.05, 0), (0.3, 0.05, 1), (0.3, 0.6, 0)],
    ids=['none of its own', 'too high', 'low enough', "the user's is higher"])
def test_networks_have_a_threshold_of_their_own_and_the_higher_one_counts(networks, users, found, decoder):
    """Peaks of 0.5; MPI's networks see joints everywhere below 0.6."""
    fields = render_fields([standing_person(300, 60, 250)], sharpness=0.5)
    model = dataclasses.replace(MOBILENET_THIN, peak_threshold=networks)
    assert len(decode(fields, model, DecodeParams(decoder=decoder, peak_threshold=users))[0]) == found


# --- borders --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('edge, x', [('left', 68.0), ('centre', 330.0), ('right', 587.0)])
def test_person_near_an_edge_is_whole_and_in_place(edge, x):
    person = standing_person(x, 50, 290)
    assert person[:, 0].min() > 1.5 * STRIDE and person[:, 0].max() < NET[1] - 1.5 * STRIDE
    assert_found(render_fields([person]), [person])


@pytest.mark.parametrize('x', [1.0, 654.0])
def test_joint_in_the_outermost_cell_is_off_by_half_a_cell_at_most(x):
    """There is no neighbour beyond the border to weigh it against."""
    v, u = np.mgrid[:46, :82]
    heat = np.exp(-((u - ((x + 0.5) / STRIDE - 0.5)) ** 2 + (v - 20) ** 2) / 2)[None].astype(np.float32)
    peaks = peaks_of(heat)
    np.testing.assert_allclose(peaks.xy, [[x, (20 + 0.5) * STRIDE - 0.5]], atol=STRIDE / 2)


@pytest.mark.parametrize('x, inside', [(0.0, 'left'), (655.0, 'right')])
def test_person_cut_in_half_by_a_side(x, inside):
    """Joints within the picture are found; those beyond are missing, not clamped to its border."""
    person = standing_person(x, 40, 280)
    seen = (person[:, 0] >= 0) & (person[:, 0] <= NET[1] - 1)
    keypoints, _ = decoded(render_fields([person]))
    assert len(keypoints) == 1
    np.testing.assert_allclose(keypoints[0, seen, :2], person[seen], atol=STRIDE / 2)
    # The Gaussian of a joint just outside reaches into the picture, and so has a peak at the border.
    far = (person[:, 0] < -24) | (person[:, 0] > NET[1] - 1 + 24)
    assert far.any() and np.isnan(keypoints[0, far, :2]).all() and (keypoints[0, far, 2] == 0).all()


def test_person_cut_by_the_lower_border():
    person = standing_person(300, 100, 420)
    keypoints, _ = decoded(render_fields([person]))
    index = COCO_18.index
    assert len(keypoints) == 1
    gone = [index[f'{side}_{joint}'] for side in ('left', 'right') for joint in ('knee', 'ankle')]
    assert np.isnan(keypoints[0, gone, :2]).all()
    there = sorted(set(range(18)) - set(gone))
    np.testing.assert_allclose(keypoints[0, there, :2], person[there], atol=0.5)


def test_joints_in_the_padding_are_no_detections():
    person = standing_person(580, 50, 290)
    valid = (int(person[COCO_18.index['left_elbow'], 0]), NET[0])
    keypoints, _ = decode(render_fields([person]), MOBILENET_THIN, DecodeParams(), valid)
    beyond = person[:, 0] > valid[0] - 0.5
    assert beyond.sum() == 2  # left elbow and wrist
    np.testing.assert_array_equal(np.isnan(keypoints[0, :, 0]), beyond)


# --- left and right -------------------------------------------------------------------------------------------------

def mirrored_fields(fields):
    """Return the fields of the mirrored picture: maps flipped, left and right swapped, x of the PAF negated."""
    swap = list(COCO_18.swap)
    partner = {(limb.start, limb.end): limb.paf for limb in COCO_18.limbs}
    flipped = fields[..., ::-1]
    out = flipped.copy()
    out[:18] = flipped[:18][swap]
    for limb in COCO_18.limbs:
        start, end = (COCO_18.joints[swap[COCO_18.index[name]]] for name in (limb.start, limb.end))
        x, y = partner[start, end]
        out[19 + limb.paf[0]], out[19 + limb.paf[1]] = -flipped[19 + x], flipped[19 + y]
    return np.ascontiguousarray(out)


def test_mirrored_fields_give_mirrored_people_with_left_and_right_swapped():
    people = [standing_person(120.4, 60, 240), standing_person(431.9, 30.3, 300)]
    people[0][4] += (-30, -90)  # a raised right hand
    plain = in_order(decoded(render_fields(people))[0])
    mirrored = in_order(decoded(mirrored_fields(render_fields(people)))[0])[::-1]
    expected = plain[:, list(COCO_18.swap)]
    expected[..., 0] = NET[1] - 1 - expected[..., 0]
    np.testing.assert_allclose(mirrored, expected, atol=1e-3)


# --- peaks ----------------------------------------------------------------------------------------------------------

def peaks_of(heatmaps, upsample=2, threshold=0.05, per_joint=64, total=576, **kwargs):
    return find_peaks(heatmaps, STRIDE, upsample, threshold, per_joint, total, **kwargs)


@pytest.mark.parametrize('upsample, tolerance', [(1, 0.5), (2, 0.2), (4, 0.2)])
def test_sub_pixel_position(upsample, tolerance):
    """Joints anywhere between cells are placed to a fraction of a network pixel, where a cell is eight."""
    v, u = np.mgrid[:46, :82].astype(float)
    for offset in np.random.default_rng(3).uniform(-0.5, 0.5, (20, 2)):
        centre = np.array([40, 20]) + offset
        heat = np.exp(-((u - centre[0]) ** 2 + (v - centre[1]) ** 2) / 2)[None].astype(np.float32)
        peaks = peaks_of(heat, upsample)
        assert len(peaks) == 1
        np.testing.assert_allclose(peaks.xy[0], (centre + 0.5) * STRIDE - 0.5, atol=tolerance)


@pytest.mark.parametrize('cell', [(0, 0), (0, 81), (45, 0), (45, 81), (20, 40)])
def test_peak_in_a_corner_cell(cell):
    heat = np.zeros((1, 46, 82), np.float32)
    heat[0][cell] = 1
    peaks = peaks_of(heat, upsample=1)
    np.testing.assert_allclose(peaks.xy, [[(cell[1] + 0.5) * STRIDE - 0.5, (cell[0] + 0.5) * STRIDE - 0.5]])
    assert peaks.score.tolist() == [1]


def test_two_equal_neighbours_are_one_peak():
    heat = np.zeros((1, 10, 10), np.float32)
    heat[0, 5, 4:6] = 0.5
    peaks = peaks_of(heat, upsample=1)
    assert len(peaks) == 1
    assert peaks.xy[0, 0] == pytest.approx(5 * STRIDE - 0.5)  # between the two


def test_threshold_is_exclusive_and_scores_end_at_one():
    heat = np.zeros((2, 10, 10), np.float32)
    heat[0, 5, 5], heat[1, 5, 5] = 0.05, 1.08
    peaks = peaks_of(heat, upsample=1)
    assert peaks.joint.tolist() == [1] and peaks.score.tolist() == [1]


def test_caps_keep_the_strongest():
    heat = np.zeros((2, 21, 21), np.float32)
    heat[:, 1::2, 1::2] = np.random.default_rng(4).uniform(0.1, 0.9, (2, 10, 10))
    heights = np.sort(heat[:, 1::2, 1::2].reshape(2, -1), axis=1)[:, ::-1]
    per_joint = peaks_of(heat, 1, per_joint=5)
    assert per_joint.joint.tolist() == [0] * 5 + [1] * 5
    np.testing.assert_array_equal(per_joint.score.reshape(2, 5), heights[:, :5])
    total = peaks_of(heat, 1, per_joint=100, total=7)
    np.testing.assert_array_equal(np.sort(total.score)[::-1], np.sort(heights.ravel())[::-1][:7])
    assert (np.diff(total.joint) >= 0).all()


@pytest.mark.parametrize('amplitude', [0.2, 1.0])
def test_noise_takes_bounded_time_and_gives_bounded_people(amplitude):
    """A broken network must not stop the robot: fields of pure noise, as large as those of a real image."""
    fields = np.random.default_rng(5).uniform(-amplitude, amplitude, (57, 46, 82)).astype(np.float32)
    decoded(fields)
    began = time.process_time()
    keypoints, _ = decoded(fields, person_min_score=0.0, person_min_joints=2)
    assert time.process_time() - began < 0.5  # 0.03 s on one core; without caps, seconds
    assert len(keypoints) <= 576 // 2
    assert np.isfinite(keypoints[..., :2]).all(axis=2).sum() <= 576


# --- limbs ----------------------------------------------------------------------------------------------------------

def elbow_and_wrist(elbow, wrist):
    joints = np.array([COCO_18.index['right_elbow'], COCO_18.index['right_wrist']])
    return Peaks(joints, np.array([elbow, wrist], np.float32), np.array([0.9, 0.8], np.float32))


def limb_scores(pafs, elbow, wrist):
    return score_limbs(pafs, elbow_and_wrist(elbow, wrist), COCO_18, STRIDE, 10, 0.05, 0.8)


def forearm_field(x, y):
    pafs = np.zeros((38, 46, 82), np.float32)
    limb = next(limb for limb in COCO_18.limbs if limb.end == 'right_wrist')
    pafs[limb.paf[0]], pafs[limb.paf[1]] = x, y
    return pafs


def test_limb_along_the_field_scores_its_strength():
    limbs = limb_scores(forearm_field(0.7, 0), (100, 100), (180, 100))
    assert (limbs.start.tolist(), limbs.end.tolist()) == ([0], [1])
    assert COCO_18.limbs[limbs.limb[0]].end == 'right_wrist'
    assert limbs.score[0] == pytest.approx(0.7)


@pytest.mark.parametrize('field', [(0, 0), (-0.7, 0), (0, 0.7)], ids=['none', 'opposite', 'across'])
def test_limb_without_a_field_along_it_is_none(field):
    assert len(limb_scores(forearm_field(*field), (100, 100), (180, 100))) == 0


def test_enough_samples_must_support_a_limb():
    """8 of 10 samples: 7 lie on a field that covers 70 % of the limb, 9 on one that covers 90 %."""
    for covered, found in ((0.7, 0), (0.9, 1)):
        pafs = forearm_field(0.9, 0)
        pafs[:, :, int(4 + 40 * covered):] = 0
        assert len(limb_scores(pafs, (35.5, 100), (355.5, 100))) == found


def test_limb_longer_than_half_the_height_pays():
    score = limb_scores(forearm_field(0.7, 0), (20, 100), (20 + 2 * 184, 100)).score[0]
    assert score == pytest.approx(0.7 + 0.5 - 1)


def test_foreshortened_limb_joins_without_a_field_but_proves_nothing():
    limbs = limb_scores(forearm_field(0, 0), (100, 100), (102, 101))
    assert limbs.score.tolist() == [0]
    assert len(limb_scores(forearm_field(0, 0), (100, 100), (104, 100))) == 0


def test_coincident_peaks_are_no_division_by_zero():
    with np.errstate(all='raise'):
        assert np.isfinite(limb_scores(forearm_field(0.7, 0), (100, 100), (100, 100)).score).all()


def test_without_peaks_no_limbs():
    nothing = Peaks(np.zeros(0, np.int64), np.zeros((0, 2), np.float32), np.zeros(0, np.float32))
    assert len(score_limbs(np.zeros((38, 4, 4), np.float32), nothing, COCO_18, STRIDE, 10, 0.05, 0.8)) == 0


# --- assembly -------------------------------------------------------------------------------------------------------

def people_from(joints, limbs, heights=None, min_joints=2):
    """Assemble peaks, given by joint name, and limbs, given as (start, end, score) in peak numbers."""
    peaks = Peaks(np.array([COCO_18.index[joint] for joint in joints]),
                  np.stack([np.arange(len(joints))] * 2, axis=1).astype(np.float32),
                  np.array(heights or [0.5] * len(joints), np.float32))
    names = [(limb.start, limb.end) for limb in COCO_18.limbs]
    kinds = [names.index((joints[start], joints[end])) for start, end, _ in limbs]
    start, end, score = (np.array(column) for column in zip(*limbs))
    keypoints, scores = assemble(peaks, LimbCandidates(np.array(kinds), start, end, score.astype(np.float32)),
                                 COCO_18, min_joints, 0.0)
    return [{joint: int(person[COCO_18.index[joint], 0]) for joint in COCO_18.joints
             if person[COCO_18.index[joint], 2] > 0} for person in keypoints], scores


def test_ear_to_shoulder_starts_nobody():
    people, _ = people_from(['right_shoulder', 'right_ear'], [(0, 1, 0.9)])
    assert people == []


def test_ear_to_shoulder_adds_an_ear():
    people, _ = people_from(['neck', 'right_shoulder', 'right_ear'], [(0, 1, 0.9), (1, 2, 0.9)])
    assert people == [{'neck': 0, 'right_shoulder': 1, 'right_ear': 2}]


def test_ear_to_shoulder_joins_a_head_and_a_body():
    people, _ = people_from(['neck', 'right_shoulder', 'nose', 'right_eye', 'right_ear'],
                            [(0, 1, 0.9), (2, 3, 0.9), (3, 4, 0.9), (1, 4, 0.3)])
    assert people == [{'neck': 0, 'right_shoulder': 1, 'nose': 2, 'right_eye': 3, 'right_ear': 4}]


def test_people_who_both_have_a_joint_are_not_joined():
    people, _ = people_from(['neck', 'right_shoulder', 'nose', 'nose', 'right_eye', 'right_ear'],
                            [(0, 1, 0.9), (0, 2, 0.9), (3, 4, 0.8), (4, 5, 0.8), (1, 5, 0.3)])
    assert sorted(len(person) for person in people) == [3, 3]


def test_nearness_alone_starts_nobody():
    people, _ = people_from(['neck', 'right_shoulder', 'right_elbow'], [(0, 1, 0.0), (1, 2, 0.0)])
    assert people == []


def test_the_better_limb_wins_and_a_peak_is_used_once():
    people, _ = people_from(['neck', 'neck', 'right_shoulder'], [(0, 2, 0.4), (1, 2, 0.8)])
    assert people == [{'neck': 1, 'right_shoulder': 2}]


def test_a_speck_of_noise_does_not_take_a_limb_from_a_joint():
    """The field ends beside the true neck, so that the line from a weak peak nearby fits a little better."""
    people, _ = people_from(['neck', 'neck', 'nose'], [(0, 2, 0.83), (1, 2, 0.92)], heights=[0.54, 0.05, 0.81])
    assert people == [{'neck': 0, 'nose': 2}]


def test_score_is_the_mean_of_joints_and_of_limbs_that_prove_something():
    _, scores = people_from(['neck', 'right_shoulder', 'right_elbow'], [(0, 1, 0.0), (1, 2, 0.9)], [0.5, 0.6, 0.8])
    assert scores.tolist() == pytest.approx([(0.5 + 0.6 + 0.8 + 0.9) / 4])


def test_person_needs_enough_joints():
    limbs = [(0, 1, 0.9), (1, 2, 0.9)]
    joints = ['neck', 'right_shoulder', 'right_elbow']
    assert len(people_from(joints, limbs, min_joints=3)[0]) == 1
    assert len(people_from(joints, limbs, min_joints=4)[0]) == 0


# --- parameters -----------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('key, value', [('heatmap_upsample', 0), ('peak_threshold', -0.1), ('limb_samples', 1),
                                        ('person_min_joints', 1), ('max_peaks', 0), ('limb_min_support', 1.5)])
def test_bad_parameter_is_refused(key, value):
    with pytest.raises(ParameterError, match=key):
        DecodeParams(**{key: value})
