"""Commands in the built workspace, and the other workspaces whose packages it uses."""
import os
from pathlib import Path
from typing import Dict, List, NoReturn, Optional, Sequence

from development import ROOT
from development.terminal import die, output_of

BUILD_STAMP = ROOT / 'build/.built_by_run'
DEVEL = ROOT / 'devel'


def underlays() -> List[Path]:
    """Return the other workspaces whose packages are used: those that are sourced where ./run starts, topmost first."""
    sourced = [Path(path) for path in os.environ.get('SOURCED_WORKSPACES', '').split(os.pathsep) if path]
    return [path for path in sourced if (path / '.catkin').is_file() and (path / 'setup.bash').is_file()
            and path.resolve() != DEVEL.resolve()]


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
