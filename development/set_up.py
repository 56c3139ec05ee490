"""./run setup: packages of the system and of PyPI, weights, build. What is there and right is left alone."""
import argparse
import fcntl
import hashlib
import os
import platform
import re
import shlex
import shutil
import time
from functools import partial
from pathlib import Path
from subprocess import run
from typing import List, Optional, Sequence, TextIO

from development import CONDA, LOGS, PACKAGES, PYTHON, ROOT, VENV, VENV_FOCAL, VENV_PYTHON
from development.locks import FOCAL_REQUIREMENTS, REQUIREMENTS, TEST_REQUIREMENTS, lock_of
from development.systems import needed_packages, this_system
from development.terminal import die, output_of, say, step, succeeds
from development.workspace import BUILD_STAMP, DEVEL, environment_of, underlays

BAD_IN_PATHS = r'[\s\'"\\;$:]'
APT = ('env', 'DEBIAN_FRONTEND=noninteractive', 'apt-get', '--yes', '--no-install-recommends',
       '-o', 'DPkg::Lock::Timeout=900', '-o', 'Dpkg::Use-Pty=0', '-o', 'Dpkg::Options::=--force-confdef',
       '-o', 'Dpkg::Options::=--force-confold')
VENV_STAMP = VENV / '.complete'  # 'with' or 'without' OpenVINO, and what it was made from
TEST_STAMP = VENV / '.complete_test'
# The system's cv_bridge, OpenCV and SciPy are built for its NumPy, so nothing of PyPI may bring another one.
NUMPY = VENV / 'numpy.txt'
PIP = ('-m', 'pip', 'install', '--disable-pip-version-check', '--require-hashes')
PIP_BESIDE_NUMPY = (VENV_PYTHON, *PIP, '--constraint', str(NUMPY))
CHECK_VENV = """
import sys, cv2, numpy
print('numpy', numpy.__version__, numpy.__file__, 'opencv', cv2.__version__)
if numpy.__file__.startswith(sys.prefix):
    sys.exit('cv_bridge needs the NumPy of the system')
if sys.argv[1] == 'with':
    sys.modules['openvino_telemetry'] = None  # it would send usage data
    import openvino
    print('openvino', openvino.__version__)
"""
# What the tests need of a Python 3.8, beside what they install: headers to compile modules with, and pip.
CHECK_PYTHON_38 = """
import ensurepip, os, ssl, sys, sysconfig
headers = os.path.join(sysconfig.get_path('include'), 'Python.h')
sys.exit(sys.version_info[:2] != (3, 8) or not os.path.exists(headers))
"""
FOCAL_STAMP = VENV_FOCAL / '.complete'
# In an environment of set-up, from its first moment on.
MADE_BY_RUN = '.made_by_run'
MODELS_PROGRAM = ROOT / 'openpose_ros_pkg/scripts/openpose_models'
MODELS = ('mobilenet_thin', 'movenet_multipose')
# Small ones at a public address, which set-up takes where it reaches each in this time [s].
SMALL_MODELS, SMALL_TIME = ('picodet', 'tinypose'), 20
# What is not there without a network; set-up goes on.
WITHOUT = {
    'movenet_thunder': 'people are found without it, less accurately',
    'hand_landmark': 'hands are not found (parameter hands)', 'face_landmark': 'faces are not found (parameter face)',
    'pose_landmark': 'heels and toes are not found',
    **dict.fromkeys(SMALL_MODELS, 'all modes work, less accurately')}
# What a build depends on; Python modules, launch and configuration files are used where they lie.
BUILT_SUFFIXES = {'.msg', '.srv', '.cpp', '.h', '.cmake'}
BUILT_NAMES = {'CMakeLists.txt', 'package.xml', 'setup.py'}


