"""Step 2 of the set-up: .venv with what PyPI brings, beside the system's packages."""
import hashlib
import platform
import shutil
import subprocess
from pathlib import Path
from typing import Optional, Tuple

from development import PYTHON, ROOT
from development.terminal import say, step

VENV = ROOT / '.venv'
VENV_PYTHON = str(VENV / 'bin/python3')
STAMP = VENV / '.complete'  # 'with' or 'without' OpenVINO, and what it was made from
TEST_STAMP = VENV / '.complete_test'
PIP = (VENV_PYTHON, '-m', 'pip', 'install', '--disable-pip-version-check')
CHECK = """
import sys

import cv2
import numpy

print('numpy', numpy.__version__, numpy.__file__, 'opencv', cv2.__version__)
if numpy.__version__.split('.')[0] != '1':
    sys.exit('cv_bridge needs NumPy 1')
if sys.argv[1] == 'with':
    import openvino
    print('openvino', openvino.__version__)
"""


def set_up_python_packages(openvino: Optional[str], test_tools: bool) -> None:
    """Make .venv `with` or `without` OpenVINO (None: as before, or as the machine allows), unless it is right."""
    stamp = STAMP.read_text().strip() if STAMP.exists() else ''
    openvino, why = (openvino, '') if openvino else _default_openvino(stamp)
    version = subprocess.run([PYTHON, '--version'], stdout=subprocess.PIPE, text=True, check=True).stdout
    wanted = f'{openvino} {_hash(f"{ROOT} {version}", ROOT / "requirements.txt")}'
    if stamp == wanted and _works(openvino):
        say(f'[2/4] Python packages: .venv is right, {openvino} OpenVINO{why}')
    else:
        step(f'[2/4] Python packages: making .venv {openvino} OpenVINO{why}', 'venv',
             'check the network; where PyPI can not be reached: ./run setup --without-openvino',
             _make, openvino, wanted)
    wanted = _hash('', ROOT / 'requirements-test.txt')
    if test_tools and not (TEST_STAMP.exists() and TEST_STAMP.read_text().strip() == wanted):
        step('[2/4] Python packages: adding the test tools to .venv', 'test_tools',
             'check the network; the test tools come from PyPI', _add_test_tools, wanted)


def _default_openvino(stamp: str) -> Tuple[str, str]:
    if stamp.startswith('without'):
        return 'without', ', as chosen before; --with-openvino changes that'
    if platform.machine() not in ('x86_64', 'aarch64'):
        return 'without', f' (which has no package for {platform.machine()}): OpenCV computes the network'
    return 'with', ''


def _hash(text: str, *files: Path) -> str:
    return hashlib.sha256(b''.join([text.encode(), *(file.read_bytes() for file in files)])).hexdigest()


def _make(openvino: str, wanted: str) -> None:
    shutil.rmtree(str(VENV), ignore_errors=True)
    subprocess.run([PYTHON, '-m', 'venv', '--system-site-packages', str(VENV)], check=True)
    if openvino == 'with':
        subprocess.run([*PIP, '--only-binary', 'openvino,numpy', '-r', str(ROOT / 'requirements.txt')], check=True)
    subprocess.run([VENV_PYTHON, '-B', '-c', CHECK, openvino], check=True)
    STAMP.write_text(f'{wanted}\n')


def _works(openvino: str) -> bool:
    try:
        return subprocess.run([VENV_PYTHON, '-B', '-c', CHECK, openvino], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, check=False).returncode == 0
    except OSError:
        return False


def _add_test_tools(wanted: str) -> None:
    subprocess.run([*PIP, '-r', str(ROOT / 'requirements-test.txt')], check=True)
    TEST_STAMP.write_text(f'{wanted}\n')
