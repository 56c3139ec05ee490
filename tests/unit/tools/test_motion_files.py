"""People as TRC and BVH files, whose joints come back where they were, and joint angles of poses with known angles."""
import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from animated_skeleton import CROSS_LEGGED, RUNNING, SITTING, STANDING, held, joints_of
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.mocap.files import read_mocap
from openpose_ros_tools.motion.angles import ANGLES, joint_angles
from openpose_ros_tools.motion.bvh import bvh_text
from openpose_ros_tools.motion.sampling import sample_people, y_up
from openpose_ros_tools.motion.trc import marker_name, trc_text
from openpose_ros_tools.ros.keypoints import keypoints_to_motion
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter
from openpose_ros_tools.tables.keypoint_table import KeypointTable, PersonRow
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

RATE, FRAMES, BEGIN = 30, 60, 1_600_000_000_000_000_000
Z_UP = np.eye(3)
MOTION = held((0.0, STANDING), (0.6, RUNNING), (1.2, replace(SITTING, facing=120.0, place=(0.5, -0.3))),
              (1.9, CROSS_LEGGED))


def moving(turn=Z_UP, place=(0, 0, 0)):
    """Return the joints of COCO_18 of a moving person, (T, 18, 3) [m]; z up but for the turn."""
    return (np.stack([joints_of(MOTION(number / RATE)) for number in range(FRAMES)]) + np.array(place)) @ turn.T


def table_of(*people, first=0, jitter=0.0, joints=COCO_18.joints):
    """Return people, (T, K, 3) each, with the ids 3, 4 and so on."""
    count = len(people[0])
    positions = np.full((len(people), count, len(MESSAGE_JOINTS), 3), np.nan)
    for number, person in enumerate(people):
        positions[number][:, [MESSAGE_JOINTS.index(joint) for joint in joints]] = person
    times = (np.arange(count) + first) / RATE + jitter * np.random.RandomState(1).uniform(-1, 1, count)
    flat = positions.reshape(-1, len(MESSAGE_JOINTS), 3)
    known = np.isfinite(flat).all(axis=2)
    stamps = BEGIN + np.tile(np.rint(times * 1e9).astype(np.int64), len(people))
    return KeypointTable(stamps, np.full(len(flat), 'world'), np.repeat(3 + np.arange(len(people)), count), flat,
                         known.astype(float), np.where(known, MEASURED, MISSING), np.where(known, 0.02, np.nan))


def sampled(*people, up=None, begin=None, **options):
    """Return the first of the people, sampled."""
    return sample_people(table_of(*people, **options), up=up, begin=begin)[3]


def of(person, joint):
    return person.positions[:, person.names.index(joint)]


# ---- samples


def test_samples_are_where_the_person_was_whatever_the_stamps():
    person = sampled(moving(), jitter=0.004)
    assert (person.rate, person.names) == (pytest.approx(RATE, rel=0.03), COCO_18.joints)
    true = sampled(moving())
    at = np.stack([np.interp(person.times, true.times, path) for path in true.positions.reshape(FRAMES, -1).T], axis=1)
    # against the grid that begins with the first frame, whose stamp is off by up to 4 ms
    assert np.linalg.norm(person.positions - at.reshape(-1, 18, 3), axis=2).max() < 0.05


def test_long_gaps_stay_and_short_ones_are_bridged():
    joints, wrist = moving(), COCO_18.index['left_wrist']
    joints[10:13, wrist] = np.nan
    joints[30:45, wrist] = np.nan
    joints[:, COCO_18.index['nose']] = np.nan
    person = sampled(joints)
    assert np.flatnonzero(np.isnan(of(person, 'left_wrist')[:, 0])).tolist() == list(range(30, 45))
    assert 'nose' not in person.names


def test_people_begin_when_they_came():
    late = np.where(np.arange(FRAMES)[:, None, None] < 20, np.nan, moving(place=(2, 0, 0)))
    table = table_of(moving(), late)
    people = sample_people(table.select(np.isfinite(table.positions[..., 0]).any(axis=1)))
    assert [(round(one.times[0] * RATE), len(one)) for one in people.values()] == [(0, FRAMES), (20, FRAMES - 20)]
    with pytest.raises(BadInputError, match='one frame'):
        sample_people(table_of(moving()[:1]))


# ---- TRC


