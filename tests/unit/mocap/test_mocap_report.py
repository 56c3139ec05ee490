"""Report and command of the comparison with motion capture."""
import csv
import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest

import truth_as_mocap
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.alignment.alignment import align
from openpose_ros_tools.mocap.evaluation import compare
from openpose_ros_tools.mocap.report import summary, write_report
from openpose_ros_tools.ros.evaluate_mocap import main, transform_of
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter
from openpose_ros_tools.tables.keypoint_table import PersonRow
from simulated_mocap import sequence_truth, simulate

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'


@pytest.fixture(scope='module')
def scene():
    return simulate(sequence_truth(SHIPPED), seed=0)


@pytest.fixture(scope='module')
def found(scene):
    alignment = align(scene.estimate.measured(), scene.reference)
    return alignment, compare(scene.estimate, scene.reference, alignment)


@pytest.fixture(scope='module')
def values(found):
    return summary(found[1], dataclasses.replace(found[0], warnings=('look at <it>',)), {'poses': 'a & b.csv'})


def test_a_report_can_be_read_without_another_file_and_gives_its_transform(found, values, tmp_path):
    write_report(tmp_path, found[1], values)
    place = json.loads((tmp_path / 'summary.json').read_text())['transform']
    rotation, translation = transform_of([*place['translation_m'], *place['quaternion_xyzw']])
    np.testing.assert_allclose(rotation, found[0].rotation, atol=1e-8)
    np.testing.assert_allclose(translation, found[0].translation, atol=1e-8)
    page = (tmp_path / 'report.html').read_text()
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert 'a &amp; b.csv' in page and 'look at &lt;it&gt;' in page
    assert f"{values['overall']['mean_mm']:.1f}" in page and 'Lengths of limbs' in page
    with (tmp_path / 'errors.csv').open() as handle:
        rows = list(csv.DictReader(handle))
    assert len(rows) == np.isfinite(found[1].errors).sum()
    distance = np.linalg.norm([float(rows[7][axis]) - float(rows[7][f'{axis}_reference']) for axis in 'xyz'])
    assert float(rows[7]['error']) == pytest.approx(distance, abs=2e-5)


def test_a_quaternion_of_another_length_is_refused():
    with pytest.raises(ParameterError, match='--transform'):
        transform_of([1, 2, 3, 0, 0, 0, 0])


@pytest.fixture(scope='module')
def files(scene, tmp_path_factory):
    """Poses, and a file of markers, 12.5 s apart."""
    folder = tmp_path_factory.mktemp('files')
    estimate = scene.estimate
    parts = np.dstack([estimate.positions, estimate.confidence, estimate.status, estimate.sigma])
    with (folder / 'poses.csv').open('w') as handle:
        KeypointCsvWriter(handle, 'extended', 3).write(
            [PersonRow(stamp, number, stamp, 'camera', 2, estimate.ids[number], parts[number])
             for number, stamp in enumerate(estimate.stamps)])
    truth_as_mocap.main([str(SHIPPED), str(folder / 'mocap.trc'), '--clock-offset', '12.5'])
    return folder


def test_report(files, tmp_path, capsys):
    (tmp_path / 'report').mkdir()
    (tmp_path / 'report' / 'summary.json').write_text('of another tool')
    command = [str(files / 'poses.csv'), str(files / 'mocap.trc'), '-o', str(tmp_path / 'report')]
    assert main(command) == 2
    assert 'summary.json is there already' in capsys.readouterr().err
    assert main([*command, '--overwrite']) == 0
    out = capsys.readouterr().out
    assert 'all joints' in out and 'report.html' in out
    values = json.loads((tmp_path / 'report' / 'summary.json').read_text())
    assert values['clock']['offset_s'] == pytest.approx(12.5 - 1.6e9, abs=0.005)
    np.testing.assert_allclose(values['transform']['matrix'], np.eye(4), atol=0.02)
    assert values['inputs']['frame of the camera'] == 'camera'
    assert values['inputs']['marker map'] == 'joint_names, chosen by the names of the markers'


@pytest.mark.parametrize('arguments, message', [
    (['none.csv', 'mocap.trc'], 'none.csv'), (['poses.csv', 'mocap.trc', '--markers', 'none.yaml'], 'none.yaml'),
    (['poses.csv', 'mocap.trc', '--topic', '/a'], '--topic'),
    (['poses.csv', 'mocap.trc', '--clock-offset', '0'], 'same time')])
def test_wrong_input_is_told_in_a_line(files, arguments, message, capsys, monkeypatch):
    monkeypatch.chdir(files)
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error and error.count('\n') == 1 and error.startswith('evaluate_mocap: ')
