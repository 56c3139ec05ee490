"""The networks of a recipe: which are loaded, and what takes their place."""
import logging
from dataclasses import replace
from typing import Dict, List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectThresholds
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED, FollowingParams
from openpose_ros_pkg.detect.recipe_choice import chosen_for_rate, fitted_to_rate, recipes_of
from openpose_ros_pkg.detect.recipes import BEST, DetectorParams, DetectorSettings, Recipe
from openpose_ros_pkg.detect.views import Setup
from openpose_ros_pkg.errors import BadInputError, MissingWeightsError, ModelError, ParameterError
from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarkNetwork, exact
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.model_registry import OPTIONAL, POSE_LANDMARK
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.networks.models import installed_by_name, weights_path
from openpose_ros_pkg.skeletons import SkeletonModel

_log = logging.getLogger(__name__)


# Thresholds of candidates where several networks vote, as others may confirm what one doubts: person score of networks
# with part affinity fields, or `person_min_score`, and of others, whose joints need none.
_DECODED_PERSON, _DIRECT_PERSON = 0.2, 0.05


class Networks:
    """Loads networks when they are first wanted, each once.

    Attributes:
        faults: what is missing or computed by something slower than the parameters ask for, and why, by network.
        not_installed: optional networks whose weights are not there, and what that changes: no fault.
    """

    def __init__(self, params: BackendParams, model_folder: str = '') -> None:
        self.params = params
        self._model_folder = model_folder
        self._loaded: Dict[str, Backend] = {}
        self.faults: Dict[str, str] = {}
        self.not_installed: Dict[str, str] = {}

    def load_any(self, recipe: Recipe) -> Optional[Tuple[Recipe, Dict[str, Backend]]]:
        """Do `load` for a recipe that has others to take its place; None: a network that it needs is a fault."""
        if any(model.name in self.faults and model.name not in self._loaded for model in recipe.needed):
            return None
        try:
            return self.load(recipe)
        except (ModelError, ParameterError) as error:
            failed = next(model for model in recipe.needed if model.name not in self._loaded)
            name = failed.name
            if failed not in OPTIONAL or not isinstance(error, MissingWeightsError):
                self.faults[name] = f'{name} is not used: {error}'
                _log.warning('%s', self.faults[name])
            elif name not in self.not_installed:  # said once; others take its place
                into = f' --model-folder {self._model_folder}' if self._model_folder else ''
                self.not_installed[name] = (
                    f'{name} is not installed, and others take its place; `rosrun openpose_ros_pkg openpose_models '
                    f'get {name}{into}` (in a checkout: `./run model get {name}{into}`) fetches it')
                _log.info('%s', self.not_installed[name])
            return None

    def load(self, recipe: Recipe) -> Tuple[Recipe, Dict[str, Backend]]:
        """Load the networks of a recipe; without a network that is missing, unless it is needed, it computes less.

        Raises:
            ParameterError, ModelError: a needed network can not be loaded, see `Detector`.
        """
        wanted = recipe
        missing: List[Model] = []
        networks: Dict[str, Backend] = {}
        while True:
            model = next((one for one in wanted.models if one.name not in networks), None)
            if model is None:
                return wanted, networks
            try:
                networks[model.name] = self._network(model)
            except (ModelError, ParameterError) as error:
                if model in recipe.needed:
                    raise
                missing.append(model)
                wanted = recipe.without(missing)
                is_fault = model not in OPTIONAL or not isinstance(error, MissingWeightsError)
                told = self.faults if is_fault else self.not_installed
                what = 'missing' if is_fault else 'not installed'
                told[model.name] = (f'{model.name} is {what}, so people are found less accurately, by '
                                    f'{wanted.description}: {error}')
                _log.warning('%s', told[model.name])

    def feet(self) -> Optional[BodyLandmarkNetwork]:
        """Return what finds toes and heels; None: it is missing, which `faults` or `not_installed` tells."""
        name = POSE_LANDMARK.name
        try:
            return BodyLandmarkNetwork(self._network(POSE_LANDMARK))
        except (ModelError, ParameterError) as error:
            told = self.not_installed if isinstance(error, MissingWeightsError) else self.faults
            told[name] = f'{name} is missing, so toes and heels are not found: {error}'
            _log.warning('%s', told[name])
            return None

    def _network(self, model: Model) -> Backend:
        if model.name not in self._loaded:
            params = exact(self.params) if model is POSE_LANDMARK else self.params
            backend = create_backend(model, weights_path(model, self._model_folder), params)
            self._loaded[model.name] = backend
            self.faults.pop(model.name, None)
            self.not_installed.pop(model.name, None)
            if backend.fallback:
                self.faults[model.name] = f'{backend.description} computes {model.name}: {backend.fallback}'
        return self._loaded[model.name]