@pytest.mark.parametrize('hidden', [(), (0,), (17,), (0, 17), range(18)])
def test_trc_is_read_as_it_was_written(tmp_path, hidden):
    """Also by OpenSim where that is installed, else by its rule: a last cell ends with a tab, or is none."""
    joints = moving()
    joints[20:40, list(hidden)] = np.nan
    person = sampled(joints)
    late = replace(person, times=person.times + 15 / RATE)
    path = tmp_path / 'person_3.trc'
    path.write_text(trc_text(late, path.name))
    read = read_mocap(path)
    assert read.names == COCO_18.joints
    np.testing.assert_allclose(read.times, (15 + np.arange(FRAMES)) / RATE, atol=1e-6)
    np.testing.assert_allclose(read.positions, person.positions, atol=1e-6)
    assert np.isnan(read.positions[20:40, list(hidden)]).all()
    lines = path.read_text().splitlines()
    assert lines[5] == '' and lines[2].split('\t')[2:5] == ['60', '18', 'm'] and lines[6].startswith('16\t')
    assert of(read, 'nose')[0, 1] > 1.4  # y is up
    try:
        import opensim
        table = opensim.TimeSeriesTableVec3(str(path))
        assert (table.getNumRows(), table.getNumColumns()) == (FRAMES, 18)
    except ImportError:
        assert {len(re.findall(r'[^\t]*\t|[^\t]+$', line)) for line in lines[3:5] + lines[6:]} == {2 + 3 * 18}


# ---- BVH


def bvh_positions(text):
    """Return the places of all joints and ends (T, 3) [cm] by forward kinematics, by names; ends as NAME end."""
    header, motion = text.split('MOTION\n')
    frames, step, *lines = motion.strip().split('\n')
    values = np.array([line.split() for line in lines], float)
    assert frames == f'Frames: {len(values)}' and re.fullmatch(r'Frame Time: 0\.0333\d+', step)
    at, turns, stack, column, places = {}, {}, [], 0, {}
    for line in header.split('\n')[1:]:
        words = line.split()
        if words[:1] in (['ROOT'], ['JOINT']):
            stack.append(words[1])
        elif words[:1] == ['End']:
            stack.append(f'{stack[-1]} end')
        elif words[:1] == ['OFFSET']:
            at[stack[-1]] = np.array(words[1:], float)
        elif words[:1] == ['CHANNELS']:
            name, channels = stack[-1], words[2:]
            assert channels[-3:] == ['Zrotation', 'Xrotation', 'Yrotation'] and len(channels) == int(words[1])
            here = values[:, column:column + len(channels)]
            column += len(channels)
            local = Rotation.from_euler('ZXY', here[:, -3:], degrees=True)
            if len(stack) == 1:
                turns[name], places[name] = local, here[:, :3] + at[name]
            else:
                turns[name] = turns[stack[-2]] * local
        if words[:1] == ['OFFSET'] and len(stack) > 1:
            places[stack[-1]] = places[stack[-2]] + turns[stack[-2]].apply(at[stack[-1]])
        elif words == ['}']:
            stack.pop()
    assert column == values.shape[1] and not stack
    return places


JOINTS_OF_BVH = {'LeftUpLeg': 'left_hip', 'LeftLeg': 'left_knee', 'LeftLeg end': 'left_ankle', 'Neck': 'neck',
                 'RightUpLeg': 'right_hip', 'RightLeg': 'right_knee', 'RightLeg end': 'right_ankle',
                 'LeftArm': 'left_shoulder', 'LeftForeArm': 'left_elbow', 'LeftForeArm end': 'left_wrist',
                 'RightArm': 'right_shoulder', 'RightForeArm': 'right_elbow', 'RightForeArm end': 'right_wrist',
                 'Head end': 'nose'}


@pytest.mark.parametrize('turn', [Z_UP, np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])])
def test_joints_of_a_bvh_are_where_they_were(turn):
    """z up, and the frame of a camera."""
    person = sampled(moving(turn))
    places = bvh_positions(bvh_text(person))
    for name, joint in JOINTS_OF_BVH.items():
        apart = np.linalg.norm(places[name] - 100 * of(person, joint), axis=1)
        assert apart.max() < 0.1, (joint, apart.max())  # 1 mm


