"""The commands of docs/recordings.md that are marked as runnable do what the page says."""
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv

ROOT = Path(__file__).resolve().parents[3]
PAGE, SEQUENCE = ROOT / 'docs/recordings.md', ROOT / 'skeleton_extract_3d/demo/cross'
TIMEOUT = 300.0  # [s] several times what all commands take


def blocks(kind=''):
    """Return the blocks of code of a kind on the page."""
    return re.findall(rf'^```{kind}\n(.*?)^```$', PAGE.read_text(), re.MULTILINE | re.DOTALL)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Where all commands that are marked as runnable have run, one after the other."""
    place = tmp_path_factory.mktemp('validation')
    for name in ('run', 'examples'):
        (place / name).symlink_to(ROOT / name)
    script = ''.join(blocks('sh')) + f'python3 - <<END\n{blocks("python")[0]}END\n'
    done = subprocess.run(['bash', '-e', '-c', script], cwd=str(place), stdin=subprocess.DEVNULL, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
    return place


def test_the_last_tree_of_the_folder_is_what_the_steps_make(folder):
    tree = [block for block in blocks() if block.startswith('walk/\n')][-1]
    assert sorted(re.findall(r'── ([\w.]+)', tree)) == sorted(path.name for path in (folder / 'walk').iterdir())


def test_every_frame_is_there_and_pictures_are_drawn(folder):
    table = read_keypoint_csv(folder / 'poses.csv')
    stamps = np.unique(table.stamps)
    np.testing.assert_array_equal(stamps, 1_000_000_000_000 + np.round(np.arange(40) / 15 * 1e9).astype(np.int64))
    for picture in ('pictures/detections.png', 'pictures/top_view.png'):
        assert (folder / picture).read_bytes().startswith(b'\x89PNG')
    assert '<table' in (folder / 'report/report.html').read_text()


def test_the_clock_and_the_place_of_the_camera_are_found(folder):
    summary = json.loads((folder / 'report/summary.json').read_text())
    # a quarter of a frame; the bag begins at 1000 s, the reference at 3.7 s
    assert summary['clock']['offset_s'] == pytest.approx(3.7 - 1000, abs=0.25 / 15)
    # what the network errs by alike in all joints is taken for the place: measured joints are 18 mm off in the median
    np.testing.assert_allclose(summary['transform']['translation_m'], [1.0, 2.0, 1.5], atol=0.04)


def test_both_people_are_found_and_measured_joints_are_right(folder):
    summary = json.loads((folder / 'report/summary.json').read_text())
    assert set(summary['subjects']) == {'person1', 'person2'}
    assert summary['compared']['id_switches'] == 0
    # one of them is hidden by the other for a quarter of the time
    assert summary['compared']['share_found'] > 0.85
    assert summary['overall']['measured']['median_mm'] < 30
    assert summary['overall']['measured']['pck_150_of_answered'] > 0.95
