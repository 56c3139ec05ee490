"""Scores of what is known: the truth itself, and the truth changed in one way."""
import json
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.skeletons import BODY_25, COCO_18
from scoring import people
from scoring.counts import Counts, blocks_of, by_bin, by_tag, by_value, load
from scoring.figures import Quantile, Ratio, differences, few_scenes, figures
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.track.feet import FEET

JOINTS = len(COCO_18.joints)
FRAMES, RATE = 10, 10.0
# Joints of a person that furniture hides.
HIDDEN = [COCO_18.index['left_ankle'], COCO_18.index['right_ankle']]
LABELS = np.where(np.isin(np.arange(JOINTS), HIDDEN), people.FURNITURE, people.VISIBLE)


def joints_of(person, number):
    """Return the joints of a person (18, 3) who walks to the right; people are 1.2 m apart."""
    body = np.random.RandomState(person).uniform(-0.4, 0.4, (JOINTS, 3))
    return body + np.array((1.2 * person + 0.05 * number, 0.0, 3.0))


@pytest.fixture
def scene(tmp_path):
    """A scene of two people; the joints have another order than COCO_18."""
    order = list(reversed(range(JOINTS)))
    truth = {'joints': [COCO_18.joints[row] for row in order],
             'frames': [{'i': number, 't': number / RATE, 'people': [
                 {'id': person, 'xyz': joints_of(person, number)[order].tolist(), 'uv': np.zeros((18, 2)).tolist(),
                  'vis': LABELS[order].tolist()}
                 for person in (1, 2)]} for number in range(FRAMES)]}
    (tmp_path / 'gt.json').write_text(json.dumps(truth))
    (tmp_path / 'meta.json').write_text(json.dumps({'scenario': '07_walk', 'sensor': 'xtion', 'light': 'dim'}))
    return tmp_path


def found(change=lambda number, person, xyz: [(person, xyz)], status=MEASURED):
    """Return the frames of the true people as `change(frame, id, xyz) -> [(id, xyz), ...]` makes them."""
    frames = []
    for number in range(FRAMES):
        made = [each for person in (1, 2) for each in change(number, person, joints_of(person, number))]
        xyz = np.array([xyz for _, xyz in made]).reshape(-1, JOINTS, 3)
        shape = xyz.shape[:2]
        frames.append((number / RATE, People3D(COCO_18, xyz, np.ones(shape), np.full(shape, status),
                                               np.full(shape, 0.05), [person for person, _ in made])))
    return frames


AWAY = np.array((0.0, 0.0, 1.0))


def with_wrong_ankles(number, person, xyz):
    wrong = xyz.copy()
    wrong[HIDDEN] += 3
    return [(person, wrong)]


