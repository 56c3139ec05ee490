"""The server of pages: what it sends, and what it refuses."""
import asyncio
import http.client
import json
import re
import socket
import time

import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from openpose_ros_web import protocol
from openpose_ros_web.protocol import hello
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
                           hello(['left', 'right'], 3))
    yield serving
    serving.stop()


def wait_for(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


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


@pytest.mark.parametrize('path', ['/../secret.txt', '/%2e%2e/secret.txt', '/vendor/..%2f..%2fsecret.txt', '/vendor/',
                                  '/missing'])
def test_other_paths_are_refused_and_folders_not_listed(pages, path):
    answer, body = get(pages, path)
    assert 400 <= answer.status < 500
    assert b'secret' not in body
    assert b'one' not in body


@pytest.mark.parametrize('host, status', [('localhost:8080', 200), ('[::1]:8080', 200), ('10.0.0.7:8080', 200),
                                          (socket.gethostname(), 200), ('evil.example', 403),
                                          ('localhost.evil.example', 403), ('a..b', 403), ('a' * 64, 403)])
def test_a_name_that_is_not_this_computers_is_refused(pages, host, status):
    assert get(pages, '/', Host=host)[0].status == status


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


def test_images_go_to_the_pages_that_want_them(pages):
    async def run():
        wants, none = await connect(pages), await connect(pages)
        await messages(wants, 1), await messages(none, 1)
        assert pages.due_widths(1) == set()
        await wants.write_message('{"want": {"image": {"camera": 1, "width": 700, "rate": 15}}}')
        while not pages.is_wanted(lambda want: want.width):
            await asyncio.sleep(0.01)
        assert (pages.due_widths(0), pages.due_widths(1)) == (set(), {640})
        image = protocol.image_message(1, 5.0, b'jpeg')
        pages.publish(Key('image', 0, 640), b'another camera')
        pages.publish(Key('image', 1, 320), b'another width')
        pages.publish(Key('image', 1, 640), image)
        pages.publish(Key('image', 1, 640), b'too soon')
        pages.publish(Key('people'), '{"type":"people"}')
        assert await messages(wants, 2) == [image, {'type': 'people'}]
        assert await messages(none, 1) == [{'type': 'people'}]
        assert pages.due_widths(1) == set()
        wants.close()
        while pages.is_wanted(lambda want: want.width):
            await asyncio.sleep(0.01)
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


@pytest.mark.parametrize('sent', ['no JSON', '{"want": {"image": {"camera": 2}}}', b'\0\xff', 'x' * 5000])
def test_a_page_that_sends_something_else_is_disconnected(pages, sent):
    async def run():
        page = await connect(pages)
        await messages(page, 1)
        await page.write_message(sent, isinstance(sent, bytes))
        while await page.read_message() is not None:
            pass
    asyncio.run(asyncio.wait_for(run(), 10))
    wait_for(lambda: not pages.clients)


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


def test_a_port_that_is_taken_is_an_error(pages, tmp_path):
    with pytest.raises(OSError, match='in use'):
        PeopleServer('localhost', pages.port, {'/': tmp_path}, hello([], 3))
    with pytest.raises(OSError, match=r'assign|known|address'):
        PeopleServer('192.0.2.1', 0, {'/': tmp_path}, hello([], 3))
