#!/usr/bin/python3
"""Render RGB-D sequences of people with exact joints.

    ./run bench render tune            48 scenes for choosing constants: 40 of people, 6 of gestures, 2 by three cameras
    ./run bench render report          as many, of other people in other clothes: for reports only
    ./run bench render committed       the three small scenes of development/benchmark_data/scenes
    ./run bench render held            eight scenes of people who hold something before them
    ./run bench render cross hands     scenarios by hand; `list` names them

Scenes that are there already are left alone. It needs an environment of its own, .venv_render (about 6 GB, most of it
for torch), which is made when it is missing, of a Python 3.11 or newer; another one by the variable RENDER_PYTHON. And
it needs MakeHuman's garments (CC0): base/clothes and base/hair of the repository makehumancommunity/makehuman-assets.
"""
import argparse
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from development import LOGS  # noqa: E402  # found by the path above
from development.locks import RENDER_REQUIREMENTS, lock_of  # noqa: E402
from development.set_up import PIP, clear, find_python, run_all  # noqa: E402
from development.terminal import die, step, succeeds  # noqa: E402

ENVIRONMENT = ROOT / '.venv_render'
STAMP = ENVIRONMENT / '.complete'
HERE = Path(__file__).resolve().parent
CHECK_PYTHON = 'import ensurepip, sys; sys.exit(sys.version_info < (3, 11))'
PEOPLE_SCENES = 40  # of a set
GET_ASSETS = """MakeHuman's garments are not there. They are in the folder base of the public repository
makehumancommunity/makehuman-assets on GitHub (CC0; about 200 MB with it all):
  git clone --depth 1 https://github.com/makehumancommunity/makehuman-assets
  ./run bench render ... --assets makehuman-assets/base       (or set the variable MH_BASE)"""


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog='./run bench render', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('what', nargs='+', metavar='tune|report|committed|SCENARIO|list')
    parser.add_argument('--out', type=Path, help=f'folder of what is rendered [{HERE}/rendered, or scenes]')
    parser.add_argument('--assets', type=Path, default=os.environ.get('MH_BASE', ''),
                        help='folder with clothes/ and hair/ [the variable MH_BASE]')
    parser.add_argument('--jobs', type=int, default=2, help='scenes side by side, each on a core [%(default)s]')
    parser.add_argument('--scenes', type=int, default=PEOPLE_SCENES, help='only the first N of a set')
    parser.add_argument('--frames', type=int, help='only N frames of each scene, spread over it, to look at')
    return parser.parse_args()


def main() -> None:
    options = parse_arguments()
    if options.what != ['list'] and not all((options.assets / name).is_dir() for name in ('clothes', 'hair')):
        die(GET_ASSETS)
    command = [render_python(), '-m', 'development.benchmark_data.jobs', *sys.argv[1:]]
    # not the system's modules, which another Python cannot load
    os.execve(command[0], command, {**os.environ, 'PYTHONPATH': str(ROOT), 'MH_BASE': str(options.assets.resolve()),
                                    'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'})


def render_python() -> str:
    """Return the interpreter that has the renderer's packages; make its environment where it is missing."""
    python = os.environ.get('RENDER_PYTHON') or str(ENVIRONMENT / 'bin/python3')
    lock = lock_of(RENDER_REQUIREMENTS).read_text()
    is_own = ENVIRONMENT.is_symlink() or (STAMP.exists() and STAMP.read_text() == lock)
    if 'RENDER_PYTHON' in os.environ or is_own:
        if not succeeds(python, '-c', 'import anny, embreex', quiet=True):
            die(f'{python} has no anny and embreex; ./run bench render makes an environment that has, without it')
        return python
    base = find_python(CHECK_PYTHON, '3.11', '3.12', '3.13')
    if base is None:
        die('rendering needs a Python 3.11 or newer with venv on PATH or in pyenv; '
            'or RENDER_PYTHON=INTERPRETER with the packages of ' + str(RENDER_REQUIREMENTS))
    clear(ENVIRONMENT)
    LOGS.mkdir(exist_ok=True)
    step('Making .venv_render: about 6 GB of packages, most of it for torch', 'render',
         'check the network and the space on the disk', run_all, [base, '-m', 'venv', str(ENVIRONMENT)],
         [str(ENVIRONMENT / 'bin/python3'), *PIP, '-r', str(lock_of(RENDER_REQUIREMENTS))])
    STAMP.write_text(lock)
    return python


if __name__ == '__main__':
    main()