def test_a_bvh_stands_up_at_rest_and_faces_z():
    """The rest pose, by its offsets alone; a person who stands still turns its limbs, not its trunk."""
    still = np.stack([joints_of(STANDING)] * 3)
    person = sampled(still, up=(0, 0, 1))
    text = bvh_text(person)
    header, motion = text.split('MOTION\n')
    values = np.array(motion.split('\n')[2].split(), float)
    flat = bvh_positions(f'{header}MOTION\nFrames: 1\nFrame Time: 0.0333333\n{" ".join(["0"] * len(values))}\n')
    assert flat['Head'][0, 1] > flat['Neck'][0, 1] > 30 and flat['LeftLeg end'][0, 1] < -70
    assert flat['LeftForeArm end'][0, 0] > 50 and flat['Head end'][0, 2] > flat['Head'][0, 2] + 5
    # the person looks along x of the room, which is z of the file
    np.testing.assert_allclose(values[3:6], 0, atol=1e-6)
    assert values[1] == pytest.approx(100 * of(person, 'left_hip')[0, 1], abs=1)


def test_missing_joints_are_interpolated_and_bones_that_never_were_left_out():
    joints = moving()
    true = joints.copy()
    for joint in ('left_wrist', 'left_elbow'):
        joints[20:24, COCO_18.index[joint]] = np.nan
    joints[:, COCO_18.index['right_ankle']] = np.nan
    joints[:5, COCO_18.index['neck']] = np.nan
    person = sampled(joints)
    places = bvh_positions(bvh_text(person))
    assert not [name for name in places if name.startswith('RightLeg')] and 'RightUpLeg end' in places
    wrist = 100 * (true @ y_up(np.array([0, 0, 1.0])).T)[:, COCO_18.index['left_wrist']]
    apart = np.linalg.norm(places['LeftForeArm end'] - wrist, axis=1)
    assert np.delete(apart, range(20, 24)).max() < 2 and apart.max() < 15
    joints[:, COCO_18.index['left_hip']] = np.nan
    with pytest.raises(BadInputError, match='no hips or no neck'):
        bvh_text(sampled(joints))


def test_opposite_directions_have_a_rotation():
    """An upper arm that points to the other side, against its direction at rest."""
    standing = joints_of(STANDING)
    left, right = (standing[COCO_18.index[f'{side}_shoulder']] for side in ('left', 'right'))
    standing[COCO_18.index['left_elbow']] = left + 0.8 * (right - left)
    person = sampled(np.stack([standing] * 2), up=(0, 0, 1))
    places = bvh_positions(bvh_text(person))
    for name, joint in JOINTS_OF_BVH.items():
        np.testing.assert_allclose(places[name], 100 * of(person, joint), atol=0.1)


# ---- angles


def about(axis, degrees):
    return Rotation.from_rotvec(np.radians(degrees) * np.eye(3)['xyz'.index(axis)]).apply(np.eye(3)).T


def posed(known):
    """Return the joints of BODY_25 of a body with known angles, by rotations of the ISB's joint coordinate systems.

    x forward, y up, z to the right; right sides turn about z (flexion), then x (adduction), left ones mirrored.
    """
    at = {'neck': np.array([0, 0.5, 0]), 'mid_hip': np.zeros(3)}
    head = about('x', known['neck_bending']) @ about('z', -known['neck_flexion'])
    at['ears'] = at['neck'] + head @ [0, 0.2, 0]
    face = about('y', known['neck_rotation']) @ [0.1, 0.02, 0]
    at['nose'] = at['ears'] + face
    for side, right in (('right', 1), ('left', -1)):
        def turn(flexion, adduction, right=right):
            return about('z', flexion) @ about('x', right * adduction)

        own = {name[len(side) + 1:]: value for name, value in known.items() if name.startswith(side)}
        at[f'{side}_ear'] = at['ears'] + np.array([0, 0, right * 0.07])
        at[f'{side}_eye'] = at['nose'] + np.array([0, 0.03, right * 0.03])
        at[f'{side}_hip'] = np.array([0, 0, right * 0.1])
        thigh = turn(own['hip_flexion'], own['hip_adduction'])
        at[f'{side}_knee'] = at[f'{side}_hip'] + thigh @ [0, -0.4, 0]
        shank = thigh @ about('z', -own['knee_flexion'])
        at[f'{side}_ankle'] = at[f'{side}_knee'] + shank @ [0, -0.4, 0]
        foot = shank @ about('z', own['ankle_dorsiflexion'])
        at[f'{side}_heel'] = at[f'{side}_ankle'] + foot @ [-0.05, -0.05, 0]
        at[f'{side}_big_toe'] = at[f'{side}_heel'] + foot @ [0.2, 0, 0]
        at[f'{side}_small_toe'] = at[f'{side}_big_toe']
        at[f'{side}_shoulder'] = at['neck'] + np.array([0, -0.02, right * 0.18])
        # about y from sidewards to forward, then raised
        plane = about('y', right * own['shoulder_plane']) @ about('x', -right * own['shoulder_elevation'])
        at[f'{side}_elbow'] = at[f'{side}_shoulder'] + plane @ [0, -0.3, 0]
        at[f'{side}_wrist'] = at[f'{side}_elbow'] + plane @ about('z', own['elbow_flexion']) @ [0, -0.25, 0]
    return np.array([at[joint] for joint in BODY_25.joints])


