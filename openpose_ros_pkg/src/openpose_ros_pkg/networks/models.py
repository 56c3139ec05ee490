"""Find pose networks by name, and their weights."""
import hashlib
import logging
import os
from pathlib import Path
from typing import List, Optional, Tuple

from openpose_ros_pkg.errors import MissingWeightsError, ModelError, ParameterError
from openpose_ros_pkg.networks.model_description import read_description
from openpose_ros_pkg.networks.model_registry import ALIASES, AUTO, BY_NAME, MODELS
from openpose_ros_pkg.networks.model_types import Archive, Model, UserFiles, WebSource, WeightsFile
from openpose_ros_pkg.networks.network_file import NETWORK_SUFFIXES, read_network_file
from openpose_ros_pkg.skeletons import BODY_25, SkeletonModel

_log = logging.getLogger(__name__)

# Names and aliases of the registry, with '_' for '-', which mean the same.
_REGISTERED = {name.replace('-', '_'): ALIASES.get(name, name) for name in (*MODELS, *ALIASES)}


def default_model_folder() -> Path:
    """Return the cache outside the source tree: $OPENPOSE_ROS_CACHE/models, else the user's cache folder."""
    cache = os.environ.get('OPENPOSE_ROS_CACHE')
    if cache:
        return Path(cache) / 'models'
    return Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache') / 'openpose_ros' / 'models'


def model_folder_of(parameter: str) -> Path:
    """Return the folder of all models that the parameter `model_folder` names; empty: the default one."""
    return Path(parameter).expanduser() if parameter else default_model_folder()


def find_model(pose_model: str, model_folder: str = '') -> Model:
    """Find a model by the value of the `pose_model` parameter; its weights need not be there.

    Args:
        pose_model: name in the registry or alias ('-' and '_' are the same), path of a network (.onnx, .xml) or of a
            description (.yaml), or name of a network that <model_folder>/<name>/<name>.yaml describes.
        model_folder: the folder of all models; empty for `default_model_folder`.

    Raises:
        ParameterError: no such model.
        ModelError: its description is wrong, or the file does not tell what network it is.
    """
    name = _REGISTERED.get(pose_model.replace('-', '_'))
    if name is not None:
        return MODELS[name]
    path = Path(pose_model).expanduser()
    if path.suffix not in ('.yaml', '.yml', *NETWORK_SUFFIXES):
        path = model_folder_of(model_folder) / pose_model / f'{pose_model}.yaml'
    if not path.is_file():
        raise ParameterError(f"parameter 'pose_model' = {pose_model!r} is not allowed: one of "
                             f'{", ".join(sorted([*MODELS, *ALIASES]))}, or a network of your own: an .onnx or .xml '
                             f'file, or a .yaml file that describes it ({path} is none)', 'pose_model')
    read = read_network_file if path.suffix in NETWORK_SUFFIXES else read_description
    return read(path.absolute())


def joint_set(pose_model: str) -> SkeletonModel:
    """Return the joints of people by the value of the parameter `pose_model`; raises as `find_model` does."""
    return BODY_25 if pose_model == AUTO else find_model(pose_model).skeleton


def described_models(model_folder: str = '') -> List[Path]:
    """Return the descriptions that `find_model` knows by name."""
    return sorted(path for path in model_folder_of(model_folder).glob('*/*.yaml') if path.stem == path.parent.name)


def installed_by_name(model_folder: str = '') -> Tuple[Model, ...]:
    """Return the networks that are fetched by name and installed, the best by published AP first."""
    installed = []
    for model in BY_NAME:
        try:
            weights_path(model, model_folder)
            installed.append(model)
        except MissingWeightsError:
            pass
        except ModelError as error:
            _log.warning('%s is not used: %s', model.name, error)
    return tuple(installed)


