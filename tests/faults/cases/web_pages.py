"""What browsers and others send to the node of pages, and people and images that it can not show."""
from contextlib import suppress
from typing import Any

from faults.cases.fused_people import a_thousand, every_joint
from faults.fault import Fault, Scenario
from faults.injectors import NAN, Injector, changed, refused

NODE = 'web/people'
PROGRAM = 'extensions/openpose_ros_web/scripts/people_web_node'
# Of its own, without what it shares with others [bytes].
MOST_MEMORY = 150e6
UPGRADE = (b'GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
           b'Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n')


def connect() -> Any:
    import socket

    from faults.rig import WEB_PORT
    return socket.create_connection(('localhost', WEB_PORT), 20.0)


def refused_request(data: bytes) -> Injector:
    """Return what sends a request; its answer has to be 4xx, or the end of the connection."""
    def inject(_chain: Any) -> None:
        answer = b''
        with connect() as connection, suppress(ConnectionError):  # closed before all was sent
            connection.sendall(data)
            answer = connection.recv(65536)
            assert not answer or answer.startswith(b'HTTP/1.1 4'), answer
    return inject


def request(line: str, host: str = 'localhost') -> Injector:
    return refused_request(f'{line} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n'.encode())


def page(data: bytes, ends: bool = True) -> Injector:
    """Return what opens a page that sends bytes, and waits for the end of its connection, or leaves it open."""
    def inject(chain: Any) -> None:
        connection = connect()
        connection.sendall(UPGRADE + b'\r\n')
        assert connection.recv(12) == b'HTTP/1.1 101'
        if not ends:
            connection.sendall(data)
            chain.kept.append(connection)
            return
        with connection, suppress(ConnectionError):  # closed before all was sent
            connection.sendall(data)
            while connection.recv(65536):
                pass
    return inject


def many(number: int, data: bytes = b'') -> Injector:
    """Return what makes connections that stay, each after some bytes."""
    def inject(chain: Any) -> None:
        for _ in range(number):
            connection = connect()
            connection.sendall(data)
            chain.kept.append(connection)
    return inject


def closed(chain: Any) -> None:
    """Close the connections that were kept; the node has to be small until then."""
    import psutil
    memory = psutil.Process(chain.processes[NODE].pid).memory_full_info().uss
    assert memory < MOST_MEMORY, f'{memory / 1e6:.0f} MB'
    while chain.kept:
        chain.kept.pop().close()


def frame(kind: int, data: bytes, length: int = 0) -> bytes:
    """Return a frame of a WebSocket with a mask of zeros; `length`: the one that it claims to have."""
    return bytes([0x80 | kind, 0xff]) + (length or len(data)).to_bytes(8, 'big') + bytes(4) + data


FAULTS = [
    Fault('people of an unknown joint set', changed('people', pose_model='none_such'), NODE,
          words=("pose_model 'none_such' is unknown",)),
    Fault('measured joints without positions', every_joint('people', x=NAN), NODE, words=('status must be MISSING',)),
    Fault('joints a thousand kilometres away', every_joint('people', z=1e6), NODE, event=''),
    Fault('sigma of NaN', every_joint('people', sigma=NAN), NODE, event=''),
    Fault('a thousand people', changed('people', persons=a_thousand), NODE, event=''),
    Fault('image of an unknown encoding', changed('image', encoding='none_such'), NODE, words=('none_such',)),
    Fault('truncated image', changed('image', data=lambda data: data[:100]), NODE, words=('bytes',)),
    Fault('POST to the page', request('POST /'), NODE, event=''),
    Fault('path out of the folder', request('GET /../../../../../../etc/passwd'), NODE, event=''),
    Fault('name of another computer', request('GET /', 'evil.example'), NODE, event=''),
    Fault('WebSocket from a page elsewhere', refused_request(UPGRADE + b'Origin: http://evil.example\r\n\r\n'), NODE,
          event=''),
    Fault('headers of 100 kB', refused_request(b'GET / HTTP/1.1\r\nX: ' + b'x' * 100000), NODE, event=''),
    Fault('bytes that are no HTTP', refused_request(bytes(range(256)) * 100 + b'\r\n\r\n'), NODE, event=''),
    Fault('page that sends no JSON', page(frame(1, b'{"want": ')), NODE, event=''),
    Fault('page that sends a frame of 1 GB', page(frame(2, bytes(4096), 1 << 30)), NODE, event=''),
    Fault('page that wants images and never reads', page(frame(1, b'{"want": {"image": {"width": 320}}}'), False), NODE,
          event=''),
    Fault('page that sends 100000 wishes at once', page(100000 * frame(1, b'{"want": {}}')), NODE, event=''),
    Fault('page that sends 100000 pings at once', page(100000 * bytes([0x89, 0x80, 0, 0, 0, 0])), NODE, event=''),
    Fault('30 pages that never read', many(30, UPGRADE + b'\r\n'), NODE, event=''),
    Fault('these pages are closed', closed, NODE, event=''),
    Fault('200 connections that say nothing', many(200), NODE, event=''),
    Fault('these connections end', closed, NODE, event=''),
    Scenario('port that is taken', refused(PROGRAM, {'port': 1, 'host': '192.0.2.1'}, '192.0.2.1', 'port 1'),
             'people_web_node', 'ends with 1 and names it'),
    Scenario('no name to serve at', refused(PROGRAM, {'host': "''"}, 'host is empty'), 'people_web_node',
             'ends with 1 and names it'),
    Scenario('name that is none', refused(PROGRAM, {'host': 'a..b'}, 'a..b'), 'people_web_node',
             'ends with 1 and names it'),
]
