"""Step 4 of the set-up, the build, and commands in what was built."""
import hashlib
import os
import shutil
import subprocess
from pathlib import Path
from typing import Dict, NoReturn, Optional, Sequence

from development import PACKAGES, PYTHON, ROOT
from development.systems import this_system
from development.terminal import die, say, step

STAMP = ROOT / 'build/.built_by_run'
DEVEL_SETUP = ROOT / 'devel/setup.bash'
# What a build depends on; Python modules, launch and configuration files are used where they lie.
BUILT_SUFFIXES = {'.msg', '.srv', '.cpp', '.h', '.cmake'}
BUILT_NAMES = {'CMakeLists.txt', 'package.xml', 'setup.py'}


def set_up_build() -> None:
    wanted = _fingerprint()
    if STAMP.exists() and STAMP.read_text() == wanted and DEVEL_SETUP.is_file():
        say('[4/4] Build: up to date')
    else:
        step('[4/4] Build: catkin_make', 'build',
             'if a CMakeLists.txt, package.xml, msg, srv or C++ file was changed, mend it', _build, wanted)


def _fingerprint() -> str:
    sums = hashlib.sha256(str(ROOT).encode())
    for command in ([PYTHON, '--version'], ['dpkg-query', '--show', 'catkin', 'ros-noetic-catkin']):
        sums.update(subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False).stdout)
    files = [path for package in PACKAGES for path in sorted((ROOT / package).rglob('*')) if path.is_file()]
    for path in [ROOT / 'CMakeLists.txt', *files]:
        read = path.name in BUILT_NAMES or path.suffix in BUILT_SUFFIXES or path.parent.name == 'env-hooks'
        if read or path.suffix == '.test' or path.parent.name == 'scripts':
            sums.update(f'{path.relative_to(ROOT)}\n'.encode() + (path.read_bytes() if read else b''))
    return sums.hexdigest()


def _build(wanted: str) -> None:
    """Build from scratch, which takes a minute: so it heals what an interrupted build or another build tool left."""
    for folder in ('build', 'devel'):
        shutil.rmtree(str(ROOT / folder), ignore_errors=True)
    subprocess.run(['catkin_make', '--source', '.', f'-DPYTHON_EXECUTABLE={PYTHON}'], cwd=str(ROOT), check=True,
                   env=_environment_of(this_system().ros_setup))
    STAMP.write_text(wanted)


def workspace_environment() -> Dict[str, str]:
    """Return the environment of a shell that has sourced the workspace's setup.bash."""
    if not STAMP.is_file():
        die('the workspace is not built yet: ./run setup')
    return _environment_of(DEVEL_SETUP)


def _environment_of(setup: Optional[Path]) -> Dict[str, str]:
    if setup is None:
        return dict(os.environ)
    # in a function, as catkin's scripts look at the positional parameters
    script = 'enter() { source "$0" >&2; }; enter; env --null'
    output = subprocess.run(['bash', '-c', script, str(setup)], stdout=subprocess.PIPE, text=True, check=True).stdout
    return dict(variable.split('=', 1) for variable in output.split('\0') if variable)


def enter_workspace(command: Sequence[str], **variables: Optional[str]) -> NoReturn:
    """Become a command in the built workspace, with these variables set, or unset where they are None."""
    environment: Dict[str, Optional[str]] = {**workspace_environment(), **variables}
    try:
        os.execvpe(command[0], list(command), {name: value for name, value in environment.items() if value is not None})
    except OSError as error:
        die(f'{command[0]}: {error.strerror}')
