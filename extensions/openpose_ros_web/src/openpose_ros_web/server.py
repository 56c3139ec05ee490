"""HTTP and WebSocket for pages: sends what is published to those that want it, and takes nothing else from them."""
import asyncio
import ipaddress
import logging
import socket
import threading
import time
from collections import OrderedDict
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Set, Union

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_web.protocol import Want, encode, read_want

MOST_CLIENTS = 16
# A connection without a request, and a client that has not taken a message, for this long are closed [s].
_PATIENCE = 10.0
_LARGEST_HEAD, _LARGEST_MESSAGE = 8192, 4096  # [bytes]
# Messages and pings that a page may send [1/s], and at once.
_MESSAGES, _MOST_MESSAGES = 20.0, 40.0
_MOST_UNSENT = 8_000_000  # [bytes]
# Of what was written, the kernel keeps so much for a slow page, and Linux twice that [bytes]. By itself it would keep
# up to 4 MB: seconds of images, all of them out of date when they arrive.
_SEND_BUFFER = 65536
# No file whose name has a special character or begins with a dot.
_FILES = r'((?:[\w-]+/)*[\w-][\w.-]*)?'
_HEADERS = {
    'Content-Security-Policy': "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws:; "
                               "frame-ancestors 'self'; base-uri 'none'; form-action 'none'",
    'X-Content-Type-Options': 'nosniff', 'Referrer-Policy': 'no-referrer', 'Cache-Control': 'no-cache'}

Payload = Union[str, bytes]


class Key(NamedTuple):
    """What a message replaces: the one before of its type, camera (index) and width [px] of an image."""

    kind: str
    camera: int = 0
    width: int = 0


