"""Hands and faces of recordings: in the bag, the JSON files and the tables of process_bag and keypoints_to_csv."""
import csv
import json

import numpy as np
import pytest
from known_recording import EMPTY, FRAMES, known_people, messages, stamp_of, write_recording

from openpose_ros_pkg.landmarks.records import (
    FACE_POINTS,
    HAND_POINT_NAMES,
    HAND_POINTS,
    MESH_POINTS,
    Faces2D,
    Hands2D,
    Landmarks2D,
)
from openpose_ros_tools.ros.keypoints.keypoints_to_csv import main as keypoints_to_csv
from openpose_ros_tools.ros.process_bag import work
from openpose_ros_tools.ros.process_bag.program import main
from openpose_ros_tools.tables.long_csv import SIGNAL_COLUMNS, landmark_columns

BOTH = ['--set', 'hands=true', '--set', 'face=true']


class KnownLandmarks:
    """A left hand at the nose of each person, in which the last point is missing, and a face there."""

    missing = False

    def __init__(self, params):
        self._params = params

    def detect(self, bgr, people, hidden, camera, stamp, seconds=None):
        assert seconds is None  # recordings do not depend on the time
        noses = people.keypoints[people.present[:, 0], 0]
        ids = people.ids[people.present[:, 0]]
        hands, faces = (np.repeat(noses[:, np.newaxis], number, axis=1) for number in (HAND_POINTS, FACE_POINTS))
        hands[:, -1] = np.nan, np.nan, 0
        mesh = np.random.RandomState(0).uniform(0, 9, (len(noses), MESH_POINTS, 3))
        ones = np.ones(len(noses))
        return Landmarks2D(Hands2D(hands, ones, ids, ones) if self._params.hands else Hands2D.empty(),
                           Faces2D(faces, mesh, ones, ids) if self._params.face else Faces2D.empty())


@pytest.fixture
def processed(tmp_path, monkeypatch):
    """Return a function that runs process_bag on the known recording, and where its results are."""
    monkeypatch.setattr(work, 'create_landmark_detector', lambda params, *_: KnownLandmarks(params))

    def run(*options, **recording):
        source = write_recording(tmp_path / 'walk.bag', **recording)
        out, folder = tmp_path / 'out.bag', tmp_path / 'json'
        assert main([str(source), '-o', str(out), '--json', str(folder), *options], known_people) == 0
        return out, [json.loads(path.read_text())['people'] for path in sorted(folder.iterdir())]

    return run


def rows(path, bag, *options):
    assert keypoints_to_csv([str(bag), '-o', str(path), '--overwrite', *options]) == 0
    with path.open() as handle:
        return list(csv.DictReader(handle))


def test_hands_and_faces_are_in_the_bag_for_each_frame(processed):
    out, frames = processed(*BOTH)
    for topic in ('detected_hands', 'detected_hands_3d', 'detected_faces', 'detected_faces_3d'):
        found = [message for message, _ in messages(out, f'/openpose_ros/skeleton_3d/{topic}')]
        assert [message.header.stamp for message in found] == [stamp_of(number) for number in range(FRAMES)], topic
        parts = [message.hands if 'hands' in topic else message.faces for message in found]
        assert any(parts) and parts[-EMPTY:] == EMPTY * [[]]
    ids = {person['person_id'][0] for people in frames for person in people}
    hands = [hand for message, _ in messages(out, '/openpose_ros/skeleton_3d/detected_hands_3d')
             for hand in message.hands]
    assert {hand.person_ID for hand in hands} <= ids


def test_json_has_hands_and_faces_of_each_person(processed):
    _, frames = processed(*BOTH)
    shown = [person for people in frames for person in people if person['hand_left_keypoints_2d']]
    assert shown
    for person in shown:
        assert person['hand_right_keypoints_2d'] == person['hand_right_keypoints_3d'] == []
        assert person['hand_left_keypoints_2d'][:3] == person['pose_keypoints_2d'][:3]  # at the nose
        assert person['hand_left_keypoints_2d'][-3:] == [0, 0, 0]
        assert len(person['face_keypoints_2d']) == 3 * FACE_POINTS
        assert len(person['hand_left_keypoints_3d']) in (0, 4 * HAND_POINTS)


def test_signals_are_in_the_bag_for_each_frame_and_in_a_table(processed, tmp_path):
    out, _ = processed('--signals')
    people = messages(out, '/openpose_ros/skeleton_3d/detected_poses_3d')
    signals = messages(out, '/openpose_ros/skeleton_3d/people_signals')
    assert [(one.header.stamp, [person.person_ID for person in one.persons]) for one, _ in signals] == [
        (one.header.stamp, [person.person_ID for person in one.persons]) for one, _ in people]
    number = sum(len(one.persons) for one, _ in signals)
    assert len(messages(out, '/openpose_ros/skeleton_3d/person_signals')) == number > 0
    found = rows(tmp_path / 'signals.csv', out, '--signals')
    assert tuple(found[0]) == SIGNAL_COLUMNS and len(found) >= number
    assert found[0]['time'] == str(people[0][0].header.stamp.to_nsec())


def test_tables_have_a_row_for_each_point(processed, tmp_path):
    out, _ = processed(*BOTH)
    hands = rows(tmp_path / 'hands.csv', out, '--hands')
    assert list(hands[0]) == landmark_columns('hands', 3)
    found = [(message, hand) for message, _ in messages(out, '/openpose_ros/skeleton_3d/detected_hands_3d')
             for hand in message.hands]
    assert len(hands) == (HAND_POINTS - 1) * len(found)  # the missing point has none
    (message, hand), first = found[0], hands[0]
    assert (first['time'], first['frame_id'], first['side'], first['point'], first['status']) == (
        str(message.header.stamp.to_nsec()), message.header.frame_id, 'left', 'wrist', 'measured')
    assert float(first['x']) == hand.keypoints[0].x and float(first['sigma']) == hand.keypoints[0].sigma
    assert [row['point'] for row in hands[:HAND_POINTS - 1]] == list(HAND_POINT_NAMES[:-1])
    faces = rows(tmp_path / 'faces.csv', out, '--faces')
    assert list(faces[0]) == landmark_columns('faces', 3) and faces[1]['point'] == '1'
    assert np.linalg.norm([float(faces[0][f'orientation_{axis}']) for axis in 'xyzw']) == pytest.approx(1)
