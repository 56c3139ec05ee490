"""Weights at their maker's address: they come whole and right out of the zip file, or an error says what to do."""
import dataclasses
import hashlib
import http.server
import io
import threading
import zipfile

import pytest

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks import weights_install
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import WebArchive, WeightsFile
from openpose_ros_pkg.networks.models import weights_path

CONTENT = b'weights of a network' * 1000
MOST, TIMEOUT = 100_000, 0.4


def zip_with(members, method=zipfile.ZIP_DEFLATED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, 'w', method) as archive:
        for path, data in members.items():
            archive.writestr(path, data)
    return buffer.getvalue()


ARCHIVE = zip_with({'20230831/rtmpose_onnx/detail.json': b'{}', '20230831/rtmpose_onnx/end2end.onnx': CONTENT,
                    '../../escaped.txt': b'nothing else is taken'})


class Maker(http.server.BaseHTTPRequestHandler):
    """A server whose answers are named by the address."""

    protocol_version = 'HTTP/1.1'

    def do_GET(self):
        self.close_connection = True
        self.server.asked.append(self.headers['User-Agent'])
        getattr(self, self.path[1:].partition('/')[0])()

    def log_message(self, *_):
        pass

    def answer(self, content, length=None, code=200, **headers):
        self.send_response(code)
        for name, value in {'Content-Length': len(content) if length is None else length, **headers}.items():
            self.send_header(name, str(value))
        self.end_headers()
        self.wfile.write(content)
        self.wfile.flush()

    def whole(self):
        self.answer(ARCHIVE)

    def cut(self):
        self.answer(ARCHIVE[:100], len(ARCHIVE))

    def moved(self):
        self.answer(b'', code=302, Location='/whole/net.zip')

    def missing(self):
        self.answer(b'', code=404)

    def a_page(self):
        self.answer(b'<html>Log in to this network</html>')

    def endless(self):
        self.send_response(200)
        self.end_headers()
        while not self.server.ended.is_set():
            self.wfile.write(bytes(4096))

    def stalls(self):
        self.answer(ARCHIVE[:100], len(ARCHIVE))
        self.server.ended.wait(10)

    def other_weights(self):
        self.answer(zip_with({'end2end.onnx': CONTENT[::-1]}))


class Server(http.server.ThreadingHTTPServer):
    """Connections that end early are what is tested."""

    daemon_threads = True

    def handle_error(self, *_):
        pass


@pytest.fixture
def maker():
    """Yield the address of the server."""
    server = Server(('127.0.0.1', 0), Maker)
    server.ended, server.asked = threading.Event(), []
    thread = threading.Thread(target=server.serve_forever, kwargs={'poll_interval': 0.01})
    thread.start()
    yield server
    server.ended.set()
    server.shutdown()
    server.server_close()
    thread.join()


def model_at(address, content=CONTENT):
    return dataclasses.replace(
        MODELS['rtmo_s'], files=(WeightsFile('end2end.onnx', len(content), hashlib.sha256(content).hexdigest()),),
        source=WebArchive(address, 'end2end.onnx', 'A. Author', 'As they say.'))


def address_of(maker, answer):
    return f'http://127.0.0.1:{maker.server_address[1]}/{answer}/net.zip'


def get(model, folder, brought=()):
    def fetch(source, target):
        weights_install.download(source.address, target / 'net.zip', MOST, TIMEOUT)
        return target / 'net.zip'
    return weights_install.get(model, str(folder), 'the licence', brought, fetch)


def names_in(folder):
    return sorted(path.name for path in folder.rglob('*') if path.is_file())


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Return the folder in which temporary files are made."""
    (tmp_path / 'temporary').mkdir()
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path / 'temporary'))
    return tmp_path / 'temporary'


@pytest.mark.parametrize('answer', ['whole', 'moved'])
def test_weights_come_with_origin_and_licence(tmp_path, temporary, maker, answer):
    model = model_at(address_of(maker, answer))
    path = get(model, tmp_path / 'models')
    assert path == tmp_path / 'models/rtmo_s/end2end.onnx' and path.read_bytes() == CONTENT
    assert weights_path(model, str(tmp_path / 'models')) == path
    assert names_in(tmp_path) == ['LICENSE', 'NOTICE', 'end2end.onnx']
    notice = (path.parent / 'NOTICE').read_text()
    for fact in (model.source.address, 'A. Author', 'Apache-2.0', 'As they say.', model.files[0].sha256):
        assert fact in notice
    assert (path.parent / 'LICENSE').read_text() == 'the licence'
    asked = len(maker.asked)
    get(model, tmp_path / 'models')
    assert len(maker.asked) == asked, 'what is there and right is not fetched again'
    assert maker.asked[0] == 'openpose_ros'


FAULTS = {
    'cut': 'net.zip is damaged or no zip file', 'missing': '404', 'a_page': 'is damaged or no zip file',
    'endless': 'has more than 100000 bytes', 'stalls': 'can not be fetched: .*timed out',
    'other_weights': 'has .*, expected 20000 bytes and sha256'}


@pytest.mark.parametrize('answer', FAULTS)
@pytest.mark.parametrize('before', [None, b'damaged'])
def test_what_is_not_whole_and_right_leaves_nothing_behind(tmp_path, temporary, maker, answer, before):
    """Weights that were there stay as they were."""
    model = model_at(address_of(maker, answer))
    here = tmp_path / 'models/rtmo_s/end2end.onnx'
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


def test_the_zip_file_and_the_file_in_it_can_be_brought(tmp_path, temporary):
    model = model_at('http://127.0.0.1:9/net.zip')
    (tmp_path / 'net.zip').write_bytes(ARCHIVE)
    (tmp_path / 'end2end.onnx').write_bytes(CONTENT)
    for name in ('net.zip', 'end2end.onnx'):
        path = get(model, tmp_path / name[:3], [tmp_path / name])
        assert path.read_bytes() == CONTENT and 'A. Author' in (path.parent / 'NOTICE').read_text()
    assert names_in(temporary) == []
    (tmp_path / 'net.zip').write_bytes(ARCHIVE[:-30])
    with pytest.raises(ModelError, match=r'net\.zip is damaged or no zip file'):
        get(model, tmp_path / 'models', [tmp_path / 'net.zip'])
    (tmp_path / 'end2end.onnx').write_bytes(CONTENT[::-1])
    with pytest.raises(ModelError, match=r'it has .*, expected 20000 bytes and sha256'):
        get(model, tmp_path / 'models', [tmp_path / 'end2end.onnx'])
    assert not (tmp_path / 'models').exists()


def test_a_zip_bomb_is_refused_before_it_is_unpacked(tmp_path):
    (tmp_path / 'net.zip').write_bytes(zip_with({'end2end.onnx': bytes(MOST + 1)}))
    with pytest.raises(ModelError, match='has 0 files'):
        weights_install.zip_member(tmp_path / 'net.zip', 'end2end.onnx', MOST)
