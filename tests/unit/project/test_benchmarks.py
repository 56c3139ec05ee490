"""What the benchmarks share: the table of joints, crowds."""
import csv
import sys
from pathlib import Path

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'development' / 'benchmarks'))

from chain_runs import write_csv
from common import DEMO
from crowd import make_crowd


def rows(path, *frames):
    write_csv(path, list(frames))
    with path.open(newline='') as handle:
        return list(csv.DictReader(handle))


def test_frames_without_people_have_no_rows(tmp_path):
    assert rows(tmp_path / 'none.csv', (0.0, People3D.empty(COCO_18))) == []


def test_each_person_of_a_frame_has_a_row(tmp_path):
    joints = (2, len(COCO_18.joints))
    xyz = np.arange(2 * joints[1] * 3.0).reshape(*joints, 3)
    people = People3D(COCO_18, xyz, np.ones(joints), np.ones(joints), np.ones(joints), [7, 4])
    table = rows(tmp_path / 'two.csv', (0.0, People3D.empty(COCO_18)), (0.5, people))
    assert [(row['%time'], row['field.person_ID'], row['field.num_people_detected']) for row in table] == [
        ('500000000', '7', '2'), ('500000000', '4', '2')]
    first, last = COCO_18.joints[0], COCO_18.joints[-1]
    assert float(table[0][f'field.{first}.y']) == 1 and float(table[1][f'field.{last}.z']) == xyz[1, -1, 2]


def test_crowds_have_more_of_the_image(tmp_path):
    shares = []
    scene = np.max([frame.depth for frame in RgbdSequence.read(DEMO)][::3], axis=0).astype(float)
    for people in (1, 2, 4):
        sequence = RgbdSequence.read(make_crowd(tmp_path / str(people), [people]))
        assert len(sequence) == 40
        shares.append(float((scene - sequence.frame(0).depth > 100).mean()))  # [mm]
    assert 0.03 < shares[0] < shares[1] < shares[2] < 0.5
