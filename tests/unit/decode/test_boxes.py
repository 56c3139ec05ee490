"""Boxes of people: both forms of YOLOX's files, PicoDet, other classes, scores and what is not finite."""
import numpy as np
import pytest

from openpose_ros_pkg.decode.boxes import decode_boxes
from openpose_ros_pkg.networks.model_types import Decoder

SIZE, CELLS = (128, 96), 16 * 12 + 8 * 6 + 4 * 3


def end_to_end(*boxes):
    """Boxes (N, 5) and classes (N,) of x1, y1, x2, y2, score, class."""
    rows = np.array(boxes, np.float32).reshape(-1, 6)
    return rows[:, :5], rows[:, 5]


def raw(*boxes, classes=80):
    """(cells, 5 + classes), each box in the cell of the middle grid where its middle is."""
    rows = np.zeros((CELLS, 5 + classes), np.float32)
    for x1, y1, x2, y2, score, kind in boxes:
        x, y = (x1 + x2) / 32, (y1 + y2) / 32
        row = rows[16 * 12 + int(y) * 8 + int(x)]
        row[:5] = x - int(x), y - int(y), np.log((x2 - x1) / 16), np.log((y2 - y1) / 16), np.sqrt(score)
        row[5 + int(kind)] = np.sqrt(score)
    return (rows,)


FORMS = pytest.mark.parametrize('form', [end_to_end, raw])


@FORMS
def test_no_person(form):
    boxes, scores = decode_boxes(form(), 0.0, SIZE)
    assert boxes.shape == (0, 4) and scores.shape == (0,) and boxes.dtype == scores.dtype == np.float32


@FORMS
def test_people_lie_where_they_are_the_surest_first(form):
    boxes, scores = decode_boxes(form((10, 20, 34, 76, 0.5, 0), (70, 5, 100, 90, 0.9, 0), (40, 5, 60, 90, 0.29, 0),
                                      (3, 3, 30, 40, 0.9, 16)), 0.0, SIZE)
    np.testing.assert_allclose(boxes, [(69.5, 4.5, 99.5, 89.5), (9.5, 19.5, 33.5, 75.5)], atol=1e-4)
    np.testing.assert_allclose(scores, [0.9, 0.5], atol=1e-6)
    assert len(decode_boxes(form((10, 20, 34, 76, 0.5, 0)), 0.6, SIZE).boxes) == 0
    assert len(decode_boxes(form((10, 20, 34, 76, 0.1, 0)), 0.05, SIZE).boxes) == 1


@FORMS
@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize('place', range(5))
def test_what_is_not_finite_is_no_box(form, value, place):
    rows, *classes = form((10, 20, 34, 76, 0.5, 0), (70, 5, 100, 90, 0.9, 0))
    rows[np.flatnonzero(rows[:, 4] > 0.8)[0] if form is end_to_end else rows[:, 4].argmax(), place] = value
    boxes, scores = decode_boxes((rows, *classes), 0.0, SIZE)
    at_zero = form is raw and place in (2, 3) and value == -np.inf  # its width or height is 0
    np.testing.assert_allclose(scores, [0.9, 0.5] if at_zero else [0.5], atol=1e-6)
    assert np.isfinite(boxes).all()


def test_of_boxes_of_picodet_that_overlap_the_surest_stays():
    boxes = np.array([(10, 20, 34, 76), (70, 5, 100, 90), (70, 9, 100, 90), (70, 5, 100, 50), (40, 5, 60, 90)],
                     np.float32)
    found = decode_boxes((boxes, np.array([(0.3, 0.8, 0.9, 0.2, 0.1)], np.float32)), 0.0, SIZE, Decoder.PICODET)
    np.testing.assert_allclose(found.boxes, boxes[[2, 0, 3]] - 0.5)
    np.testing.assert_allclose(found.scores, [0.9, 0.3, 0.2])
    assert len(decode_boxes((boxes[:0], np.zeros((1, 0), np.float32)), 0.0, SIZE, Decoder.PICODET).boxes) == 0