def set_up(arguments: Sequence[str], test_tools: bool = False, python_38: Optional[str] = None) -> None:
    """Set everything up; with a Python 3.8 also .venv_focal."""
    parser = argparse.ArgumentParser(prog='./run setup', description='See ./run help.')
    parser.add_argument('--without-openvino', dest='openvino', action='store_const', const='without')
    parser.add_argument('--with-openvino', dest='openvino', action='store_const', const='with')
    parser.add_argument('--no-build', dest='build', action='store_false')
    options = parser.parse_args(arguments)
    started = time.monotonic()
    _check_place()
    _check_system()
    with _lock():
        say(f'Setting up {ROOT}' + ''.join(f', on {path}' for path in underlays()))
        _set_up_system_packages(test_tools)
        _set_up_venv(options.openvino)
        if test_tools:
            _set_up_test_tools()
        if python_38:
            _set_up_focal(python_38)
        _set_up_weights()
        if options.build:
            _set_up_build()
        else:
            say('[4/4] Build: left to you')
    say(f'Ready after {time.monotonic() - started:.0f} s.'
        + (f' In a terminal of your own: source {DEVEL}/setup.bash' if options.build else ''))


def _check_place() -> None:
    if re.search(BAD_IN_PATHS, str(ROOT)):
        die(f'ROS can not work in a folder with such a name; move the checkout: {ROOT}')
    if not all(os.access(str(folder), os.W_OK) for folder in (ROOT, LOGS) if folder.exists()):
        die(f'{os.environ.get("USER", "this user")} may not write in {ROOT}')
    LOGS.mkdir(exist_ok=True)


def _check_system() -> None:
    try:
        this_system()
    except (OSError, ValueError) as error:
        die(str(error))


def _lock() -> TextIO:
    """Return a file that holds the lock of the set-up until it is closed: two at once would undo each other's work."""
    lock = (LOGS / 'setup.lock').open('a')
    fcntl.flock(lock, fcntl.LOCK_EX)
    return lock


# ---- 1: packages of the system

def _set_up_system_packages(tests: bool) -> None:
    missing = _missing_packages(tests)
    if not missing:
        say('[1/4] System packages: all there')
        return
    if CONDA is not None:
        die(f'{CONDA} lacks {", ".join(missing)}; add them: conda env update --file {ROOT / "environment.yml"}')
    step(f'[1/4] System packages: installing {len(missing)} and what these need', 'packages',
         'check the network and the sources of apt (on Ubuntu universe is needed, on 20.04 that of ROS noetic too)',
         _install, missing, _as_root(missing))
    missing = _missing_packages(tests)
    if missing:
        die(f'apt-get reported success, but these packages are still missing: {" ".join(missing)}')


def _missing_packages(tests: bool) -> List[str]:
    if CONDA is not None:
        installed = {path.stem.rsplit('-', 2)[0] for path in CONDA.glob('conda-meta/*.json')}
    else:
        shown = output_of('dpkg-query', '--show', '--showformat', '${db:Status-Abbrev}${Package}\n')
        installed = {line[3:] for line in shown.splitlines() if line[1:3] == 'i '}
    return sorted(needed_packages(this_system(), tests) - installed)


def _as_root(packages: Sequence[str]) -> List[str]:
    """Return what comes in front of a command to run it as root; ask for the password if that is needed."""
    if os.getuid() == 0:
        return []
    names = shlex.join(packages)
    if shutil.which('sudo') is None:
        die('system packages are missing and there is no sudo; do this once as root, then run ./run setup again:\n'
            f'  apt-get update && apt-get install --no-install-recommends {names}')
    if not succeeds('sudo', '-n', 'true', quiet=True) and not succeeds('sudo', '-v'):
        die(f'this user may not install system packages with sudo: {names}')
    return ['sudo', '-n']


def _install(packages: Sequence[str], root: Sequence[str]) -> None:
    apt = (*root, *APT)
    succeeds(*root, 'dpkg', '--configure', '-a')  # what an interrupted installation left
    if not succeeds(*apt, 'install', *packages):  # there is no package list, or an old one names files that are gone
        run_all([*apt, 'update'], [*apt, '--fix-broken', 'install'], [*apt, 'install', *packages])


# ---- 2: packages of PyPI, in .venv, beside the system's

