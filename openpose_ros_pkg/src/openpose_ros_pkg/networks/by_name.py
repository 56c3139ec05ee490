"""Networks that are fetched by name from their makers' address, and what they have proved."""
import logging
from pathlib import Path
from typing import Tuple

from openpose_ros_pkg.errors import ModelError, RefusedError
from openpose_ros_pkg.networks.model_registry import BY_NAME
from openpose_ros_pkg.networks.model_types import Model, WebArchive
from openpose_ros_pkg.networks.models import find_weights, weights_path
from openpose_ros_pkg.networks.proof import kept_proof

_log = logging.getLogger(__name__)


def proved_models(model_folder: str = '') -> Tuple[Model, ...]:
    """Return the networks by name that are installed and prove themselves, the best by published AP first.

    One that is refused is named in the log. Those whose file or decoder is new take a second or two.
    """
    return tuple(model for model in BY_NAME if _is_proved(model, model_folder))


def published() -> str:
    """Return the networks by name with their published AP, in words; the data sets differ."""
    sources = [(model.name, model.source) for model in BY_NAME]
    return ', '.join(f'{name} {source.published_ap:.2f} on {source.published_on}' for name, source in sources
                     if isinstance(source, WebArchive) and source.published_ap > 0)


def _is_proved(model: Model, model_folder: str) -> bool:
    if find_weights(model, model_folder) is None:
        return False
    try:
        path = weights_path(model, model_folder)
        proof = kept_proof(model, path)
        if proof is None:
            prove_installed(model, path)
        elif not proof.passed:  # not again at each start
            raise RefusedError(f'it was refused: {proof}')
    except ModelError as error:
        _log.warning('%s is not used: %s', model.name, error)
        return False
    return True


def prove_installed(model: Model, weights: Path) -> str:
    """Let a network prove itself, unless it has, and return the result in words.

    Raises:
        ModelError: it is refused, or no runtime can compute it.
    """
    try:
        from openpose_ros_pkg.networks.backends import BackendParams, create_backend
    except ImportError as error:  # compiled modules, before the first build
        raise ModelError(f'{model.name} can not prove itself yet ({error}): build first') from error
    create_backend(model, weights, BackendParams())
    return f'proved: {kept_proof(model, weights) or "in this run alone, as its folder can not be written to"}'
