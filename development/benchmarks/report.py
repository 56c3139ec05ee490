#!/usr/bin/python3
"""Measure what docs/results.md shows, and write it: figures as docs/results/SECTION.json, the page, and its plots.

Scenes: those of --scenes FOLDER; else development/benchmark_data/rendered/report where at least 40 are there; else the
small ones that are part of this repository. Sections of other data need --data NAME=FOLDER and are left as they are
without it. Scenes that were counted with the same code and settings are read from build/report.

Sections of time (speed, latency, live: `timed`) should run alone, on a machine that does nothing else; `untimed` are
all others.

    ./run bench report                             # all sections that have their data
    ./run bench report untimed --data real=FOLDER --data mvor=FOLDER --data pose2sim=FOLDER \\
        --data caliscope=FOLDER && ./run bench report timed
    ./run bench report accuracy errors --scenes FOLDER
"""
import importlib
import sys
import time
from pathlib import Path
from typing import Any

import results
from common import ROOT, SCENES, Parser, scenes_of
from development import LOGS
from development.results import ORDER, write_results
from openpose_ros_pkg.command_line import DONE, SOME_FAILED, add_settings, run_command, setting_values
from openpose_ros_pkg.errors import OpenposeRosError
from results import machine

RENDERED, ENOUGH = ROOT / 'development/benchmark_data/rendered/report', 40
_FOLDER = Path(__file__).parent
# Modules of sections/ by name, in the order of the page.
SECTIONS = {path.stem: '.'.join(path.relative_to(_FOLDER).with_suffix('').parts)
            for path in sorted((_FOLDER / 'sections').rglob('*.py'), key=lambda path: ORDER.index(path.stem))}
# Those of time, which other processes would disturb.
TIMED = ('speed', 'latency', 'live')


def measure(name: str, options: results.Options, unit: machine.Unit) -> bool:
    """Measure a section and write it; return whether that succeeded, also if its data are not there."""
    module: Any = importlib.import_module(SECTIONS[name])
    began = time.monotonic()
    before = unit.milliseconds()
    try:
        section = module.measure(options)
    except results.NeedsDataError as error:
        print(f'{name}: not measured; it needs {error}', flush=True)
        return True
    except (OpenposeRosError, OSError) as error:
        print(f'{name}: failed: {error}', flush=True)
        return False
    title = (module.__doc__ or name).splitlines()[0].rstrip('.')
    if not options.quick:
        results.write(name, title, section, machine.made(min(before, unit.milliseconds())))
    print(f'{title}\n\n{section}\n{name}: {time.monotonic() - began:.0f} s\n', flush=True)
    return True


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sections', nargs='*', metavar='SECTION', help=f"timed, untimed, {', '.join(SECTIONS)}")
    parser.add_argument('--scenes', type=Path, help='folder of scene folders')
    parser.add_argument('--data', metavar='NAME=FOLDER', action='append', default=[], help='another data set')
    parser.add_argument('--quick', action='store_true', help='a few frames; only pictures are written, to logs/report')
    add_settings(parser, 'of the chain, for trials')
    arguments = parser.parse_args()
    groups = {'timed': TIMED, 'untimed': [name for name in SECTIONS if name not in TIMED]}
    wanted = [name for each in arguments.sections or groups for name in groups.get(each, [each])]
    for name in set(wanted) - {*SECTIONS}:
        parser.error(f'there is no section {name}; one of: {", ".join(SECTIONS)}')
    data = dict(text.partition('=')[::2] for text in arguments.data)
    if not all(map(all, data.items())):
        parser.error('--data needs NAME=FOLDER')
    rendered = scenes_of(RENDERED)
    scenes = scenes_of(arguments.scenes) if arguments.scenes else (
        rendered if len(rendered) >= ENOUGH else scenes_of(SCENES))
    options = results.Options(scenes, arguments.quick, {name: Path(path) for name, path in data.items()},
                              setting_values(parser, arguments.settings))
    if not options.scenes:
        parser.error('there is no scene: a folder with gt.json, rgb/ and depth/')
    if options.quick:
        results.IMAGES = LOGS / 'report'
        results.IMAGES.mkdir(parents=True, exist_ok=True)
    unit = machine.Unit()
    done = [measure(name, options, unit) for name in SECTIONS if name in wanted]
    if not options.quick:
        write_results()
    return DONE if all(done) else SOME_FAILED


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
