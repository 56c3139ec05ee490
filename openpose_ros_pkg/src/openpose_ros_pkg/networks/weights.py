"""What the program openpose_models does: list, get and check the weights of the networks."""
import shutil
import sys
from pathlib import Path
from typing import Callable, List, Optional, Sequence

from openpose_ros_pkg.command_options import command_parser, plain_path
from openpose_ros_pkg.errors import ModelError, OpenposeRosError
from openpose_ros_pkg.networks.model_registry import ALIASES, FETCHED, GROUPS, LANDMARK_MODELS, MODELS
from openpose_ros_pkg.networks.model_types import BOX_DECODERS, Archive, Model, WebSource
from openpose_ros_pkg.networks.models import described_models, find_model, find_weights, model_folder_of, weights_path
from openpose_ros_pkg.networks.weights_install import get, origin, say


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command line and return the exit status."""
    parser = command_parser('openpose_models', 'Weights of the networks.')
    commands = parser.add_subparsers(dest='command', required=True)
    commands.add_parser('list', help='show the networks, and which are here')
    get_parser = commands.add_parser('get', help='fetch or copy the weights, unless they are here and right')
    get_parser.add_argument('--from', dest='brought', nargs='+', type=plain_path, default=[], metavar='PATH',
                            help='files, or folders with them, to check and copy')
    check_parser = commands.add_parser('check', help='compare the weights that are here with their checksums')
    names = f'one of {", ".join([*MODELS, *LANDMARK_MODELS, *ALIASES, *GROUPS])}, or a description (.yaml)'
    fetched = ' and '.join(model.name for model in FETCHED)
    get_parser.add_argument('models', nargs='*', metavar='NAME', help=f'{names}; none: {fetched}')
    check_parser.add_argument('models', nargs='*', metavar='NAME', help=f'{names}; none: all that are here')
    for sub in commands.choices.values():
        sub.add_argument('--model-folder', default='', metavar='DIR', help=f"instead of {model_folder_of('')}")
    options = parser.parse_args(arguments)
    if options.command == 'get' and options.brought and len(options.models) != 1:
        parser.error('--from takes one NAME, before it')
    folder = options.model_folder
    models = [one for name in getattr(options, 'models', ()) for one in (
        [model.name for model in GROUPS[name]] if name in GROUPS else [name])]
    try:
        if options.command == 'list':
            _say_list(folder)
            return 0
        if options.command == 'get':
            return _for_each(models or [model.name for model in FETCHED],
                             lambda name: _get(_find(name, folder), folder, options.brought))
        return _for_each(models or _models_here(folder), lambda name: _check(name, folder))
    except (OpenposeRosError, OSError) as error:
        sys.stderr.write(f'error: {error}\n')
        return 1


def _for_each(names: Sequence[str], work: Callable[[str], object]) -> int:
    """Call `work` with each name, print its errors, and return the exit status."""
    status = 0
    for name in names:
        try:
            work(name)
        except (OpenposeRosError, OSError) as error:
            sys.stderr.write(f'error: {error}\n')
            status = 1
    return status


def _get(model: Model, model_folder: str, brought: Sequence[Path]) -> None:
    """Put the weights of a model in their folder; new ones of a network by name that is refused are not kept."""
    is_new = find_weights(model, model_folder) is None
    path = get(model, model_folder, brought)
    if isinstance(model.source, WebSource):
        _prove(model, path, is_new)


def _prove(model: Model, path: Path, is_new: bool = False) -> None:
    """Let a network by name prove itself and print the result; ModelError: it is refused, and deleted if it is new."""
    from openpose_ros_pkg.networks.backends import BackendParams, create_backend
    from openpose_ros_pkg.networks.proof import prove
    try:
        backend = create_backend(model, path, BackendParams())
    except ModelError as error:  # its runtime is not installed
        say(f'{model.name}: not proved: {error}')
        return
    try:
        say(f'{model.name}: proved: {prove(backend, model)}')
    except ModelError:
        if is_new:
            shutil.rmtree(str(path.parent))
        raise


def _find(name: str, model_folder: str) -> Model:
    """Return a pose network, or one of hands and faces; see `find_model`."""
    return LANDMARK_MODELS.get(name.replace('-', '_')) or find_model(name, model_folder)


def _check(name: str, model_folder: str) -> None:
    """Print that the weights of a model are right, or raise OpenposeRosError."""
    model = _find(name, model_folder)
    path = weights_path(model, model_folder)
    say(f'{model.name}: {path} is right')
    if isinstance(model.source, WebSource):
        _prove(model, path)


def _models_here(model_folder: str) -> List[str]:
    """Return the models that have files; raise ModelError if there is none."""
    candidates = [*MODELS, *LANDMARK_MODELS, *(path.stem for path in described_models(model_folder))]
    names = [name for name in candidates if _is_here(name, model_folder)]
    if not names:
        raise ModelError(f'there are no weights in {model_folder_of(model_folder)}')
    return names


def _is_here(name: str, model_folder: str) -> bool:
    """Return whether a model has files, or a wrong description, to check."""
    try:
        return find_weights(_find(name, model_folder), model_folder) is not None
    except ModelError:
        return True


def _say_list(model_folder: str) -> None:
    """Print one paragraph per model."""
    for name in [*MODELS, *LANDMARK_MODELS, *map(str, described_models(model_folder))]:
        try:
            model = _find(name, model_folder)
        except ModelError as error:
            say(f'{Path(name).stem}: {error}')
            continue
        place = find_weights(model, model_folder)
        try:
            state = f'here: {weights_path(model, model_folder)}' if place else _not_here(model)
        except ModelError as error:
            state = str(error)
        sizes = [(place / file.name).stat().st_size if place else file.size for file in model.files]
        size = f'{sum(sizes) / 1e6:.1f} MB' if all(sizes) else 'size not known'
        say(f'{model.name}: {_gives(model)}, {size}, licence {model.licence}\n  from {origin(model)}\n  {state}')


def _gives(model: Model) -> str:
    """Return what a network finds, in words."""
    if model.decoder in BOX_DECODERS:
        return 'boxes of people, without joints'
    points = 'points' if model.name in LANDMARK_MODELS else 'joints'
    return f'{len(model.skeleton.joints)} {points} ({model.skeleton.name})'


def _not_here(model: Model) -> str:
    if model.description is None and isinstance(model.source, (Archive, WebSource)):
        return f'not here: openpose_models get {model.name}'
    names = ' and '.join(file.name for file in model.files)
    return f'not here: bring {names}, then openpose_models get {model.name} --from FILES or FOLDER'
