"""A page as people_web_node sees it: keeps what it gets."""
import asyncio
import json
import threading
import time
from typing import Any, Callable, Dict, List, Optional

from tornado.websocket import websocket_connect

from session import await_true


class PageClient:
    """Connects in a thread of its own, until it is closed or the server has `ended` the connection.

    Args:
        keep: called with each message and the time of its arrival [s], instead of keeping it in `messages`.
    """

    def __init__(self, port: int, want: Optional[Dict[str, Any]] = None,
                 keep: Optional[Callable[[Any, float], None]] = None) -> None:
        self.messages: List[Any] = []
        self._keep = keep or (lambda message, arrival: self.messages.append(message))
        self._url, self._want = f'ws://localhost:{port}/ws', want
        self.ended, self._opened = False, threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._read(),), daemon=True)
        self._thread.start()
        await_true(lambda: self._opened.is_set() or not self._thread.is_alive(), self._url)
        assert self._opened.is_set(), f'{self._url} refused'

    def of(self, kind: str) -> List[Any]:
        """Return the texts of a type so far."""
        return [message for message in list(self.messages) if isinstance(message, dict) and message['type'] == kind]

    def binary(self, kind: int) -> List[bytes]:
        """Return the binary messages of a kind so far."""
        return [message for message in list(self.messages) if isinstance(message, bytes) and message[0] == kind]

    def wait(self, kind: str, condition: Callable[[Any], bool] = lambda message: True) -> Any:
        """Return the newest text of a type for which a condition holds, as soon as there is one."""
        return await_true(lambda: next((message for message in reversed(self.of(kind)) if condition(message)), None),
                          lambda: f'{kind}; got {self.of(kind)[-2:]}')

    def send(self, text: str) -> None:
        """Send a text."""
        self._loop.call_soon_threadsafe(self._page.write_message, text)

    def close(self) -> None:
        """End the connection."""
        self._loop.call_soon_threadsafe(self._page.close)
        self._thread.join()

    async def _read(self) -> None:
        self._page = await websocket_connect(self._url)
        if self._want is not None:
            await self._page.write_message(json.dumps({'want': self._want}))
        self._opened.set()
        while True:
            message = await self._page.read_message()
            if message is None:
                self.ended = True
                return
            self._keep(json.loads(message) if isinstance(message, str) else message, time.time())
