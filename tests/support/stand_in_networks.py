"""Networks that read off the picture which part of a scene they see, and answer with the people who are there.

The picture is a chart: blue grows with x, green with y. So a stand-in knows where each pixel of its input comes from,
however the detector has scaled, cut, mirrored and padded the picture, and what it answers is as true as the input.
"""
import numpy as np

from known_fields import FRONT, render_fields
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.skeletons import COCO_17, COCO_18

_DARKEST, _RANGE = 20, 215
# Pixels of one colour that a chart has at most; what is covered is larger.
_MOST_ALIKE = 400


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


def _uncovered(image):
    """Return which pixels show the chart, (H, W) bool: what covers others has one colour, which the chart has not.

    Nor has it a border in black, and what is blended with it.
    """
    colours = image.astype(np.int32) @ (1 << 16, 1 << 8, 1)
    values, counts = np.unique(colours, return_counts=True)
    grey = np.abs(image[..., 2] - (_DARKEST + _RANGE / 2)) < 2
    return grey & ((colours != values[counts.argmax()]) | (counts.max() <= _MOST_ALIKE))


class StandIn:
    """What all stand-ins have in common: people (K, 2) each, in pixels of a chart of a size (width, height)."""

    name = description = 'stand-in'
    fallback = ''
    skeleton = COCO_18  # of the people

    def __init__(self, people=(), size=(640, 480), confidence=0.9):
        self.people, self.size, self.confidence = people, size, confidence
        self.inputs = []  # (H, W, 3) of all pictures so far
        # left, top, right, bottom of what they show, pixels of the chart; left > right in a mirror image
        self.parts = []

    def infer_many(self, images):
        return [self.infer(image) for image in images]

    def _seen(self, image):
        """Return the people, (K, 2) pixels of the input each, as they look there; without a chart, none."""
        self.inputs.append(image)
        if len(self.people) == 0 or (image == image[0, 0]).all():
            return []
        turns = _turns(image)
        image = np.rot90(image, -turns)
        left, top, right, bottom = _without_padding(image)
        part = image[top:bottom, left:right]
        shown = _uncovered(part)
        x, y = _line(part[..., 0], shown, left), _line(part[..., 1].T, shown.T, top)
        step = np.array([x[0], y[0]]) * np.subtract(self.size, 1)
        start = np.array([x[1], y[1]]) * np.subtract(self.size, 1)
        edges = np.subtract([(left, top), (right, bottom)], 0.5)
        self.parts.append(tuple((start + edges * step).ravel()))
        people = [(person - start) / step for person in self.people]
        people = [person[list(self.skeleton.swap)] for person in people] if step[0] < 0 else people
        for turn in range(turns):
            people = [np.stack([xy[:, 1], image.shape[1 - turn % 2] - 1 - xy[:, 0]], axis=1) for xy in people]
        return people


def _turns(image):
    """Return by how many quarter turns, counter-clockwise, a chart is turned, 0 to 3."""
    rows, columns = np.nonzero(_uncovered(image))
    level = image[rows, columns, 1].astype(float)  # it grows downwards
    down, right = np.polyfit(rows, level, 1)[0], np.polyfit(columns, level, 1)[0]
    return (0 if down > 0 else 2) if abs(down) > abs(right) else (1 if right > 0 else 3)


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


class ThunderNetwork(StandIn):
    """Stands in for MoveNet Thunder: the one person nearest to the middle of the input."""

    def infer(self, images):
        pose = np.zeros((1, 1, 17, 3), np.float32)
        middle = np.divide(images.shape[2:0:-1], 2)
        people = sorted(self._seen(images[0]), key=lambda person: np.linalg.norm(person.mean(axis=0) - middle))
        if people:
            places = (people[0][[COCO_18.index[joint] for joint in COCO_17.joints]] + 0.5) / images.shape[2:0:-1]
            pose[0, 0, :, 1::-1] = places
            pose[0, 0, :, 2] = self.confidence * ((places >= 0) & (places <= 1)).all(axis=1)
        return (pose,)


class SimccNetwork(StandIn):
    """Stands in for RTMPose: the one person nearest to the middle of the input, joints in bins of half a pixel.

    Args:
        skeleton: of the people.
        order: of the joints in the output.
    """

    def __init__(self, people=(), size=(640, 480), confidence=0.9, skeleton=COCO_18, order=COCO_17):
        super().__init__(people, size, confidence)
        self.skeleton, self._order = skeleton, order

    def infer(self, images):
        height, width = images.shape[1:3]
        along_x, along_y = (np.zeros((1, len(self._order.joints), 2 * side), np.float32) for side in (width, height))
        people = sorted(self._seen(images[0]),
                        key=lambda person: np.linalg.norm(person.mean(axis=0) - np.divide([width, height], 2)))
        for i, joint in enumerate(self._order.joints if people else ()):
            x, y = np.rint(2 * people[0][self.skeleton.index[joint]]) if joint in self.skeleton.index else (-1, -1)
            if 0 <= x < 2 * width and 0 <= y < 2 * height:
                along_x[0, i, int(x)] = along_y[0, i, int(y)] = self.confidence
        return along_x, along_y


class BoxNetwork(StandIn):
    """Stands in for YOLOX: the boxes of people, a little larger than those of their joints, and their class."""

    def infer(self, images):
        people = self._seen(images[0])
        boxes = np.zeros((1, len(people), 5), np.float32)
        for row, person in zip(boxes[0], people):
            low, high = person.min(axis=0), person.max(axis=0)
            row[:2], row[2:4], row[4] = low - 0.1 * (high - low), high + 0.1 * (high - low), self.confidence
        return boxes, np.zeros((1, len(people)), np.float32)


class Together:
    """Stands in for `Networks`: all are there, by the models' names."""

    params = BackendParams(threads=1)

    def __init__(self, **networks):
        self.faults, self.not_installed = {}, {}
        self.networks = networks

    def load(self, recipe):
        return recipe, {model.name: self.networks[model.name] for model in recipe.models}

    def load_any(self, recipe):
        there = all(model.name in self.networks for model in recipe.needed)
        return self.load(recipe) if there else None

    def feet(self):
        return None


def _without_padding(image):
    """Return left, top, right and bottom of the picture, beyond which its border is repeated."""
    left, right = _not_repeated(image.transpose(1, 0, 2))
    top, bottom = _not_repeated(image[:, left:right])
    return left, top, right, bottom


def _not_repeated(rows):
    """Return the first row and one past the last of those that are not copies of the outermost ones."""
    # resampling rounds a few pixels of a copy in another way
    return (np.flatnonzero((rows != rows[:1]).mean(axis=(1, 2)) > 0.1).min() - 1,
            np.flatnonzero((rows != rows[-1:]).mean(axis=(1, 2)) > 0.1).max() + 2)


def _line(levels, shown, start):
    """Fit place = a * index + b, 0..1, to those grey levels (N, M) that count; the outermost are blurred."""
    margin = levels.shape[1] // 8
    index = np.arange(margin, levels.shape[1] - margin)
    index = index[shown[:, index].any(axis=0)]
    mean = np.average(levels[:, index], axis=0, weights=shown[:, index])
    return np.polyfit(start + index, (mean - _DARKEST) / _RANGE, 1)
