"""Set-up, tests, generated files and daily use of the checkout: what ./run does. Standard library only."""
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHON = '/usr/bin/python3'  # ROS is installed for the system's Python, whichever comes first on PATH
VENV = ROOT / '.venv'
VENV_PYTHON = str(VENV / 'bin/python3')
VENV_FOCAL = ROOT / '.venv_focal'  # the libraries of Ubuntu 20.04, for tests
LOGS = ROOT / 'logs'
PACKAGES = tuple(sorted(path.parent.name for path in ROOT.glob('*/package.xml')))
