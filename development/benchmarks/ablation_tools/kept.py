"""What is computed once for all variants: what the chain finds in a sequence, in a file, and what networks give."""
import hashlib
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from chain_runs import CountedNetwork, Finder, name_of, open_sequence
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.people import People3D

IN_SPACE = ('xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity')
IN_IMAGE = ('keypoints', 'scores', 'ids')


class RememberedNetwork(CountedNetwork):
    """A network that computes each input once, and counts those; `outputs`: what it computed."""

    def __init__(self, network: Backend) -> None:
        super().__init__(network)
        self.outputs: Dict[Any, Tuple[np.ndarray, ...]] = {}

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        keys = [(image.shape, hashlib.blake2b(image.tobytes(), digest_size=16).digest()) for image in images]
        new = {key: image for key, image in zip(keys, images) if key not in self.outputs}
        self.outputs.update(zip(new, super().infer_many(list(new.values())) if new else ()))
        return [self.outputs[key] for key in keys]


def found_in(folder: Path, cache: Path) -> Tuple[List[Tuple[float, People3D]], List[People2D]]:
    """Return stamp [s] and people in space, and people in the image, of each frame of a sequence."""
    path = cache / f'{name_of(folder)}.npz'
    if not path.is_file():
        run = Finder(build(ChainSettings, {})).run(open_sequence(folder))
        cache.mkdir(parents=True, exist_ok=True)
        values = {'stamps': [stamp for stamp, _ in run.frames]}
        for word, people, names in (('space', [people for _, people in run.frames], IN_SPACE),
                                    ('image', run.people, IN_IMAGE)):
            values[f'{word}_counts'] = [len(one) for one in people]
            for name in names:
                values[f'{word}_{name}'] = np.concatenate([getattr(one, name) for one in people])
        np.savez_compressed(path, **values)
    with np.load(path) as kept:
        values = dict(kept)
    in_space = [People3D(COCO_18, *arrays) for arrays in _frames(values, 'space', IN_SPACE)]
    return (list(zip(values['stamps'].tolist(), in_space)),
            [People2D(COCO_18, *arrays) for arrays in _frames(values, 'image', IN_IMAGE)])


def _frames(values: Dict[str, np.ndarray], word: str, names: Tuple[str, ...]) -> List[Tuple[np.ndarray, ...]]:
    ends = np.cumsum(values[f'{word}_counts'])[:-1]
    return list(zip(*(np.split(values[f'{word}_{name}'], ends) for name in names)))
