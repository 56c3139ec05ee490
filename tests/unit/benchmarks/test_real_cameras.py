"""Marked things of the recording of four real cameras."""
import numpy as np

from sections import real_cameras
from skeleton_extract_3d.points.camera import CameraModel


def test_marked_things_are_at_their_pixels_by_poses_that_fit(tmp_path, monkeypatch):
    """A thing that two cameras see at the pixels of its place, and one that the first of them sees 20 px aside."""
    model = CameraModel(1088, 1920, [1000.0, 0, 500, 0, 1000, 1000, 0, 0, 1])
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
