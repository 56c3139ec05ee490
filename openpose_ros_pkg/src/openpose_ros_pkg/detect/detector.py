"""From an image to the people in it: views, networks, decoders, and one opinion out of several."""
import logging
from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams
from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.detect.ensemble import EnsembleParams, Opinions, group, person_score, vote, without_duplicates
from openpose_ros_pkg.detect.looks import People, View, look_closer, people_of_look, views_of
from openpose_ros_pkg.detect.oks import sigmas
from openpose_ros_pkg.detect.recipes import CLOSE_MODEL, DetectorParams, Recipe, recipe_of
from openpose_ros_pkg.detect.target_rate import fitted_to_rate
from openpose_ros_pkg.errors import BadInputError, ModelError, ParameterError
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.models import Model, weights_path
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock

_log = logging.getLogger(__name__)

# Scores of candidates where several opinions follow: what one network doubts, others may confirm.
_CANDIDATE_SHARE, _CANDIDATE_MOST = 0.8, 0.2
_CANDIDATE_PERSON_SCORE = 0.05
_CANDIDATE_JOINT_SCORE = 0.0


@dataclass(frozen=True)
class DetectorSettings:
    """All parameters of the detector."""

    detector: DetectorParams
    backend: BackendParams
    decode: DecodeParams
    direct: DirectDecodeParams
    ensemble: EnsembleParams


@dataclass(frozen=True)
class _Setup:
    """What holds for a frame, whatever is reconfigured meanwhile."""

    recipe: Recipe
    networks: Dict[str, Backend]
    settings: DetectorSettings


@dataclass
class Frame:
    """An image on its way through the detector; what it is made of is the detector's own affair."""

    bgr: np.ndarray
    setup: _Setup
    views: List[List[View]]
    people: Optional[People] = None


class Networks:
    """Loads networks when they are first wanted, each once.

    Args:
        params: what computes them.
        model_folder: folder of the weights; empty for the default one.
    """

    def __init__(self, params: BackendParams, model_folder: str = '') -> None:
        self.params = params
        self._model_folder = model_folder
        self._loaded: Dict[str, Backend] = {}

    def load(self, recipe: Recipe) -> Tuple[Recipe, Dict[str, Backend]]:
        """Load the networks of a recipe, and leave out of it what a missing additional one would have done.

        Raises:
            ParameterError: a runtime that is not installed.
            ModelError: weights of its first network are missing or damaged, or it computes wrong results.
        """
        first, networks = recipe.looks[0].model, {}
        for model in recipe.models:
            try:
                networks[model.name] = self._network(model)
            except (ModelError, ParameterError) as error:
                if model is first:
                    raise
                _log.warning('%s finds people without %s, less accurately: %s', first.name, model.name, error)
                recipe = recipe.without(model)
        return recipe, networks

    def _network(self, model: Model) -> Backend:
        if model.name not in self._loaded:
            self._loaded[model.name] = create_backend(model, weights_path(model, self._model_folder), self.params)
        return self._loaded[model.name]


