"""Marker maps: values by hand, subjects by prefix, the shipped maps and the choice among them, what may be wrong."""
import logging

import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS, mirrored_joint
from openpose_ros_tools.mocap.files import MarkerRecording
from openpose_ros_tools.mocap.joints import chosen_map, joints_of
from openpose_ros_tools.mocap.marker_map import read_marker_map

MAPS = ('joint_names', 'optitrack_baseline', 'optitrack_biomech', 'plug_in_gait')
# Six joints that need nothing, so that a map of one more is enough for a person.
SIX = ('left_knee', 'right_knee', 'left_ankle', 'right_ankle', 'left_wrist', 'right_wrist')
LEGS = ', '.join(f'{joint}: {joint}' for joint in SIX)

# A person of 1.7 m that stands upright: x to the right, y forwards, z up [m]. Markers of Plug-in Gait.
STANDING = {
    'LSHO': (-0.20, 0.0, 1.45), 'LELB': (-0.25, 0.0, 1.15), 'LWRA': (-0.24, 0.03, 0.9), 'LWRB': (-0.26, -0.03, 0.9),
    'LASI': (-0.12, 0.10, 1.0), 'LPSI': (-0.05, -0.08, 1.0), 'LKNE': (-0.15, 0.0, 0.5), 'LANK': (-0.14, 0.0, 0.1),
    'LHEE': (-0.10, -0.08, 0.05)}
STANDING.update({f'R{name[1:]}': (-x, y, z) for name, (x, y, z) in STANDING.items()})


def recording(markers, frames=2):
    """Return a recording in which markers stay where they are; each (3,), or (frames, 3)."""
    positions = [np.broadcast_to(np.asarray(point, float), (frames, 3)) for point in markers.values()]
    return MarkerRecording(tuple(markers), np.arange(frames) / 100, np.stack(positions, axis=1))


def with_six(markers):
    return recording({**dict.fromkeys(SIX, (9, 9, 9)), **markers})


def marker_map(folder, text):
    path = folder / 'map.yaml'
    path.write_text(text)
    return read_marker_map(path)


def joint(joints, name, subject=0):
    return joints.positions[subject, :, MESSAGE_JOINTS.index(name)]


@pytest.mark.parametrize('rule, expected', [
    ('A', (0, 0, 0)),
    ('[A, B]', (0.5, 1, 0)),
    ('{markers: [A], shift: {metres: 0.1, from: [B], to: [C]}}', (0, 0, 0.1)),
    ('{markers: [A], shift: {metres: -0.5, to: [D, A]}}', (-0.5, 0, 0)),
    ('{joints: [left_knee, right_knee]}', (9, 9, 9)),
    ('{first_of: [none, [A, none], [A, B], A]}', (0.5, 1, 0)),
    ('{first_of: [{joints: [left_knee]}, A]}', (9, 9, 9)),
])
def test_rules_by_hand(tmp_path, rule, expected):
    markers = with_six({'A': (0, 0, 0), 'B': (1, 2, 0), 'C': (1, 2, 7), 'D': (2, 0, 0)})
    joints = joints_of(markers, marker_map(tmp_path, f'joints: {{{LEGS}, nose: {rule}}}'))
    np.testing.assert_allclose(joint(joints, 'nose'), [expected] * 2, atol=1e-12)
    np.testing.assert_allclose(joint(joints, 'left_knee'), 9)
    assert np.isnan(joint(joints, 'neck')).all()


@pytest.mark.parametrize('rule, expected', [
    ('[A, B]', [(np.nan,) * 3, (0.5, 1, 0)]),
    ('{first_of: [A, B]}', [(np.nan,) * 3, (0, 0, 0)]),
    ('{markers: [B], shift: {metres: 1, to: [A]}}', [(np.nan,) * 3, np.array((1, 2, 0)) * (1 - 1 / 5 ** 0.5)]),
])
def test_hidden_markers(tmp_path, rule, expected):
    rule = marker_map(tmp_path, f'joints: {{{LEGS}, nose: {rule}}}')
    joints = joints_of(with_six({'A': [(np.nan,) * 3, (0, 0, 0)], 'B': (1, 2, 0)}), rule)
    np.testing.assert_allclose(joint(joints, 'nose'), expected, atol=1e-12)


def test_plug_in_gait_by_hand():
    joints = joints_of(recording(STANDING), read_marker_map('plug_in_gait'))
    assert joints.subjects == ('subject',)
    np.testing.assert_allclose(joint(joints, 'left_wrist')[0], [-0.25, 0, 0.9])
    np.testing.assert_allclose(joint(joints, 'left_knee')[0], [-0.095, 0, 0.5])
    np.testing.assert_allclose(joint(joints, 'right_ankle')[0], [0.10, 0, 0.1])
    np.testing.assert_allclose(joint(joints, 'right_hip')[0], [0.0865, 0.0469, 0.9171], atol=1e-6)
    np.testing.assert_allclose(joint(joints, 'mid_hip')[0], [0, 0.0469, 0.9171], atol=1e-6)
    down = np.array([0.08, 0.10, -0.45]) / np.linalg.norm([0.08, 0.10, 0.45])
    np.testing.assert_allclose(joint(joints, 'left_shoulder')[0], STANDING['LSHO'] + 0.05 * down)
    shoulders, hips = (joint(joints, f'left_{pair}')[0] + joint(joints, f'right_{pair}')[0]
                       for pair in ('shoulder', 'hip'))
    np.testing.assert_allclose(joint(joints, 'chest')[0], (shoulders + hips) / 4)
    assert np.isnan(joint(joints, 'nose')).all()
    sacrum = {name: point for name, point in STANDING.items() if not name.endswith('PSI')}
    by_sacrum = joints_of(recording({**sacrum, 'SACR': (0, -0.08, 1.0)}), read_marker_map('plug_in_gait'))
    np.testing.assert_allclose(by_sacrum.positions, joints.positions)