@pytest.mark.parametrize('change, status, expected', [
    (lambda number, person, xyz: [], MEASURED, {
        'persons_recall': 0, 'persons_precision': None, 'visible_100': 0, 'hidden_150': 0, 'lies': 0,
        'visible_median': None}),
    (lambda number, person, xyz: [(person, xyz)], MEASURED, {
        'persons_recall': 1, 'persons_precision': 1, 'visible_100': 1, 'hidden_150': 1, 'idf1': 1, 'within_1_sigma': 1,
        'visible_median': 0, 'switches': 0, 'lies': 0, 'jitter': 0, 'hidden_measured': 1}),
    (lambda number, person, xyz: [(person, xyz + 0.16 * AWAY)], MEASURED, {
        'visible_median': 160, 'visible_90': 160, 'visible_100': 0, 'within_2_sigma': 0, 'lies': 1,
        'persons_recall': 1}),
    (lambda number, person, xyz: [(person, xyz + 0.16 * AWAY)], INFERRED, {'lies': 0, 'visible_inferred': 1}),
    # ids swapped half way; people reported twice; one who is missing; all beyond the gate
    (lambda number, person, xyz: [(person if number < FRAMES // 2 else 3 - person, xyz)], MEASURED, {
        'switches': 2, 'idf1': 0.5}),
    (lambda number, person, xyz: [(person, xyz), (person + 10, xyz + 0.2 * AWAY)], MEASURED, {
        'persons_precision': 0.5, 'persons_recall': 1, 'visible_median': 0}),
    (lambda number, person, xyz: [(person, xyz)] if person == 1 else [], MEASURED, {
        'persons_recall': 0.5, 'visible_100': 0.5, 'hidden_given': 0.5, 'persons_precision': 1}),
    (lambda number, person, xyz: [(person, xyz + 0.7 * AWAY)], MEASURED, {'persons_recall': 0}),
    (with_wrong_ankles, MEASURED, {'persons_recall': 1}),
    # to and fro by 1 cm: the second difference is 4 cm
    (lambda number, person, xyz: [(person, xyz + 0.01 * (-1) ** number * AWAY)], MEASURED, {
        'jitter': 0.04 * RATE ** 2})])
def test_the_truth_changed_in_one_way(scene, change, status, expected):
    counts = people.score_people(scene, found(change, status))
    result = figures([counts], people.STATISTICS, resamples=10)
    for name, value in expected.items():  # positions are float32
        assert result[name].value == (value if value is None else pytest.approx(value, abs=3e-3)), name


def test_toes_and_heels(scene):
    truth, offset, frames = json.loads((scene / 'gt.json').read_text()), np.array((0.05, 0.0, 0.0)), []
    for frame in truth['frames']:
        xyz = []
        for person in frame['people']:
            feet = np.array(person['xyz'][:6])
            person['feet'] = {'xyz': feet.tolist(), 'vis': [2, 2, 2, 2, 2, 3]}
            xyz.append(np.full((25, 3), np.nan))
            xyz[-1][[BODY_25.index[name] for name in COCO_18.joints]] = joints_of(person['id'], frame['i'])
            xyz[-1][[BODY_25.index[name] for name in FEET]] = feet + np.outer((1, 2, 1, 1, 1, 4), offset)
        status = np.where(np.isfinite(np.array(xyz)[..., 0]), MEASURED, 0)
        frames.append((frame['t'], People3D(BODY_25, np.array(xyz), np.ones((2, 25)), status, np.full((2, 25), 0.05),
                                            [1, 2])))
    (scene / 'gt.json').write_text(json.dumps(truth))
    counts = [people.score_people(scene, frames)]
    result = figures(counts, {**people.STATISTICS, **people.FEET_STATISTICS}, resamples=10)
    expected = {'visible_100': 1, 'visible_median': 0, 'feet_60': 0.8, 'feet_median': 50, 'feet_measured': 1,
                'feet_lies': 1, 'feet_surprise': (4 + 2 ** 2) / 5}
    for name, value in expected.items():
        assert result[name].value == pytest.approx(value, abs=3e-3), name
    none = figures([people.score_people(scene, found())], people.FEET_STATISTICS, resamples=10)  # people of COCO_18
    assert (none['feet_60'].value, none['feet_median'].value, none['feet_60'].n) == (0, None, 10 * FRAMES)


def test_frames_at_no_true_time_are_stray(scene):
    for late, stray in ((0.001, 0), (0.04, 2 * FRAMES), (50, 2 * FRAMES)):
        sums = people.score_people(scene, [(seconds + late, each) for seconds, each in found()]).sums
        assert (sums['stray'], sums['paired']) == (stray, 2 * FRAMES - stray)


def test_counts_come_back_from_their_file(scene, tmp_path):
    counts = people.score_people(scene, found())
    counts.save(tmp_path / 'kept' / 'counts.npz')
    again = load(tmp_path / 'kept' / 'counts.npz')
    assert (again.scene, again.sums) == (counts.scene, counts.sums)
    assert again.tags == {'kind': 'walk', 'sensor': 'xtion', 'light': 'dim'}
    for name, rows in counts.rows.items():
        np.testing.assert_array_equal(again.rows[name], rows)


def test_groups_of_joints_and_scenes(scene):
    counts = [people.score_people(scene, found())]
    by_joint = by_value(counts, 'joints', 'joint', {'nose': [COCO_18.index['nose']], 'ankles': HIDDEN})
    assert figures(by_joint['nose'], people.JOINT_STATISTICS, 0)['visible_100'].n == 2 * FRAMES
    assert figures(by_joint['ankles'], people.JOINT_STATISTICS, 0)['hidden_150'].n == 4 * FRAMES
    bins = by_bin(counts, 'joints', 'distance', (0, 3, 9))
    assert sum(len(each.rows['joints']) for group in bins.values() for each in group) == 2 * FRAMES * JOINTS
    assert list(by_tag(counts, 'sensor')) == ['xtion']


def counted(values):
    return [Counts(str(number), {}, {'right': value, 'all': 100}, {'errors': np.full(7, value).astype([('e', 'f8')])})
            for number, value in enumerate(values)]


SHARE = {'share': Ratio('', lambda counts: counts.sums['right'], lambda counts: counts.sums['all'])}


def test_the_interval_of_a_mean_is_that_of_normal_theory():
    values = np.random.RandomState(1).uniform(40, 80, 60)
    figure = figures(counted(values), SHARE)['share']
    half = 1.96 * values.std() / 100 / np.sqrt(len(values))
    assert figure.value == pytest.approx(values.mean() / 100)
    assert (figure.low, figure.high) == pytest.approx((figure.value - half, figure.value + half), abs=0.1 * half)


def test_one_scene_has_no_interval_and_none_has_no_figure():
    figure = figures(counted([50]), SHARE)['share']
    assert (figure.value, figure.low, figure.high) == (0.5, None, None)
    assert str(figures([], SHARE)['share']) == '-'


def test_quantiles_are_those_of_all_values():
    values = np.random.RandomState(2).uniform(0, 1, 40)
    statistic = {'median': Quantile('', lambda counts: counts.rows['errors']['e'], 0.5, digits=3)}
    figure = figures(counted(values), statistic)['median']
    assert figure.value == pytest.approx(np.median(values))
    drawn = [np.median(np.random.RandomState(seed).choice(values, 40)) for seed in range(2000)]
    assert (figure.low, figure.high) == pytest.approx(tuple(np.quantile(drawn, (0.025, 0.975))), abs=0.06)


def test_blocks_of_a_scene_are_its_frames(scene):
    blocks = blocks_of(scene, 0.4)
    assert [(block.start, block.stop) for block in blocks] == [(0, 4), (4, 8), (8, 10)]
    parts = [people.score_people(scene, found(), block) for block in blocks]
    assert sum(part.sums['paired'] for part in parts) == 2 * FRAMES
    figure = few_scenes([people.score_people(scene, found())], parts, people.STATISTICS)['visible_100']
    assert (figure.value, figure.low, figure.high) == (1, 1, 1)


def test_what_one_scene_alone_tells_has_no_interval():
    values = [each if number else replace(each, rows={'errors': each.rows['errors'][:0]})
              for number, each in enumerate(counted([1.0, 2.0]))]
    figure = figures(values, {'median': Quantile('', lambda counts: counts.rows['errors']['e'])})['median']
    assert (figure.value, figure.low, figure.scenes, figure.n) == (2, None, 1, 7)


def test_differences_are_paired():
    values = np.random.RandomState(1).uniform(20, 80, 40)
    same = differences(counted(values), counted(values + 1), SHARE)['share']
    assert (same.value, same.low, same.high) == pytest.approx((0.01, 0.01, 0.01))
    with pytest.raises(ValueError, match='the same scenes'):
        differences(counted(values), counted(values[1:]), SHARE)


@pytest.fixture
def stage(tmp_path):
    """Two people before two cameras, of which one sees no ankles."""
    truth = {'joints': list(COCO_18.joints), 'fps': RATE, 'cameras': ['cam0', 'cam1'],
             'frames': [{'i': number, 't': number / RATE, 'people': [
                 {'id': person, 'xyz': joints_of(person, number).tolist(),
                  'vis': {'cam0': LABELS.tolist(), 'cam1': np.where(np.arange(JOINTS) == HIDDEN[0], 2, 1).tolist()}}
                 for person in (1, 2)]} for number in range(FRAMES)]}
    (tmp_path / 'gt_world.json').write_text(json.dumps(truth))
    return tmp_path


@pytest.mark.parametrize('change, expected', [
    (lambda number, person, xyz: [], {'persons_recall': 0, 'all_right': 0, 'visible_100': 0}),
    (lambda number, person, xyz: [(person, xyz)], {'persons_recall': 1, 'persons_precision': 1, 'all_right': 1,
                                                   'visible_100': 1, 'hidden_100': 1, 'switches': 0, 'idf1': 1}),
    (lambda number, person, xyz: [(person, xyz + np.array((0, 0, 0.15)))], {'visible_median': 150, 'visible_mean': 150,
                                                                 'visible_100': 0, 'within_2_sigma': 0}),
    (lambda number, person, xyz: [(person, xyz), (person + 10, xyz + np.array((0.3, 0, 0)))],
     {'persons_precision': 0.5, 'all_right': 0, 'persons_recall': 1})])
def test_fused_people(stage, change, expected):
    counts = people.score_world(stage, found(change))
    result = figures([counts], people.WORLD_STATISTICS, 0)
    assert {name: result[name].value for name in expected} == pytest.approx(expected, abs=0.01)
    assert sorted(np.unique(counts.rows['joints']['cameras'])) == [0, 1]


def test_exchanged_sides_are_counted_where_both_have_a_position():
    true = np.random.default_rng(1).normal(size=(18, 3))
    swapped, half = true[list(COCO_18.swap)], true.copy()
    half[COCO_18.index['left_hip']] = np.nan
    assert people.exchanged_sides(true, true + 0.01).tolist() == [False, False]
    assert people.exchanged_sides(true, swapped).tolist() == [True, True]
    assert people.exchanged_sides(true, half).tolist() == [False]
