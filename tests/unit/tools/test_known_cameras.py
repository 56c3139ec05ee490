"""Calibrations of other programs: rigs and lenses of them project points to where the programs themselves do."""
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from openpose_ros_fusion.rig import read_rig
from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.calibration.known_cameras import read_known_cameras
from openpose_ros_tools.ros.rig_from import main
from skeleton_extract_3d.points.camera import calibrated_camera

RANDOM = np.random.RandomState(7)
# Points of people, 0.3 to 2 m above the middle of a room with z up [m].
POINTS = RANDOM.uniform([-1, -1, 0.3], [1, 1, 2], (40, 3))
SIZE = (1280, 720)


def looking(place, target):
    """Return R, t of OpenCV, x_camera = R x + t, of a camera at a place [m] that looks at another."""
    z = np.subtract(target, place) / np.linalg.norm(np.subtract(target, place))
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    roll = cv2.Rodrigues(np.array([0, 0, 0.1]))[0]
    return roll @ rotation, -roll @ rotation @ place


# Of each camera: R, t in the room, K and D of OpenCV.
CAMERAS = {
    'door': (*looking((3.5, -2.5, 1.9), (0, 0, 1.1)), np.array([[910.0, 0, 633.3], [0, 905.0, 371.2], [0, 0, 1]]),
             np.array([-0.05, 0.14, 0.0006, -0.0007, 0.01])),
    'window': (*looking((-3.0, -2.8, 2.3), (0.2, 0, 1.0)), np.array([[880.0, 0, 655.5], [0, 882.0, 349.9], [0, 0, 1]]),
               np.array([-0.28, 0.09, -0.0002, 0.0004, 0.0])),
    'shelf': (*looking((0.3, 4.1, 1.2), (0, 0.1, 1.2)), np.array([[1400.0, 0, 640.0], [0, 1400.0, 360.0], [0, 0, 1]]),
              np.zeros(5))}


def seen(camera):
    rotation, translation, matrix, distortion = CAMERAS[camera]
    return cv2.projectPoints(POINTS, cv2.Rodrigues(rotation)[0], translation, matrix, distortion)[0][:, 0]


def pixels(folder, name, points=POINTS):
    """Return where the rig and the calibration file of a camera see points of the room."""
    rotation, centre = read_rig(folder / 'rig.yaml').camera(name).pose
    return calibrated_camera(read_calibration(folder / f'{name}.yaml')).project((points - centre) @ rotation)


def made(folder, *arguments):
    """Run the command, on files in a folder, into its subfolder; return this."""
    words = [str(folder / word) if (folder / word).is_file() else word for word in arguments]
    assert main([*words, '-o', str(folder / 'made/rig.yaml')]) == 0
    return folder / 'made'


def check(folder, names, points=POINTS):
    for name in names:
        apart = np.linalg.norm(pixels(folder, name, points) - seen(name), axis=1)
        assert len(apart) == len(POINTS) and apart.max() < 0.01, (name, apart.max())


