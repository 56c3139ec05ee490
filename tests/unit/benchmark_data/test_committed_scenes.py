"""The scenes of the repository: their truth agrees with itself and with their depth."""
import json
import os
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from development import ROOT
from development.benchmark_data.people.body import COCO18
from development.benchmark_data.rendering.depth_sensors import SENSORS
from development.benchmark_data.truth import BEHIND_FURNITURE, BEHIND_PERSON, BEHIND_SELF, JOINT_THICKNESS, VISIBLE

SCENES = sorted((ROOT / 'development/benchmark_data/scenes').iterdir())
SIGMAS = 4  # of the sensor's noise are allowed beyond the thickness of the body


@pytest.fixture(params=SCENES, ids=lambda folder: folder.name, scope='module')
def scene(request):
    meta, truth = (json.loads((request.param / name).read_text()) for name in ('meta.json', 'gt.json'))
    return request.param, meta, truth['frames']


def joints_of(frames):
    """Yield frame number, (18, 3) joints, (18, 2) pixels and (18,) visibility of each person."""
    for frame in frames:
        for person in frame['people']:
            yield frame['i'], np.array(person['xyz']), np.array(person['uv']), np.array(person['vis'])


def test_there_are_three_small_ones_of_all_sensors():
    size = sum(path.stat().st_size for folder in SCENES for path in folder.rglob('*') if path.is_file())
    assert len(SCENES) == 3 and size < 15e6
    assert {json.loads((folder / 'meta.json').read_text())['sensor'] for folder in SCENES} == {
        'kinect_v2', 'xtion', 'realsense'}


def test_each_frame_has_its_images(scene):
    folder, meta, frames = scene
    assert [frame['i'] for frame in frames] == list(range(40))
    for i in (0, 39):
        size = (meta['height'], meta['width'])
        assert cv2.imread(str(folder / f'rgb/{i:03d}.jpg')).shape == (*size, 3)
        depth = cv2.imread(str(folder / f'depth/{i:03d}.png'), cv2.IMREAD_UNCHANGED)
        assert depth.shape == size and depth.dtype == np.uint16 and 0.5 < (depth > 0).mean() < 1


def test_pixels_are_projected_joints(scene):
    _, meta, frames = scene
    matrix = np.array(meta['K']).reshape(3, 3)
    for _, xyz, uv, _ in joints_of(frames):
        projected = xyz @ matrix.T
        assert np.abs(projected[:, :2] / projected[:, 2:] - uv).max() < 0.1  # of joints rounded to 0.1 mm


def test_depth_at_visible_joints_is_the_body_in_front_of_them(scene):
    """The surface lies before the joint by at most the thickness. A few pixels are lost to noise at edges."""
    folder, meta, frames = scene
    sensor, off, hidden_off = SENSORS[meta['sensor']], [], []
    for i, xyz, uv, vis in joints_of(frames):
        depth = cv2.imread(str(folder / f'depth/{i:03d}.png'), cv2.IMREAD_UNCHANGED) / 1000.0
        shape = np.array(depth.shape[::-1])
        u, v = np.clip(np.rint(uv).astype(int), 0, shape - 1).T
        measured = depth[v, u]
        before, noise = xyz[:, 2] - measured, SIGMAS * sensor.sigma(measured)
        visible = (vis == VISIBLE) & (measured > 0)
        off.extend((before > JOINT_THICKNESS + noise)[visible])
        hidden_off.extend((before < -noise)[np.isin(vis, (BEHIND_PERSON, BEHIND_FURNITURE)) & (measured > 0)])
    assert len(off) > 400 and np.mean(off) < 0.03
    assert np.mean(hidden_off or [0]) < 0.05  # what hides a joint is before it


def test_people_are_partly_hidden_and_on_the_floor(scene):
    _, meta, frames = scene
    vis = np.concatenate([codes for *_, codes in joints_of(frames)])
    assert (vis == VISIBLE).mean() > 0.3
    if meta['kind'] == 'group':
        assert np.isin(vis, (BEHIND_PERSON, BEHIND_FURNITURE)).mean() > 0.05
    assert (vis == BEHIND_SELF).mean() > 0.02
    poses = np.array(meta.get('poses', [meta['T_world_camera']] * len(frames)))
    ankles = [COCO18.index('left_ankle'), COCO18.index('right_ankle')]
    heights = [(poses[i] @ np.c_[xyz, np.ones(18)].T)[2, ankles].min() for i, xyz, _, _ in joints_of(frames)]
    assert np.min(heights) > 0 and np.median(heights) < 0.2  # [m] above the floor


def test_the_renderer_gives_the_same_files(tmp_path):
    """The first frame of the second scene, rendered again; the first one is older than its sensor."""
    python = os.environ.get('RENDER_PYTHON') or str(ROOT / '.venv_render/bin/python3')
    if not Path(python).exists() or not os.environ.get('MH_BASE'):
        pytest.skip('rendering needs .venv_render (./run bench render makes it) and the garments (MH_BASE)')
    command = [str(ROOT / 'run'), 'bench', 'render', 'committed', '--scenes', '2', '--frames', '1', '--jobs', '1',
               '--out', str(tmp_path)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0, done.stdout
    for name in ('rgb/000.jpg', 'depth/000.png'):
        assert (tmp_path / SCENES[1].name / name).read_bytes() == (SCENES[1] / name).read_bytes()