def random_angles(random):
    ranges = {'hip_flexion': (-30, 110), 'hip_adduction': (-40, 25), 'knee_flexion': (0, 140),
              'ankle_dorsiflexion': (-40, 25), 'shoulder_elevation': (25, 155), 'shoulder_plane': (-60, 120),
              'elbow_flexion': (0, 140), 'neck_flexion': (-30, 40), 'neck_bending': (0, 0), 'neck_rotation': (-60, 60)}
    return {name: random.uniform(*ranges[name.replace('right_', '').replace('left_', '')]) for name in ANGLES}


def test_angles_of_known_poses():
    random = np.random.RandomState(3)
    for _ in range(50):
        known = random_angles(random)
        turn = Rotation.from_rotvec(random.normal(size=3)).apply(np.eye(3)).T
        found = joint_angles(BODY_25.joints, (1.7 * posed(known) @ turn.T + random.normal(size=3))[np.newaxis])
        assert {name: float(value[0]) for name, value in found.items()} == pytest.approx(known, abs=1e-3)


@pytest.mark.parametrize('angle, value, joint, axis, sign', [
    ('left_hip_flexion', 30, 'left_knee', 0, 1), ('right_shoulder_elevation', 90, 'right_elbow', 2, 1),
    ('neck_rotation', 40, 'nose', 2, -1), ('neck_bending', 10, 'nose', 2, 1),
    ('right_hip_adduction', -20, 'right_knee', 2, 1)])
def test_signs(angle, value, joint, axis, sign):
    """A person who faces x, y up: leg forward, arm sidewards, head to the left and bent to the right, leg outwards."""
    straight, changed = (posed({**dict.fromkeys(ANGLES, 0.0), angle: degrees}) for degrees in (0.0, value))
    number = BODY_25.index[joint]
    assert sign * (changed - straight)[number, axis] > 0.02
    assert joint_angles(BODY_25.joints, changed[np.newaxis])[angle][0] == pytest.approx(value, abs=0.01)


def test_angles_of_missing_joints_are_missing():
    joints = posed(random_angles(np.random.RandomState(1)))[np.newaxis].repeat(2, axis=0)
    joints[1, BODY_25.index['left_knee']] = np.nan
    found = joint_angles(BODY_25.joints, joints)
    missing = {name for name in ANGLES if np.isnan(found[name][1])}
    assert missing == {'left_hip_flexion', 'left_hip_adduction', 'left_knee_flexion', 'left_ankle_dorsiflexion'}
    hanging = joint_angles(BODY_25.joints, posed(dict.fromkeys(ANGLES, 0.0))[np.newaxis])
    assert np.isnan(hanging['left_shoulder_plane'][0]) and hanging['left_shoulder_elevation'][0] == pytest.approx(0)
    without_feet = joint_angles(COCO_18.joints, joints_of(STANDING)[np.newaxis])
    assert np.isnan(without_feet['left_ankle_dorsiflexion'][0]) and abs(without_feet['left_knee_flexion'][0]) < 10


# ---- the programs


@pytest.fixture
def poses(tmp_path):
    """A table of two people; the second has inferred wrists, and no neck."""
    tables = table_of(moving(), moving(place=(1, 0, 0)))
    status = tables.status.copy()
    wrists = [MESSAGE_JOINTS.index(f'{side}_wrist') for side in ('left', 'right')]
    status[FRAMES:, wrists] = INFERRED
    positions = tables.positions.copy()
    positions[FRAMES:, MESSAGE_JOINTS.index('neck')] = np.nan
    parts = np.concatenate([positions, np.stack([tables.confidence, status, tables.sigma], axis=2)], axis=2)
    order = np.argsort(tables.stamps, kind='stable')
    with (tmp_path / 'poses.csv').open('w') as handle:
        KeypointCsvWriter(handle, 'extended', 3).write([
            PersonRow(int(tables.stamps[row]), 0, int(tables.stamps[row]), 'world', 2, int(tables.ids[row]), parts[row])
            for row in order])
    return tmp_path / 'poses.csv'


