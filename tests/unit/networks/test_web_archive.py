"""Weights at their maker's address: they come whole and right out of the zip file, or an error says what to do."""
import dataclasses
import hashlib
import http.server
import threading

import pytest
from test_weights import names_in, zip_with

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks import weights_install
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import WebSource, WeightsFile
from openpose_ros_pkg.networks.models import weights_path

CONTENT = b'weights of a network' * 1000
MOST, TIMEOUT = 100_000, 0.4
ARCHIVE = zip_with({'20230831/rtmpose_onnx/detail.json': b'{}', '20230831/rtmpose_onnx/end2end.onnx': CONTENT,
                    '../../escaped.txt': b'nothing else is taken'})
# Status, content, whether more was announced, and location, by the first part of the address.
ANSWERS = {
    'whole': (200, ARCHIVE, False, ''), 'moved': (302, b'', False, '/whole/net.zip'),
    'cut': (200, ARCHIVE[:100], True, ''), 'missing': (404, b'', False, ''),
    'page': (200, b'<html>Log in to this network</html>', False, ''),
    'moved to a file': (302, b'', False, 'file:///etc/hostname'), 'too large': (200, bytes(2 * MOST), False, ''),
    'stalls': (200, ARCHIVE[:100], True, ''),
    'other weights': (200, zip_with({'end2end.onnx': CONTENT[::-1]}), False, ''),
    'other member': (200, zip_with({'model.onnx': CONTENT}), False, ''),
    'files': (200, CONTENT, False, '')}
FAULTS = {
    'cut': 'net.zip is damaged or no archive', 'missing': '404', 'page': 'is damaged or no archive',
    'moved to a file': '302', 'too large': 'has more than 100000 bytes', 'stalls': 'can not be fetched: .*timed out',
    'other weights': 'has .*, expected 20000 bytes and sha256',
    'other member': 'has 0 files end2end.onnx, expected one'}


class Maker(http.server.BaseHTTPRequestHandler):
    protocol_version = 'HTTP/1.1'

    def do_GET(self):
        self.close_connection = True
        self.server.agents.append(self.headers['User-Agent'])
        name = self.path[1:].partition('/')[0].replace('_', ' ')
        code, content, is_cut, location = ANSWERS[name]
        self.send_response(code)
        self.send_header('Content-Length', str(len(ARCHIVE) if is_cut else len(content)))
        self.send_header('Location', location)
        self.end_headers()
        self.wfile.write(content)
        self.wfile.flush()
        if name == 'stalls':
            self.server.ended.wait(10)

    def log_message(self, *_):
        pass


@pytest.fixture
def maker():
    server = http.server.ThreadingHTTPServer(('127.0.0.1', 0), Maker)
    server.daemon_threads, server.handle_error = True, lambda *_: None  # connections that end early are tested
    server.ended, server.agents = threading.Event(), []
    thread = threading.Thread(target=server.serve_forever, kwargs={'poll_interval': 0.01})
    thread.start()
    yield server
    server.ended.set()
    server.shutdown()
    server.server_close()
    thread.join()


def model_at(address):
    return dataclasses.replace(
        MODELS['rtmo_s'], files=(WeightsFile('end2end.onnx', len(CONTENT), hashlib.sha256(CONTENT).hexdigest()),),
        source=WebSource(address, 'A. Author', 'As they say.'))


def model_of(maker, answer):
    return model_at(f'http://127.0.0.1:{maker.server_address[1]}/{answer.replace(" ", "_")}/net.zip')


def get(model, folder, brought=()):
    def fetch(source, target):
        weights_install.download(source.address, target / 'net.zip', MOST, TIMEOUT)
        return target / 'net.zip'
    return weights_install.get(model, str(folder), brought, fetch)


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    (tmp_path / 'temporary').mkdir()
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path / 'temporary'))


@pytest.mark.parametrize('answer', ['whole', 'moved'])
def test_weights_come_with_origin_and_licence(tmp_path, maker, answer):
    model = model_of(maker, answer)
    path = get(model, tmp_path / 'models')
    assert path == tmp_path / 'models/rtmo_s/end2end.onnx' and path.read_bytes() == CONTENT
    assert weights_path(model, str(tmp_path / 'models')) == path
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', 'end2end.onnx']
    notice = (path.parent / 'NOTICE').read_text()
    for fact in (model.source.address, 'A. Author', 'Apache-2.0', 'As they say.', model.files[0].sha256):
        assert fact in notice
    assert (path.parent / 'LICENSE').read_text() == weights_install.APACHE.read_text()
    requests = len(maker.agents)
    get(model, tmp_path / 'models')
    assert len(maker.agents) == requests, 'what is there and right is not fetched again'
    assert maker.agents[0] == 'openpose_ros'


