"""Networks that are fetched by name from their makers' address, and what they have proved."""
from pathlib import Path
from typing import Optional, Tuple

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_registry import BY_NAME
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.networks.models import find_weights, weights_path
from openpose_ros_pkg.networks.proof import Proof, kept_proof


def proved_models(model_folder: str = '') -> Tuple[Model, ...]:
    """Return the networks by name that are installed and have proved themselves, the best by published AP first."""
    proofs = ((model, _installed(model, model_folder)) for model in BY_NAME)
    return tuple(model for model, proof in proofs if proof is not None and proof.passed)


def _installed(model: Model, model_folder: str) -> Optional[Proof]:
    """Return the proof of a network that is installed; None: there is none, or not the expected file."""
    if find_weights(model, model_folder) is None:
        return None
    try:
        return kept_proof(model, weights_path(model, model_folder))
    except ModelError:
        return None


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
