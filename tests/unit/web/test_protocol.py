"""What pages get: whole millimetres, no NaN, and what docs/web.md says."""
import json

import numpy as np
import pytest

from development import PACKAGES, ROOT
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.records import Facing, Fall, Gesture, Hit, PersonSignals, Pointing, Posture, Ray, Walk
from openpose_ros_web import protocol
from openpose_ros_web.protocol import Moment, Want
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import UPRIGHT

MOMENT = Moment(1000.1234567, 0.1, 2000.0, 'world')
STILL = np.eye(3), np.zeros(3)
# Optical frame of a level camera 1 m above the floor.
POSE = UPRIGHT.T, np.array([0.0, 0.0, 1.0])


def person():
    """Return one that has three joints 2 m before a camera, of which one moves."""
    xyz, status = np.full((1, 18, 3), np.nan), np.full((1, 18), MISSING)
    xyz[0, :3], status[0, :3] = [[0.0, 0.0, 2.0], [0.5, 0.25, 2.0], [-0.0004, 0.0, 2.0]], (MEASURED, INFERRED, MEASURED)
    sigma = np.where(status > 0, 0.02, np.nan)
    sigma[0, 1], velocity = np.nan, np.full((1, 18, 3), np.nan)
    velocity[0, 1] = 0.0, 0.0, -1.5
    return People3D(COCO_18, xyz, status > 0, status, sigma, np.array([3]), velocity)


def signals():
    ray = Ray(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0]), 0.1)
    pointing = Pointing(ray.origin, ray.direction, 0.1, ray, ray, Hit(np.array([1.0, 0.0, 2.0]), 'lamp', 0.0))
    facing = Facing(np.array([0.0, 0.0, -1.0]), 0.2)
    return PersonSignals(3, np.array([0.0, 0.0, 2.0]), Posture('standing', 990.0, 1.0), (
        Gesture('point', 'left', 999.0, 1.0, pointing),), facing, None, Walk(True, 1.25, np.array([1.0, 0, 0])),
        Fall(999.0, 1.0, 1.0))


def hands():
    points = Points3D(np.ones((1, 21, 3)), np.ones((1, 21)), np.full((1, 21), MEASURED), np.ones((1, 21)))
    return Hands3D(points, np.ones(1), np.array([3]), np.array([False]))


def faces():
    points = Points3D(np.ones((1, 70, 3)), np.ones((1, 70)), np.full((1, 70), MEASURED), np.ones((1, 70)))
    return Faces3D(points, np.ones(1), np.array([3]), np.zeros((1, 4)), np.ones(1))


CAMERA = CameraModel(64, 48, np.array([[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]]))
MESSAGES = {message['type']: message for message in (
    protocol.hello(['camera'], 3), protocol.people_message(person(), POSE, MOMENT),
    protocol.signals_message([signals()], POSE, MOMENT), protocol.hands_message(hands(), STILL, MOMENT),
    protocol.faces_message(faces(), STILL, MOMENT), protocol.cameras_message([(0, CAMERA, POSE)], 'world'))}


def test_people():
    message = MESSAGES['people']
    assert (message['stamp'], message['age'], message['time'], message['frame']) == (1000.123457, 0.1, 2000.0, 'world')
    (found,) = message['people']
    assert found['xyz'][:9] == [2000, 0, 1000, 2000, -500, 750, 2000, 0, 1000]
    assert found['xyz'][9:] == [0] * 45
    assert found['status'] == [1, 2, 1] + [0] * 15
    assert found['sigma'] == [20, 0, 20] + [0] * 15
    assert found['velocity'] == [-1500, 0, 0]


def test_signals():
    (found,) = MESSAGES['signals']['people']
    assert found == {
        'id': 3, 'position': [2000, 0, 1000], 'posture': 'standing', 'posture_seconds': 10.123, 'fallen': True,
        'speed': 1.25, 'moving': True, 'body_facing': [-1.0, 0.0, 0.0], 'head_facing': None, 'gestures': [
            {'name': 'point', 'arm': 'left', 'seconds': 1.123, 'pointing': {
                'origin': [2000, 0, 1000], 'direction': [0.0, -1.0, 0.0], 'sigma': 0.1, 'hit': [2000, -1000, 1000],
                'target': 'lamp'}}]}
    hidden = protocol.signals_message([PersonSignals(4, np.full(3, np.nan))], POSE, MOMENT)['people'][0]
    assert (hidden['position'], hidden['posture_seconds'], hidden['speed']) == (None, None, None)


@pytest.mark.parametrize('text, want', [
    ('{"want": {}}', Want()), ('{"want": {"image": null, "cloud": true}}', Want()),
    ('{"want": {"image": {"width": 700}}}', Want(0, 640)), ('{"want": {"image": {"width": 1}}}', Want(0, 160)),
    ('{"want": {"image": {"camera": 1, "width": 5000, "rate": 60}}}', Want(1, 960, 15.0))])
def test_what_a_page_wants(text, want):
    assert protocol.read_want(text, 2) == want


def keys(value):
    """Yield all names in a message but those of skeletons."""
    for key, each in value.items() if isinstance(value, dict) else []:
        yield key
        if key not in ('skeletons', 'look'):
            yield from keys(each)
    for each in value if isinstance(value, list) else []:
        yield from keys(each)


@pytest.mark.parametrize('kind', MESSAGES)
def test_the_page_describes_each_field(kind):
    page = (ROOT / 'docs/web.md').read_text()
    missing = {key for key in keys(MESSAGES[kind]) if f'`{key}`' not in page} - {'type'}
    assert not missing


def test_the_sample_has_the_fields_of_messages():
    lines = (PACKAGES['openpose_ros_web'] / 'test/messages.jsonl').read_text().splitlines()
    found = {kind: set() for kind in MESSAGES}
    for message in map(json.loads, lines):
        found.setdefault(message['type'], set()).update(keys(message))
    for kind in ('hello', 'people', 'signals', 'cameras'):
        assert found[kind] == set(keys(MESSAGES[kind]))
