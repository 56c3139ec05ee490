"""Build the makers' architectures of pose networks with random weights, by their public configurations, as ONNX files.

The files serve to measure time: `./run bench networks shares FOLDER` and `rate`. They find no people. Batch
normalization is set by a pass over noise, so that the numbers in the network are of the size that they have in a
trained one. It needs an environment of its own, of Python 3.11, about 5 GB:

    python3.11 -m venv makers
    makers/bin/pip install 'setuptools<80' torch==2.14.1 torchvision==0.29.1 'numpy<2' onnx onnxscript mmengine scipy \
        six json_tricks munkres pycocotools shapely terminaltables omegaconf iopath cloudpickle rfdetr==1.11.2 \
        ultralytics 'opencv-python-headless<4.12'
    makers/bin/pip install --no-deps --no-build-isolation mmcv-lite==2.1.0 mmpose==1.3.2 mmdet==3.3.0 xtcocotools
    git clone https://github.com/SebastianJanampa/DETRPose
    makers/bin/python development/benchmarks/networks/make_random.py FOLDER --detrpose DETRPose

Outputs have the names and forms of the makers' own files: RTMPose, RTMW, RTMO and YOLOX as exported by mmdeploy,
DETRPose by its tools/deployment/export_onnx.py, RF-DETR by its `export`, YOLO by ultralytics (AGPL-3.0: used as a
tool). A network whose packages are not there is left out, and the exit status is 1.
"""
import argparse
import importlib
import sys
import types
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any, Callable, ClassVar, Dict, List, Sequence, Tuple

import torch
from torch import Tensor, nn
from torchvision.ops import nms

OPSET = 16
BODY, WHOLE = 'body_2d_keypoint', 'wholebody_2d_keypoint/rtmpose'
# Configurations of mmpose 1.3.2, below its folder .mim/configs, by the name of the file that is written.
SIMCC = {
    'rtmpose_t': f'{BODY}/rtmpose/body8/rtmpose-t_8xb256-420e_body8-256x192.py',
    'rtmpose_s': f'{BODY}/rtmpose/body8/rtmpose-s_8xb256-420e_body8-256x192.py',
    'rtmpose_m': f'{BODY}/rtmpose/body8/rtmpose-m_8xb256-420e_body8-256x192.py',
    'rtmpose_l': f'{BODY}/rtmpose/body8/rtmpose-l_8xb256-420e_body8-256x192.py',
    'rtmpose_s_feet': f'{BODY}/rtmpose/body8/rtmpose-s_8xb1024-700e_body8-halpe26-256x192.py',
    'rtmpose_m_384': f'{BODY}/rtmpose/body8/rtmpose-m_8xb256-420e_body8-384x288.py',
    'rtmpose_l_384': f'{BODY}/rtmpose/body8/rtmpose-l_8xb256-420e_body8-384x288.py',
    'rtmpose_m_whole': f'{WHOLE}/coco-wholebody/rtmpose-m_8xb64-270e_coco-wholebody-256x192.py',
    'rtmw_m_whole': f'{WHOLE}/cocktail14/rtmw-m_8xb1024-270e_cocktail14-256x192.py'}
RTMO = {'rtmo_s': f'{BODY}/rtmo/body7/rtmo-s_8xb32-600e_body7-640x640.py'}
# mmdet 3.3.0; that of people's boxes (YOLOX-tiny HumanArt) has one class.
YOLOX = {'yolox_tiny': 'yolox/yolox_tiny_8xb8-300e_coco.py'}
DETRPOSE = {f'detrpose_{size}': f'configs/detrpose/detrpose_hgnetv2_{size}.py' for size in 'nsm'}
YOLO_POSE = {'yolo11n_pose': 'yolo11n-pose.yaml', 'yolo26n_pose': 'yolo26n-pose.yaml'}
Writer = Callable[[str, str, Path], None]


class _NoOperations(types.ModuleType):
    """Stands in for mmcv.ops, which only mmcv's build for the machine has; these networks use none of it."""

    __path__: ClassVar[List[str]] = []

    def __getattr__(self, name: str) -> Any:
        if name.startswith('__'):
            raise AttributeError(name)
        return type(name, (nn.Module,), {})


class _OperationsFinder:
    """Finds all modules of mmcv.ops."""

    @staticmethod
    def find_spec(name: str, *_: object) -> Any:
        is_operation = name.split('.')[:2] in (['mmcv', 'ops'], ['mmcv', '_ext'])
        return ModuleSpec(name, _OperationsFinder) if is_operation else None

    @staticmethod
    def create_module(spec: ModuleSpec) -> types.ModuleType:
        return _NoOperations(spec.name)

    @staticmethod
    def exec_module(_module: types.ModuleType) -> None:
        """Nothing is in it."""


def configuration(package: str, path: str) -> Any:
    """Return a configuration that a package of OpenMMLab brings, without addresses of weights."""
    from mmengine.config import Config
    from mmengine.registry import init_default_scope
    importlib.import_module(f'{package}.utils').register_all_modules()
    init_default_scope(package)
    folder = Path(importlib.import_module(package).__file__).parent / '.mim/configs'
    return Config.fromfile(str(folder / path))


