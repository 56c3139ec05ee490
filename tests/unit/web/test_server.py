"""The server of pages: what it sends, and what it refuses."""
import asyncio
import contextlib
import http.client
import json
import re
import socket
import time

import numpy as np
import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from openpose_ros_web import protocol, server
from openpose_ros_web.protocol import encode, hello
from openpose_ros_web.server import Key, PeopleServer

HANDSHAKE = (b'GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
             b'Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n')


@pytest.fixture
def pages(tmp_path):
    folder = tmp_path / 'www'
    folder.mkdir()
    (tmp_path / 'three').mkdir()
    (folder / 'index.html').write_text('the page')
    (tmp_path / 'three' / 'one.js').write_text('one')
    (tmp_path / 'secret.txt').write_text('secret')
    serving = PeopleServer('localhost', 0, {'/': folder, '/vendor/': tmp_path / 'three'},
                           hello(['left', 'right'], True, 3))
    yield serving
    serving.stop()


def wait_for(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def request(pages, text, expected_bytes=100000):
    """Return the answer to the bytes of a request."""
    with socket.create_connection(('127.0.0.1', pages.port), timeout=30) as connection:
        connection.sendall(text)
        answer = b''
        while len(answer) < expected_bytes:
            more = connection.recv(65536)
            if not more:
                break
            answer += more
        return answer


def get(pages, path, method='GET', **headers):
    connection = http.client.HTTPConnection('127.0.0.1', pages.port, timeout=30)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, body


async def connect(pages, **headers):
    return await websocket_connect(HTTPRequest(f'ws://127.0.0.1:{pages.port}/ws', headers=headers))


async def messages(page, number):
    """Return the next messages; texts as objects."""
    found = [await page.read_message() for _ in range(number)]
    return [json.loads(each) if isinstance(each, str) else each for each in found]


def test_the_page_and_its_files(pages):
    answer, body = get(pages, '/')
    assert (answer.status, body) == (200, b'the page')
    assert "default-src 'self'" in answer.headers['Content-Security-Policy']
    assert answer.headers['X-Content-Type-Options'] == 'nosniff'
    assert get(pages, '/vendor/one.js')[1] == b'one'


@pytest.mark.parametrize('path', ['/../secret.txt', '/%2e%2e/secret.txt', '/vendor/..%2f..%2fsecret.txt',
                                  '//etc/passwd', '/vendor', '/vendor/', '/missing', '/%00', '/..\\secret.txt'])
def test_other_paths_are_refused_and_folders_not_listed(pages, path):
    answer, body = get(pages, path)
    assert 400 <= answer.status < 500
    assert b'secret' not in body
    assert b'one' not in body


@pytest.mark.parametrize('method', ['POST', 'PUT', 'DELETE', 'PATCH', 'OPTIONS', 'TRACE', 'ANY'])
def test_pages_are_only_read(pages, method):
    for path in ('/', '/ws'):
        assert 400 <= get(pages, path, method)[0].status < 500


def test_a_body_that_is_too_large_is_refused(pages):
    answer = request(pages, b'GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\n')
    assert answer.startswith(b'HTTP/1.1 4') or not answer


@pytest.mark.parametrize('bad', [
    b'\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n', b'GET\r\n\r\n', b'GET / HTTP/9.9\r\n\r\n', b'\0' * 20000,
    b'GET / HTTP/1.1\r\n' + b'X: ' + b'y' * 100000 + b'\r\n\r\n', b'GET / HTTP/1.1\r\nHost: a b\r\n\r\n'])
def test_what_is_no_request_gets_an_error_or_no_answer(pages, bad):
    answer = b''
    with contextlib.suppress(ConnectionError):
        answer = request(pages, bad)
    assert not answer or answer.startswith(b'HTTP/1.1 4')
    assert get(pages, '/')[0].status == 200


@pytest.mark.parametrize('host, status', [('localhost:8080', 200), ('127.0.0.1', 200), ('[::1]:8080', 200),
                                          ('10.0.0.7:8080', 200), (socket.gethostname(), 200), ('evil.example', 403),
                                          ('localhost.evil.example', 403), ('[', 403)])
def test_a_name_that_is_not_this_computers_is_refused(pages, host, status):
    answer = request(pages, f'GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n'.encode())
    assert int(answer.split()[1]) == status or (status == 403 and int(answer.split()[1]) == 400)


def test_messages_arrive_in_order_and_later_pages_get_those_that_are_kept(pages):
    async def run():
        page = await connect(pages)
        first, = await messages(page, 1)
        assert (first['type'], first['version'], first['cameras']) == ('hello', 1, ['left', 'right'])
        pages.publish(Key('cameras'), '{"type":"cameras"}', keep=True)
        pages.publish(Key('people'), '{"type":"people"}')
        assert [each['type'] for each in await messages(page, 2)] == ['cameras', 'people']
        later = await connect(pages)
        assert [each['type'] for each in await messages(later, 2)] == ['hello', 'cameras']
    asyncio.run(run())


def test_images_and_clouds_go_to_the_pages_that_want_them(pages):
    async def run():
        wants, none = await connect(pages), await connect(pages)
        await messages(wants, 1), await messages(none, 1)
        assert pages.due_widths(1) == set()
        await wants.write_message('{"want": {"image": {"camera": 1, "width": 700, "rate": 15}, "cloud": true}}')
        while not pages.is_wanted(lambda want: want.cloud):
            await asyncio.sleep(0.01)
        assert (pages.due_widths(0), pages.due_widths(1)) == (set(), {640})
        image, cloud = protocol.image_message(1, 5.0, b'jpeg'), protocol.cloud_message(0, 5.0, np.zeros((0, 3)),
                                                                                      np.zeros((0, 3), np.uint8))
        pages.publish(Key('image', 0, 640), b'another camera')
        pages.publish(Key('image', 1, 320), b'another width')
        pages.publish(Key('image', 1, 640), image)
        pages.publish(Key('image', 1, 640), b'too soon')
        pages.publish(Key('cloud', 0), cloud)
        pages.publish(Key('people'), '{"type":"people"}')
        assert await messages(wants, 3) == [image, cloud, {'type': 'people'}]
        assert await messages(none, 1) == [{'type': 'people'}]
        assert pages.due_widths(1) == set()
        wants.close()
        while pages.is_wanted(lambda want: want.cloud):
            await asyncio.sleep(0.01)
    asyncio.run(run())


def test_images_come_at_the_rate_that_is_wanted(pages, monkeypatch):
    """Of a camera at 15 Hz, 10 a second."""
    async def run():
        page = await connect(pages)
        await messages(page, 1)
        await page.write_message('{"want": {"image": {"width": 160, "rate": 10}}}')
        while not pages.is_wanted(lambda want: want.width):
            await asyncio.sleep(0.01)
        now, due = time.monotonic(), 0
        monkeypatch.setattr(server.time, 'monotonic', lambda: now)
        for _ in range(150):
            now += 1 / 15 + 1e-9
            due += pages.due_widths(0) == {160}
            pages.clients[0].offer(Key('image', 0, 160), b'image')
        assert 99 <= due <= 101
    asyncio.run(run())


@pytest.mark.parametrize('origin, allowed', [('http://127.0.0.1:{port}', True), ('http://evil.example', False),
                                             ('http://127.0.0.1:1', False), ('null', False)])
def test_pages_of_other_servers_get_no_messages(pages, origin, allowed):
    async def run():
        page = await connect(pages, Origin=origin.format(port=pages.port))
        assert (await messages(page, 1))[0]['type'] == 'hello'
    if allowed:
        asyncio.run(run())
    else:
        with pytest.raises(HTTPClientError, match='403'):
            asyncio.run(run())


@pytest.mark.parametrize('sent', ['', 'no JSON', '[]', '{}', '{"want": 1}', '{"want": {"image": {"camera": 2}}}',
                                  '{"want": {"image": {"width": 1e999}}}', '{"want": {"image": {"rate": NaN}}}',
                                  '{"want": {"cloud": "yes"}}', '[' * 4000, b'\0\xff', 'x' * 5000])
def test_a_page_that_sends_something_else_is_disconnected(pages, sent):
    async def run():
        page = await connect(pages)
        await messages(page, 1)
        await page.write_message(sent, isinstance(sent, bytes))
        while await page.read_message() is not None:
            pass
    asyncio.run(asyncio.wait_for(run(), 10))
    wait_for(lambda: not pages.clients)


def test_there_are_at_most_sixteen_pages(pages):
    async def run():
        opened = [await connect(pages) for _ in range(server.MOST_CLIENTS)]
        with pytest.raises(HTTPClientError, match='503'):
            await connect(pages)
        opened[0].close()
        while len(pages.clients) == server.MOST_CLIENTS:
            await asyncio.sleep(0.01)
        await connect(pages)
    asyncio.run(run())


def test_a_page_that_never_reads_holds_up_no_other(pages):
    """Of what waits for it, only the newest of each kind is kept."""
    large = encode({'type': 'people', 'text': 'x' * 500000})

    def handshake():
        connection = socket.create_connection(('127.0.0.1', pages.port))
        connection.sendall(HANDSHAKE)
        return connection

    async def run():
        await messages(page := await connect(pages), 1)
        for _ in range(100):
            pages.publish(Key('people'), large)
            pages.publish(Key('state'), '{"type":"state"}')
            assert [each['type'] for each in await messages(page, 2)] == ['people', 'state']
        waiting = max(len(each._waiting) for each in pages.clients)
        assert waiting == 2, 'the other one took nothing'

    with handshake():
        wait_for(lambda: pages.clients)
        asyncio.run(asyncio.wait_for(run(), 30))


def test_a_slow_page_gets_the_present(pages):
    """What waits for it in buffers of the kernel is little."""
    with socket.socket() as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.settimeout(10)
        slow.connect(('127.0.0.1', pages.port))
        slow.sendall(HANDSHAKE)
        wait_for(lambda: pages.clients)
        for number in range(150):
            pages.publish(Key('people'), f'({number})' + 'x' * 20000)
            time.sleep(0.003)
        got = b''
        while b'(149)' not in got:
            got += slow.recv(65536)
    assert len(re.findall(rb'\(\d+\)', got)) <= 15  # 3 MB were published


def test_a_server_that_ends_closes_its_connections(tmp_path):
    serving = PeopleServer('localhost', 0, {'/': tmp_path}, hello([], False, 3))
    with socket.create_connection(('127.0.0.1', serving.port), timeout=5) as page, \
            socket.create_connection(('127.0.0.1', serving.port), timeout=5) as silent:
        page.sendall(HANDSHAKE)
        wait_for(lambda: serving.clients and serving._http._connected)
        serving.stop()
        assert silent.recv(1) == b''
        while page.recv(65536):
            pass
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(('127.0.0.1', serving.port), timeout=5)


def test_a_page_that_takes_nothing_is_disconnected(pages, monkeypatch):
    monkeypatch.setattr(server, '_PATIENCE', 0.2)
    with socket.create_connection(('127.0.0.1', pages.port)) as connection:
        connection.sendall(HANDSHAKE)
        wait_for(lambda: pages.clients)
        for _ in range(40):
            pages.publish(Key('people'), 'x' * 500000)
            time.sleep(0.01)
        wait_for(lambda: not pages.clients, 20)


@pytest.mark.parametrize('kind', [0x81, 0x89, 0x8a, 0x00], ids=['text', 'ping', 'pong', 'fragment'])
def test_a_page_that_floods_is_disconnected_and_holds_up_no_other(pages, kind):
    want = b'{"want": {}}' if kind == 0x81 else b''
    begin = bytes([0x01, 0x80]) + bytes(4) if kind == 0x00 else b''
    frames = begin + 1000 * (bytes([kind, 0x80 + len(want)]) + bytes(4) + want)

    async def run():
        await messages(page := await connect(pages), 1)
        with socket.create_connection(('127.0.0.1', pages.port)) as flood:
            flood.sendall(HANDSHAKE)
            wait_for(lambda: len(pages.clients) == 2)
            with contextlib.suppress(ConnectionError):
                flood.sendall(frames)
            wait_for(lambda: len(pages.clients) == 1)
            pages.publish(Key('people'), '{"type":"people"}')
            assert await messages(page, 1) == [{'type': 'people'}]
    asyncio.run(asyncio.wait_for(run(), 20))


def test_a_page_may_send_what_it_wants_many_times(pages):
    async def run():
        await messages(page := await connect(pages), 1)
        for _ in range(35):
            await page.write_message('{"want": {"cloud": true}}')
        wait_for(lambda: pages.is_wanted(lambda want: want.cloud))
        pages.publish(Key('people'), '{"type":"people"}')
        assert await messages(page, 1) == [{'type': 'people'}]
    asyncio.run(asyncio.wait_for(run(), 20))


def test_a_file_that_is_not_taken_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(server, '_PATIENCE', 0.2)
    (tmp_path / 'index.html').write_bytes(bytes(30_000_000))
    serving = PeopleServer('localhost', 0, {'/': tmp_path}, hello([], False, 3))
    with socket.create_connection(('127.0.0.1', serving.port)) as connection:
        connection.sendall(b'GET / HTTP/1.1\r\nHost: localhost\r\n\r\n')
        wait_for(lambda: serving._http._connected == 1)
        wait_for(lambda: serving._http._connected == 0)
    serving.stop()


def test_a_server_that_can_not_begin_is_an_error(tmp_path, monkeypatch):
    def fail(_server, _sockets):
        raise RuntimeError('no selector')
    monkeypatch.setattr(server._Server, 'add_sockets', fail)
    with pytest.raises(RuntimeError, match='no selector'):
        PeopleServer('localhost', 0, {'/': tmp_path}, hello([], False, 3))


def test_a_flood_of_silent_connections_leaves_the_pages_alone(pages):
    async def run():
        page = await connect(pages)
        await messages(page, 1)
        silent = [socket.create_connection(('127.0.0.1', pages.port)) for _ in range(300)]
        pages.publish(Key('people'), '{"type":"people"}')
        assert await messages(page, 1) == [{'type': 'people'}]
        for each in silent:
            each.settimeout(10)
        closed = sum(each.recv(1) == b'' for each in silent[server.MOST_CONNECTIONS:])
        assert closed == 300 - server.MOST_CONNECTIONS
        for each in silent:
            each.close()
    asyncio.run(asyncio.wait_for(run(), 30))
    wait_for(lambda: pages.due_widths(0) == set() and _answers(pages))


def _answers(pages):
    try:
        return get(pages, '/')[0].status == 200
    except (OSError, http.client.HTTPException):
        return False


def test_a_request_that_never_ends_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(server, '_PATIENCE', 0.3)
    serving = PeopleServer('localhost', 0, {'/': tmp_path}, hello([], False, 3))
    for begun in (b'', b'GET / HTTP/1.1\r\nHost:'):
        assert request(serving, begun) == b''
    serving.stop()


def test_a_port_that_is_taken_is_an_error(pages, tmp_path):
    with pytest.raises(OSError, match='in use'):
        PeopleServer('localhost', pages.port, {'/': tmp_path}, hello([], False, 3))
    with pytest.raises(OSError, match=r'assign|known|address'):
        PeopleServer('192.0.2.1', 0, {'/': tmp_path}, hello([], False, 3))
