"""The library three.js, which draws the page's view: fetched from npm, compared with checksums, never installed."""
import argparse
import sys
import tempfile
from pathlib import Path
from typing import Optional, Sequence

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_types import Archive
from openpose_ros_pkg.networks.models import default_model_folder, file_digest
from openpose_ros_pkg.networks.weights_install import archive_member, fetch_archive, say
from openpose_ros_pkg.output.files import write_whole

# Under the MIT licence. From 0.172 on the library is two files.
ARCHIVE = Archive(
    project='three', version='0.170.0', file='three-0.170.0.tgz',
    sha256='4a608a355dcaba72e0e5383cdc814303f5b6060b43c238cdf6932dceb699238d', member='', author='three.js authors')
# Members of the archive, and SHA-256 of the files as they are kept.
FILES = {
    'build/three.module.min.js': '08fd7545d13d2c7fb65ab691530a802dafefd638596501854f267d0fb13c39e7',
    'examples/jsm/controls/OrbitControls.js': 'e9c4f26866d39a36c8c9e8215e7d2a90a8a0b50ea6d44a005906e3d1fc726b8f',
    'LICENSE': '4c40a1ef62450b857c3b2aaf294936304cd552d965fbcd9d32d4c5bcf4ba4454'}


def three_folder() -> Path:
    """Return the folder with the library, which the page reads as vendor/.

    Raises:
        ModelError: a file is missing or damaged.
    """
    folder = _folder()
    for member, sha256 in FILES.items():
        path = folder / Path(member).name
        if not path.is_file() or file_digest(path, 'sha256') != sha256:
            raise ModelError(f'{path} is missing or damaged; to fetch it: rosrun openpose_ros_web fetch_three')
    return folder


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command line of fetch_three and return the exit status."""
    parser = argparse.ArgumentParser(prog='fetch_three', description='Fetch three.js, unless it is here and right.')
    parser.add_argument('--check', action='store_true', help='only say whether it is')
    options = parser.parse_args(arguments)
    try:
        say(f'three.js is there and right: {three_folder()}')
        return 0
    except ModelError as error:
        if options.check:
            sys.stderr.write(f'error: {error}\n')
            return 1
    try:
        say(f'three.js: fetching {ARCHIVE.project} {ARCHIVE.version} from npm')
        _fetch()
        say(f'three.js is in place: {three_folder()}')
    except (ModelError, OSError) as error:
        sys.stderr.write(f'error: three.js could not be fetched: {error}\n')
        return 1
    return 0


def _folder() -> Path:
    return default_model_folder().parent / f'three-{ARCHIVE.version}'


def _fetch() -> None:
    with tempfile.TemporaryDirectory(prefix='openpose_ros_') as place:
        archive = fetch_archive(ARCHIVE, Path(place))
        if file_digest(archive, 'sha256') != ARCHIVE.sha256:
            raise ModelError(f'{archive.name} is not the expected file')
        _folder().mkdir(parents=True, exist_ok=True)
        for member in FILES:
            # without an import map, which the page's security policy forbids, 'three' leads nowhere
            content = archive_member(archive, member).replace(b"} from 'three';", b"} from './three.module.min.js';")
            write_whole(_folder() / Path(member).name, content)