def normalized(model: nn.Module, *inputs: Tensor) -> nn.Module:
    """Set batch normalization by a pass and return the network for inference."""
    model.eval()
    norms = [module for module in model.modules() if isinstance(module, (nn.BatchNorm2d, nn.SyncBatchNorm))]
    for norm in norms:
        norm.momentum = 1.0
        norm.train()
    with torch.no_grad():
        model(*inputs)
    return model.eval()


def noise(width: int, height: int) -> Tensor:
    """Return an image in which each pixel is noise of mean 0 and variance 1."""
    return torch.randn(1, 3, height, width)


def pixels(width: int, height: int) -> Tensor:
    """Return an image of noise for networks that take 0 .. 255."""
    return 255 * torch.rand(1, 3, height, width)


def write_onnx(model: nn.Module, inputs: Tuple[Tensor, ...], path: Path, names: Dict[str, Sequence[str]],
               free: Sequence[str] = ()) -> None:
    """Write a network; `names` of inputs and outputs, `free`: those with a free batch."""
    with torch.no_grad():
        torch.onnx.export(model, inputs, str(path), input_names=names['inputs'], output_names=names['outputs'],
                          dynamic_axes={name: {0: 'batch'} for name in free}, opset_version=OPSET, dynamo=False)


class _SimCC(nn.Module):
    """Backbone, neck and head of a top-down network."""

    def __init__(self, model: Any) -> None:
        super().__init__()
        self.parts = nn.Sequential(model.backbone, model.neck) if model.with_neck else model.backbone
        self.head = model.head

    def forward(self, image: Tensor) -> Any:
        return self.head(self.parts(image))


def write_simcc(name: str, path: str, file: Path) -> None:
    from mmpose.models import build_pose_estimator
    config = configuration('mmpose', path)
    config.model.backbone.pop('init_cfg', None)
    image = noise(*config.codec.input_size)
    model = build_pose_estimator(config.model)
    model.switch_to_deploy()
    whole = normalized(_SimCC(model), image)
    names = {'inputs': ['input'], 'outputs': ['simcc_x', 'simcc_y']}
    write_onnx(whole, (image,), file, names, ['input', 'simcc_x', 'simcc_y'])


def quiet(*layers: nn.ModuleList) -> None:
    """Let the last layers of a head find nothing, the first of them with the scores; and boxes of a finite size."""
    for layer in layers:
        for each in layer:
            nn.init.normal_(each.weight, std=1e-3)
            nn.init.constant_(each.bias, -4.6 if each.out_channels == 1 else 0.0)  # a score of .01


def _kept(boxes: Tensor, scores: Tensor, thresholds: Tuple[float, float]) -> Tensor:
    """Return the rows of boxes, (N, 4), after the suppression of mmdeploy: thresholds of score and overlap."""
    sure = (scores > thresholds[0]).nonzero()[:, 0]
    return sure[nms(boxes[sure], scores[sure], thresholds[1])[:50]]


class _Rtmo(nn.Module):
    """RTMO with the suppression, as mmdeploy rewrites its head (codebase/mmpose/models/heads/rtmo_head.py)."""

    def __init__(self, model: Any) -> None:
        super().__init__()
        self.backbone, self.neck, self.head = model.backbone, model.neck, model.head
        self.test_cfg = model.test_cfg

    def forward(self, image: Tensor) -> Any:
        from mmpose.structures.bbox import bbox_xyxy2cs
        head = self.head
        scores, boxes, _, visible, poses = head.head_module(self.neck(self.backbone(image)))[:5]
        scores, boxes, visible, poses = map(head._flatten_predictions, (scores, boxes, visible, poses))
        boxes = head.decode_bbox(boxes, head.flatten_priors, head.flatten_stride)
        scores, visible = scores.sigmoid(), visible.sigmoid()
        kept = _kept(boxes[0], scores[0, :, 0], (self.test_cfg['score_thr'], self.test_cfg['nms_thr']))
        boxes, scores, visible, poses = boxes[0, kept], scores[0, kept], visible[0, kept], poses[0, kept]
        centres = torch.cat(bbox_xyxy2cs(boxes, head.bbox_padding), dim=-1)
        joints = head.dcc.forward_test(poses[None], centres[None], head.flatten_priors[kept][None])
        joints = torch.cat([joints.reshape(1, -1, *visible.shape[1:], 2), visible[None, ..., None]], dim=-1)
        return torch.cat([boxes, scores], dim=1)[None], joints


def write_rtmo(name: str, path: str, file: Path) -> None:
    from mmpose.models import build_pose_estimator
    config = configuration('mmpose', path)
    config.model.backbone.pop('init_cfg', None)
    image = pixels(*config.input_size)
    model = build_pose_estimator(config.model)
    quiet(model.head.head_module.out_cls, model.head.head_module.out_bbox)
    model.switch_to_deploy()
    write_onnx(normalized(_Rtmo(model), image), (image,), file, {'inputs': ['input'], 'outputs': ['dets', 'keypoints']})