def test_a_file_for_each_person(poses, tmp_path, capsys):
    out = tmp_path / 'out'
    assert keypoints_to_motion.trc([str(poses), '-o', str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {'person_3.trc', 'person_4.trc'}
    # those of Pose2Sim's OpenSim_Setup/Markers_Body25.xml
    assert {'Nose', 'RWrist', 'LBigToe', 'CHip'} <= {*map(marker_name, BODY_25.joints)}
    assert 'RWrist' in read_mocap(out / 'person_4.trc').names
    assert keypoints_to_motion.trc([str(poses), '-o', str(out)]) == 2
    assert 'person_3.trc is there already' in capsys.readouterr().err
    (out / 'person_9.trc').write_text('of a former export')
    assert keypoints_to_motion.trc([str(poses), '-o', str(out), '--overwrite', '--measured']) == 0
    assert {path.name for path in out.iterdir()} == {'person_3.trc', 'person_4.trc'}
    assert 'RWrist' not in read_mocap(out / 'person_4.trc').names
    capsys.readouterr()
    assert keypoints_to_motion.bvh([str(poses), '-o', str(tmp_path / 'bvh')]) == 0
    assert [path.name for path in (tmp_path / 'bvh').iterdir()] == ['person_3.bvh']
    assert 'person 4 has no hips or no neck' in capsys.readouterr().err


def test_all_exports_of_a_recording_have_one_clock(poses, tmp_path):
    """Person 4 comes a second after person 3."""
    head, *rows = poses.read_text().splitlines()
    late = [row for row in rows if row.split(',')[5] == '3' or int(row.split(',')[0]) >= BEGIN + 10 ** 9]
    poses.write_text('\n'.join([head, *late]) + '\n')
    assert keypoints_to_motion.trc([str(poses), '-o', str(tmp_path)]) == 0
    assert read_mocap(tmp_path / 'person_4.trc').times[0] == pytest.approx(1)


def test_a_bvh_rests_until_the_person_comes():
    person = sampled(moving(), begin=BEGIN - 2 * 10 ** 9)
    places = bvh_positions(bvh_text(person))
    assert person.times[0] == 2 and len(places['Neck']) == FRAMES + 2 * RATE
    np.testing.assert_allclose(places['Neck'][2 * RATE:], 100 * of(person, 'neck'), atol=0.1)
    assert np.ptp(places['LeftForeArm end'][:2 * RATE], axis=0).max() == 0


@pytest.mark.parametrize('order, is_refused', [
    (lambda rows: rows + rows[::2], True),
    (lambda rows: rows + [','.join([*row.split(',')[:5], '9', *row.split(',')[6:]]) for row in rows], True),
    (lambda rows: sorted(rows, key=lambda row: row.split(',')[5]), False)])
def test_time_that_runs_back_is_refused(poses, tmp_path, capsys, order, is_refused):
    """Two recordings in one table; one that is sorted by people is fine."""
    head, *rows = poses.read_text().splitlines()
    poses.write_text('\n'.join([head, *order(rows)]) + '\n')
    assert keypoints_to_motion.angles([str(poses), '-o', str(tmp_path / 'angles.csv')]) == 2 * is_refused
    assert ('time runs back by' in capsys.readouterr().err) == is_refused


def test_the_table_of_angles(poses, tmp_path):
    path = tmp_path / 'angles.csv'
    assert keypoints_to_motion.angles([str(poses), '-o', str(path)]) == 0
    rows = list(csv.DictReader(path.open()))
    assert list(rows[0]) == ['time', 'person_ID', *ANGLES] and len(rows) == 2 * FRAMES
    assert [rows[0]['time'], rows[0]['person_ID'], rows[1]['person_ID']] == [str(BEGIN), '3', '4']
    expected = joint_angles(COCO_18.joints, moving())
    knee = [float(row['left_knee_flexion']) for row in rows if row['person_ID'] == '3']
    np.testing.assert_allclose(knee, expected['left_knee_flexion'], atol=0.02)
    assert rows[1]['left_hip_flexion'] == 'nan'
    assert keypoints_to_motion.angles([str(poses), '-o', str(path)]) == 2
