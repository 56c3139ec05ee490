"""Pictures of RViz: which moments are shown, and where joints are drawn."""
import importlib

import numpy as np
import pytest
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

from development import ROOT
from openpose_ros_pkg.output.draw import person_colour
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.points.transform import LEVEL
from skeleton_extract_3d.ros.convert import people_to_array

VISIBLE, HIDDEN = [2] * 18, [3] * 18
BESIDE = np.array([-9.0, 0.0, 1.0])  # of RViz's view


@pytest.fixture
def picture(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / 'development/demo'))
    return importlib.import_module('picture')


def a_person(status=MEASURED, around=(0.0, 0.0, 3.0)):
    """A person with joints 10 cm apart, across and upwards."""
    xyz = np.array(around) + 0.1 * np.stack([np.arange(18) % 6, np.arange(18) // 6, np.zeros(18)], axis=1)
    return People3D(COCO_18, xyz[None], np.ones((1, 18)), np.full((1, 18), status), np.full((1, 18), 0.05), [1])


def moment_of(picture, people):
    return picture.Moment(0, PointCloud2(), Image(), people_to_array(people, Header()))


def drawn(picture, people):
    """RViz's window: a panel, and beside it the scene with the joints of people."""
    window = np.full((600, 900, 3), 240, np.uint8)
    window[:, 300:] = picture.BACKGROUND
    for u, v in picture.project(people.xyz.reshape(-1, 3), LEVEL, window):
        if np.isfinite(u):
            window[round(v), round(u)] = person_colour(1)
    return window


def test_pictures_are_of_frames_before_a_person_is_hidden_and_while_one_is(picture):
    def truth(*frames):
        return {'frames': [{'people': [{'vis': vis} for vis in people]} for people in frames]}
    both, one = (VISIBLE, VISIBLE), (VISIBLE, HIDDEN)
    assert picture.both_in_view(truth(both, both, one, one)) == {'rviz.png': [1, 0], 'rviz_hidden.png': [3, 2]}
    assert picture.both_in_view(truth(both, both)) == {'rviz.png': [1, 0]}
    assert picture.both_in_view(truth(one)) == {'rviz_hidden.png': [0]}


def test_joints_are_drawn_where_they_project_and_those_beside_the_view_do_not_count(picture):
    people = a_person()
    window, moment = drawn(picture, people), moment_of(picture, people)
    assert picture.drawn_joints(window, moment, LEVEL).tolist() == [True] * 18
    empty = drawn(picture, People3D.empty(COCO_18))
    assert picture.drawn_joints(empty, moment, LEVEL).tolist() == [False] * 18
    for none in (People3D.empty(COCO_18), a_person(INFERRED), a_person(around=BESIDE)):
        assert picture.drawn_joints(empty, moment_of(picture, none), LEVEL).size == 0


def test_errors_are_those_of_the_drawn_joints(picture):
    people = a_person()
    window, moment = drawn(picture, people), moment_of(picture, people)

    def truth(*true):
        return {'joints': COCO_18.joints, 'frames': [{'people': [{'vis': VISIBLE, 'xyz': each} for each in true]}]}
    assert picture.errors_of(window, moment, LEVEL, truth()).size == 0
    off = picture.errors_of(window, moment, LEVEL, truth(people.xyz[0] + (0.03, 0.0, 0.0)))
    expected = np.linalg.norm(picture.project(people.xyz[0], LEVEL, window)
                              - picture.project(people.xyz[0] + (0.03, 0.0, 0.0), LEVEL, window), axis=1)
    np.testing.assert_allclose(off, expected)
    without_people = moment_of(picture, People3D.empty(COCO_18))
    assert np.isinf(picture.errors_of(window, without_people, LEVEL, truth(people.xyz[0]))).all()
