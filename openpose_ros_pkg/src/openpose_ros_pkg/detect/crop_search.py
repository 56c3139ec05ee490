"""How an image is searched: its strips for any person, and crops for people who are expected."""
import time
from collections import deque
from dataclasses import dataclass, field, replace
from statistics import median
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.detector import Detector, PreparedFrame, Setup
from openpose_ros_pkg.detect.ensemble import group, vote
from openpose_ros_pkg.detect.following import FOLLOWING, Followed, FollowingParams
from openpose_ros_pkg.detect.occlusion_masks import foregrounds
from openpose_ros_pkg.detect.recipes import Recipe
from openpose_ros_pkg.detect.refinement import decode_crop, prepare_crop
from openpose_ros_pkg.detect.schedule import SCHEDULE, Part, strips
from openpose_ros_pkg.detect.target_rate import RATE, seconds_per_pixel
from openpose_ros_pkg.detect.tracking import TRACKING
from openpose_ros_pkg.detect.views import ComputedView, compute_views, decode_views, prepare_views, views_of
from openpose_ros_pkg.oks import extent, sigmas


class Found(NamedTuple):
    """The people whom a source found in a part: number of the source, the part, (P, K, 3) keypoints."""

    number: int
    part: Part
    keypoints: np.ndarray


# Runs of a network whose median tells what it takes: the first run for a size, which compiles it, does not.
_PACE_RUNS = 9


class Pace:
    """How long networks take, by their newest runs.

    Args:
        seconds: per pixel of the input at first, by the models' names.
        fixed: it stays what it is, so that results do not depend on the machine.

    Attributes:
        fixed: see above.
    """

    def __init__(self, seconds: Dict[str, float], fixed: bool = False) -> None:
        self._runs = {model: deque([one] * _PACE_RUNS, _PACE_RUNS) for model, one in seconds.items()}
        self.fixed = fixed

    def of_part(self, part: Part, setup: Setup, height: int) -> float:
        """Return what a part takes of an image of a height [px], [s]."""
        one = setup.recipe.passes[part.number]
        views = views_of((part.width, height), one, (part.left, part.right))
        return sum(self._of(one.model.name, view.plan.net_size) for view in views)

    def of_person(self, setup: Setup) -> float:
        """Return what the crops of a person take [s]."""
        return sum(self._of(one.model.name, (one.side, one.side)) for one in setup.recipe.refinements)

    def learn(self, model: str, views: Sequence[ComputedView], seconds: float) -> None:
        """Take into account how long views took with all that belongs to them, from the image to poses [s]."""
        if not self.fixed and model in self._runs and views:
            pixels = sum(view.view.plan.net_size[0] * view.view.plan.net_size[1] for view in views)
            self._runs[model].append(seconds / pixels)

    def _of(self, model: str, size: Tuple[int, int]) -> float:
        runs = self._runs.get(model)
        return median(runs) * size[0] * size[1] if runs else 0.0


@dataclass(frozen=True, eq=False)
class Plan:
    """How the images of all cameras are searched.

    Attributes:
        setup: that they are computed with.
        follows: whether people are followed.
        rate: that is wanted [Hz]; 0: none.
        period: without a rate, every image of this number is searched in full.
        pace: what the networks take.
        cuts: parts by the size of the images, of the newest sizes. They stay, as a network is compiled for each size of
            a part.
    """

    setup: Setup
    follows: bool
    rate: float
    period: int
    pace: Pace
    cuts: Dict[Tuple[int, int], List[Part]] = field(default_factory=dict)

    @classmethod
    def of(cls, detector: Detector, following: FollowingParams, fixed: Optional[Dict[str, float]]) -> 'Plan':
        """Return the plan for the present parameters, after measuring the networks where none are given."""
        setup = detector.setup
        params = setup.settings.detector
        follows = bool(setup.recipe.refinements) and following.wanted(params)
        pace = fixed or {}
        if follows and params.target_rate > 0 and fixed is None:
            pace = seconds_per_pixel(setup.recipe, setup.networks, detector.threads)
        return cls(setup, follows, params.target_rate, following.search_period, Pace(pace, fixed is not None))

    def parts(self, size: Tuple[int, int]) -> List[Part]:
        """Return the parts of a search of an image of (width, height) [px]."""
        if size not in self.cuts:
            self.cuts[size] = self._cut(size)
        parts = self.cuts[size]
        if len(self.cuts) > TRACKING.most_cameras:
            del self.cuts[next(iter(self.cuts))]
        return parts

    def least(self, size: Tuple[int, int]) -> float:
        """Return what there is time for in any frame [s]."""
        return SCHEDULE.least_work * (self.search(size) + RATE.expected_people * self.of_person)

    def search(self, size: Tuple[int, int]) -> float:
        """Return what all parts of an image of (width, height) [px] take [s]."""
        return sum(self.of_part(part, size) for part in self.parts(size))

    def of_part(self, part: Part, size: Tuple[int, int]) -> float:
        """Return what a part of an image of (width, height) [px] takes [s]."""
        return self.pace.of_part(part, self.setup, size[1])

    @property
    def of_person(self) -> float:
        """What the crops of a person take [s]."""
        return self.pace.of_person(self.setup)

    def _cut(self, size: Tuple[int, int]) -> List[Part]:
        """Cut each pass into as many strips as it takes to fit into a frame beside the expected number of people."""
        width = size[0]
        most = min(SCHEDULE.most_strips, width) if self.rate > 0 else 1
        left = 1 / self.rate - RATE.expected_people * self.of_person if self.rate > 0 else 0.0
        parts = []
        for number, one in enumerate(self.setup.recipe.passes):
            counts = range(1, 2 if one.model.input.fixed_size else most + 1)
            cuts = [[Part(number, *columns, width) for columns in strips(width, count)] for count in counts]
            parts += next((cut for cut in cuts if self.of_part(cut[0], size) <= left), cuts[-1])
        return parts


