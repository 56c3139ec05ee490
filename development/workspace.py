"""Commands in the built workspace, and the other workspaces that it extends."""
import os
from pathlib import Path
from typing import Dict, List, NoReturn, Optional, Sequence

from development import ROOT
from development.terminal import die, output_of

BUILD_STAMP = ROOT / 'build/.built_by_run'
DEVEL = ROOT / 'devel'
EXTENDED = ROOT / '.extended_workspaces'  # of ./run setup --extend, one a line


def extend(folders: Sequence[str]) -> None:
    """Remember the workspaces of ./run setup --extend: devel or install spaces, or the folders that hold them."""
    spaces = []
    for folder in map(os.path.abspath, folders):
        candidates = [Path(folder), Path(folder) / 'devel', Path(folder) / 'install']
        space = next((path for path in candidates if is_workspace(path)), None)
        if space is None:
            die(f'{folder} has no setup.bash of catkin, and no devel/ or install/ with one')
        spaces.append(space)
    EXTENDED.write_text(''.join(f'{space}\n' for space in spaces))


def underlays() -> List[Path]:
    """Return the other workspaces whose packages are used, topmost first: those of --extend, then the sourced ones."""
    remembered = [Path(line) for line in EXTENDED.read_text().splitlines()] if EXTENDED.exists() else []
    for path in remembered:
        if not is_workspace(path):
            die(f'{path}, of ./run setup --extend, is not there; to forget it: ./run setup --extend')
    sourced = [Path(path) for path in os.environ.get('SOURCED_WORKSPACES', '').split(os.pathsep) if path]
    sourced = [path for path in sourced if is_workspace(path) and path.resolve() != DEVEL.resolve()]
    return [*dict.fromkeys([*remembered, *sourced])]


def is_workspace(path: Path) -> bool:
    return (path / '.catkin').is_file() and (path / 'setup.bash').is_file()


def environment_of(workspaces: Sequence[Path]) -> Dict[str, str]:
    """Return the environment of a shell that has sourced these workspaces, the last one first."""
    setups = [str(path / 'setup.bash') for path in reversed(workspaces) if (path / 'setup.bash').is_file()]
    # in a function, as catkin's scripts look at the positional parameters
    output = output_of('bash', '-c', 'enter() { source "$1" --extend >&2; }; for setup; do enter "$setup"; done; '
                       'env --null', 'bash', *setups)
    return dict(variable.split('=', 1) for variable in output.split('\0') if variable)


def workspace_environment() -> Dict[str, str]:
    if not BUILD_STAMP.is_file():
        die('the workspace is not built yet: ./run setup')
    return environment_of([DEVEL, *underlays()])


def enter_workspace(command: Sequence[str], **variables: Optional[str]) -> NoReturn:
    """Become a command in the built workspace, with these variables set, or unset where they are None."""
    environment: Dict[str, Optional[str]] = {**workspace_environment(), **variables}
    try:
        os.execvpe(command[0], list(command), {name: value for name, value in environment.items() if value is not None})
    except OSError as error:
        die(f'{command[0]}: {error.strerror}')