class Detector:
    """Find people in images. Any thread may call it; the networks compute one image at a time.

    `detect` does it all. Who wants to prepare the next image and finish the last one while the networks are at work
    calls `prepare`, `compute` and `finish` himself.

    Args:
        settings: what is computed, and from which thresholds on.
        networks: load the networks that this takes.

    Attributes:
        lock: to be held round `compute`; several who want it take turns in the order in which they came.

    Raises:
        ParameterError: no such network, or a runtime that is not installed.
        ModelError: weights are missing or damaged, or the network computes wrong results.
    """

    def __init__(self, settings: DetectorSettings, networks: Networks) -> None:
        if settings.decode.decoder != 'auto':
            _log.warning("parameter 'decoder' = %r has no effect: there is one decoder", settings.decode.decoder)
        self._networks = networks
        self.lock = FairLock()
        self._setup = _Setup(*self._load(settings.detector), settings)

    @property
    def recipe(self) -> Recipe:
        """What is computed."""
        return self._setup.recipe

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
        return self._setup.recipe.skeleton

    @property
    def description(self) -> str:
        """What computes which networks, for people."""
        return '; '.join(f'{name} on {network.description}' for name, network in self._setup.networks.items())

    def reconfigure(self, settings: DetectorSettings) -> None:
        """Take other parameters for all frames that are prepared from now on; runtime and model folder stay.

        Raises:
            ParameterError, ModelError: a network can not be had; all stays as it was.
        """
        recipe, loaded = self._setup.recipe, self._setup.networks
        if settings.detector != self._setup.settings.detector:
            recipe, loaded = self._load(settings.detector)
        self._setup = _Setup(recipe, loaded, settings)

    def detect(self, bgr: np.ndarray) -> People2D:
        """Find the people in an image, the surest first.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.

        Returns:
            People in pixels of the image, without ids. Joints lie within it: x in 0 .. W - 1, y in 0 .. H - 1.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        frame = self.prepare(bgr)
        with self.lock:
            frame = self.compute(frame)
        return self.finish(frame)

    def prepare(self, bgr: np.ndarray) -> Frame:
        """Check an image and bring it to the sizes that the networks want; see `detect`."""
        _check_image(bgr)
        setup = self._setup
        return Frame(bgr, setup, [views_of(bgr, look) for look in setup.recipe.looks])

    def compute(self, frame: Frame) -> Frame:
        """Compute the networks for a prepared image, with `lock` held."""
        setup = frame.setup
        for look, views in zip(setup.recipe.looks, frame.views):
            for view in views:
                view.compute(setup.networks[look.model.name])
        if setup.recipe.closer:
            frame.people = _look_closer(frame)
        return frame

    def finish(self, frame: Frame) -> People2D:
        """Return the people of a computed image; see `detect`."""
        setup = frame.setup
        skeleton = setup.recipe.skeleton
        if not setup.recipe.is_ensemble:
            keypoints, scores = people_of_look(setup.recipe.looks[0], frame.views[0], setup.settings.decode,
                                               setup.settings.direct)[0]
        else:
            keypoints, scores = frame.people if frame.people is not None else _as_people(
                setup.recipe, _voted(setup.recipe, _opinions(frame)))
            keypoints, scores = _accepted(*without_duplicates(keypoints, scores, sigmas(skeleton)), setup)
        # Half a pixel beyond the centre of the outermost pixel is still that pixel.
        keypoints[..., :2] = np.clip(keypoints[..., :2], 0, np.subtract(frame.bgr.shape[1::-1], 1))
        return People2D(skeleton, keypoints, scores, np.full(len(scores), -1))

    def _load(self, params: DetectorParams) -> Tuple[Recipe, Dict[str, Backend]]:
        """Return what the parameters ask for, or as much of it as the processor computes at `target_rate`."""
        recipe, loaded = self._networks.load(recipe_of(params))
        if params.target_rate > 0 and params.mode != 'accurate':
            with self.lock:  # frames may be on their way through the same networks
                recipe = fitted_to_rate(recipe, loaded, params.target_rate, self._networks.params.threads)
        names = [model.name for model in recipe.models]
        return recipe, {name: loaded[name] for name in names}


def create_detector(settings: DetectorSettings) -> Detector:
    """Load the networks that the parameters ask for, and fit what is computed to the processor for `target_rate`.

    Raises:
        ParameterError: no such network, or a runtime that is not installed.
        ModelError: weights are missing or damaged, or the network computes wrong results.
    """
    return Detector(settings, Networks(settings.backend, settings.detector.model_folder))


def _opinions(frame: Frame) -> List[Opinions]:
    """Return what each whole look says of each person."""
    setup = frame.setup
    decode_params = replace(setup.settings.decode, person_min_score=min(
        _CANDIDATE_SHARE * setup.settings.decode.person_min_score, _CANDIDATE_MOST))
    direct_params = _candidates(setup.settings.direct)
    sources = [keypoints for look, views in zip(setup.recipe.looks, frame.views)
               for keypoints, _ in people_of_look(look, views, decode_params, direct_params)]
    return group(sources, sigmas(setup.recipe.skeleton))


def _candidates(params: DirectDecodeParams) -> DirectDecodeParams:
    return replace(params, direct_person_score=_CANDIDATE_PERSON_SCORE, direct_joint_score=_CANDIDATE_JOINT_SCORE)


def _voted(recipe: Recipe, people: List[Opinions]) -> List[np.ndarray]:
    """Return one pose, (K, 3) float32, of what the whole looks say of each person."""
    joint_sigmas = sigmas(recipe.skeleton)
    return [vote(person, recipe.weights[:recipe.whole_opinions], joint_sigmas) for person in people]


def _as_people(recipe: Recipe, poses: List[np.ndarray]) -> People:
    joints = len(recipe.skeleton.joints)
    return (np.array(poses, np.float32).reshape(-1, joints, 3),
            np.array([person_score(pose) for pose in poses], np.float32))


def _look_closer(frame: Frame) -> People:
    """Look again at those who seem to be there, and vote anew; doubtful ones seldom become people by it."""
    setup = frame.setup
    recipe, network = setup.recipe, setup.networks[CLOSE_MODEL.name]
    joint_sigmas, params = sigmas(recipe.skeleton), _candidates(setup.settings.direct)
    people = _opinions(frame)
    poses = _voted(recipe, people)
    scores = np.array([person_score(pose) for pose in poses])
    surest = np.argsort(-scores, kind='stable')[:recipe.most_people]
    for i in surest[scores[surest] >= recipe.acceptance * setup.settings.decode.person_min_score]:
        for number, look in enumerate(recipe.closer, start=recipe.whole_opinions):
            pose = look_closer(frame.bgr, poses[i], look, recipe.close_side, network, params, joint_sigmas)
            if pose is not None:
                people[i][number] = pose
        poses[i] = vote(people[i], recipe.weights, joint_sigmas)
    return _as_people(recipe, poses)


def _accepted(keypoints: np.ndarray, scores: np.ndarray, setup: _Setup) -> People:
    """Leave out joints and people below their thresholds."""
    acceptance, decode_params = setup.recipe.acceptance, setup.settings.decode
    keypoints[keypoints[..., 2] < acceptance * setup.settings.ensemble.joint_min_score] = (np.nan, np.nan, 0)
    joints = (keypoints[..., 2] > 0).sum(axis=1)
    kept = (scores >= acceptance * decode_params.person_min_score) & (joints >= decode_params.person_min_joints)
    return keypoints[kept], scores[kept]


def _check_image(bgr: np.ndarray) -> None:
    """Raise BadInputError unless it is a non-empty (H, W, 3) uint8 image."""
    if not isinstance(bgr, np.ndarray) or bgr.dtype != np.uint8 or bgr.ndim != 3 or bgr.shape[2] != 3:
        actual = f'{bgr.shape} {bgr.dtype}' if isinstance(bgr, np.ndarray) else type(bgr).__name__
        raise BadInputError(f'image: expected an (H, W, 3) uint8 array, got {actual}')
    if bgr.size == 0:
        raise BadInputError(f'image of {bgr.shape[1]}x{bgr.shape[0]} pixels: expected at least 1x1')
