"""Download a zip file from its maker's address, and read the one member of it that is wanted.

What comes is trusted only by the checksum of the member, wherever the address redirects to.
"""
import http.client
import socket
import time
import urllib.error
import urllib.request
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from openpose_ros_pkg.command_line import Progress
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class DownloadLimits:
    """What a download may take."""

    most_bytes: int = constant(256 << 20, 'Greatest size of an archive and of its member; the known ones have up to '
                                          '60 MB.', unit='B')
    patience: float = constant(30.0, 'A server that sends less than `least_bytes` in this time has stalled.', unit='s')
    least_bytes: int = constant(30_000, '1 kB/s: such a download would take a day.', unit='B')


LIMITS = DownloadLimits()
_BLOCK = 1 << 16  # bytes that are read at once


def download(address: str, path: Path, limits: DownloadLimits = LIMITS) -> None:
    """Download a file.

    Raises:
        ModelError: the server can not be reached, answers with an error, sends too much, stalls, or ends too early.
    """
    opener = urllib.request.build_opener()
    opener.addheaders = [('User-Agent', 'openpose_ros')]
    try:
        with opener.open(address, timeout=limits.patience) as response, path.open('wb') as file:
            length = response.getheader('Content-Length')
            with Progress(total=None if length is None else int(length), unit='B', unit_scale=True) as bar:
                _receive(response, file, bar, address, limits)
    except urllib.error.HTTPError as error:
        raise ModelError(f'{address} answers {error.code} {error.reason}') from error
    except urllib.error.URLError as error:
        raise ModelError(f'{address} can not be reached: {error.reason}') from error
    except socket.timeout as error:
        raise ModelError(f'{address} has stalled: nothing in {limits.patience:g} s') from error
    except (http.client.HTTPException, ConnectionError, ValueError) as error:
        raise ModelError(f'{address} was cut off, or answers nonsense: {error or type(error).__name__}') from error


def _receive(response: http.client.HTTPResponse, file: IO[bytes], bar: Progress, address: str, limits: DownloadLimits
             ) -> None:
    """Write what a server sends into a file; raise ModelError where it is too much, too slow or too little."""
    window_begin, window_bytes = time.monotonic(), 0
    while True:
        if max(bar.n, bar.total or 0) > limits.most_bytes:
            raise ModelError(f'{address} has {max(bar.n, bar.total or 0)} bytes, expected at most {limits.most_bytes}')
        block = response.read1(_BLOCK)
        if not block:
            break
        file.write(block)
        bar.update(len(block))
        window_bytes += len(block)
        if time.monotonic() - window_begin > limits.patience:
            if window_bytes < limits.least_bytes:
                raise ModelError(f'{address} has stalled: {window_bytes} bytes in {limits.patience:g} s')
            window_begin, window_bytes = time.monotonic(), 0
    if bar.total is not None and bar.n != bar.total:
        raise ModelError(f'{address} was cut off after {bar.n} of {bar.total} bytes')


def zip_member(archive: Path, name: str, size: int = 0, limits: DownloadLimits = LIMITS) -> bytes:
    """Return the one file of this name in any folder of a zip file; nothing is extracted.

    Args:
        size: of the file [bytes], which is compared before it is unpacked; 0: not known.

    Raises:
        ModelError: no zip file, a damaged one, or one without exactly one such file of the right size.
    """
    try:
        with zipfile.ZipFile(str(archive)) as opened:
            members = [member for member in opened.infolist() if member.filename.rsplit('/', 1)[-1] == name]
            if len(members) != 1:
                raise ModelError(f'{archive.name} has {len(members)} files {name}, expected one')
            member, = members
            if member.file_size > limits.most_bytes or (size and member.file_size != size):
                raise ModelError(f'{name} in {archive.name} has {member.file_size} bytes, expected '
                                 f'{size or f"at most {limits.most_bytes}"}')
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise ModelError(f'{name} in {archive.name} is compressed by method {member.compress_type}, expected '
                                 f'{zipfile.ZIP_STORED} or {zipfile.ZIP_DEFLATED}')
            with opened.open(member) as file:
                return file.read(limits.most_bytes)  # at most the size that the member claims
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OverflowError, OSError) as error:
        raise ModelError(f'{archive.name} is damaged or no zip file: {error or type(error).__name__}') from error
