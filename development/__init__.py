"""Set-up, tests, generated files and daily use of the checkout: what ./run does. Standard library only."""
from pathlib import Path
from typing import Dict

ROOT = Path(__file__).resolve().parents[1]
PYTHON = '/usr/bin/python3'  # ROS is installed for the system's Python, whichever comes first on PATH
VENV = ROOT / '.venv'
VENV_PYTHON = str(VENV / 'bin/python3')
VENV_FOCAL = ROOT / '.venv_focal'  # the libraries of Ubuntu 20.04, for tests
LOGS = ROOT / 'logs'
PACKAGES: Dict[str, Path] = {  # folder of each package
    path.parent.name: path.parent for pattern in ('*/package.xml', 'extensions/*/package.xml')
    for path in sorted(ROOT.glob(pattern))}
PYTHON_SOURCES = tuple(str(folder / 'src') for folder in PACKAGES.values() if (folder / 'setup.py').is_file())
