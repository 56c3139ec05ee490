"""Networks that read off the picture which part of a scene they see, and answer with the people who are there.

The picture is a chart: blue grows with x, green with y. So a stand-in knows where each pixel of its input comes from,
however the detector has scaled, cut, mirrored and padded the picture, and what it answers is as true as the input.
"""
import numpy as np

from known_fields import FRONT, render_fields
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.skeletons import COCO_17, COCO_18

_DARKEST, _RANGE = 20, 215


def chart(width, height):
    """Return the picture, (H, W, 3) uint8; noise of one grey level tells it from the repeated border."""
    x, y = np.arange(width) / max(width - 1, 1), np.arange(height) / max(height - 1, 1)
    ramps = np.stack([*np.meshgrid(x, y), np.full((height, width), 0.5)], axis=2)
    noise = np.random.default_rng(0).uniform(-0.5, 0.5, ramps.shape)
    return np.rint(_DARKEST + _RANGE * ramps + noise).astype(np.uint8)


def person_at(x, y, height):
    """Return (18, 2) pixels of a person with the nose at x, y, who raises the right hand; the neck is between the
    shoulders, where MoveNet has it."""
    person = FRONT * height + (x, y)
    shoulders = [COCO_18.index['left_shoulder'], COCO_18.index['right_shoulder']]
    person[COCO_18.index['neck']] = person[shoulders].mean(axis=0)
    person[COCO_18.index['right_wrist']] += (-0.15 * height, -0.3 * height)
    return person


def mirrored(person, width):
    """Return (K, 2) of the person in the mirror image: left is right."""
    result = person[list(COCO_18.swap)]
    result[:, 0] = width - 1 - result[:, 0]
    return result


def in_order(people):
    """Return the places (P, 18, 2) of People2D by the x of the neck."""
    return people.xy[np.argsort(people.xy[:, COCO_18.index['neck'], 0])]


class StandIn:
    """What both stand-ins have in common.

    Args:
        people: (18, 2) each, pixels of the chart.
        size: (width, height) of the chart.
        confidence: of every joint.

    Attributes:
        inputs: (H, W, 3) of all pictures so far.
        parts: left, top, right, bottom of what they show, pixels of the chart; left > right in a mirror image.
    """

    name = description = 'stand-in'

    def __init__(self, people=(), size=(640, 480), confidence=0.9):
        self.people, self.size, self.confidence = people, size, confidence
        self.inputs, self.parts = [], []

    def _seen(self, image):
        """Return the people, (18, 2) pixels of the input each, as they look there; without a chart, nobody."""
        self.inputs.append(image)
        if len(self.people) == 0 or (image == image[0, 0]).all():
            return []
        columns, rows = _without_padding(image)
        x, y = _line(image[:rows, :columns, 0].mean(axis=0)), _line(image[:rows, :columns, 1].mean(axis=1))
        step = np.array([x[0], y[0]]) * np.subtract(self.size, 1)
        start = np.array([x[1], y[1]]) * np.subtract(self.size, 1)
        self.parts.append((*(start - 0.5 * step), *(start + (np.array([columns, rows]) - 0.5) * step)))
        people = [(person - start) / step for person in self.people]
        return [person[list(COCO_18.swap)] for person in people] if step[0] < 0 else people


class PafNetwork(StandIn):
    """Stands in for mobilenet_thin: ideal confidence maps and part affinity fields."""

    def infer(self, images):
        people = self._seen(images[0])
        return ((self.confidence * render_fields(people, images.shape[1:3]))[np.newaxis],)


class MovenetNetwork(StandIn):
    """Stands in for MoveNet: six rows; joints beyond the picture have no confidence."""

    def infer(self, images):
        rows = np.zeros((1, 6, 56), np.float32)
        for row, person in zip(rows[0], self._seen(images[0])):
            places = (person[[COCO_18.index[joint] for joint in COCO_17.joints]] + 0.5) / images.shape[2:0:-1]
            inside = ((places >= 0) & (places <= 1)).all(axis=1)
            row[0:51:3], row[1:51:3], row[2:51:3] = places[:, 1], places[:, 0], self.confidence * inside
            row[55] = self.confidence * inside.any()
        return (rows,)


class Together:
    """Stands in for `Networks`: all are there, by the models' names."""

    params = BackendParams(threads=1)

    def __init__(self, **networks):
        self.networks = networks

    def load(self, recipe):
        return recipe, {model.name: self.networks[model.name] for model in recipe.models}


def _without_padding(image):
    """Return the number of columns and rows of the picture, of which the last is repeated."""
    columns = np.flatnonzero((image != image[:, -1:]).any(axis=(0, 2))).max() + 2
    rows = np.flatnonzero((image[:, :columns] != image[-1:, :columns]).any(axis=(1, 2))).max() + 2
    return columns, rows


def _line(levels):
    """Fit place = a * index + b to grey levels; the outermost are blurred by resampling. Places are 0..1."""
    margin = 2 if len(levels) > 12 else 0
    index = np.arange(margin, len(levels) - margin)
    return np.polyfit(index, (levels[index] - _DARKEST) / _RANGE, 1)
