"""Proof of a network that is fetched by name: it has to find the people of a known picture.

No known output of such a network is at hand, unlike for `self_check`. So a decoder that misreads its real weights is
found by what it says of a picture whose joints are known: data/two_people.jpg, rendered by the generator of
development/benchmark_data, with the truth of its joints beside it [px]; boxes and feet were placed by hand. One person
stands, one sits, each with another arm raised: no fixed pose, mirror image or exchange of left and right is near both.
"""
import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, List, NamedTuple, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.decode.boxes import decode_boxes, overlaps
from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.ensemble import area, sigmas
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet, cut, fit_image, fit_recipe
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import Poses
from openpose_ros_pkg.skeletons import SkeletonModel

if TYPE_CHECKING:
    from openpose_ros_pkg.networks.backends import Backend

PICTURE = Path(__file__).resolve().parent / 'data' / 'two_people.jpg'


@dataclass(frozen=True)
class ProofConstants:
    """What a network has to find."""

    wanted: float = constant(
        0.8, 'Least mean similarity of the people: OKS of joints, or IoU of the boxes of a network for boxes.',
        source='the default networks reach .96, exchanged or shifted joints .21 at most (test_proof.py)')
    same_person: float = constant(0.5, 'Least similarity of a found person.', source="COCO's lowest")
    crop_margin: float = constant(1.25, 'Sides of a crop, in units of the box of the person.',
                                  source='rtmlib, rtmpose.py')
    least_score: float = constant(0.01, 'Score that a person needs: the surest ones count, whatever their scores.')


PROOF = ProofConstants()


class Proof(NamedTuple):
    """What a network found in the picture."""

    found: float  # mean over the people of the greatest similarity that a detection has to them
    people: int  # number of found people
    expected: int  # number of people in the picture
    measure: str  # what the similarity is of

    @property
    def passed(self) -> bool:
        return self.people == self.expected and self.found >= PROOF.wanted

    def __str__(self) -> str:
        return (f'it finds {self.people} of {self.expected} people of a known picture at {self.measure} '
                f'{self.found:.2f}, wanted {self.expected} at {PROOF.wanted:.2f}')


class _Truth(NamedTuple):
    """The picture and its T people [px]."""

    bgr: np.ndarray  # (H, W, 3) uint8
    names: Tuple[str, ...]  # of the J joints: COCO's and those of the feet
    joints: np.ndarray  # (T, J, 2)
    boxes: np.ndarray  # (T, 4): x1, y1, x2, y2


def prove(backend: 'Backend', model: Model) -> Proof:
    """Let a network find the people of the picture; raise ModelError, which has both figures, if it does not."""
    proof = measure(backend, model)
    if not proof.passed:
        raise ModelError(f'{model.name} on {backend.description} is refused: {proof}')
    return proof


def measure(backend: 'Backend', model: Model, constants: ProofConstants = PROOF) -> Proof:
    """Return what a network finds in the picture."""
    truth = _truth()
    if model.decoder == Decoder.BOXES:
        alike = overlaps(_boxes(backend, model, truth, constants), truth.boxes)
        what = 'a mean overlap of boxes (IoU) of'
    else:
        find = _on_crops if model.decoder in (Decoder.SIMCC, Decoder.MOVENET_SINGLEPOSE) else _in_whole
        poses = find(backend, model, truth, constants)
        surest = poses.keypoints[np.argsort(-poses.scores, kind='stable')[:len(truth.joints)]]
        alike = _similarities(surest, model.skeleton, truth)
        what = 'a mean similarity of joints (OKS) of'
    best = alike.max(axis=0) if len(alike) else np.zeros(len(truth.joints))
    return Proof(round(float(best.mean()), 4), int((best >= constants.same_person).sum()), len(best), what)


def _in_whole(backend: 'Backend', model: Model, truth: _Truth, constants: ProofConstants) -> Poses:
    """Return the people that a network finds in the whole picture."""
    outputs, plan = _whole(backend, model, truth)
    poses = decode_direct(outputs, model, _params(constants), plan)
    return _moved(poses, plan.to_image(poses.keypoints[..., :2]))


def _boxes(backend: 'Backend', model: Model, truth: _Truth, constants: ProofConstants) -> np.ndarray:
    """Return the surest boxes, (P, 4) x1, y1, x2, y2 [px], that a network for boxes finds in the whole picture."""
    outputs, plan = _whole(backend, model, truth)
    boxes = decode_boxes(outputs, constants.least_score, plan.net_size).boxes[:len(truth.boxes)]
    return plan.to_image(boxes.reshape(-1, 2, 2)).reshape(-1, 4)


def _whole(backend: 'Backend', model: Model, truth: _Truth) -> Tuple[List[np.ndarray], ImageToNet]:
    """Return the outputs for the whole picture, and how it lay in the input."""
    size = truth.bgr.shape[1], truth.bgr.shape[0]
    plan = fit_recipe(size, model.input, size)
    return _computed(backend, model, truth.bgr, plan), plan


def _on_crops(backend: 'Backend', model: Model, truth: _Truth, constants: ProofConstants) -> Poses:
    """Return the people that a network for crops finds on crops of the true boxes."""
    net_width, net_height = model.input.fixed_size or (192, 256)
    found: List[Poses] = []
    for box in truth.boxes:
        sides = (box[2:] - box[:2]) * constants.crop_margin
        side = max(sides[0] / net_width, sides[1] / net_height) / 2
        middle, half = (box[:2] + box[2:]) / 2, side * np.array([net_width, net_height])
        left, top = np.rint(middle - half).astype(int).tolist()
        right, bottom = np.rint(middle + half).astype(int).tolist()
        crop = cut(truth.bgr, (left, top, right - left, bottom - top), model.input.padding)
        plan = fit_image((right - left, bottom - top), net_width, net_height, model.input.multiple_of, whole_box=True)
        poses = decode_direct(_computed(backend, model, crop, plan), model, _params(constants), plan)
        found.append(_moved(poses, plan.to_image(poses.keypoints[..., :2]) + np.array([left, top])))
    return functools.reduce(Poses.joined, found)


def _computed(backend: 'Backend', model: Model, bgr: np.ndarray, plan: ImageToNet) -> List[np.ndarray]:
    return [output[0] for output in backend.infer(plan.apply(bgr, model.input.padding)[np.newaxis])]


def _params(constants: ProofConstants) -> DirectDecodeParams:
    return DirectDecodeParams(direct_joint_score=0.0, direct_person_score=constants.least_score)


def _moved(poses: Poses, xy: np.ndarray) -> Poses:
    """Return people at other places, (P, K, 2)."""
    return Poses(np.concatenate([xy.astype(np.float32), poses.keypoints[..., 2:]], axis=2), poses.scores)


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
    """Read the picture; raises ModelError where it, which comes with the package, is damaged."""
    try:
        people = json.loads(PICTURE.with_suffix('.json').read_text())['people']
        names = tuple(people[0]['joints'])
        joints = np.array([[person['joints'][name] for name in names] for person in people])
        bgr = cv2.imdecode(np.fromfile(str(PICTURE), np.uint8), cv2.IMREAD_COLOR)
        if bgr is None:
            raise ValueError('no image')
        return _Truth(bgr, names, joints, np.array([person['box'] for person in people]))
    except (OSError, ValueError, LookupError, TypeError, cv2.error) as error:
        raise ModelError(f'{PICTURE} is damaged, install the package again: {error}') from error
