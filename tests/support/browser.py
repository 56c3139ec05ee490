"""A headless Chromium that tests steer by its DevTools protocol; see https://chromedevtools.github.io/devtools-protocol/."""
import asyncio
import base64
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import tornado.httpclient
import tornado.websocket

# WebGL by Mesa: Debian 11's Chromium is built without SwiftShader.
_FLAGS = ('--headless=new', '--no-sandbox', '--use-angle=gl-egl', '--ignore-gpu-blocklist', '--disable-quic',
          '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
          '--disable-dev-shm-usage', '--hide-scrollbars', '--remote-debugging-port=0')


def chromium() -> Optional[str]:
    """Return the program; None: it is not installed."""
    return shutil.which('chromium') or shutil.which('chromium-browser')


class Browser:
    """A page in Chromium, in a `with` statement; `errors`: what the console and the browser complained of."""

    def __init__(self, width: int = 1280, height: int = 800, phone: bool = False) -> None:
        self.errors: List[str] = []
        self._size, self._phone = (width, height), phone
        self._replies: Dict[int, Any] = {}
        self._number = 0
        self._loop = asyncio.new_event_loop()

    def __enter__(self) -> 'Browser':
        self._folder = Path(tempfile.mkdtemp(prefix='browser_'))
        program = chromium()
        assert program is not None, 'chromium is not installed'
        self._process = subprocess.Popen([program, *_FLAGS, f'--user-data-dir={self._folder}', 'about:blank'],
                                         stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._connect())
        self.call('Runtime.enable')
        self.call('Log.enable')
        self.call('Page.enable')
        self.resize(*self._size, phone=self._phone)
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(20)
        shutil.rmtree(str(self._folder), ignore_errors=True)  # its processes may write a moment longer
        self._loop.close()

    def open(self, address: str) -> None:
        """Load a page."""
        self.call('Page.navigate', url=address)

    def resize(self, width: int, height: int, phone: bool = False) -> None:
        """Change the size of the window [px]."""
        self.call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                  deviceScaleFactor=2 if phone else 1, mobile=phone)

    def run(self, script: str) -> Any:
        """Return the value of an expression in the page."""
        result = self.call('Runtime.evaluate', expression=script, returnByValue=True, awaitPromise=True)
        if 'exceptionDetails' in result:
            raise AssertionError(json.dumps(result['exceptionDetails']))
        return result['result'].get('value')

    def wait(self, script: str, until: Callable[[Any], bool] = bool, seconds: float = 120.0) -> Any:
        """Return the value of an expression as soon as it is as wanted."""
        end = time.monotonic() + seconds
        while True:
            value = self.run(script)
            if until(value):
                return value
            assert time.monotonic() < end, f'{script} is {value!r} after {seconds} s; errors: {self.errors}'
            time.sleep(0.1)

    def wait_for_drawing(self) -> None:
        """Wait until what is shown now is drawn."""
        self.run('new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))')

    def press(self, key: str) -> None:
        """Press a key."""
        text = {'text': key} if len(key) == 1 else {}
        self.call('Input.dispatchKeyEvent', type='keyDown', key=key, **text)
        self.call('Input.dispatchKeyEvent', type='keyUp', key=key)

    def screenshot(self) -> bytes:
        """Return what is drawn, as PNG."""
        return base64.b64decode(self.call('Page.captureScreenshot', format='png')['data'])

    def call(self, method: str, **params: Any) -> Any:
        """Call a method of the protocol and return its result."""
        return self._loop.run_until_complete(asyncio.wait_for(self._call(method, params), 120))

    async def _connect(self) -> None:
        port = self._folder / 'DevToolsActivePort'
        end = time.monotonic() + 60
        while not port.exists() or '\n' not in port.read_text():
            assert time.monotonic() < end and self._process.poll() is None, 'chromium did not start'
            await asyncio.sleep(0.1)
        client = tornado.httpclient.AsyncHTTPClient()
        address = f'http://127.0.0.1:{port.read_text().splitlines()[0]}/json'
        pages = json.loads((await client.fetch(address)).body)
        page = next(page for page in pages if page['type'] == 'page')
        self._socket = await tornado.websocket.websocket_connect(page['webSocketDebuggerUrl'],
                                                                 max_message_size=100_000_000)

    async def _call(self, method: str, params: Any) -> Any:
        self._number += 1
        await self._socket.write_message(json.dumps({'id': self._number, 'method': method, 'params': params}))
        while True:
            message = json.loads(await self._socket.read_message())
            if message.get('id') == self._number:
                assert 'error' not in message, message
                return message['result']
            self._note(message)

    def _note(self, message: Any) -> None:
        kind, params = message.get('method'), message.get('params', {})
        if kind == 'Runtime.exceptionThrown':
            self.errors.append(json.dumps(params['exceptionDetails'])[:500])
        if kind == 'Runtime.consoleAPICalled' and params['type'] in ('error', 'warning', 'assert'):
            self.errors.append(' '.join(str(each.get('value')) for each in params['args']))
        if kind == 'Log.entryAdded' and params['entry']['level'] == 'error':
            self.errors.append(f'{params["entry"]["text"]} {params["entry"].get("url", "")}')
