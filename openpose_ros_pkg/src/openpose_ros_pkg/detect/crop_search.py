"""How an image is searched: its parts for any person, and crops for expected people."""
import time
from dataclasses import dataclass, replace
from statistics import median
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.crops import CrowdImage, compute_crops, decode_crop, found_by, prepare_crops
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import FollowedPerson, FollowingParams, with_crops
from openpose_ros_pkg.detect.head_recovery import HEADS
from openpose_ros_pkg.detect.occlusion_masks import Foreground, foregrounds
from openpose_ros_pkg.detect.recipe_choice import RATE, TargetRateConstants, seconds_per_pixel
from openpose_ros_pkg.detect.schedule import SCHEDULE, Costs, Part, ScheduleConstants, strips
from openpose_ros_pkg.detect.views import ComputedView, PreparedImage, Setup, prepare_views, views_of
from openpose_ros_pkg.ensemble import extent, group, person_scores, sigmas, stacked, vote

# Runs of a network whose median tells its pace: the first run for a size, which compiles it, does not count.
_PACE_RUNS = 9


class Run(NamedTuple):
    """A measured run of a network: model, pixels of its inputs, time from the image to poses [s]."""

    model: str
    pixels: int
    seconds: float


class PartPeople(NamedTuple):
    """The people that a source found in a part: number of the source, the part, (P, K, 3) keypoints."""

    number: int
    part: Part
    keypoints: np.ndarray


class Search(NamedTuple):
    """Result of searching a part: people, time of the networks [s], runs, and number of crops of boxes."""

    found: Tuple[PartPeople, ...]
    seconds: float
    runs: Tuple[Run, ...]
    crops: int


class Look(NamedTuple):
    """Result of computing crops: all people of the image, time of the networks [s], and runs."""

    people: List[FollowedPerson]
    seconds: float
    runs: Tuple[Run, ...]


@dataclass(frozen=True, eq=False)
class Pace:
    """How long networks take, by their newest runs."""

    runs: Mapping[str, Tuple[float, ...]]  # [s] per pixel of the input, by the models' names
    fixed: bool = False  # runs do not count, so that results do not depend on the machine

    def of(self, model: str, size: Tuple[int, int]) -> float:
        """Return what a network takes for an input of (width, height) [px], [s]."""
        runs = self.runs.get(model)
        return median(runs) * size[0] * size[1] if runs else 0.0

    def after(self, runs: Sequence[Run]) -> 'Pace':
        """Return the pace after more runs."""
        newest = dict(self.runs)
        for run in () if self.fixed else runs:
            if run.model in newest:
                newest[run.model] = (*newest[run.model], run.seconds / run.pixels)[-_PACE_RUNS:]
        return replace(self, runs=newest)


@dataclass(frozen=True, eq=False)
class SearchPlan:
    """How the images of all cameras are searched."""

    setup: Setup  # that they are computed with
    follows: bool  # whether people are followed
    rate: float  # that is wanted [Hz]; 0: none
    period: int  # without a rate, every image of this number is searched in full
    pace: Pace  # of the networks now
    # when the plan was made: the parts of a size stay, as a network is compiled for each size of a part
    first_pace: Pace
    schedule: ScheduleConstants = SCHEDULE
    most_heads: int = HEADS.most

    @classmethod
    def of(cls, detector: Detector, following: FollowingParams, fixed: Optional[Dict[str, float]],
           schedule: ScheduleConstants = SCHEDULE, rate: TargetRateConstants = RATE) -> 'SearchPlan':
        """Return the plan for the present parameters; fixed: [s] per pixel by model; None: measured where needed."""
        setup = detector.setup
        params = setup.settings.detector
        follows = bool(setup.recipe.refinements) and following.wanted(params)
        seconds = fixed or {}
        if follows and params.target_rate > 0 and fixed is None:
            # a part is what is searched
            seconds = seconds_per_pixel(setup.recipe, setup.networks, detector.threads,
                                        strips(rate.image_size[0], schedule.most_strips)[0], rate)
        pace = Pace({model: (one,) * _PACE_RUNS for model, one in seconds.items()}, fixed is not None)
        return cls(setup, follows, params.target_rate, following.search_period, pace, pace, schedule)

    @property
    def of_person(self) -> float:
        """What the crops of a person take [s]."""
        return self._of_person(self.pace)

    def costs(self, parts: Sequence[Part], height: int, people: int) -> Costs:
        """Return what an image of a height [px] with some people takes."""
        search = {part: self._of_part(self.pace, part, height) for part in parts}
        return Costs(people * self.of_person, search)

    def parts(self, size: Tuple[int, int]) -> Tuple[Part, ...]:
        """Return the parts of an image of (width, height) [px].

        Each pass is cut into as many strips as make one short enough; the pass that takes least comes first.
        """
        width, height = size
        most = min(self.schedule.most_strips, width) if self.rate > 0 else 1
        parts: List[Part] = []
        for number, one in enumerate(self.setup.recipe.passes):
            counts = range(1, 2 if one.model.input.fixed_size else most + 1)
            cuts = [[Part(number, *columns, width) for columns in strips(width, count, self.schedule)]
                    for count in counts]
            parts += next((cut for cut in cuts
                           if self._of_part(self.first_pace, cut[0], height) <= self.schedule.strip_time), cuts[-1])
        return tuple(sorted(parts, key=lambda part: self._of_part(self.first_pace, part, height)
                            / (part.right - part.left)))

    def _of_part(self, pace: Pace, part: Part, height: int) -> float:
        one = self.setup.recipe.passes[part.number]
        views = views_of((part.width, height), one, (part.left, part.right))
        return sum(pace.of(one.model.name, view.plan.net_size) for view in views)

    def _of_person(self, pace: Pace) -> float:
        return sum(pace.of(one.model.name, one.size) for one in self.setup.recipe.refinements)