class PeopleServer:
    """Serves folders and the messages, in a thread of its own.

    Args:
        host: name or address to listen at.
        port: 0: any free one.
        folders: files by the path at which they are found: '/' is that of the page.
        hello: the first message of each connection.
        changed: called in the server's thread when what is wanted may have changed.

    Attributes:
        port: that is listened at.
        clients: the pages that are open.

    Raises:
        OSError: the port is taken, or the host is none of this computer.
    """

    def __init__(self, host: str, port: int, folders: Mapping[str, Path], hello: Mapping[str, Any],
                 changed: Callable[[], None] = lambda: None) -> None:
        # a name may have addresses of IPv4 and IPv6, one of which may be switched off
        sockets = bind_sockets(port, '127.0.0.1' if host == 'localhost' else host)
        self.port: int = sockets[0].getsockname()[1]
        own = socket.gethostname().lower()
        self.names = {host.lower(), 'localhost', own, f'{own}.local'}
        self.clients: List[_Page] = []
        self.cameras, self.changed = len(hello['cameras']), changed
        self._hello = encode(dict(hello))
        self._kept: Dict[Key, Payload] = {}
        self._loop = asyncio.new_event_loop()
        self._application = Application(
            [('/ws', _Page), *((path + _FILES, _Files, {'path': str(folder)})
                               for path, folder in sorted(folders.items(), reverse=True))], server=self,
            websocket_ping_interval=_PATIENCE, websocket_ping_timeout=3 * _PATIENCE,
            websocket_max_message_size=_LARGEST_MESSAGE, log_function=lambda handler: None)
        logging.getLogger('tornado').setLevel(logging.ERROR)  # not of each bad request
        self._thread = threading.Thread(target=self._loop.run_forever, name='web server', daemon=True)
        self._thread.start()
        self._http = asyncio.run_coroutine_threadsafe(self._begin(sockets), self._loop).result()

    def is_wanted(self, wanted: Callable[[Want], bool] = lambda want: True) -> bool:
        """Return whether a page is open that wants something."""
        return any(wanted(page.want) for page in list(self.clients))

    def due_widths(self, camera: int) -> Set[int]:
        """Return the widths in which an image of a camera is wanted now [px]."""
        return {page.due_width() for page in list(self.clients) if page.want.camera == camera} - {0}

    def publish(self, key: Key, payload: Payload, keep: bool = False) -> None:
        """Send a message to the pages that want it; `keep`: pages that open later get it, too."""
        self._loop.call_soon_threadsafe(self._distribute, key, payload, keep)

    def stop(self) -> None:
        """End the thread, and all connections with it."""
        asyncio.run_coroutine_threadsafe(self._end(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def open(self, page: '_Page') -> None:
        """Begin to send messages to a page; called in the server's thread."""
        self.clients.append(page)
        page.offer(Key('hello'), self._hello)
        for key, payload in self._kept.items():
            page.offer(key, payload)
        self.changed()

    def close(self, page: '_Page') -> None:
        """Send nothing more to a page; called in the server's thread."""
        if page in self.clients:
            self.clients.remove(page)
            self.changed()

    async def _begin(self, sockets: List[socket.socket]) -> HTTPServer:
        http = HTTPServer(self._application, idle_connection_timeout=_PATIENCE, body_timeout=_PATIENCE,
                          max_header_size=_LARGEST_HEAD, max_body_size=_LARGEST_MESSAGE,
                          max_buffer_size=2 * _LARGEST_HEAD)
        http.add_sockets(sockets)
        return http

    async def _end(self) -> None:
        self._http.stop()
        for page in list(self.clients):
            page.stream.close()
        await self._http.close_all_connections()

    def _distribute(self, key: Key, payload: Payload, keep: bool) -> None:
        if keep:
            self._kept[key] = payload
        for page in list(self.clients):
            page.offer(key, payload)


class _Guarded(RequestHandler):
    """Answers requests for names of this computer alone.

    A page elsewhere could otherwise read this one through a name of its own that leads here (DNS rebinding).
    """

    @property
    def server(self) -> PeopleServer:
        """The one of the request."""
        return self.settings['server']

    def set_default_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        host = self.request.host_name.strip('[]')
        if host not in self.server.names and not _is_address(host):
            raise HTTPError(403)


class _Files(_Guarded, StaticFileHandler):
    """The files of a folder."""

    def parse_url_path(self, url_path: str) -> str:
        """Return the path of a file below the folder."""
        return str(super().parse_url_path(url_path or 'index.html'))


class _Page(_Guarded, WebSocketHandler):
    """A connection of a page: of each kind of message, only the newest waits."""

    def initialize(self) -> None:
        self.want = Want()
        self._waiting: OrderedDict[Key, Payload] = OrderedDict()
        self._sending = False
        self._next_image = 0.0
        self._left, self._counted = _MOST_MESSAGES, time.monotonic()

    async def get(self, *arguments: Any, **options: Any) -> None:
        if len(self.server.clients) >= MOST_CLIENTS:
            raise HTTPError(503)
        await super().get(*arguments, **options)

    def open(self, *_: str, **__: str) -> None:
        self.set_nodelay(True)
        connection: Any = self.ws_connection
        self.stream = connection.stream
        self.stream.max_write_buffer_size = _MOST_UNSENT
        self.stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        self.server.open(self)

    def on_close(self) -> None:
        self._waiting.clear()
        self.server.close(self)

    def on_message(self, message: Union[str, bytes]) -> None:
        self.on_ping()
        try:
            self.want = read_want(message, self.server.cameras)
        except BadInputError:
            self.close(1008)
        self.server.changed()

    def on_ping(self, data: bytes = b'') -> None:
        """Close the connection of a page that sends too much: it would hold up all others."""
        now = time.monotonic()
        self._left = min(self._left + _MESSAGES * (now - self._counted), _MOST_MESSAGES) - 1
        self._counted = now
        if self._left < 0:
            self.stream.close()

    def offer(self, key: Key, payload: Payload) -> None:
        """Send a message as soon as the ones before are sent, unless a newer one replaces it."""
        if not self._wants(key):
            return
        self._waiting[key] = payload
        if not self._sending:
            self._sending = True
            asyncio.ensure_future(self._send())  # noqa: RUF006 -- ends by itself

    def due_width(self) -> int:
        """Return the width of an image that is wanted now [px]; 0: none is."""
        return self.want.width if time.monotonic() >= self._next_image else 0

    def _wants(self, key: Key) -> bool:
        if key.kind == 'image' and (key.camera, key.width) == (self.want.camera, self.due_width()):
            now, period = time.monotonic(), 1 / self.want.rate
            # one that is late does not delay the next: 10 of 15 images a second can be sent
            self._next_image = now + period - min(now - self._next_image, period / 2)
            return True
        return key.kind != 'image'

    async def _send(self) -> None:
        """Send what waits, each message when the one before has left."""
        try:
            while self._waiting:
                _, payload = self._waiting.popitem(last=False)
                sent = asyncio.ensure_future(self.write_message(payload, isinstance(payload, bytes)))
                sent.add_done_callback(lambda done: done.exception())  # of a connection that was closed meanwhile
                if not (await asyncio.wait({sent}, timeout=_PATIENCE))[0]:
                    self.close()  # tornado ends the connection 5 s later, whether the client takes this or not
                    return
        except WebSocketClosedError:
            self._waiting.clear()
        finally:
            self._sending = False


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