def _set_up_venv(openvino: Optional[str]) -> None:
    """Make .venv `with` or `without` OpenVINO; None: as before, or as the machine allows."""
    stamp, why = _read(VENV_STAMP), ''
    if openvino is None and stamp.startswith('without'):
        openvino, why = 'without', ', as chosen before; --with-openvino changes that'
    elif openvino is None and platform.machine() not in ('x86_64', 'aarch64'):
        openvino, why = 'without', f' (which has no package for {platform.machine()}): OpenCV computes the network'
    openvino = openvino or 'with'
    numpy = output_of(PYTHON, '-c', 'import numpy; print(f"numpy=={numpy.__version__}")')
    made_from = _hash(f'{ROOT} {output_of(PYTHON, "--version")} {numpy}', lock_of(REQUIREMENTS))
    wanted = f'{openvino} {made_from}'
    if stamp == wanted and succeeds(VENV_PYTHON, '-B', '-c', CHECK_VENV, openvino, quiet=True):
        say(f'[2/4] Python packages: .venv is right, {openvino} OpenVINO{why}')
        return
    clear(VENV)
    step(f'[2/4] Python packages: making .venv {openvino} OpenVINO{why}', 'venv',
         'check the network; where PyPI can not be reached: ./run setup --without-openvino',
         _make_venv, openvino, numpy)
    VENV_STAMP.write_text(wanted)


def _make_venv(openvino: str, numpy: str) -> None:
    run([PYTHON, '-m', 'venv', '--system-site-packages', str(VENV)], check=True)
    NUMPY.write_text(numpy)
    if openvino == 'with':
        run([*PIP_BESIDE_NUMPY, '--only-binary', 'openvino', '-r', str(lock_of(REQUIREMENTS))], check=True)
    run([VENV_PYTHON, '-B', '-c', CHECK_VENV, openvino], check=True)


def check_own(environment: Path) -> None:
    """End the program where the user has an environment of this name: it would be deleted."""
    own = any((environment / name).exists() for name in (MADE_BY_RUN, VENV_STAMP.name))
    if environment.is_symlink() or (environment.exists() and not own):
        die(f'{environment} was not made by ./run setup, which needs this name; move it away')


def clear(folder: Path) -> None:
    """Make a folder of this program anew; see `check_own`."""
    check_own(folder)
    shutil.rmtree(str(folder), ignore_errors=True)
    folder.mkdir()
    (folder / MADE_BY_RUN).touch()


def _set_up_test_tools() -> None:
    wanted = _hash('', lock_of(TEST_REQUIREMENTS))
    if _read(TEST_STAMP) != wanted:
        step('[2/4] Python packages: adding the test tools to .venv', 'test_tools',
             'check the network; the test tools come from PyPI',
             run_all, [*PIP_BESIDE_NUMPY, '-r', str(lock_of(TEST_REQUIREMENTS))])
        TEST_STAMP.write_text(wanted)


def run_all(*commands: Sequence[str]) -> None:
    """Run commands one after the other; one that fails is an error."""
    for command in commands:
        run(command, check=True)


def find_python_38() -> Optional[str]:
    """Return a Python 3.8 of pyenv or on PATH that can make .venv_focal; None: there is none."""
    return find_python(CHECK_PYTHON_38, '3.8')


def find_python(check: str, *versions: str) -> Optional[str]:
    """Return the first Python of these versions, of pyenv or on PATH, in which a program succeeds."""
    pyenv = Path(os.environ.get('PYENV_ROOT') or Path.home() / '.pyenv')
    candidates = [name for version in versions for name in (*map(str, sorted(pyenv.glob(
        f'versions/{version}*/bin/python{version}'))), f'python{version}')]
    return next((python for python in candidates if succeeds(python, '-c', check, quiet=True)), None)


def _set_up_focal(python: str) -> None:
    wanted = _hash(f'{ROOT} {python} {output_of(python, "--version")}', lock_of(FOCAL_REQUIREMENTS))
    if _read(FOCAL_STAMP) != wanted:
        clear(VENV_FOCAL)
        step(f'[2/4] Python packages: making .venv_focal, the libraries of Ubuntu 20.04, with {python}', 'focal',
             'check the network; the libraries come from PyPI', run_all, [python, '-m', 'venv', str(VENV_FOCAL)],
             [str(VENV_FOCAL / 'bin/python3'), *PIP, '-r', str(lock_of(FOCAL_REQUIREMENTS))])
        FOCAL_STAMP.write_text(wanted)


# ---- 3: weights, and the library of the page

