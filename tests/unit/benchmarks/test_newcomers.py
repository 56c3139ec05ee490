"""The benchmark of people who come into view, on pasted people: who is there is published late, elsewhere or not."""
import json

import numpy as np
import pytest

import crowd
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import MEASURED, People3D

newcomer = pytest.importorskip('newcomer', reason='needs ROS')
RATE, LATENCY = 30.0, 0.04


def people(rows, moved=0.0):
    xyz = np.array([row['xyz'] for row in rows], np.float32).reshape(-1, 18, 3) + np.float32([0, 0, moved])
    shape = xyz.shape[:2]
    return People3D(COCO_18, xyz, np.ones(shape), np.full(shape, MEASURED), np.full(shape, 0.02),
                    np.arange(len(rows)), np.zeros_like(xyz))


@pytest.fixture(name='truth')
def fixture_truth(tmp_path, monkeypatch):
    first, second = (copy for _, copy in newcomer.NEWCOMERS[:2])
    monkeypatch.setattr(newcomer, 'NEWCOMERS', ((1, first), (5, second)))
    monkeypatch.setattr(newcomer, 'STAY', 3)
    crowd.write_crowd(tmp_path / 'crowd', newcomer.casts())
    return tmp_path / 'crowd'


def test_copies_are_where_the_truth_says(truth):
    frame = json.loads((truth / 'gt.json').read_text())['frames'][1]
    assert [person['id'] for person in frame['people']] == [1, 2, crowd.FIRST_COPY]
    matrix = crowd.open_sequence(truth).camera.matrix
    depth = crowd.cv2.imread(str(truth / 'depth/00001.png'), crowd.cv2.IMREAD_UNCHANGED)
    xyz, uv = (np.array(frame['people'][2][name]) for name in ('xyz', 'uv'))
    at_pixel = (uv - matrix[:2, 2]) * xyz[:, 2:] / matrix[[0, 1], [0, 1]]
    # copies are as flat as a picture, and moved aside by 0.6 of the distance: 0.3 m of depth are 0.18 m aside
    assert np.abs(at_pixel - xyz[:, :2]).max() < 0.18
    neck = np.round(uv[COCO_18.index['neck']]).astype(int)
    assert depth[neck[1], neck[0]] / 1000 == pytest.approx(xyz[COCO_18.index['neck'], 2], abs=0.25)


def test_time_until_a_newcomer_is_published(truth):
    frames = json.loads((truth / 'gt.json').read_text())['frames']
    published = [(frame['t'], people([row for row in frame['people'] if row['id'] < 3 or frame['i'] >= 2],
                                     moved=0.0 if frame['i'] < 5 else 1.0)) for frame in frames if frame['i'] != 2]
    seen = newcomer.compare(truth, (published, [LATENCY] * len(published)), RATE)
    # the first comes in frame 1, of frame 2 is no message; the second is published a metre away
    assert seen.seconds[0] == pytest.approx(2 / RATE + LATENCY) and np.isinf(seen.seconds[1])
    assert seen.beyond.tolist() == [0] * len(frames)
    many = [(frame['t'], people([*frame['people'], *frame['people']])) for frame in frames]
    seen = newcomer.compare(truth, (many, [LATENCY] * len(many)), RATE)
    assert seen.seconds == pytest.approx([LATENCY] * 2)
    assert seen.beyond.tolist() == [len(frame['people']) for frame in frames]
