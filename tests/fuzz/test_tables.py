"""Tables and texts of recordings: any bytes give a table that holds together, or BadInputError."""
import json
from io import StringIO

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fuzzing import mutated, spoiled, survives, written
from mocap_files import MOTIVE, TRC, c3d_file
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from openpose_ros_tools.mocap.files import read_mocap
from openpose_ros_tools.tables.keypoint_csv import LAYOUTS, KeypointCsvWriter, read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import FIELDS, PersonRow
from skeleton_extract_3d.points.rgbd_folder import read_rgbd_folder

JOINTS = len(COCO_18.joints)


def csv_text(layout, dimensions):
    out = StringIO()
    writer = KeypointCsvWriter(out, layout, dimensions)
    for number in range(3):
        parts = np.full((len(MESSAGE_JOINTS), len(FIELDS[dimensions])), 0.5, np.float32)
        writer.write([PersonRow(10 ** 18 + number, number, 10 ** 18 + number, 'camera, left', 1, 7, parts)])
    return out.getvalue().encode()


@given(mutated(*(csv_text(layout, dimensions) for layout in LAYOUTS for dimensions in (2, 3))))
def test_keypoint_csv(tmp_path_factory, content):
    path = written(tmp_path_factory, 'people.csv', content)
    table = survives(read_keypoint_csv, path, size=len(content))
    if table is not None:
        missing = table.status == 0
        assert (np.isnan(table.positions).all(axis=2) == missing).all() and np.isfinite(table.positions[~missing]).all()
        assert not np.isnan(table.confidence).any() and (table.stamps >= 0).all()


@pytest.mark.parametrize('suffix', ['.csv', '.trc', '.c3d'])
@given(st.data())
def test_motion_capture(tmp_path_factory, suffix, data):
    texts = {'.csv': MOTIVE.encode(), '.trc': TRC.encode()}
    good = texts.get(suffix) or c3d_file(tmp_path_factory.getbasetemp() / 'good.c3d').read_bytes()
    content = data.draw(mutated(good))
    path = written(tmp_path_factory, f'walk{suffix}', content)
    found = survives(read_mocap, path, size=len(content))
    if found is not None:
        assert len(found) > 0 and np.isfinite(found.times).all() and (np.diff(found.times) > 0).all()
        seen = np.isfinite(found.positions)
        assert (seen.all(axis=2) == seen.any(axis=2)).all() and not np.isinf(found.positions).any()


TUM = b'# timestamp filename\n1600000000.123456 rgb/1.png\n1600000000.2 rgb/2.png\n'
META = {'K': [[500, 0, 320], [0, 500, 240], [0, 0, 1]], 'width': 640, 'height': 480, 'fps': 30,
        'T_world_camera': np.eye(4).tolist()}


def folder_with(factory, name, content):
    """Return a folder of two images that has a file with this content."""
    folder = written(factory, name, content).parent
    for image in ('rgb/1.png', 'rgb/2.png'):
        written(factory, f'{folder.name}/{image}', b'')
    return folder


@given(mutated(TUM))
def test_image_lists(tmp_path_factory, content):
    folder = folder_with(tmp_path_factory, 'lists/rgb.txt', content)
    found = survives(read_rgbd_folder, folder, size=len(content))
    if found is not None:
        assert all(0 < item.stamp < 2 ** 32 * 10 ** 9 for items in found.streams.values() for item in items)


@given(st.one_of(mutated(json.dumps(META).encode()), spoiled(META).map(lambda values: json.dumps(values).encode())))
@example(json.dumps({**META, 'T_world_camera': [[10 ** 400] * 4] * 4}).encode())
@example(json.dumps({**META, 'depth_scale': 10 ** 400}).encode())
@example(json.dumps({**META, 'fps': 5e-324}).encode())
def test_rendered_description(tmp_path_factory, content):
    survives(read_rgbd_folder, folder_with(tmp_path_factory, 'rendered/meta.json', content), size=len(content))