@pytest.mark.parametrize('answer', FAULTS)
@pytest.mark.parametrize('before', [None, b'damaged'])
def test_what_is_not_whole_and_right_leaves_nothing_behind(tmp_path, maker, answer, before):
    """Weights that were there stay as they were."""
    model, here = model_of(maker, answer), tmp_path / 'models/rtmo_s/end2end.onnx'
    if before is not None:
        here.parent.mkdir(parents=True)
        here.write_bytes(before)
    with pytest.raises(ModelError, match=FAULTS[answer]) as caught:
        get(model, tmp_path / 'models')
    assert names_in(tmp_path) == ([] if before is None else ['end2end.onnx'])
    assert before is None or here.read_bytes() == before
    for advice in ('weights of rtmo_s could not be fetched', f'download {model.source.address} in a browser',
                   '--from FILE', './run model get rtmo_s'):
        assert advice in str(caught.value)


def files_at(address, *contents):
    """Return a model of two files; the server calls them by other names."""
    files = [WeightsFile(f'net.{suffix}', len(content), hashlib.sha256(content).hexdigest())
             for suffix, content in zip(('xml', 'bin'), contents)]
    return dataclasses.replace(MODELS['tinypose'], files=tuple(files), source=WebSource(
        address, 'A. Author', 'As they say.', names=('model.xml', 'model.bin')))


def test_files_at_an_address_come_under_their_own_names_all_or_none(tmp_path, maker):
    address = f'http://127.0.0.1:{maker.server_address[1]}/files'
    path = weights_install.get(files_at(address, CONTENT, CONTENT), str(tmp_path / 'models'))
    assert path == tmp_path / 'models/tinypose/net.xml' and names_in(tmp_path) == [
        'LICENSE', 'NOTICE', 'net.bin', 'net.xml']
    with pytest.raises(ModelError, match=r'net\.bin has .*, expected 20000 bytes and sha256'):
        weights_install.get(files_at(address, CONTENT, CONTENT[::-1]), str(tmp_path / 'others'))
    assert not (tmp_path / 'others').exists()


def test_files_in_a_folder_are_known_by_their_checksums(tmp_path):
    """And one of another precision is as good."""
    folder, other = tmp_path / 'there', b'of other precision'
    folder.mkdir()
    for name, content in (('a.xml', CONTENT), ('b.xml', CONTENT[::-1]), ('c.bin', other)):
        (folder / name).write_bytes(content)
    model = files_at('http://127.0.0.1:9', CONTENT, CONTENT)
    model = dataclasses.replace(model, files=(model.files[0], dataclasses.replace(
        model.files[1], also=hashlib.sha256(other).hexdigest())))
    path = weights_install.get(model, str(tmp_path / 'models'), brought=[folder])
    assert path.read_bytes() == CONTENT and path.with_name('net.bin').read_bytes() == other
    assert weights_path(model, str(tmp_path / 'models')) == path


def test_the_zip_file_and_the_file_in_it_can_be_brought(tmp_path):
    model = model_at('http://127.0.0.1:9/net.zip')
    for name, right, damaged, fault in (
            ('net.zip', ARCHIVE, ARCHIVE[:-30], r'net\.zip is damaged or no archive'),
            ('end2end.onnx', CONTENT, CONTENT[::-1], r'it has .*, expected 20000 bytes and sha256')):
        (tmp_path / name).write_bytes(right)
        path = get(model, tmp_path / name[:3], [tmp_path / name])
        assert path.read_bytes() == CONTENT and 'A. Author' in (path.parent / 'NOTICE').read_text()
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(ModelError, match=fault):
            get(model, tmp_path / 'models', [tmp_path / name])
    assert not (tmp_path / 'models').exists()


def test_a_zip_bomb_is_refused_before_it_is_unpacked(tmp_path):
    (tmp_path / 'net.zip').write_bytes(zip_with({'end2end.onnx': bytes(MOST + 1)}))
    with pytest.raises(ModelError, match='has 0 files'):
        weights_install.archive_member(tmp_path / 'net.zip', 'end2end.onnx', MOST)
