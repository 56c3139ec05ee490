"""Commands in the built workspace."""
import os
from pathlib import Path
from typing import Dict, NoReturn, Optional, Sequence

from development import ROOT
from development.terminal import die, output_of

BUILD_STAMP = ROOT / 'build/.built_by_run'
DEVEL_SETUP = ROOT / 'devel/setup.bash'


def environment_of(setup: Optional[Path]) -> Dict[str, str]:
    """Return the environment of a shell that has sourced a setup.bash; None: of this process."""
    if setup is None:
        return dict(os.environ)
    # in a function, as catkin's scripts look at the positional parameters
    output = output_of('bash', '-c', 'enter() { source "$0" >&2; }; enter; env --null', str(setup))
    return dict(variable.split('=', 1) for variable in output.split('\0') if variable)


def workspace_environment() -> Dict[str, str]:
    if not BUILD_STAMP.is_file():
        die('the workspace is not built yet: ./run setup')
    return environment_of(DEVEL_SETUP)


def enter_workspace(command: Sequence[str], **variables: Optional[str]) -> NoReturn:
    """Become a command in the built workspace, with these variables set, or unset where they are None."""
    environment: Dict[str, Optional[str]] = {**workspace_environment(), **variables}
    try:
        os.execvpe(command[0], list(command), {name: value for name, value in environment.items() if value is not None})
    except OSError as error:
        die(f'{command[0]}: {error.strerror}')