class _Yolox(nn.Module):
    """YOLOX of one class with the suppression, as mmdeploy rewrites its head."""

    def __init__(self, model: Any) -> None:
        super().__init__()
        self.backbone, self.neck, self.head = model.backbone, model.neck, model.bbox_head

    def forward(self, image: Tensor) -> Any:
        classes, boxes, objects = self.head(self.neck(self.backbone(image)))
        priors = torch.cat(self.head.prior_generator.grid_priors([each.shape[2:] for each in classes], with_stride=True,
                                                                 device=image.device))
        classes, boxes, objects = (torch.cat([each.flatten(2).transpose(1, 2) for each in level], dim=1)
                                   for level in (classes, boxes, objects))
        scores = (classes.sigmoid() * objects.sigmoid())[0, :, 0]
        boxes = self.head._bbox_decode(priors, boxes)[0]
        kept = _kept(boxes, scores, (0.01, 0.65))
        found = torch.cat([boxes[kept], scores[kept, None]], dim=1)[None]
        return found, torch.zeros_like(found[..., 0]).long()


def write_yolox(name: str, path: str, file: Path) -> None:
    config = configuration('mmdet', path)
    from mmdet.registry import MODELS
    config.model.bbox_head.num_classes = 1
    model = MODELS.build(config.model)
    head = model.bbox_head
    quiet(head.multi_level_conv_cls, head.multi_level_conv_obj, head.multi_level_conv_reg)
    image = pixels(416, 416)
    write_onnx(normalized(_Yolox(model), image), (image,), file, {'inputs': ['input'], 'outputs': ['dets', 'labels']})


def write_detrpose(name: str, path: str, file: Path) -> None:
    core = importlib.import_module('src.core')
    config = core.LazyConfig.load(path)
    config.model.backbone.pretrained = config.model.backbone.freeze_norm = False

    class Whole(nn.Module):
        """As Model of tools/deployment/export_onnx.py."""

        def __init__(self) -> None:
            super().__init__()
            self.model = core.instantiate(config.model).deploy()
            self.postprocessor = core.instantiate(config.postprocessor).deploy()

        def forward(self, images: Tensor, sizes: Tensor) -> Any:
            return self.postprocessor(self.model(images), sizes)

    torch.backends.mha.set_fastpath_enabled(False)  # ONNX has no such operation
    names = {'inputs': ['images', 'orig_target_sizes'], 'outputs': ['scores', 'labels', 'keypoints']}
    inputs = noise(640, 640), torch.tensor([[640, 640]])
    write_onnx(normalized(Whole(), *inputs), inputs, file, names, names['inputs'])


def write_rf_detr(name: str, _path: str, file: Path) -> None:
    network = importlib.import_module('rfdetr').RFDETRKeypointPreview(pretrain_weights=None, device='cpu')
    network.export(output_dir=str(file.parent), output_name=file.stem, verbose=False)


def write_yolo(name: str, path: str, file: Path) -> None:
    network = importlib.import_module('ultralytics').YOLO(path)
    people = importlib.import_module('ultralytics.nn.tasks').PoseModel(path, nc=1, verbose=False)  # one class
    people.args, people.task, people.pt_path = network.model.args, network.model.task, None
    network.model = people
    written = network.export(format='onnx', dynamic=True, simplify=False)
    Path(written).replace(file)


NETWORKS: Dict[str, Tuple[Writer, str]] = {
    **{name: (write_simcc, path) for name, path in SIMCC.items()},
    **{name: (write_rtmo, path) for name, path in RTMO.items()},
    **{name: (write_yolox, path) for name, path in YOLOX.items()},
    **{name: (write_yolo, path) for name, path in YOLO_POSE.items()},
    **{name: (write_detrpose, path) for name, path in DETRPOSE.items()},
    'rf_detr_keypoint': (write_rf_detr, '')}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=Path, help='where the files are written; those that are there are left')
    parser.add_argument('--only', nargs='+', choices=NETWORKS, default=[*NETWORKS], metavar='NAME')
    parser.add_argument('--detrpose', type=Path, default=Path('DETRPose'), help='checkout of DETRPose')
    options = parser.parse_args()
    sys.path.insert(0, str(options.detrpose))
    sys.meta_path.insert(0, _OperationsFinder)
    options.folder.mkdir(parents=True, exist_ok=True)
    failed = 0
    for name in options.only:
        file, (write, path) = options.folder / f'{name}.onnx', NETWORKS[name]
        if file.exists():
            continue
        torch.manual_seed(1)
        try:
            write(name, str(options.detrpose / path) if name in DETRPOSE else path, file)
            print(f'{name}: {file.stat().st_size / 1e6:.1f} MB', flush=True)
        except Exception as error:  # packages of several makers: any of them may lack something
            failed = 1
            print(f'{name}: left out: {type(error).__name__}: {error}', flush=True)
    return failed


if __name__ == '__main__':
    sys.exit(main())