def how_to_get(model: Model, folder: Path) -> str:
    """Return how to get the weights of a model into a folder of models, for error texts."""
    names = ' and '.join(file.name for file in model.files)
    target = folder / model.name
    get = f'rosrun openpose_ros_pkg openpose_models get {model.name}'
    fetch = f'run `{get}` (in a checkout: `./run model get {model.name}`), which fetches it; without network, '
    if isinstance(model.source, Archive):
        return (f'{fetch}run it elsewhere and copy {names} from there to {target}; for another place, set the '
                "parameter 'model_folder'")
    if isinstance(model.source, WebSource):
        address = model.source.address
        address, files = (' and '.join(f'{address}/{name}' for name in model.source.names), 'both'
                          ) if model.source.names else (address, f'the zip file, or {names} of it')
        return f'{fetch}download {address} in a browser and add `--from FILE`: {files}'
    if model.description is not None:
        return f'put {names} beside {model.description}; source: {model.source.where}'
    return (f'bring {names} and run `{get} --from FILES or FOLDER` (in a checkout: `./run model get ...`), which '
            f"checks them and copies them to {target}; for another place, set the parameter 'model_folder'; "
            f'source: {model.source.where}; licence: {model.licence}')


def find_weights(model: Model, model_folder: str = '') -> Optional[Path]:
    """Return the folder that holds all files of a model, unchecked; None when there is none.

    Searched: `model_folder/<model>`, `model_folder`, and for OpenPose's networks their place in OpenPose's folder of
    models. Files of a described network lie beside its description.
    """
    places = _places(model, model_folder_of(model_folder))
    return next((place for place in places if all((place / file.name).is_file() for file in model.files)), None)


def weights_path(model: Model, model_folder: str = '') -> Path:
    """Return the first file of the checked weights; the others lie beside it. `find_weights` says where they may lie.

    Args:
        model_folder: folder to look in; empty for `default_model_folder`.

    Raises:
        MissingWeightsError: a file is missing; the text says how to get it.
        ModelError: it is not the expected one.
    """
    folder = model_folder_of(model_folder)
    how = how_to_get(model, folder)
    place = find_weights(model, model_folder)
    if place is None:
        raise MissingWeightsError(f'weights of {model.name} not found (looked for {_missing(model, folder)}): {how}')
    for file in model.files:
        fault = file_fault(place / file.name, file)
        if fault:
            raise ModelError(f'weights of {model.name} are damaged or not the expected file: {place / file.name} '
                             f'{fault}: delete it, then {how}')
    return place / model.files[0].name


def _missing(model: Model, folder: Path) -> str:
    """Return the missing files; if a folder holds some files of the model, only the others."""
    lacking = {place: [file.name for file in model.files if not (place / file.name).is_file()]
               for place in _places(model, folder)}
    partly = {place: names for place, names in lacking.items() if len(names) < len(model.files)} or lacking
    return ', or '.join(' and '.join(str(place / name) for name in names) for place, names in partly.items())


def _places(model: Model, folder: Path) -> List[Path]:
    """Return the folders in which a model's files may lie."""
    if model.description is not None:
        return [model.description.parent]
    places = [folder / model.name, folder]
    if isinstance(model.source, UserFiles) and model.source.folder:
        places.append(folder / model.source.folder)
    return places


def file_fault(path: Path, expected: WeightsFile) -> str:
    """Return how a file differs from the expected one, with actual and expected values; empty: it does not."""
    known = {kind: getattr(expected, kind) for kind in ('sha256', 'md5') if getattr(expected, kind)}
    actual = {kind: file_digest(path, kind) for kind in known}
    size = path.stat().st_size
    if (actual == known and size == (expected.size or size) and size > 0) or expected.also in actual.values():
        return ''
    wanted = [f'{expected.size} bytes'] if expected.size else []
    wanted += [f'{kind} {digest}' for kind, digest in known.items()]
    has = [f'{size} bytes'] + [f'{kind} {digest}' for kind, digest in actual.items()]
    return f'has {" and ".join(has)}, expected {" and ".join(wanted) or "a file that is not empty"}'


def file_digest(path: Path, kind: str) -> str:
    """Return a checksum of a file ('sha256' or 'md5') as hexadecimal text."""
    digest = hashlib.new(kind)
    with path.open('rb') as handle:
        for block in iter(lambda: handle.read(1 << 20), b''):
            digest.update(block)
    return digest.hexdigest()