@pytest.mark.parametrize('prefixes, subjects', [
    (('Ann_',), ('Ann',)), (('Ann:', 'Ben:'), ('Ann', 'Ben')), (('Skeleton 001_', 'x_y_'), ('Skeleton 001', 'x_y'))])
def test_subjects_by_prefix(prefixes, subjects):
    markers = {prefix + name: np.array(point) + i
               for i, prefix in enumerate(prefixes) for name, point in STANDING.items()}
    joints = joints_of(recording({**markers, 'Unlabeled 12': (0, 0, 0)}), read_marker_map('plug_in_gait'))
    assert joints.subjects == subjects
    for subject in range(len(subjects)):
        np.testing.assert_allclose(joint(joints, 'left_elbow', subject)[0], np.array(STANDING['LELB']) + subject)


@pytest.mark.parametrize('prefix, subject, style', [
    ('', 'subject', str.upper), ('Ann:', 'Ann', str.title), ('p0.', 'p0', lambda joint: joint.title().replace('_', '')),
    # as OpenPose has them
    ('person 2 ', 'person 2',
     lambda joint: joint.replace('left', 'l').replace('right', 'r').title().replace('_', ''))])
def test_joints_in_other_spellings(prefix, subject, style):
    markers = recording({**{prefix + style(name): (i, 0, 0) for i, name in enumerate(MESSAGE_JOINTS)},
                         'Unlabeled 1001': (0, 0, 0)})
    joints = joints_of(markers, chosen_map(markers))
    assert joints.subjects == (subject,)
    np.testing.assert_array_equal(joints.positions[0, 0, :, 0], np.arange(len(MESSAGE_JOINTS)))


def test_props_and_subjects_without_positions_are_left_out(caplog):
    markers = {f'{subject}:{name}': point if subject == 'Ann' else (np.nan,) * 3
               for subject in ('Ann', 'Ben') for name, point in STANDING.items()}
    markers['Dummy:LKNE'] = (0, 0, 0)
    with caplog.at_level(logging.WARNING):
        joints = joints_of(recording(markers), read_marker_map('plug_in_gait'))
    assert joints.subjects == ('Ann',)
    assert "Dummy has only 0 joints by the marker map 'plug_in_gait'" in caplog.text


@pytest.mark.parametrize('name', MAPS)
def test_shipped_maps_are_symmetric_and_chosen_for_their_markers(name):
    one = read_marker_map(name)
    assert {'neck', 'chest', 'mid_hip'} < set(one.rules) <= set(MESSAGE_JOINTS)
    assert {mirrored_joint(joint) for joint in one.rules} == set(one.rules)
    rng = np.random.default_rng(0)
    everything = recording({f'Ann:{marker}': rng.uniform(-1, 1, 3) for marker in one.markers})
    assert chosen_map(everything).name == name
    joints = joints_of(everything, one)
    assert set(np.array(MESSAGE_JOINTS)[np.isfinite(joints.positions[0, 0, :, 0])]) == set(one.rules)


def test_markers_that_no_map_knows_are_named():
    markers = recording({'LELB': (0, 0, 0), 'Foo': (1, 1, 1)})
    with pytest.raises(BadInputError, match=r"'plug_in_gait' gives no person 6 joints: it knows 1 of 2 markers, LELB, "
                       r'Foo. It expects LSHO.*The shipped maps are joint_names, optitrack'):
        joints_of(markers, read_marker_map('plug_in_gait'))


@pytest.mark.parametrize('text, expected', [
    ('', 'expected keys with values, got None'),
    ('joints: {', 'can not be read'),
    ('joint: {nose: A}', 'unknown joint; allowed: description, joints'),
    ('joints: {knee: A}', 'joints: unknown knee; allowed: nose, neck'),
    ('joints: {nose: []}', r'nose: \[\], expected a name or a list of names'),
    ('joints: {nose: {markers: A, joints: B}}', 'unknown joints; allowed: markers, shift'),
    ('joints: {nose: 3}', 'nose: '), ('joints: {nose: {}}', 'nose: expected one of first_of'),
    ('joints: {nose: {markers: A, side: 1}}', 'unknown side; allowed: markers,'),
    ('joints: {neck: {joints: [left_hip]}, left_hip: A}', 'uses left_hip, which is not among the joints above'),
    ('joints: {nose: {markers: A, shift: {metres: 50, to: B}}}', r'shift by metres = 50, expected a number within -1'),
    ('joints: {left_hip: {hip_centre: up, asis: [A, B], psis: [C]}}', 'expected hip_centre left or right'),
    ('joints: {left_hip: {hip_centre: left, asis: [A, B]}}', 'left_hip: None, expected a name'),
])
def test_wrong_maps_are_refused(tmp_path, text, expected):
    with pytest.raises(BadInputError, match=expected):
        marker_map(tmp_path, text)
    with pytest.raises(BadInputError, match=r'no such file, nor a shipped map of this name .joint_names, optitrack'):
        read_marker_map('nothing.yaml')
