"""Proof of a network that is fetched by name: it has to find the people of a known picture.

No known output of such a network is at hand, unlike for `self_check`. So a decoder that misreads its real weights is
found by what it says of a picture whose joints are known: data/two_people.jpg, rendered by the generator of
development/benchmark_data, with the truth of its joints beside it [px]; boxes and feet were placed by hand. One person
stands, one sits, each with another arm raised: no fixed pose, mirror image or exchange of left and right is near both.
"""
import json
from pathlib import Path
from typing import TYPE_CHECKING, List, NamedTuple, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.decode.boxes import decode_boxes, overlaps
from openpose_ros_pkg.decode.direct import DirectThresholds, decode_direct
from openpose_ros_pkg.decode.paf import DecodeParams, decode_fields
from openpose_ros_pkg.ensemble import area, sigmas
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_types import BOX_DECODERS, CROP_DECODERS, Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet, cut, fit_recipe
from openpose_ros_pkg.skeletons import SkeletonModel

if TYPE_CHECKING:
    from openpose_ros_pkg.networks.backends import Backend

PICTURE = Path(__file__).resolve().parent / 'data' / 'two_people.jpg'
# Least mean similarity of the people: OKS of joints, or IoU of boxes. The default networks reach .96, exchanged or
# shifted joints .21 at most (test_proof.py).
_WANTED = 0.8
_SAME_PERSON = 0.5  # least similarity of a found person: COCO's lowest
_CROP_MARGIN = 1.25  # sides of a crop per side of the box of the person: rtmlib, rtmpose.py
_PERSON = 0.01  # score that a person needs: the surest people count
_PARAMS = DirectThresholds(joint_score=0.0, person_score=_PERSON)


class _Truth(NamedTuple):
    """The picture and its T people [px]."""

    bgr: np.ndarray  # (H, W, 3) uint8
    names: Tuple[str, ...]  # of the J joints: COCO's and those of the feet
    joints: np.ndarray  # (T, J, 2)
    boxes: np.ndarray  # (T, 4): x1, y1, x2, y2


def prove(backend: 'Backend', model: Model) -> str:
    """Let a network find the people of the picture; return how well it does, in words.

    Raises:
        ModelError: it misses a person, or their mean similarity is too small.
    """
    truth = _truth()
    if model.decoder in BOX_DECODERS:
        what = 'overlap of boxes (IoU)'
        outputs, plan = _computed(backend, model, truth.bgr)
        boxes = decode_boxes(outputs, _PERSON, plan.net_size, model.decoder).boxes[:len(truth.boxes)]
        alike = overlaps(plan.to_image(boxes.reshape(-1, 2, 2)).reshape(-1, 4), truth.boxes)
    else:
        what = 'similarity of joints (OKS)'
        alike = _similarities(_people(backend, model, truth), model.skeleton, truth)
    best = alike.max(axis=0) if len(alike) else np.zeros(len(truth.joints))
    found = int((best >= _SAME_PERSON).sum())
    text = (f'it finds {found} of {len(best)} people of a known picture at a mean {what} of {best.mean():.2f}, wanted '
            f'{len(best)} at {_WANTED:.2f}')
    if found < len(best) or best.mean() < _WANTED:
        raise ModelError(f'{model.name} on {backend.description} is refused: {text}')
    return text


def _people(backend: 'Backend', model: Model, truth: _Truth) -> np.ndarray:
    """Return the surest people that a network finds in the whole picture or on crops of the true boxes, (P, K, 3)."""
    parts = [(0, 0, truth.bgr.shape[1], truth.bgr.shape[0])]
    if model.decoder in (*CROP_DECODERS, Decoder.MOVENET_SINGLEPOSE):
        parts = [_crop(box, np.array(model.input.fixed_size)) for box in truth.boxes]
    found = []
    for part in parts:
        outputs, plan = _computed(backend, model, cut(truth.bgr, part, model.input.padding))
        poses = (decode_fields(np.concatenate(outputs), model, DecodeParams(), plan.scaled_size)
                 if model.decoder == Decoder.PAF else decode_direct(outputs, model, _PARAMS, plan))
        poses.keypoints[..., :2] = plan.to_image(poses.keypoints[..., :2]) + part[:2]
        found.append(poses)
    surest = np.argsort(-np.concatenate([poses.scores for poses in found]), kind='stable')[:len(truth.joints)]
    return np.concatenate([poses.keypoints for poses in found])[surest]


def _crop(box: np.ndarray, net_size: np.ndarray) -> Tuple[int, int, int, int]:
    """Return left, top, width and height of the crop of a person, with the aspect of a network's input."""
    middle, half = (box[:2] + box[2:]) / 2, ((box[2:] - box[:2]) * _CROP_MARGIN / net_size).max() / 2 * net_size
    left, top, right, bottom = np.rint([*(middle - half), *(middle + half)]).astype(int).tolist()
    return left, top, right - left, bottom - top


def _computed(backend: 'Backend', model: Model, bgr: np.ndarray) -> Tuple[List[np.ndarray], ImageToNet]:
    """Return the outputs for an image, and how it lay in the input."""
    size = bgr.shape[1], bgr.shape[0]
    plan = fit_recipe(size, model.input, size)
    return [output[0] for output in backend.infer(plan.apply(bgr, model.input.padding)[np.newaxis])], plan


def _similarities(found: np.ndarray, skeleton: SkeletonModel, truth: _Truth) -> np.ndarray:
    """Return the OKS of people (P, K, 3) and the T true ones, (P, T), over the joints that both have.

    A joint that the skeleton has and that was not found counts as 0.
    """
    common = [(skeleton.index[name], i) for i, name in enumerate(truth.names) if name in skeleton.index]
    columns, known = map(list, zip(*common))
    apart = ((found[:, None, columns, :2].astype(np.float64) - truth.joints[:, known]) ** 2).sum(axis=-1)
    spread = 2 * area(truth.joints)[:, None] * sigmas(skeleton)[columns] ** 2
    return np.nan_to_num(np.exp(-apart / spread)).mean(axis=-1)


def _truth() -> _Truth:
    """Return the picture, which comes with the package, and its people."""
    people = json.loads(PICTURE.with_suffix('.json').read_text())['people']
    names = tuple(people[0]['joints'])
    joints = [[one['joints'][name] for name in names] for one in people]
    return _Truth(cv2.imread(str(PICTURE)), names, np.array(joints), np.array([one['box'] for one in people]))
