"""The table that the accuracy benchmark writes."""
import csv
import sys
from pathlib import Path

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import People3D

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'development' / 'benchmarks'))

import accuracy_3d


def rows(path, *frames):
    accuracy_3d.write_csv(path, list(frames))
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
