"""Set-up, tests, generated files and daily use of the checkout: what ./run does. Standard library only."""
import os
from pathlib import Path
from typing import Dict, Optional

ROOT = Path(__file__).resolve().parents[1]
CATKIN = 'share/catkin/cmake/toplevel.cmake'  # what a prefix with ROS has
_conda = Path(os.environ.get('CONDA_PREFIX') or os.devnull)
CONDA: Optional[Path] = _conda if (_conda / CATKIN).is_file() else None  # RoboStack: ROS in a conda environment
# ROS is installed for the system's Python, whichever comes first on PATH; RoboStack's for that of its environment.
PYTHON = str(CONDA / 'bin/python3') if CONDA else '/usr/bin/python3'
VENV = ROOT / '.venv'
VENV_PYTHON = str(VENV / 'bin/python3')
VENV_FOCAL = ROOT / '.venv_focal'  # the libraries of Ubuntu 20.04, for tests
LOGS = ROOT / 'logs'
PACKAGES: Dict[str, Path] = {  # folder of each package
    path.parent.name: path.parent for pattern in ('*/package.xml', 'extensions/*/package.xml')
    for path in sorted(ROOT.glob(pattern))}
PYTHON_SOURCES = tuple(str(folder / 'src') for folder in PACKAGES.values() if (folder / 'setup.py').is_file())
