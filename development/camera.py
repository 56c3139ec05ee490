"""./run camera: driver, chain and view of a camera in one command."""
import sys
from pathlib import Path
from typing import List, Sequence

from development import PACKAGES
from development.terminal import die

sys.path.append(str(PACKAGES['openpose_ros_pkg'] / 'src'))
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import AUTO, find_preset, read_presets

# Arguments of people.launch that may be a path, which a node would read in a folder of its own.
_PATHS = ('source', 'record', 'config')


def launch_command(arguments: Sequence[str], has_display: bool) -> List[str]:
    """Return the command that starts a camera and finds its people.

    Args:
        arguments: name of the camera, or a file with one; then NAME:=VALUE of people.launch, which win over what the
            camera says, and FILE.launch in place of the driver's.
    """
    name, *words = arguments or ['']
    if name == AUTO:
        chosen = []
    else:
        try:
            preset = find_preset(name)
        except ParameterError as error:
            cameras = '\n'.join(f'  {preset.name:13} {preset.title}' for preset in read_presets().values())
            wrong = str(error).partition(': one of')[0] if name else 'name a camera'
            die(f'{wrong}\n\nusage: ./run camera NAME [NAME:=VALUE | FILE.launch ...]\n{cameras}\n'
                f'  {AUTO:13} the camera that is published\n  FILE.yaml     a camera of your own')
        chosen = ['driver:=true'] * bool(preset.package) + ['points:=none'] * (preset.dimensions == 2)
    driver = [word for word in words if word.endswith('.launch')]
    chosen += [f'driver:={" ".join(driver)}'] if driver else []
    return ['roslaunch', 'openpose_ros_bringup', 'people.launch', f'camera:={_absolute(name)}', *chosen,
            f'rviz:={str(has_display).lower()}', *(_with_path(word) for word in words if word not in driver)]


def _with_path(word: str) -> str:
    key, equals, value = word.partition(':=')
    return key + equals + (_absolute(value) if key in _PATHS else value)


def _absolute(value: str) -> str:
    return str(Path(value).absolute()) if value and Path(value).exists() else value
