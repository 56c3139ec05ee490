"""From the outputs of MoveNet MultiPose, RTMO and YOLO-pose, which find people in one pass, to these people."""
from typing import Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.boxes import without_overlap
from openpose_ros_pkg.people import Poses


def decode_movenet(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Poses:
    """Return the people of MoveNet MultiPose.

    Its model card: 17 times y, x, score, then ymin, xmin, ymax, xmax, score; positions as shares of the input.
    """
    rows = np.asarray(outputs[0], np.float64)
    rows = rows[rows[:, 55] >= least]
    joints = rows[:, :51].reshape(-1, 17, 3)[..., [1, 0, 2]]
    joints[..., :2] = joints[..., :2] * net_size - 0.5
    return Poses(joints, rows[:, 55])


def decode_rtmo(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int], overlap: float) -> Poses:
    """Return the people of RTMO, of boxes that share more of their union than `overlap` only the surest.

    It gives boxes (N, 5): x1, y1, x2, y2 [px of its input], score; and keypoints (N, 17, 3): x, y [px], score.
    """
    boxes, joints = (np.asarray(output, np.float64) for output in outputs)
    sure = (boxes[:, 4] >= least) & np.isfinite(boxes).all(axis=1)
    boxes, joints = boxes[sure], joints[sure]
    kept = without_overlap(boxes[:, :4], boxes[:, 4], overlap)
    return Poses(joints[kept], boxes[kept, 4])


def decode_yolo(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int], overlap: float) -> Poses:
    """Return the people of YOLO-pose (v8, 11, 26), of boxes that share more than `overlap` only the surest.

    It gives one of two forms, in pixels of its input from the corner of the first one (measured with mirror images),
    each with 17 times x, y, visibility at the end:
    - raw, (56, N): x and y of the middle of the box, its width, height and score;
    - end to end, (N, 57): x1, y1, x2, y2, score, class (there is one), of boxes that are different people already;
      unused rows are 0.
    Visibility supposes that there is a person, so the score of a joint is its visibility times the person's score.
    """
    output = outputs[0]
    end_to_end = output.shape[1] == 57
    rows = output if end_to_end else output.T
    rows = rows[(rows[:, 4] >= least) & np.isfinite(rows[:, :5]).all(axis=1)].astype(np.float64)
    if not end_to_end:
        half = rows[:, 2:4] / 2
        boxes = np.hstack([rows[:, :2] - half, rows[:, :2] + half])
        rows = rows[without_overlap(boxes, rows[:, 4], overlap)]
    joints = rows[:, -51:].reshape(-1, 17, 3) - (0.5, 0.5, 0)
    joints[..., 2] *= rows[:, 4:5]
    return Poses(joints, rows[:, 4])
