"""From the outputs of networks whose queries are people (DETRPose, RF-DETR Keypoint) to people; they need no NMS."""
from typing import Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.points import Decoded

# RF-DETR multiplies the score of a person by the mean trace of the joints' covariances (in shares of the image) to the
# power of minus this: rfdetr 1.11.2, models/postprocess.py, trace_alpha.
_TRACE_ALPHA = 0.2


def decode_detr_pose(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Decoded:
    """Return the people of DETRPose.

    Its files have one of two forms, with places as shares of the image:
    - with its post-processor (tools/deployment/export_onnx.py): scores (N,), classes (N,) and joints (N, 17, 2). Its
      input orig_target_sizes, by which it multiplies the places, is 1, 1;
    - without: logits (N, classes) and joints (N, 17, 2) or (N, 34).
    A query is one person: its score is that of its surest class. Joints have no scores of their own: the person's.
    """
    joints = np.asarray(outputs[-1], np.float64).reshape(-1, 17, 2)
    scores = np.asarray(outputs[0], np.float64)
    if scores.ndim == 2:
        scores = _sigmoid(scores.max(axis=1))
    order = np.argsort(-scores, kind='stable')
    order = order[scores[order] >= least]
    joints, scores = joints[order], scores[order]
    # Of pixels' centres of the image, in shares of its size: it mirrors images by w - x - 1 (src/data/transforms.py).
    return Decoded(np.concatenate([joints * net_size, np.broadcast_to(scores[:, None, None], (*joints.shape[:2], 1))],
                                  axis=2), scores)


def decode_rf_detr(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Decoded:
    """Return the people of RF-DETR Keypoint: rfdetr 1.11.2, models/postprocess.py.

    It gives boxes (N, 4), logits of classes (N, C), and points (N, 17 or 34, 8): x, y as shares of the input, logits of
    "it can be found" and of "it is visible", and log L11, L21, log L22, where L times its transpose is the inverse of
    the covariance of x and y in these shares. With 34 points the first class, of the background, has 17 of its own.
    The score of a joint is that it can be found.
    """
    logits, points = (np.asarray(output, np.float64) for output in outputs[1:])
    classes = points.shape[1] // 17
    probabilities = _sigmoid(logits)
    # As many pairs of query and class as there are queries take part, of whatever class.
    chosen = np.argsort(-probabilities.ravel(), kind='stable')[:len(logits)]
    queries = chosen[chosen % logits.shape[1] == classes - 1] // logits.shape[1]
    points = points[queries, -17:]
    found = _sigmoid(points[..., 2])
    with np.errstate(all='ignore'):
        # Covariance of x: (L21^2 + L22^2) / (L11 L22)^2; of y: 1 / L22^2.
        across = np.exp(-2 * points[..., 6])
        along = np.exp(-2 * points[..., 4]) * (1 + points[..., 5] ** 2 * across)
        trace = ((along + across) * found).sum(axis=1) / found.sum(axis=1)
        scores = probabilities[queries, classes - 1]
        scores = scores / (scores + trace ** _TRACE_ALPHA)  # sigmoid(log(score) - alpha log(trace))
        sigmas = np.sqrt(np.stack([along, across], axis=2)) * net_size
    order = np.argsort(-scores, kind='stable')
    order = order[scores[order] >= least]
    places = np.concatenate([points[..., :2] * net_size, found[..., None]], axis=2)
    return Decoded(places[order], scores[order], sigmas[order])


def _sigmoid(logits: np.ndarray) -> np.ndarray:
    with np.errstate(over='ignore'):
        return 1 / (1 + np.exp(-logits))
