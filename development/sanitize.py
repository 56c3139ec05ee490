"""The C++ modules and nodelets, built with sanitizers, under their own tests."""
import os
from pathlib import Path
from typing import Mapping, Sequence

from development import PACKAGES, PYTHON, PYTHON_SOURCES, ROOT, VENV_PYTHON
from development.terminal import output_of, succeeds
from development.workspace import workspace_environment

FOLDER = ROOT / 'build/sanitize'
# Undefined behaviour ends the test. Eigen aligns memory in another way under the address sanitizer, but libpcl, built
# without, gives and takes such memory: both have to take that of malloc, which is aligned as Eigen needs it here.
FLAGS = ('-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -g1 '
         '-DEIGEN_MALLOC_ALREADY_ALIGNED=1')
MODULES = {'openpose_ros_decode': PACKAGES['openpose_ros_pkg'] / 'src/cpp',
           'skeleton_extract_3d_lifting': PACKAGES['skeleton_extract_3d'] / 'src/cpp'}
# The rooms whose code calls the modules.
UNIT_TESTS = ('tests/unit/decode', 'tests/unit/lift', 'tests/unit/estimator')
NODELETS = 'openpose_ros_nodelets'
GTESTS = ('test_floor', 'test_organized_cloud', 'test_people_cloud')
SOURCES = (*PYTHON_SOURCES, 'tests/support', '.', *(f'build/sanitize/{module}' for module in MODULES))


def sanitized(results: Path) -> bool:
    """Build and run the tests; results as JUnit files."""
    return _modules(results) and _nodelets(results)


def _build(sources: Path, folder: Path, environment: Mapping[str, str], targets: Sequence[str] = ('all',),
           definitions: Sequence[str] = ()) -> bool:
    return (succeeds('cmake', '-S', str(sources), '-B', str(folder), f'-DCMAKE_CXX_FLAGS={FLAGS}',
                     f'-DPYTHON_EXECUTABLE={PYTHON}', *definitions, env=environment)
            and succeeds('cmake', '--build', str(folder), '--target', *targets, env=environment))


def _modules(results: Path) -> bool:
    environment = dict(os.environ)
    if not all(_build(sources, FOLDER / module, environment) for module, sources in MODULES.items()):
        return False
    libraries = [output_of('g++', f'-print-file-name={name}.so').strip() for name in ('libasan', 'libubsan')]
    # the interpreter frees nothing at its end, which is no leak of the modules
    environment.update(LD_PRELOAD=' '.join(libraries), ASAN_OPTIONS='detect_leaks=0',
                       UBSAN_OPTIONS='print_stacktrace=1')
    return succeeds(VENV_PYTHON, '-m', 'pytest', '-p', 'no:cacheprovider', '-o', f'pythonpath={" ".join(SOURCES)}',
                    '--junitxml', str(results / 'sanitized_modules.xml'), *UNIT_TESTS, env=environment)


def _nodelets(results: Path) -> bool:
    environment, folder = workspace_environment(), FOLDER / NODELETS
    if not _build(PACKAGES[NODELETS], folder, environment, GTESTS, [f'-DCATKIN_DEVEL_PREFIX={folder}/devel']):
        return False
    environment['UBSAN_OPTIONS'] = 'print_stacktrace=1'
    return all(succeeds(str(folder / 'devel/lib' / NODELETS / test),
                        f'--gtest_output=xml:{results / f"sanitized_{test}.xml"}', env=environment)
               for test in GTESTS)
