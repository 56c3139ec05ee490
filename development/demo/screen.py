"""A screen in memory for RViz, and screenshots."""
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Dict, Optional

from session import ENDS_WITH_PARENT

# Width and height of the screen [px]; the RViz configuration opens its window at this size.
RVIZ_SIZE = (1440, 900)


class HeadlessScreen:
    """An Xvfb server on a free display, rendering OpenGL in software."""

    def __init__(self, width: int, height: int) -> None:
        self._size = f'{width}x{height}x24'
        self._server: Optional[subprocess.Popen] = None
        self._display = ''
        self._runtime = tempfile.TemporaryDirectory(prefix='openpose_ros_screen_')

    def __enter__(self) -> 'HeadlessScreen':
        read_end, write_end = os.pipe()
        self._server = subprocess.Popen(
            [*ENDS_WITH_PARENT, 'Xvfb', '-displayfd', str(write_end), '-screen', '0', self._size, '+extension', 'GLX',
             '-nolisten', 'tcp'],
            pass_fds=[write_end], stderr=subprocess.DEVNULL, start_new_session=True)
        os.close(write_end)
        with os.fdopen(read_end) as announced:
            self._display = ':' + announced.readline().strip()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.terminate()
        self._server.wait()
        self._runtime.cleanup()

    def environment(self) -> Dict[str, str]:
        """Return the variables with which a program draws on this screen."""
        return {'DISPLAY': self._display, 'LIBGL_ALWAYS_SOFTWARE': '1', 'QT_X11_NO_MITSHM': '1',
                'XDG_RUNTIME_DIR': self._runtime.name}


def take_screenshot(path: Path) -> None:
    """Write what $DISPLAY shows as a PNG file."""
    subprocess.run(['scrot', '--overwrite', str(path)], check=True)