def search(setup: Setup, bgr: np.ndarray, part: Part, pace: Pace) -> Tuple[List[Found], float]:
    """Find the people in a part of an image, (H, W, 3) uint8 BGR; return the time of the network too [s]."""
    recipe = setup.recipe
    one = recipe.passes[part.number]
    begin = time.perf_counter()
    prepared = prepare_views(bgr, one, (part.left, part.right))
    views = [view.compute(setup.networks[one.model.name]) for view in prepared]
    first = sum(before.opinions for before in recipe.passes[:part.number])
    poses = decode_views(one, views, setup.decode, setup.direct)
    pace.learn(one.model.name, views, time.perf_counter() - begin)
    return ([Found(number, part, found.keypoints) for number, found in enumerate(poses, start=first)],
            sum(view.seconds for view in views))


def look(frame: PreparedFrame, people: Sequence[Followed], everybody: Sequence[Followed], pace: Pace) -> float:
    """Look at crops round people of an image, and let them have what is believed; return the networks' time [s].

    Args:
        frame: the image.
        everybody: who is in the image; the others are covered in a person's crop.
    """
    setup, bgr, skeleton, seconds = frame.setup, frame.bgr, frame.setup.recipe.skeleton, 0.0
    present = [person for person in everybody if person.unseen <= FOLLOWING.unlooked_time]
    there = [person.shown for person in present]
    for person, foreground in zip(present, foregrounds(there, skeleton, frame.depth, (bgr.shape[1], bgr.shape[0]))):
        person.foreground = foreground
    for number, one in enumerate(setup.recipe.refinements, start=setup.recipe.pass_opinions):
        begin = time.perf_counter()
        margins = [one.margin * _margin(person) for person in people]
        prepared = [prepare_crop(bgr, person.expected, replace(one, margin=margin), there, skeleton, person.foreground)
                    for person, margin in zip(people, margins)]
        views = compute_views(prepared, setup.networks[one.model.name])
        seconds += sum(view.seconds for view in views)
        for person, view in zip(people, views):
            seen = decode_crop(view, one.model, setup.direct, skeleton).keypoints
            poses = [pose for pose in seen if person.believes(pose)]
            person.opinions[number] = poses[0] if poses else None
            if poses and person.crop is None:
                person.crop = poses[0]
        if len(views) > 1:  # one alone takes more than one of several, which are computed side by side
            pace.learn(one.model.name, views, time.perf_counter() - begin)
    return seconds


def _margin(person: Followed) -> float:
    """Return a factor on the side of a crop."""
    return FOLLOWING.lost_margin if person.unseen > FOLLOWING.unlooked_time else 1.0


def assign(found: Sequence[Found], people: Sequence[Followed], recipe: Recipe) -> List[Followed]:
    """Give people the opinions of searches; return those who are new.

    A strip that cuts somebody tells of this person only where nothing else does: the next strip sees all of the person.
    """
    joint_sigmas = sigmas(recipe.skeleton)
    known = np.array([person.shown for person in people], np.float32).reshape(-1, len(joint_sigmas), 3)
    new = []
    for i, poses in enumerate(group([known, *(one.keypoints for one in found)], joint_sigmas)):
        person = people[i] if i < len(people) else Followed(np.full((len(joint_sigmas), 3), np.nan, np.float32))
        for index, pose in sorted(poses.items()):
            if index > 0:
                number, part, _ = found[index - 1]
                low, high = extent(pose) if person.known is None else person.box
                if part.holds(low[0], high[0]) or not person.found:
                    person.opinions[number] = pose
        if person.known is None:
            opinions = {number: pose for number, pose in person.opinions.items() if pose is not None}
            weights = [weight * (number in opinions) for number, weight in enumerate(recipe.weights)]
            person.expected = vote(opinions, weights, joint_sigmas)
            new.append(person)
    for person in (*people, *new):
        low, high = person.box
        for number, part, _ in found:
            if part.holds(low[0], high[0]):
                person.opinions.setdefault(number, None)
    return new
