"""Let the makers' own code decode tensors of networks, and keep what it makes of them for the tests of our decoders.

The tensors are those of tests/support/makers_tensors.py, by seed. It wrote tests/unit/decode/makers_outputs.npz once,
in an environment of its own, of Python 3.11:

    makers/bin/pip install 'setuptools<80' torch==2.14.1 torchvision==0.29.1 'numpy<2' mmengine scipy json_tricks \
        munkres pycocotools 'opencv-python-headless<4.12'
    makers/bin/pip install --no-deps --no-build-isolation mmcv-lite==2.1.0 mmpose==1.3.2 mmdet==3.3.0 xtcocotools \
        rtmlib==0.0.16
    makers/bin/python development/benchmarks/makers_outputs.py
"""
import sys
import types
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any, Dict

import numpy as np
import torch

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / 'tests/unit/decode/makers_outputs.npz'
sys.path.insert(0, str(ROOT / 'tests/support'))

import makers_tensors

Arrays = Dict[str, np.ndarray]


class _NoOperations:
    """Finds all modules of mmcv.ops, which only mmcv's build for the machine has; these networks use none of it."""

    @staticmethod
    def find_spec(name: str, *_: object) -> Any:
        is_operation = name.split('.')[:2] in (['mmcv', 'ops'], ['mmcv', '_ext'])
        return ModuleSpec(name, _NoOperations) if is_operation else None

    @staticmethod
    def create_module(spec: ModuleSpec) -> Any:
        module: Any = types.ModuleType(spec.name)
        module.__path__ = []
        return module

    @staticmethod
    def exec_module(module: Any) -> None:
        """Let every name be a kind of layer."""
        def layer(name: str) -> type:
            if name.startswith('__'):
                raise AttributeError(name)
            return type(name, (torch.nn.Module,), {})
        module.__getattr__ = layer


sys.meta_path.insert(0, _NoOperations)  # type: ignore[arg-type]


def simcc() -> Arrays:
    """mmpose 1.3.2, SimCCLabel of the RTMPose configurations; rtmlib 0.0.16, places and scores of the same tensors."""
    from mmpose.codecs import SimCCLabel
    from rtmlib.tools.pose_estimation.post_processings import get_simcc_maximum
    arrays = {}
    for name, (_, size) in makers_tensors.SIMCC.items():
        label = SimCCLabel(size, sigma=(4.9, 5.66), simcc_split_ratio=2.0, normalize=False, use_dark=False)
        places, scores = label.decode(*makers_tensors.simcc(name))
        arrays[f'simcc_{name}'] = np.concatenate([places, scores[..., None]], axis=2)
    places, scores = get_simcc_maximum(*makers_tensors.simcc('body'))
    arrays['rtmlib_body'] = np.concatenate([places / 2, scores[..., None]], axis=2)
    return arrays


def input_of_simcc() -> Arrays:
    """mmpose's PoseDataPreprocessor on a small image, BGR."""
    from mmpose.models import PoseDataPreprocessor
    image = np.random.RandomState(1).randint(0, 256, (8, 8, 3)).astype(np.uint8)
    normalize = PoseDataPreprocessor([123.675, 116.28, 103.53], [58.395, 57.12, 57.375], bgr_to_rgb=True)
    data = normalize({'inputs': [torch.from_numpy(image.transpose(2, 0, 1))], 'data_samples': []})
    return {'image': image, 'simcc_input': data['inputs'].numpy()}


def yolox() -> Arrays:
    """rtmlib 0.0.16, YOLOX.postprocess of both forms of files: boxes of people."""
    from rtmlib.tools.object_detection.yolox import YOLOX
    decode = YOLOX.__new__(YOLOX)  # without a file
    decode.model_input_size, decode.nms_thr, decode.score_thr = makers_tensors.YOLOX_SIZE, 0.45, 0.3
    decode.det_mode = 'multiclass'
    boxes, classes = decode.postprocess(makers_tensors.yolox())
    decode.det_mode = 'human'
    return {'yolox_raw': boxes[classes == 0], 'yolox_end_to_end': decode.postprocess(
        makers_tensors.yolox_end_to_end()[0].copy())}


def main() -> None:
    arrays = {**simcc(), **input_of_simcc(), **yolox()}
    np.savez_compressed(str(TARGET), **{name: array.astype(np.float32) if array.dtype == np.float64 else array
                                        for name, array in arrays.items()})
    print(f'{TARGET}: {TARGET.stat().st_size} bytes')


if __name__ == '__main__':
    main()
