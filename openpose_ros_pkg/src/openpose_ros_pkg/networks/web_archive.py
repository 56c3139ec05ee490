"""Download a zip file from its maker's address, and read the one member of it that is wanted.

What comes is trusted only by the checksum of the member, wherever the address redirects to.
"""
import http.client
import urllib.error
import urllib.request
import zipfile
import zlib
from pathlib import Path

from openpose_ros_pkg.command_line import Progress
from openpose_ros_pkg.errors import ModelError

# Greatest size of an archive and of its member [bytes]; the known ones have up to 60 MB.
MOST_BYTES = 256 << 20
_TIMEOUT = 30.0  # of a server that sends nothing [s]
_BLOCK = 1 << 16


def download(address: str, path: Path, most: int = MOST_BYTES, timeout: float = _TIMEOUT) -> None:
    """Download a file; raise ModelError if the server can not be reached, answers with an error, or sends too much."""
    request = urllib.request.Request(address, headers={'User-Agent': 'openpose_ros'})  # noqa: S310
    try:
        with urllib.request.urlopen(request, timeout=timeout) as response, path.open('wb') as file:  # noqa: S310
            length = response.getheader('Content-Length')
            with Progress(total=length and int(length), unit='B', unit_scale=True) as bar:
                for block in iter(lambda: response.read1(_BLOCK), b''):
                    file.write(block)
                    bar.update(len(block))
                    if bar.n > most:
                        raise ModelError(f'{address} has more than {most} bytes')
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise ModelError(f'{address} can not be fetched: {error or type(error).__name__}') from error


def zip_member(archive: Path, name: str, most: int = MOST_BYTES) -> bytes:
    """Return the one file of this name in any folder of a zip file; nothing is extracted.

    Raises:
        ModelError: no zip file, a damaged one, or one without exactly one such file of at most so many bytes.
    """
    try:
        with zipfile.ZipFile(str(archive)) as opened:
            members = [member for member in opened.infolist() if member.filename.rsplit('/', 1)[-1] == name
                       and member.file_size <= most]
            if len(members) != 1:
                raise ModelError(f'{archive.name} has {len(members)} files {name}, expected one')
            with opened.open(members[0]) as file:
                return file.read(most)  # at most the size that the member claims
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OverflowError, OSError) as error:
        raise ModelError(f'{archive.name} is damaged or no zip file: {error or type(error).__name__}') from error