def opencv_file(path, **matrices):
    """Write values as OpenCV does."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in matrices.items():
        storage.write(key, value)
    storage.release()


# ---- the formats


def pose2sim_text(fisheye=False, distortions=4):
    text = ''
    for name, (rotation, translation, matrix, distortion) in CAMERAS.items():
        text += (f'[cam_{name}]\nname = "{name}"\nsize = [ {SIZE[0]}.0, {SIZE[1]}.0]\nmatrix = {matrix.tolist()}\n'
                 f'distortions = {distortion[:distortions].tolist()}\n'
                 f'rotation = {cv2.Rodrigues(rotation)[0].ravel().tolist()}\ntranslation = {translation.tolist()}\n'
                 f'fisheye = {str(fisheye).lower()}\n\n')
    return text + '[metadata]\nadjusted = false\nerror = 0.0\n'


@pytest.mark.parametrize('absent', ['tomllib', pytest.param('toml', marks=pytest.mark.skipif(
    sys.version_info < (3, 11), reason='Python has tomllib from 3.11 on'))])
def test_pose2sim(tmp_path, monkeypatch, absent):
    """By the library of Python, and by the one for Python before 3.11."""
    monkeypatch.setitem(sys.modules, absent, None)
    monkeypatch.setitem(CAMERAS, 'door', (*CAMERAS['door'][:3], np.array([-0.05, 0.14, 0.0006, -0.0007])))
    (tmp_path / 'Calib.toml').write_text(pose2sim_text())
    folder = made(tmp_path, 'Calib.toml')
    check(folder, CAMERAS)
    assert read_rig(folder / 'rig.yaml').camera('shelf').frame_id == 'shelf_rgb_optical_frame'
    np.testing.assert_allclose(read_rig(folder / 'rig.yaml').camera('door').translation, (3.5, -2.5, 1.9), atol=1e-9)
    assert read_calibration(folder / 'door.yaml').image_size == SIZE


def test_a_fisheye_of_pose2sim(tmp_path, monkeypatch):
    for name, camera in CAMERAS.items():
        monkeypatch.setitem(CAMERAS, name, (*camera[:3], np.array([-0.03, 0.01, -0.004, 0.001])))
    (tmp_path / 'Calib.toml').write_text(pose2sim_text(fisheye=True))
    folder = made(tmp_path, 'Calib.toml')
    for name, (rotation, translation, matrix, distortion) in CAMERAS.items():
        expected = cv2.fisheye.projectPoints(POINTS[:, None], cv2.Rodrigues(rotation)[0], translation, matrix,
                                             distortion[:4])[0][:, 0]
        np.testing.assert_allclose(pixels(folder, name), expected, atol=0.01)


def qualisys_text(left=0, top=0):
    """As QTM writes it: axes of the camera right, up and back as rows, its centre in mm, 1/64 px of the sensor."""
    cameras = ''
    for name, (rotation, translation, matrix, distortion) in CAMERAS.items():
        axes, centre = np.diag([1, -1, -1]) @ rotation, -1000 * rotation.T @ translation
        place = ' '.join(f'r{i + 1}{j + 1}="{axes[i, j]:.15f}"' for i in range(3) for j in range(3))
        k1, k2, p1, p2, k3 = distortion
        cameras += (
            f'<camera active="1" avg-residual="0.4" serial="{name}" model="Miqus Video" viewrotation="0">'
            f'<fov_marker left="0" top="0" right="1919" bottom="1079"/>'
            f'<fov_video left="{left}" top="{top}" right="{left + SIZE[0] - 1}" bottom="{top + SIZE[1] - 1}"/>'
            f'<transform x="{centre[0]}" y="{centre[1]}" z="{centre[2]}" {place}/>'
            f'<intrinsic focallength="9.3" sensorMinU="0" sensorMaxU="122816" sensorMinV="0" sensorMaxV="69056" '
            f'focalLengthU="{64 * matrix[0, 0]}" focalLengthV="{64 * matrix[1, 1]}" '
            f'centerPointU="{64 * (matrix[0, 2] + left)}" centerPointV="{64 * (matrix[1, 2] + top)}" skew="0.0" '
            f'radialDistortion1="{k1}" radialDistortion2="{k2}" radialDistortion3="{k3}" '
            f'tangentalDistortion1="{p1}" tangentalDistortion2="{p2}"/></camera>\n')
    return f'<?xml version="1.0"?>\n<calibration source="a.qca.txt"><cameras>{cameras}</cameras></calibration>\n'


@pytest.mark.parametrize('crop', [(0, 0), (320, 180)])
def test_qualisys(tmp_path, crop):
    (tmp_path / 'room.qca.txt').write_text(qualisys_text(*crop))
    check(made(tmp_path, 'room.qca.txt'), CAMERAS)


def test_qualisys_is_read_as_pose2sim_reads_it(tmp_path):
    """Camera cam01 of its demo (perfanalytics/pose2sim, Calib.qca.txt and the Calib_qualisys.toml made of it)."""
    row = {'r11': 0.5536380477336265, 'r12': 0.8046719867383512, 'r13': 0.2144479094331626,
           'r21': -0.4345300743838753, 'r22': 0.05946489349975602, 'r23': 0.8986921279821063,
           'r31': 0.7104002579937896, 'r32': -0.5907342212870501, 'r33': 0.3825762057979294,
           'x': 1460.2323709212087, 'y': -1909.1590482454608, 'z': 1896.5058524092062}
    transform = ' '.join(f'{key}="{value}"' for key, value in row.items())
    start = qualisys_text().split('<camera ', 2)
    text = f'{start[0]}<camera {start[1]}</cameras></calibration>'
    begin, end = text.index('<transform'), text.index('<intrinsic')
    (tmp_path / 'demo.qca.txt').write_text(f'{text[:begin]}<transform {transform}/>{text[end:]}')
    camera, = read_known_cameras([tmp_path / 'demo.qca.txt']).cameras
    np.testing.assert_allclose(cv2.Rodrigues(camera.rotation)[0].T, [[1.68827548, 1.04832205, -0.41955852]], atol=1e-7)
    np.testing.assert_allclose(camera.translation / 1000, [0.32110489, 0.95633206, 2.89071305], atol=1e-7)


@pytest.mark.parametrize('resolution, scale', [('1080p', 1), ('720p', 2 / 3), ('N/A', 1)])
def test_a_resolution_of_qualisys_scales_image_and_lens(tmp_path, resolution, scale):
    """As Pose2Sim reads it: pixels of the file are those of 1080 rows."""
    text = qualisys_text().replace('<camera ', f'<camera video_resolution="{resolution}" ')
    (tmp_path / 'a.qca.txt').write_text(text)
    found = read_known_cameras([tmp_path / 'a.qca.txt']).cameras[0].calibration
    assert found.image_size == tuple(round(scale * side) for side in SIZE)
    np.testing.assert_allclose(np.reshape(found.matrix, (3, 3)), np.diag([scale, scale, 1]) @ CAMERAS['door'][2])


@pytest.mark.parametrize('vector', [False, True])
def test_a_file_of_each_camera(tmp_path, vector):
    """Boards in millimetres; rotations as matrices or vectors."""
    for name, (rotation, translation, matrix, distortion) in CAMERAS.items():
        place = ({'rvec': cv2.Rodrigues(rotation)[0], 'tvec': 1000 * translation} if vector else
                 {'R': rotation, 'T': 1000 * translation})
        opencv_file(tmp_path / f'{name}.yml', image_width=SIZE[0], image_height=SIZE[1], camera_matrix=matrix,
                    distortion_coefficients=distortion.reshape(5, 1), **place)
    check(made(tmp_path, *(f'{name}.yml' for name in CAMERAS), '--unit', 'mm'), CAMERAS)


# Formats in the frame of the first camera, here the door's.


def seen_from_the_door():
    rotation, translation = CAMERAS['door'][:2]
    return POINTS @ rotation.T + translation


def test_kalibr(tmp_path):
    chain, before = {}, np.eye(4)
    for number, (rotation, translation, matrix, distortion) in enumerate(CAMERAS.values()):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, translation
        chain[f'cam{number}'] = {
            'cam_overlaps': [], 'camera_model': 'pinhole', 'distortion_model': 'radtan',
            'distortion_coeffs': distortion[:4].tolist(), 'resolution': list(SIZE),
            'intrinsics': matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(),
            'timeshift_cam_imu': 0.01 + 0.02 * number,
            **({'T_cn_cnm1': (pose @ np.linalg.inv(before)).tolist()} if number else {})}
        before = pose
    (tmp_path / 'camchain.yaml').write_text(yaml.safe_dump(chain))
    assert main([str(tmp_path / 'camchain.yaml'), '-o', str(tmp_path / 'rig.yaml')]) == 2  # without --height
    folder = made(tmp_path, 'camchain.yaml', '--cameras', 'door window shelf', '--height', '1.9', '--tilt', '10')
    rig = read_rig(folder / 'rig.yaml')
    assert [camera.clock_offset for camera in rig.cameras] == pytest.approx([0, 0.02, 0.04])
    turn, centre = rig.camera('door').pose
    np.testing.assert_allclose(centre, [0, 0, 1.9], atol=1e-9)
    down, ahead = np.sin(np.radians(10)), np.cos(np.radians(10))
    np.testing.assert_allclose(turn, [[0, -down, ahead], [-1, 0, 0], [0, -ahead, -down]], atol=1e-9)
    for name in CAMERAS:
        rotation, translation, matrix, distortion = CAMERAS[name]
        expected = cv2.projectPoints(POINTS, cv2.Rodrigues(rotation)[0], translation, matrix, distortion[:4])[0][:, 0]
        np.testing.assert_allclose(pixels(folder, name, seen_from_the_door() @ turn.T + centre), expected, atol=0.01)


def test_stereo_of_ros(tmp_path):
    """Two files of camera_calibration, whose R and P cv2.stereoRectify has computed, as that program does."""
    (first, start, m1, d1), (second, end, m2, d2) = (CAMERAS[name] for name in ('door', 'window'))
    rectified = cv2.stereoRectify(m1, d1, m2, d2, SIZE, second @ first.T, end - second @ first.T @ start)
    for name, matrix, distortion, r, p in zip(('door', 'window'), (m1, m2), (d1, d2), rectified[:2], rectified[2:4]):
        (tmp_path / f'{name}.yaml').write_text(yaml.safe_dump({
            'image_width': SIZE[0], 'image_height': SIZE[1], 'camera_name': f'stereo/{name}',
            'distortion_model': 'plumb_bob', **{f'{key}_matrix': {'data': np.ravel(value).tolist()} for key, value in (
                ('camera', matrix), ('rectification', r), ('projection', p))},
            'distortion_coefficients': {'data': distortion.tolist()}}))
    folder = made(tmp_path, 'door.yaml', 'window.yaml', '--cameras', 'door window', '--height', '1.4')
    turn, centre = read_rig(folder / 'rig.yaml').camera('door').pose
    check(folder, ('door', 'window'), seen_from_the_door() @ turn.T + centre)


# ---- what is wrong


def refused(capsys, *arguments):
    assert main([str(argument) for argument in arguments]) == 2
    return capsys.readouterr().err


@pytest.mark.parametrize('options, told', [
    (['--cameras', 'a b'], '2 names, expected 3, of door, window, shelf'), (['--cameras', 'a a b'], "the name 'a'"),
    (['--tilt', '3'], 'this one is in that of a room')])
def test_options_that_do_not_fit(tmp_path, capsys, options, told):
    (tmp_path / 'Calib.toml').write_text(pose2sim_text())
    assert told in refused(capsys, tmp_path / 'Calib.toml', '-o', tmp_path / 'made/rig.yaml', *options)
    assert not (tmp_path / 'made').exists()


@pytest.mark.parametrize('name, text, told', [
    ('a.toml', '', 'no cameras'), ('a.toml', '[cam]\nname = "a"', "KeyError('size')"),
    ('a.toml', pose2sim_text().replace('matrix = [[910.0, 0.0', 'matrix = [[910.0, 3.0'), 'skew of 3'),
    ('a.qca.txt', '<calibration', 'ParseError'),
    ('a.qca.txt', qualisys_text().replace('r11="', 'r11="1'), 'is no rotation'),
    ('a.yaml', '- 3', 'is no calibration'),
    ('a.yaml', 'cam0: {camera_model: omni}', 'cam0 is of the model omni'),
    ('a.yaml', 'cam0: {camera_model: pinhole, distortion_model: fov, intrinsics: [5, 5, 2, 2], resolution: [4, 4], '
               'distortion_coeffs: [1]}', "distortion model 'fov' is unknown"),
    ('a.yaml', '{image_width: 640, image_height: 480, camera_matrix: {data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}}',
     'do not say where all cameras are'), ('a.txt', '\0', 'a.txt'), ('a.yaml', None, 'can not be read')])
def test_what_is_wrong_is_told(tmp_path, name, text, told):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(BadInputError) as error:
        read_known_cameras([Path(tmp_path / name)])
    assert told in str(error.value)