def _set_up_weights() -> None:
    three = _command(ROOT / 'extensions/openpose_ros_web/scripts/fetch_three')
    if weights('check', *MODELS, *WITHOUT, quiet=True) and succeeds(*three, '--check', quiet=True):
        say('[3/4] Networks and three.js: there and right')
        return
    missing = [model for model in (*MODELS, *WITHOUT) if not weights('check', model, quiet=True)]
    step('[3/4] Networks and three.js, which draws the page: fetching', 'weights', 'as the lines above say',
         _fetch, missing, three)
    missing = [model for model in missing if not weights('check', model, quiet=True)]
    for without in dict.fromkeys(WITHOUT[model] for model in missing):
        names = ' '.join(model for model in missing if WITHOUT[model] == without)
        say(f'      {names} could not be fetched: {without}. To try again: ./run model get {names}')
    if not succeeds(*three, '--check', quiet=True):
        say('      three.js could not be fetched: there is no page of people (web:=true). To try again: ./run setup')


def _fetch(models: Sequence[str], three: Sequence[str]) -> None:
    """Fetch what is needed, or fail, and what is wanted, or not."""
    for model in models:
        get = _command(MODELS_PROGRAM, 'get', model)
        if model in MODELS:
            run(get, check=True)
        else:
            succeeds(*(['timeout', str(SMALL_TIME)] if model in SMALL_MODELS else []), *get)
    succeeds(*three)


def weights(*arguments: str, quiet: bool = False) -> bool:
    """Run openpose_models; return whether it succeeded."""
    return succeeds(*_command(MODELS_PROGRAM, *arguments), quiet=quiet)


def _command(script: Path, *arguments: str) -> List[str]:
    """Return a program with what is there so far: the sources, and packages of PyPI."""
    sources = [PACKAGES[name] / 'src' for name in ('openpose_ros_pkg', 'openpose_ros_web')]
    from_pypi = ''.join(map(str, VENV.glob('lib/python3*/site-packages')))
    variables = [f'PYTHONPATH={os.pathsep.join(map(str, sources))}', f'OPENPOSE_ROS_SITE_PACKAGES={from_pypi}']
    return ['env', *variables, PYTHON, '-B', str(script), *arguments]


# ---- 4: build

def _set_up_build() -> None:
    """Build from scratch, which takes a minute: so it heals what an interrupted build or another build tool left."""
    wanted = _fingerprint()
    if _read(BUILD_STAMP) == wanted and (DEVEL / 'setup.bash').is_file():
        say('[4/4] Build: up to date')
        return
    for folder in ('build', 'devel'):
        shutil.rmtree(str(ROOT / folder), ignore_errors=True)
    step('[4/4] Build: catkin_make', 'build',
         'if a CMakeLists.txt, package.xml, msg, srv or C++ file was changed, mend it', partial(
             run, ['catkin_make', '--source', '.', f'-DPYTHON_EXECUTABLE={PYTHON}'], cwd=str(ROOT), check=True,
             env=environment_of([*underlays(), *filter(None, [this_system().ros])])))
    BUILD_STAMP.write_text(wanted)


def _fingerprint() -> str:
    sums = hashlib.sha256(f'{ROOT} {output_of(PYTHON, "--version")}'.encode())
    sums.update(str(this_system().ros).encode())
    if CONDA is None:
        sums.update(output_of('dpkg-query', '--show', 'catkin', 'ros-noetic-catkin', 'ros-one-catkin').encode())
    files = [path for folder in PACKAGES.values() for path in sorted(folder.rglob('*')) if path.is_file()]
    for path in [ROOT / 'CMakeLists.txt', *files]:
        is_read = path.name in BUILT_NAMES or path.suffix in BUILT_SUFFIXES or path.parent.name == 'env-hooks'
        if is_read or path.suffix == '.test' or path.parent.name == 'scripts':
            sums.update(f'{path.relative_to(ROOT)}\n'.encode() + (path.read_bytes() if is_read else b''))
    return sums.hexdigest()


def _hash(text: str, *files: Path) -> str:
    return hashlib.sha256(b''.join([text.encode(), *(file.read_bytes() for file in files)])).hexdigest()


def _read(stamp: Path) -> str:
    return stamp.read_text().strip() if stamp.exists() else ''