def search_part(setup: Setup, bgr: np.ndarray, part: Part, people: Sequence[FollowedPerson] = ()) -> Search:
    """Find the people in a part of an image, (H, W, 3) uint8 BGR.

    Args:
        people: that were found in it; where crops show them, boxes of them need no crop.
    """
    recipe, begin = setup.recipe, time.perf_counter()
    one = recipe.passes[part.number]
    prepared = prepare_views(bgr, one, (part.left, part.right))
    views = [view.compute(setup.networks[one.model.name]) for view in prepared]
    first = sum(before.opinions for before in recipe.passes[:part.number])
    known = np.array([person.crop for person in people if person.crop is not None], np.float32)
    by_pass = found_by(one, views, bgr, setup, known.reshape(-1, len(recipe.skeleton.joints), 3))
    found = tuple(PartPeople(number, part, poses.keypoints)
                  for number, poses in enumerate(by_pass.opinions, start=first))
    runs = (_run(one.model.name, views, time.perf_counter() - begin - by_pass.seconds),)
    return Search(found, sum(view.seconds for view in views) + by_pass.seconds, runs, len(by_pass.crops))


def look(frame: PreparedImage, people: Sequence[FollowedPerson], chosen: Sequence[int]) -> Look:
    """Compute crops of some people of an image.

    Args:
        people: in the image; the others are covered in a person's crop.
        chosen: indices of the people who get a crop.
    """
    if not chosen:
        return Look(list(people), 0.0, ())
    setup, bgr, skeleton = frame.setup, frame.bgr, frame.setup.recipe.skeleton
    present = [i for i, person in enumerate(people) if person.recent]
    poses = np.array([people[i].pose for i in present], np.float32).reshape(-1, len(skeleton.joints), 3)
    crowd = CrowdImage(bgr, poses, skeleton)
    in_front: Dict[int, Optional[Foreground]] = dict(
        zip(present, foregrounds(poses, skeleton, frame.depth, (bgr.shape[1], bgr.shape[0]))))
    result, seconds, runs = list(people), 0.0, []
    for number, one in enumerate(setup.recipe.refinements, start=setup.recipe.pass_opinions):
        begin = time.perf_counter()
        prepared = prepare_crops(crowd, np.stack([people[i].expected for i in chosen]), one,
                                 [in_front.get(i) for i in chosen])
        views = compute_crops(prepared, setup.networks[one.model.name])
        seconds += sum(view.seconds for view in views)
        found = [decode_crop(view, one.model, setup) for view in views]
        for i, person in zip(chosen, with_crops([result[i] for i in chosen], number, found,
                                               setup.recipe.sources.known[number])):
            result[i] = person
        if len(views) > 1:  # a single crop takes longer than each of several, which are computed side by side
            runs.append(_run(one.model.name, views, time.perf_counter() - begin))
    return Look(result, seconds, tuple(runs))


def _run(model: str, views: Sequence[ComputedView], seconds: float) -> Run:
    return Run(model, sum(view.view.plan.net_size[0] * view.view.plan.net_size[1] for view in views), seconds)


def assign(found: Sequence[PartPeople], people: Sequence[FollowedPerson], setup: Setup
           ) -> Tuple[List[FollowedPerson], List[FollowedPerson]]:
    """Return people with the opinions of searches, and new people.

    The pose of a strip that cuts a person counts only without any other: the next strip sees all of the person.
    """
    joint_sigmas = sigmas(setup.recipe.skeleton)
    known = np.array([person.pose for person in people], np.float32).reshape(-1, len(joint_sigmas), 3)
    nowhere = FollowedPerson(np.full((len(joint_sigmas), 3), np.nan, np.float32))
    result: List[FollowedPerson] = []
    for i, poses in enumerate(group([known, *(one.keypoints for one in found)], joint_sigmas)):
        person = people[i] if i < len(people) else nowhere
        opinions = dict(person.opinions)
        for index, pose in sorted(poses.items()):
            if index > 0:
                number, part, _ = found[index - 1]
                low, high = extent(pose) if person.memory is None else person.box
                if part.contains(low[0], high[0]) or not any(one is not None for one in opinions.values()):
                    opinions[number] = pose
        expected = person.expected
        if person.memory is None:
            given = {number: pose for number, pose in opinions.items() if pose is not None}
            weights = np.array([weight * (number in given) for number, weight in enumerate(setup.recipe.weights)])
            expected = vote(stacked([given], len(weights), len(joint_sigmas))[0], weights, joint_sigmas)
        result.append(_searched(replace(person, expected=expected, opinions=opinions), found))
    return result[:len(people)], result[len(people):]


def _searched(person: FollowedPerson, found: Sequence[PartPeople]) -> FollowedPerson:
    """Return a person with empty opinions of the searches that contain the person and did not find it."""
    low, high = person.box
    missed = dict.fromkeys(number for number, part, _ in found if part.contains(low[0], high[0]))
    return replace(person, opinions={**missed, **person.opinions})


def likely(new: Sequence[FollowedPerson], setup: Setup) -> List[FollowedPerson]:
    """Return the new people that are worth a crop, the surest first."""
    least, sources = setup.acceptance.person_score, setup.recipe.sources
    expected = np.array([person.expected for person in new], np.float32).reshape(-1, *sources.known.shape[1:], 3)
    scores = person_scores(expected, sources.asked([person.opinions for person in new]))
    order = np.argsort(-scores, kind='stable')[:setup.recipe.max_refined]
    return [new[i] for i in order if scores[i] >= least]
