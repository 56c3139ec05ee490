"""The page with a recording inside: one file of HTML that needs no server and no network."""
import base64
import html
import json
import re
import zlib
from pathlib import Path
from typing import Dict, Iterable, List, Sequence

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_web.protocol import Message, encode

_ENTRY = 'main.js'
# How the page's modules name each other.
_IMPORT = re.compile(r"(\b(?:from|import)\s*)'\./(?:vendor/)?([\w.]+\.js)'")
# The modules are within the page, and nothing is fetched or sent.
_POLICY = "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; img-src data: blob:"


def recorded_page(title: str, facts: Message, frames: Iterable[Sequence[Message]], www: Path, three: Path) -> str:
    """Return the page.

    Nothing of the recording is markup: the title is escaped, and all else is compressed and in base64.

    Args:
        title: of the browser's window.
        facts: what `www/recording.js` reads: `hello` and the stamps of the frames among them.
        frames: messages of each frame.
        www: folder of the page's files.
        three: folder of three.js.

    Raises:
        BadInputError: a file of the page is missing.
    """
    try:
        modules = _modules(www, three)
        style, page, licence = (path.read_text(encoding='utf-8') for path in (
            www / 'style.css', www / 'index.html', three / 'LICENSE'))
    except OSError as error:
        raise BadInputError(f'the page lacks a file: {error.filename}: {error.strerror}') from error
    imports = {'imports': {name: f'data:text/javascript;base64,{_base64(text.encode())}'
                           for name, text in modules.items()}}
    policy, data = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">', _base64(_packed(facts, frames))
    for there, new in (
            ('<meta charset="utf-8">',
             f'<meta charset="utf-8">\n{policy}\n<!-- three.js and OrbitControls:\n{licence}-->'),
            ('<title>People</title>', f'<title>{html.escape(title)}</title>'),
            ('<link rel="stylesheet" href="style.css">', f'<style>\n{style}</style>'),
            ('<script type="module" src="main.js"></script>',
             f'<script type="importmap">{json.dumps(imports)}</script>\n'
             f'<script type="module">import \'{_ENTRY}\'</script>'),
            ('</body>', f'<script type="text/plain" id="recording">{data}</script>\n</body>')):
        if page.count(there) != 1:
            raise ValueError(f'index.html has {page.count(there)} times {there}, expected once')
        page = page.replace(there, new)
    return page


def _modules(www: Path, three: Path) -> Dict[str, str]:
    """Return the modules that the page imports by name, which is how they import each other here."""
    found: Dict[str, str] = {}
    names: List[str] = [_ENTRY]
    while names:
        name = names.pop()
        if name not in found:
            path = www / name if (www / name).is_file() else three / name
            text = path.read_text(encoding='utf-8')
            names += [imported for _, imported in _IMPORT.findall(text)]
            found[name] = _IMPORT.sub(r"\1'\2'", text)
    return found


def _packed(facts: Message, frames: Iterable[Sequence[Message]]) -> bytes:
    """Return a line of facts and one for each frame, compressed."""
    packer = zlib.compressobj(9)
    parts = [packer.compress(f'{encode(facts)}\n'.encode())]
    parts += [packer.compress(f'[{",".join(map(encode, messages))}]\n'.encode()) for messages in frames]
    return b''.join([*parts, packer.flush()])


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode()
