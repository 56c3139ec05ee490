"""Markers: finite points only, inferred apart from measured ones, deletes for people who left, trails, a lifetime that
outlasts the frame period."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.show.markers import LIMB_NAMESPACES, MarkerParams, PeopleMarkers

K = len(COCO_18.joints)
INDEX = COCO_18.index
# A person standing upright in the optical frame (y down), 3 m ahead.
UPRIGHT = {'nose': (0, -0.6, 2.9), 'neck': (0, -0.4, 3), 'right_shoulder': (-0.2, -0.4, 3),
           'left_shoulder': (0.2, -0.4, 3), 'right_hip': (-0.1, 0.2, 3), 'left_hip': (0.1, 0.2, 3)}


def people(persons, inferred=(), sigma=None):
    """People by id, each a mapping from joint to position; `inferred` names joints, `sigma` maps from joint to [m]."""
    xyz = np.full((len(persons), K, 3), np.nan)
    for row, joints in zip(xyz, persons.values()):
        for joint, position in joints.items():
            row[INDEX[joint]] = position
    found = np.isfinite(xyz).all(axis=2)
    status = np.where(found, MEASURED, MISSING)
    for joint in inferred:
        status[found[:, INDEX[joint]], INDEX[joint]] = INFERRED
    sigmas = np.full(found.shape, np.nan)
    for joint, value in (sigma or {}).items():
        sigmas[:, INDEX[joint]] = value
    return People3D(COCO_18, xyz, found * 0.9, status, sigmas, list(persons))


def names(markers):
    return [(marker.action, marker.ns, marker.id) for marker in markers]


def of(markers, ns):
    """The only marker of that namespace."""
    marker, = (marker for marker in markers if marker.ns == ns)
    return marker


def shown(persons, params):
    """The markers of the first frame."""
    return PeopleMarkers(params).update(persons, 0.0, 'camera')


EVERYTHING = MarkerParams(label=True, sigma_spheres=True, trail_seconds=2.0)


@pytest.mark.parametrize('params', [MarkerParams(), EVERYTHING], ids=['defaults', 'everything'])
@pytest.mark.parametrize('persons', [{}, {3: {}}], ids=['no people', 'a person without a position'])
def test_no_people_have_no_markers(persons, params):
    assert shown(people(persons), params) == []


def test_joints_and_limbs_look_as_in_the_original():
    joints, skeleton = shown(people({7: UPRIGHT}), MarkerParams())
    assert (joints.ns, joints.id, joints.action, joints.kind) == ('joints', 7, 'add', 'sphere_list')
    assert (joints.scale, joints.rgba, joints.lifetime) == (0.05, (1, 0, 0, 1), 0.15)
    np.testing.assert_allclose(joints.points, [UPRIGHT[joint] for joint in COCO_18.joints if joint in UPRIGHT])
    assert (skeleton.ns, skeleton.id, skeleton.action, skeleton.kind) == ('skeleton', 7, 'add', 'line_list')
    assert (skeleton.scale, skeleton.rgba, skeleton.lifetime) == (0.03, (0, 0, 1, 1), 0.15)


def test_inferred_joints_and_their_limbs_are_apart_and_paler():
    markers = shown(people({7: UPRIGHT}, inferred=['left_hip', 'nose']), MarkerParams(dash_length=0.0))
    assert names(markers) == [('add', 'joints', 7), ('add', 'joints_inferred', 7), ('add', 'skeleton', 7),
                              ('add', 'skeleton_inferred', 7)]
    assert LIMB_NAMESPACES == ('skeleton', 'skeleton_inferred')
    joints, inferred, skeleton, guessed = markers
    np.testing.assert_allclose(joints.points, [UPRIGHT[joint] for joint in COCO_18.joints
                                               if joint in set(UPRIGHT) - {'left_hip', 'nose'}])
    assert (inferred.kind, inferred.scale, inferred.rgba, inferred.lifetime) == (
        'sphere_list', 0.05, (1, 0.6, 0.6, 0.6), 0.15)
    np.testing.assert_allclose(inferred.points, [UPRIGHT['nose'], UPRIGHT['left_hip']])
    seen = [('neck', 'right_shoulder'), ('neck', 'left_shoulder'), ('neck', 'right_hip')]
    np.testing.assert_allclose(skeleton.points, [UPRIGHT[joint] for limb in seen for joint in limb])
    assert (guessed.kind, guessed.scale, guessed.rgba, guessed.lifetime) == (
        'line_list', 0.03, (0.6, 0.6, 1, 0.6), 0.15)
    np.testing.assert_allclose(guessed.points, [UPRIGHT[joint] for joint in ('neck', 'left_hip', 'neck', 'nose')])


# Ends of the dashes of a limb from z = 1 m on; dashes and gaps of one limb have one length.
@pytest.mark.parametrize('dash, length, ends', [
    (0.0, 0.5, [0, 0.5]),
    (0.1, 0.15, [0, 0.15]),
    (0.1, 0.5, [0, 0.1, 0.2, 0.3, 0.4, 0.5]),
    (0.1, 0.65, [0, 0.65 / 7, 0.65 * 2 / 7, 0.65 * 3 / 7, 0.65 * 4 / 7, 0.65 * 5 / 7, 0.65 * 6 / 7, 0.65]),
    (0.1, 0.0, [0, 0]),
], ids=['solid', 'too short', 'as long as said', 'fitted', 'no length'])
def test_dashes_begin_and_end_at_the_joints(dash, length, ends):
    arm = {'right_elbow': (0.3, -0.2, 1), 'right_wrist': (0.3, -0.2, 1 + length)}
    markers = shown(people({0: arm}, inferred=['right_wrist']), MarkerParams(dash_length=dash))
    expected = [(0.3, -0.2, 1 + end) for end in ends]
    np.testing.assert_allclose(of(markers, 'skeleton_inferred').points, expected, atol=1e-6)


def test_spheres_of_sigma_in_sizes():
    # 40 mm and 55 mm round to 40 and 57 mm, 5 m to the largest; the neck's is unknown
    sigma = {'nose': 0.001, 'right_shoulder': 0.04, 'left_shoulder': 0.055, 'right_hip': 0.04, 'left_hip': 5.0}
    persons = people({2: UPRIGHT}, inferred=['right_hip'], sigma=sigma)
    assert not [marker for marker in shown(persons, MarkerParams()) if marker.ns == 'sigma']
    markers = [marker for marker in shown(persons, MarkerParams(sigma_spheres=True))
               if marker.ns == 'sigma']
    assert [marker.id for marker in markers] == [32 + 0, 32 + 4, 32 + 5, 32 + 15]
    np.testing.assert_allclose([marker.scale for marker in markers],
                               [0.02, 0.08, 0.08 * np.sqrt(2), 0.02 * 2 ** 7.5])
    for marker, joints in zip(markers, (['nose'], ['right_shoulder', 'right_hip'], ['left_shoulder'], ['left_hip'])):
        assert (marker.kind, marker.rgba, marker.lifetime) == ('sphere_list', (1, 1, 0, 0.25), 0.15)
        np.testing.assert_allclose(marker.points, [UPRIGHT[joint] for joint in joints])


def test_markers_of_people_who_left_are_deleted_once():
    tracker = PeopleMarkers(MarkerParams())
    assert names(tracker.update(people({1: UPRIGHT, 2: UPRIGHT}), 0.0, 'camera')) == [
        ('add', 'joints', 1), ('add', 'skeleton', 1), ('add', 'joints', 2), ('add', 'skeleton', 2)]
    # 1 leaves; of 2 one joint remains
    assert names(tracker.update(people({2: {'nose': (0, 0, 1)}}), 0.1, 'camera')) == [
        ('delete', 'joints', 1), ('delete', 'skeleton', 1), ('delete', 'skeleton', 2), ('add', 'joints', 2)]
    # 2 is seen in the image, but has no position: no empty list, which RViz complains about
    assert names(tracker.update(people({2: {}}), 0.2, 'camera')) == [('delete', 'joints', 2)]
    assert tracker.update(people({}), 0.3, 'camera') == []
    assert names(tracker.update(people({1: {'nose': (0, 0, 1)}}), 0.4, 'camera')) == [('add', 'joints', 1)]


def path_of(tracker, x, stamp, frame_id='camera', person=1):
    """Return the trail on the x axis after a frame with the person at x."""
    moved = {joint: np.add(place, (x, 0, 0)) for joint, place in UPRIGHT.items()}
    trail = [marker for marker in tracker.update(people({person: moved}), stamp, frame_id)
             if (marker.action, marker.ns, marker.id) == ('add', 'trail', person)]
    if not trail:
        return []
    points = trail[0].points
    np.testing.assert_array_equal(points[1:-1:2], points[2::2])  # each line begins where the one before ends
    return np.round([*points[::2, 0], points[-1, 0]], 4).tolist()


@pytest.mark.parametrize('seconds, frames, expected', [
    (0.0, [(0.0, 0.0), (0.1, 0.1)], []),
    (0.5, [(0.25 * i, 0.125 * i) for i in range(8)], [1, 1.25, 1.5, 1.75]),
    (1.0, [(0.0, 0.0), (0.25, 0.25), (0.75, 0.75)], [0, 0.25, 0.75]),
    (5.0, [(0.0, 100.0), (0.5, 100.1), (7.0, 90.0), (7.5, 90.1)], [7, 7.5]),
    (5.0, [(0.0, 100.0), (0.5, 100.1), (7.0, 100.2, 'map'), (7.5, 100.3, 'map')], [7, 7.5]),
    (5.0, [(0.0, 0.0), (0.5, 0.1), (9.0, 0.2, 'camera', 2), (9.5, 0.3, 'camera', 2)], [9, 9.5]),
], ids=['off', 'the last seconds', 'all of it', 'stamps jump back', 'another frame', 'another person'])
def test_a_trail_is_the_path_of_one_person_in_the_last_seconds(seconds, frames, expected):
    tracker = PeopleMarkers(MarkerParams(trail_seconds=seconds))
    assert [path_of(tracker, *frame) for frame in frames][-1] == expected


def test_one_colour_per_person():
    persons = people(dict.fromkeys(range(12), UPRIGHT))
    markers = shown(persons, MarkerParams(colour_by_person=True))
    colours = {person: {marker.rgba for marker in markers if marker.id == person} for person in range(12)}
    assert all(len(own) == 1 for own in colours.values())
    assert len(set.union(*colours.values())) == 12
    again = shown(people({5: UPRIGHT}), MarkerParams(colour_by_person=True))
    assert again[0].rgba in colours[5]


# Optical frame, an upright world frame (x right, y ahead, z up), and a person who stands on the head.
@pytest.mark.parametrize('turn', [np.eye(3), [[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.diag([-1, -1, 1])],
                         ids=['optical frame', 'world frame', 'upside down'])
def test_the_label_stands_above_the_head_in_any_frame(turn):
    turned = {joint: np.dot(turn, position) for joint, position in UPRIGHT.items()}
    label = shown(people({31: turned}), MarkerParams(label=True))[-1]
    assert (label.ns, label.id, label.kind, label.text) == ('label', 31, 'text', '31')
    np.testing.assert_allclose(label.points, [np.dot(turn, (0, -0.6 - 0.3, 2.9))], atol=1e-6)
    hidden = shown(people({31: turned}, inferred=list(UPRIGHT)), MarkerParams(label=True))
    assert of(hidden, 'label').text == '31 (hidden)'


@pytest.mark.parametrize('rate, expected', [(30, 0.15), (15, 0.2), (5, 0.6)])
def test_the_lifetime_covers_three_frames(rate, expected):
    markers = PeopleMarkers(MarkerParams())
    lifetimes = [markers.update(people({1: UPRIGHT}), 100.0 + i / rate, 'camera')[0].lifetime for i in range(20)]
    assert lifetimes[0] == 0.15 and lifetimes[-1] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize('values', [{'joint_colour': 'red'}, {'joint_colour': '1 0 0'}, {'skeleton_colour': '0 0 2 1'},
                                    {'skeleton_colour': '0 0 nan 1'}, {'joint_inferred_colour': '1 1 1'},
                                    {'skeleton_inferred_colour': '1 1 1 -1'}, {'sigma_colour': ''},
                                    {'joint_scale': 0.0}, {'lifetime': 0.0}, {'label': 1}, {'dash_length': -0.1},
                                    {'trail_seconds': -1.0}, {'trail_seconds': 61.0}], ids=str)
def test_bad_parameters_are_refused_by_name(values):
    (key, value), = values.items()
    with pytest.raises(ParameterError, match=f"parameter '{key}' = {value!r}"):
        MarkerParams(**values)
