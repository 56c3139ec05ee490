"""The first minute as a library: people of a photo, and of a folder with and without depth, drawn and as a table."""
import json

import cv2
import numpy as np
import pytest

import openpose_ros
from development import ROOT
from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.chain import Result
from skeleton_extract_3d.estimator import Estimate

SEQUENCE = ROOT / 'skeleton_extract_3d/demo/cross'
TRUTH = json.loads((SEQUENCE / 'gt.json').read_text())


def true_noses(frame, key):
    nose = TRUTH['joints'].index('nose')
    return [person[key][nose] for person in TRUTH['frames'][frame]['people']]


def assert_near(found, truth, tolerance):
    assert len(found) == len(truth) == 2
    for place in truth:
        assert min(np.linalg.norm(np.subtract(other, place)) for other in found) < tolerance


def test_a_photo(tmp_path):
    people = openpose_ros.people(SEQUENCE / 'rgb/000.jpg', mode='fast')
    table = people.table()
    noses = table[table.joint == 'nose']
    assert_near(noses[['u', 'v']].to_numpy(), true_noses(0, 'uv'), 15.0)
    assert list(table.columns) == ['time', 'person_ID', 'joint', 'u', 'v', 'score'] and people.in_space is None
    drawn = people.draw(tmp_path / 'people.png')
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / 'people.png')), drawn)
    assert (drawn != people.bgr).any()
    with pytest.raises(BadInputError, match=r'nothing\.jpg can not be read'):
        openpose_ros.people(tmp_path / 'nothing.jpg')


def test_a_folder_with_depth():
    frames = openpose_ros.sequence(SEQUENCE, mode='fast')
    first, second = next(frames), next(frames)
    table = second.table()
    assert (first.time, second.time) == (0.0, pytest.approx(1 / 15, abs=0.01))
    assert sorted(first.in_space.ids) == sorted(second.in_space.ids) == [1, 2]
    assert_near(table[table.joint == 'nose'][['x', 'y', 'z']].to_numpy(), true_noses(1, 'xyz'), 0.15)
    np.testing.assert_array_equal(second.in_image.ids, second.in_space.ids)
    assert second.draw().shape == second.bgr.shape


def test_a_person_who_is_hidden_has_a_place_in_space_alone():
    frame = next(openpose_ros.sequence(SEQUENCE, mode='fast'))
    estimate = Estimate(frame.in_space, frame.in_image.select(np.array([0])))
    hidden = openpose_ros._found(frame.bgr, 0.0, Result(None, estimate.people_2d, estimate))
    np.testing.assert_array_equal(hidden.in_image.ids, frame.in_space.ids)
    assert not hidden.in_image.present[1].any() and len(hidden.table()) == 2 * 25
    assert hidden.draw().shape == frame.bgr.shape


def test_a_folder_of_images():
    frames = openpose_ros.sequence(SEQUENCE / 'rgb', mode='fast')
    for number in range(2):
        frame = next(frames)
        assert len(frame) == 2 and frame.in_space is None and frame.time == pytest.approx(number / 25)
        assert sorted(frame.in_image.ids) == [1, 2]
