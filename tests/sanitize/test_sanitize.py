"""The C++ modules and nodelets, built with sanitizers, under their own tests."""
import os
import subprocess

import pytest

from development import PACKAGES, PYTHON, PYTHON_SOURCES, ROOT, VENV_PYTHON
from development.terminal import output_of
from development.workspace import workspace_environment

FOLDER = ROOT / 'build/sanitize'
# Undefined behaviour ends the test. Eigen aligns memory in another way under the address sanitizer, but libpcl, built
# without, gives and takes such memory: both have to take that of malloc, which is aligned as Eigen needs it here.
FLAGS = ('-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -g1 '
         '-DEIGEN_MALLOC_ALREADY_ALIGNED=1')
MODULES = {'skeleton_extract_3d_lifting': PACKAGES['skeleton_extract_3d'] / 'src/cpp'}
# Their code calls the modules; none loads OpenVINO, whose TBB the runtime of the address sanitizer refuses.
UNIT_TESTS = tuple(f'tests/unit/{room}' for room in ('points', 'body', 'lift', 'track', 'estimator'))
NODELETS = 'openpose_ros_nodelets'
GTESTS = ('test_people_cloud',)
SOURCES = (*PYTHON_SOURCES, 'tests/support', '.', *(f'build/sanitize/{module}' for module in MODULES))
pytestmark = pytest.mark.timeout(0)


def run(*command, env):
    subprocess.run(list(map(str, command)), cwd=str(ROOT), env=env, check=True)


def build(sources, folder, env, targets=('all',), definitions=()):
    run('cmake', '-S', sources, '-B', folder, f'-DCMAKE_CXX_FLAGS={FLAGS}', f'-DPYTHON_EXECUTABLE={PYTHON}',
        *definitions, env=env)
    run('cmake', '--build', folder, '--target', *targets, env=env)


def test_modules():
    env = dict(os.environ)
    for module, sources in MODULES.items():
        build(sources, FOLDER / module, env)
    libraries = [output_of('g++', f'-print-file-name={name}.so').strip() for name in ('libasan', 'libubsan')]
    # the interpreter frees nothing at its end, which is no leak of the modules
    env.update(LD_PRELOAD=' '.join(libraries), ASAN_OPTIONS='detect_leaks=0', UBSAN_OPTIONS='print_stacktrace=1')
    run(VENV_PYTHON, '-m', 'pytest', '-p', 'no:cacheprovider', '-o', f'pythonpath={" ".join(SOURCES)}', *UNIT_TESTS,
        env=env)


def test_nodelets():
    env, folder = workspace_environment(), FOLDER / NODELETS
    build(PACKAGES[NODELETS], folder, env, GTESTS, [f'-DCATKIN_DEVEL_PREFIX={folder}/devel'])
    for test in GTESTS:
        run(folder / 'devel/lib' / NODELETS / test, env={**env, 'UBSAN_OPTIONS': 'print_stacktrace=1'})