class Detector:
    """The networks that find people, and what is computed with them.

    Args:
        settings: what is computed, and from which thresholds on.
        networks: load the networks that this takes.
        following: whether people are followed: then `target_rate` changes how often the image is searched, not how.

    Attributes:
        setup: what images are computed with from now on.

    Raises:
        ParameterError: no such network, or a runtime that is not installed.
        ModelError: weights are missing or damaged, or the network computes wrong results.
    """

    def __init__(self, settings: DetectorSettings, networks: Networks,
                 following: FollowingParams = NEVER_FOLLOWED) -> None:
        self._networks, self._following = networks, following
        self.setup = self._made(*self._load(settings.detector), settings)

    @property
    def threads(self) -> int:
        """Number of threads that compute a network; 0: as many as there are cores."""
        return self._networks.params.threads

    @property
    def recipe(self) -> Recipe:
        """What is computed."""
        return self.setup.recipe

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
        return self.setup.skeleton

    @property
    def description(self) -> str:
        """What computes which networks, for the log."""
        return '; '.join(f'{name} on {network.description}' for name, network in self.setup.networks.items())

    @property
    def faults(self) -> str:
        """What is missing or computed by something slower than the parameters ask for, and why; empty: nothing."""
        return '; '.join(self._networks.faults.values())

    @property
    def not_installed(self) -> Dict[str, str]:
        """Names of optional networks that the parameters ask for and that are not there, and what that changes."""
        return dict(self._networks.not_installed)

    def reconfigure(self, settings: DetectorSettings) -> None:
        """Take other parameters for all images from now on; runtime and model folder stay.

        Raises:
            ParameterError, ModelError: a network can not be loaded, or has another joint set; nothing changes.
        """
        recipe, loaded = self.setup.recipe, self.setup.networks
        if settings.detector != self.setup.settings.detector:
            recipe, loaded = self._load(settings.detector)
        setup = self._made(recipe, loaded, settings)
        if setup.skeleton != self.skeleton:  # tracks, and the nodes that read the people, have the other joints
            raise ParameterError(f'{recipe.description} gives the joint set {setup.skeleton.name}, but people have '
                                 f'that of {self.skeleton.name} while this runs: start again with these parameters')
        self.setup = setup

    def _made(self, recipe: Recipe, networks: Dict[str, Backend], settings: DetectorSettings) -> Setup:
        decode, direct = settings.decode, DirectThresholds()
        if recipe.is_ensemble:  # these are thresholds of candidates, on which other networks vote
            decode = replace(decode, person_min_score=min(decode.person_min_score, _DECODED_PERSON))
            direct = DirectThresholds(joint_score=0.0, person_score=_DIRECT_PERSON)
        setup = Setup(recipe, networks, decode, direct, settings)
        return replace(setup, feet=self._networks.feet()) if setup.skeleton != recipe.skeleton else setup

    def _load(self, params: DetectorParams) -> Tuple[Recipe, Dict[str, Backend]]:
        """Return the recipe of the parameters, or a faster one for `target_rate`, and its networks."""
        recipes, rate = recipes_of(params), params.target_rate if params.mode != 'accurate' else 0.0
        follows = bool(recipes[0].refinements) and self._following.wanted(params)
        if rate > 0 and len(recipes) > 1:
            # what stands in for missing networks is not timed, but where `best` may need it to reach the rate
            timed = recipes if params.mode == BEST else recipes[:-1]
            chosen = chosen_for_rate(timed, self._networks.load_any, rate, follows, self.threads)
        else:
            chosen = next(filter(None, map(self._networks.load_any, recipes[:-1])), None)
        recipe, loaded = chosen or self._networks.load(recipes[-1])
        if params.mode == BEST and not installed_by_name(params.model_folder):
            _log.info('mode best is balanced, as no network by name is installed; `rosrun openpose_ros_pkg '
                      'openpose_models list` (in a checkout: `./run model list`) shows them, with their published AP')
        elif params.mode == BEST:
            _log.info('mode best is %s with the joint set %s: both depend on the networks that are installed by name',
                      recipe.description, recipe.skeleton.name)
        if rate > 0 and not (recipe.refinements and follows):
            recipe = fitted_to_rate(recipe, loaded, rate, self.threads)
        names = [model.name for model in recipe.models]
        return recipe, {name: loaded[name] for name in names}


def create_detector(settings: DetectorSettings, following: FollowingParams = NEVER_FOLLOWED) -> Detector:
    """Return the `Detector` of these settings, which has its own networks."""
    return Detector(settings, Networks(settings.backend, settings.detector.model_folder), following)


def check_image(bgr: np.ndarray) -> None:
    """Raise BadInputError unless it is a non-empty (H, W, 3) uint8 image."""
    if not isinstance(bgr, np.ndarray) or bgr.dtype != np.uint8 or bgr.ndim != 3 or bgr.shape[2] != 3:
        actual = f'{bgr.shape} {bgr.dtype}' if isinstance(bgr, np.ndarray) else type(bgr).__name__
        raise BadInputError(f'image: expected an (H, W, 3) uint8 array, got {actual}')
    if bgr.size == 0:
        raise BadInputError(f'image of {bgr.shape[1]}x{bgr.shape[0]} pixels: expected at least 1x1')
