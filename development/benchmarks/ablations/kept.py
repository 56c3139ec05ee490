"""What the chain finds in a sequence, kept in a file, so that it runs once."""
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np

from chain_runs import Finder, open_sequence
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.people import People3D

IN_SPACE = ('xyz', 'confidence', 'status', 'sigma', 'ids', 'velocity')
IN_IMAGE = ('keypoints', 'scores', 'ids')


def found_in(folder: Path, cache: Path) -> Tuple[List[Tuple[float, People3D]], List[People2D]]:
    """Return stamp [s] and people in space, and people in the image, of each frame of a sequence."""
    path = cache / f'{folder.resolve().parent.name}_{folder.name}.npz'
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
