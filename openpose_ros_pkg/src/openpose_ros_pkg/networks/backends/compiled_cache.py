"""Networks that OpenVINO has compiled, kept on disk for a faster start.

OpenVINO's own cache (CACHE_DIR) loads a damaged file without an error and grows without limit, by a file for each size
of image. Here each file carries a checksum, and those unused for the longest time are deleted.
"""
import functools
import hashlib
import logging
import os
import re
import stat
from pathlib import Path
from typing import Optional

from openpose_ros_pkg.networks.models import default_model_folder
from openpose_ros_pkg.output.files import write_whole

_log = logging.getLogger(__name__)

# The default network takes 8 MB for each size of its input, the largest of OpenPose's about 200 MB.
_MAX_BYTES = 1 << 30
_DIGEST_BYTES = hashlib.sha256().digest_size
# Names of its files, and of temporary ones that a killed process left: nothing else is ever deleted.
_OWN_NAME = re.compile(r'[0-9a-f]{32}\.blob|\.[0-9a-f]{32}\.blob\.[0-9]+\.part')


class CompiledCache:
    """Files by key. Errors of the folder are logged, not raised: without a cache the network is compiled again."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def load(self, key: str) -> Optional[bytes]:
        """Return the data stored under a key; None: no file, or an unreadable or damaged one."""
        path = self._path(key)
        try:
            content = path.read_bytes()
            os.utime(str(path))
        except FileNotFoundError:
            return None
        except OSError as error:
            _warn_once(str(error.strerror or error))
            return None
        digest, data = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
        if hashlib.sha256(data).digest() != digest:
            _log.warning('compiled network %s is damaged: it is compiled again', path)
            return None
        return data

    def store(self, key: str, data: bytes) -> None:
        """Store a compiled network; beyond the maximum of bytes, delete the files unused for the longest time."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._path(key), hashlib.sha256(data).digest() + data)
            self._prune()
        except OSError as error:
            _warn_once(str(error.strerror or error))

    def _path(self, key: str) -> Path:
        return self._folder / f'{hashlib.sha256(key.encode()).hexdigest()[:32]}.blob'

    def _prune(self) -> None:
        own = [(path.lstat(), path) for path in self._folder.iterdir() if _OWN_NAME.fullmatch(path.name)]
        total = 0
        for status, path in sorted(own, key=lambda item: item[0].st_mtime, reverse=True):
            if stat.S_ISREG(status.st_mode):
                total += status.st_size
                if total > _MAX_BYTES:
                    path.unlink()


@functools.lru_cache(maxsize=None)
def _warn_once(reason: str) -> None:
    _log.warning('the cache of compiled networks can not be used, each start compiles again: %s', reason)


def open_cache(folder: str) -> Optional[CompiledCache]:
    """Return the cache that the parameter `compiled_cache` names: '' the default one, 'off' none.

    It is a subfolder of its own, as the user's folder may hold other files.
    """
    if folder == 'off':
        return None
    return CompiledCache(Path(folder).expanduser() / 'openpose_ros_compiled' if folder
                         else default_model_folder().parent / 'compiled')
