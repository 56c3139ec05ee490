"""Hands and faces in OpenPose's JSON files and in images."""
import json

import numpy as np
import pytest

from openpose_ros_pkg.landmarks.records import Faces2D, Hands2D, Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams
from openpose_ros_pkg.output.openpose_json import landmark_fields, people_to_json
from openpose_ros_pkg.output.recorder import Recorder, SaveParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18

IMAGE = np.zeros((120, 160, 3), np.uint8)
PLAIN = DrawParams(disable_blending=True)


def people(*ids):
    keypoints = np.full((len(ids), 18, 3), (10.0, 10.0, 0.5), np.float32)
    return People2D(COCO_18, keypoints, np.ones(len(ids)), ids)


def hand(person, left, middle=(80, 60), hidden=None, step=6):
    """A hand whose fingers are rays round the middle; the last point is missing."""
    angles = np.arange(20) // 4
    places = np.column_stack([np.cos(angles), np.sin(angles)]) * (step * (1 + np.arange(20) % 4))[:, np.newaxis]
    points = np.column_stack([np.r_[[(0, 0)], places] + middle, np.full(21, 0.9)])
    points[20] = np.nan, np.nan, 0
    return Hands2D(points[np.newaxis], [0.9], [person], [left], None if hidden is None else [hidden])


def face(person):
    points = np.column_stack([np.linspace(20, 90, 70), np.linspace(30, 60, 70), np.ones(70)])
    return Faces2D(points[np.newaxis], np.zeros((1, 468, 3)), [1.0], [person])


def entries(text):
    return json.loads(text)['people']


def test_each_person_has_the_own_hands_and_face():
    found = Landmarks2D(hand(4, left=False), face(3))
    text = people_to_json(people(3, 4), more=landmark_fields(found))
    third, fourth = entries(text)
    assert len(third['face_keypoints_2d']) == 210 and third['hand_right_keypoints_2d'] == []
    right = np.array(fourth['hand_right_keypoints_2d'], np.float32).reshape(21, 3)
    np.testing.assert_array_equal(right[:20], found.hands.keypoints[0, :20])
    assert right[20].tolist() == [0, 0, 0]  # as OpenPose writes what is missing
    assert fourth['hand_left_keypoints_2d'] == fourth['face_keypoints_2d'] == []


def test_people_without_ids_are_told_apart_and_written_without():
    first, second = entries(people_to_json(people(-1, -2), more=landmark_fields(
        Landmarks2D(hand(-2, left=True), Faces2D.empty()))))
    assert first['person_id'] == second['person_id'] == [-1]
    assert first['hand_left_keypoints_2d'] == [] and len(second['hand_left_keypoints_2d']) == 63


def test_files_have_the_units_that_are_asked_for(tmp_path):
    with Recorder(SaveParams(write_json=str(tmp_path)), scale=KeypointScaleParams(keypoint_scale=3)) as recorder:
        recorder.submit('a', IMAGE, people(3), Landmarks2D(hand(3, True), Faces2D.empty()))
    first, = entries((tmp_path / 'a_keypoints.json').read_text())
    assert first['hand_left_keypoints_2d'][:2] == pytest.approx([80 / 159, 60 / 119])


def test_fingers_and_contours_are_drawn():
    without = draw_people(IMAGE, people(3), PLAIN, landmarks=Landmarks2D.empty())
    drawn = draw_people(IMAGE, people(3), PLAIN, landmarks=Landmarks2D(hand(3, True), face(3)))
    assert not without[60, 80].any() and drawn[60, 80].any()  # the wrist
    assert drawn[60, 80 + 24].argmax() == 2  # the tip of the thumb is red
    assert drawn[30, 20].tolist() == [255, 255, 255]  # of a face all is white
