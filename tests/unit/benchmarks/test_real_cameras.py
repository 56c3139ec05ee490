"""The calibration of the recording of four real cameras is read as Qualisys means it."""
import numpy as np

from sections import real_cameras

# A camera at (0, -3, 1) m that looks along y; r11 r12 r13 is its x axis, r21 r22 r23 is up, r31 r32 r33 backwards.
FILE = '''<calibration><cameras><camera serial="cam01">
<transform r11="1" r12="0" r13="0" r21="0" r22="0" r23="1" r31="0" r32="-1" r33="0" x="0" y="-3000" z="1000"/>
<intrinsic focalLengthU="64000" focalLengthV="64000" centerPointU="32000" centerPointV="64000" radialDistortion1="0"
radialDistortion2="0" tangentalDistortion1="0" tangentalDistortion2="0"/></camera></cameras></calibration>'''


def test_a_point_of_the_room_is_where_the_camera_sees_it(tmp_path, monkeypatch):
    (tmp_path / 'calibration').mkdir()
    (tmp_path / 'calibration/Calib.qca.txt').write_text(FILE)
    monkeypatch.setattr(real_cameras, 'fetch', lambda: tmp_path)
    camera, = real_cameras.cameras()
    rotation, origin = camera.pose
    # 0.3 m to the right of the axis, 0.5 m above it, 2 m away
    pixel = camera.model.project((np.array([[0.3, -1.0, 1.5]]) - origin) @ rotation)
    np.testing.assert_allclose(pixel, [[500 + 150, 1000 - 250]], atol=1e-6)


def test_marked_things_are_at_their_pixels_by_poses_that_fit(tmp_path, monkeypatch):
    """A thing that two cameras see at the pixels of its place, and one that the first of them sees 20 px aside."""
    (tmp_path / 'calibration').mkdir()
    (tmp_path / 'calibration/Calib.qca.txt').write_text(FILE)
    monkeypatch.setattr(real_cameras, 'fetch', lambda: tmp_path)
    model = real_cameras.cameras()[0].model
    turned = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # looks along x
    poses = {'a': (np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([0, -3.0, 1])),
             'b': (turned, np.array([-3.0, 0, 1]))}
    seen = {name: model.project((np.array([[0.2, 0.1, 1.3]]) - pose[1]) @ pose[0])[0] for name, pose in poses.items()}
    for beside, least, most in ((0.0, 0.0, 0.01), (20.0, 5.0, 20.0)):
        monkeypatch.setattr(real_cameras, 'MARKED', ({**seen, 'a': seen['a'] + [0.0, beside]},))
        errors = np.linalg.norm(real_cameras.marked_errors(poses, {'a': model, 'b': model}), axis=1)
        assert len(errors) == 2 and least <= errors.max() <= most
        cameras = [real_cameras.Camera(name, model, pose, tmp_path) for name, pose in poses.items()]
        adjusted = real_cameras.adjusted_poses(cameras)
        rest = np.linalg.norm(real_cameras.marked_errors(adjusted, {'a': model, 'b': model}), axis=1)
        assert rest.max() < 2
        # 1000 px are a focal length: 20 px are 1.1 degrees of one camera, or half of it of each
        turned = [np.degrees(np.arccos(np.clip((np.trace(adjusted[name][0] @ pose[0].T) - 1) / 2, -1, 1)))
                  for name, pose in poses.items()]
        assert max(turned) < (0.01 if beside == 0 else 1.2)
