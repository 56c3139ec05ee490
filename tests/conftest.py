"""Compiled modules for the tests: those of the devel space, or, where these are missing or older than their sources,
built by plain CMake into build/cpp.
"""
import importlib.machinery
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
SOURCES = {'skeleton_extract_3d_lifting': ROOT / 'skeleton_extract_3d/src/cpp'}
TIMEOUT = 600.0  # [s]


def built_by_catkin(module: str, sources: Path) -> bool:
    """Whether the devel space has the module for this Python, newer than its sources."""
    changed = max(path.stat().st_mtime for path in sources.rglob('*') if path.is_file())
    return any(path.stat().st_mtime > changed for suffix in importlib.machinery.EXTENSION_SUFFIXES
               for path in (ROOT / 'devel/lib').glob(f'python3*/*-packages/{module}{suffix}'))


def build(sources: Path, folder: Path) -> None:
    for command in (['cmake', '-S', str(sources), '-B', str(folder), f'-DPYTHON_EXECUTABLE={sys.executable}'],
                    ['cmake', '--build', str(folder)]):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT,
                              check=False)
        if done.returncode != 0:
            raise RuntimeError(f'{" ".join(command)} failed:\n{done.stdout[-4000:]}')


def pytest_configure(config: Any) -> None:
    for module, sources in SOURCES.items():
        if not built_by_catkin(module, sources):
            folder = ROOT / 'build/cpp' / sys.implementation.cache_tag / module
            if not hasattr(config, 'workerinput'):  # workers of pytest-xdist start when their controller has built
                build(sources, folder)
            sys.path.insert(0, str(folder))
