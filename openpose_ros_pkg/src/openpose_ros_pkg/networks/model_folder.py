"""Where the networks' files lie."""
import os
from pathlib import Path


def default_model_folder() -> Path:
    """Return the cache outside the source tree: $OPENPOSE_ROS_CACHE/models, else the user's cache folder."""
    cache = os.environ.get('OPENPOSE_ROS_CACHE')
    if cache:
        return Path(cache) / 'models'
    return Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache') / 'openpose_ros' / 'models'


def model_folder_of(parameter: str) -> Path:
    """Return the folder of all models that the parameter `model_folder` names; empty: the default one."""
    return Path(parameter).expanduser() if parameter else default_model_folder()
