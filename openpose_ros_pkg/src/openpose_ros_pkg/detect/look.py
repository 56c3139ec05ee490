"""What the networks see of an image: crops of people, and parts of it in which any person may be."""
import time
from dataclasses import dataclass, replace
from statistics import median
from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.crops import CrowdImage, alone, compute_crops, decode_crop, found_by, prepare_crops
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.existence import EXISTENCE
from openpose_ros_pkg.detect.following import FollowingParams, Person, voted, with_crop, without_shared_crops
from openpose_ros_pkg.detect.head_recovery import recover
from openpose_ros_pkg.detect.occlusion_masks import foregrounds
from openpose_ros_pkg.detect.recipe_choice import RATE, seconds_per_pixel
from openpose_ros_pkg.detect.schedule import SCHEDULE, Part, ScheduleConstants, strips
from openpose_ros_pkg.detect.tracking import person_sizes
from openpose_ros_pkg.detect.views import Setup, prepare_views, views_of
from openpose_ros_pkg.ensemble import Opinions, accepted_people, extent, group, person_scores, stacked, vote
from openpose_ros_pkg.landmarks.body_landmarks import BODY_CROP
from openpose_ros_pkg.landmarks.feet import FEET, FeetLook, SeenFeet, look_at_feet
from openpose_ros_pkg.networks.model_registry import POSE_LANDMARK
from openpose_ros_pkg.people import People2D, Poses, keypoints_in

# A keypoint this near to where its own person has the joint stays there, as a share of the size of the person (half the
# diagonal of the box of the joints).
_STAYS = 0.1

# Runs of a network whose median tells its pace: the first run for a size, which compiles it, does not count.
_PACE_RUNS = 9


class Run(NamedTuple):
    """A measured run of a network: model, pixels of its inputs, time from the image to poses [s]."""

    model: str
    pixels: int
    seconds: float


class Look(NamedTuple):
    """The people of an image after networks saw it, and the runs of these."""

    people: List[Person]
    runs: Tuple[Run, ...] = ()


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
    follows: bool  # whether a frame is published before the image is searched
    pace: Pace  # of the networks now
    # when the plan was made: the parts of a size stay, as a network is compiled for each size of a part
    first_pace: Pace
    schedule: ScheduleConstants = SCHEDULE

    @classmethod
    def of(cls, detector: Detector, following: FollowingParams, fixed: Optional[Dict[str, float]]) -> 'SearchPlan':
        """Return the plan for the present parameters; fixed: [s] per pixel by model; None: measured where needed."""
        setup = detector.setup
        follows = bool(setup.recipe.refinements) and following.wanted(setup.settings.detector)
        seconds = fixed or {}
        if follows and fixed is None:
            # a part is what is searched
            seconds = seconds_per_pixel(setup.recipe, setup.networks, detector.threads,
                                        strips(RATE.image_size[0], SCHEDULE.most_strips)[0])
        runs = {model: (one,) * _PACE_RUNS for model, one in seconds.items()}
        pace = Pace(runs if setup.feet is None else {POSE_LANDMARK.name: (), **runs}, fixed is not None)
        return cls(setup, follows, pace, pace)

    @property
    def of_person(self) -> float:
        """Time of the crops of a person, and the mean time of those of the feet [s]."""
        crops = sum(self.pace.of(one.model.name, one.size) for one in self.setup.recipe.refinements)
        return crops + FEET.share * self.pace.of(POSE_LANDMARK.name, BODY_CROP)

    def of_part(self, part: Part, height: int, first: bool = False) -> float:
        """Return what a part of an image of a height [px] takes [s]; `first`: when the plan was made."""
        one, pace = self.setup.recipe.passes[part.number], self.first_pace if first else self.pace
        views = views_of((part.width, height), one, (part.left, part.right))
        return sum(pace.of(one.model.name, view.plan.net_size) for view in views)

    def parts(self, size: Tuple[int, int]) -> Tuple[Part, ...]:
        """Return the parts of an image of (width, height) [px].

        Each pass is cut into as many strips as make one short enough; the pass that takes least comes first.
        """
        width, height = size
        most = min(self.schedule.most_strips, width) if self.follows else 1
        parts: List[Part] = []
        for number, one in enumerate(self.setup.recipe.passes):
            counts = range(1, 2 if one.model.input.fixed_size else most + 1)
            cuts = [[Part(number, *columns, width) for columns in strips(width, count, self.schedule)]
                    for count in counts]
            parts += next((cut for cut in cuts if self.of_part(cut[0], height, True) <= self.schedule.strip_time),
                          cuts[-1])
        return tuple(sorted(parts, key=lambda part: self.of_part(part, height, True) / (part.right - part.left)))


class Networks(NamedTuple):
    """What computes an image, and the clock [s] that times it."""

    setup: Setup
    image: ImageFrame
    clock: Callable[[], float] = time.perf_counter

    def look(self, people: Sequence[Person], chosen: Sequence[int]) -> Look:
        """Compute crops of some people of the image.

        Args:
            people: in the image; the others are covered in a person's crop.
            chosen: indices of the people who get a crop.
        """
        image, result, runs = self.image, list(people), []
        if not chosen:
            return Look(result)
        setup, skeleton = self.setup, self.setup.recipe.skeleton
        present = [i for i, person in enumerate(people) if person.existence >= EXISTENCE.reported]
        poses = np.array([people[i].pose for i in present], np.float32).reshape(-1, len(skeleton.joints), 3)
        for i, front in zip(present, foregrounds(poses, skeleton, image.depth, image.size)):
            result[i] = replace(result[i], front=front)
        crowd, expected = CrowdImage(image.bgr, poses, skeleton), np.stack([person.expected for person in people])
        for number, one in enumerate(setup.recipe.refinements, start=setup.recipe.pass_opinions):
            begin = self.clock()
            found = _in_boxes([result[i] for i in chosen], setup.recipe.box_pass(one), crowd)
            seen = [i for i, poses_in_box in zip(chosen, found) if poses_in_box is None]
            crops = prepare_crops(crowd, expected[seen], one, [result[i].front for i in seen]) if seen else []
            views = iter(compute_crops(crops, setup.networks[one.model.name]))
            for i, in_box in zip(chosen, found):
                on_crop = decode_crop(next(views), one.model, setup) if in_box is None else in_box
                result[i] = with_crop(result[i], number, on_crop, setup.recipe.sources.known[number], poses,
                                      setup.recipe)
            if seen:
                runs.append(Run(one.model.name, len(seen) * one.size[0] * one.size[1], self.clock() - begin))
        return Look(without_shared_crops(result, setup.recipe), tuple(runs))

    def feet(self, people: People2D, known: Sequence[Optional[SeenFeet]], stamp: float, hurried: bool = False
             ) -> Tuple[FeetLook, Tuple[Run, ...]]:
        """Return people with the joints of the setup, with toes and heels where it finds them, and the runs.

        Args:
            people: of the image, with the joints of the recipe.
            known: the feet of each as they were seen before; None: not at all.
            stamp: of the image [s].
            hurried: there is time for new people alone.
        """
        setup, begin = self.setup, self.clock()
        people = replace(people, skeleton=setup.skeleton,
                         keypoints=keypoints_in(people.keypoints, people.skeleton, setup.skeleton))
        if setup.feet is None or not len(people):
            return FeetLook(people, list(known), 0), ()
        look = look_at_feet(setup.feet, self.image.bgr, people, known, stamp, hurried)
        pixels = look.looked * BODY_CROP[0] * BODY_CROP[1]
        return look, (Run(POSE_LANDMARK.name, pixels, self.clock() - begin),) if pixels else ()

    def search(self, people: Sequence[Person], part: Part) -> Look:
        """Return the people of the image with the opinions of a search of a part, the new ones on crops."""
        searched, found = self.passed(people, part)
        elsewhere = [i for i, person in enumerate(searched.people[:len(people)])
                     if person.crop is None and self.setup.recipe.pass_opinions in person.opinions
                     and any(person.opinions.get(number) is not None for number in found)]
        looked = self.look(searched.people, [*elsewhere, *self.likely(searched.people, len(people))])
        return Look(looked.people, (*searched.runs, *looked.runs))

    def passed(self, people: Sequence[Person], part: Part) -> Tuple[Look, List[int]]:
        """Return the people of the image with the opinions of a search of a part, and the numbers of its sources."""
        found, runs = self.search_part(part, people)
        persons, new = assigned(found, people, self.setup)
        return Look([*persons, *new], runs), [one.number for one in found]

    def likely(self, people: Sequence[Person], first: int) -> List[int]:
        """Return the indices of people from the first new one on that are worth a crop, the surest first."""
        setup, new = self.setup, people[first:]
        expected = np.array([person.expected for person in new], np.float32)
        scores = person_scores(expected.reshape(-1, len(setup.recipe.skeleton.joints), 3),
                               setup.recipe.sources.observable([one.opinions for one in new]))
        order = [first + i for i in np.argsort(-scores, kind='stable') if scores[i] >= setup.acceptance.person_score]
        return order[:setup.recipe.max_refined]

    def search_part(self, part: Part, people: Sequence[Person] = ()) -> Tuple[List['PartPeople'], Tuple[Run, ...]]:
        """Return the people that a source finds in a part, and the runs.

        Args:
            people: that were found in the image; where crops show them, boxes of them need no crop.
        """
        setup, begin = self.setup, self.clock()
        one = setup.recipe.passes[part.number]
        views = [view.compute(setup.networks[one.model.name])
                 for view in prepare_views(self.image.bgr, one, (part.left, part.right))]
        first = sum(before.opinions for before in setup.recipe.passes[:part.number])
        known = np.array([person.crop for person in people if person.crop is not None], np.float32)
        by_pass = found_by(one, views, self.image.bgr, setup, known.reshape(-1, len(setup.recipe.skeleton.joints), 3))
        seconds = self.clock() - begin
        pixels = sum(view.view.plan.net_size[0] * view.view.plan.net_size[1] for view in views)
        return ([PartPeople(number, part, poses) for number, poses in enumerate(by_pass, start=first)],
                (Run(one.model.name, pixels, seconds),))

    def heads(self, people: Sequence[Person], stamp: float) -> Look:
        """Return the people of an image of a stamp [s], and those who are found by their heads in the depth."""
        setup, begin = self.setup, self.clock()
        found = [person for person in people if person.found]
        known = accepted_people(voted(found, setup.recipe, stamp), setup.acceptance, self.image.size)[0]
        recovered = recover(self.image, setup, known)
        new = [Person(pose, crop=pose, opinions={setup.recipe.pass_opinions: pose}, by_depth=float(score))
               for pose, score in zip(recovered.poses.keypoints, recovered.poses.scores)]
        one = setup.recipe.refinements[0]
        pixels = recovered.crops * one.size[0] * one.size[1]
        runs = (Run(one.model.name, pixels, self.clock() - begin),) if pixels else ()
        return Look([*people, *new], runs)


def _in_boxes(people: Sequence[Person], number: int, crowd: CrowdImage) -> List[Optional[Poses]]:
    """Return what a network saw of people in boxes of this image, the opinion of a number; -1: there are no boxes.

    None for a person who has to be seen on a crop: without such an opinion, or not `alone`.
    """
    poses = [person.opinions.get(number) for person in people]
    if all(pose is None for pose in poses):
        return [None] * len(people)
    are_alone = alone(np.stack([person.expected for person in people]), crowd)
    return [Poses(pose[np.newaxis], np.ones(1)) if is_alone and pose is not None else None
            for pose, is_alone in zip(poses, are_alone)]


class PartPeople(NamedTuple):
    """The people that a source found in a part: number of the source, the part, the poses."""

    number: int
    part: Part
    poses: Poses


def assigned(found: Sequence[PartPeople], people: Sequence[Person], setup: Setup) -> Tuple[List[Person], List[Person]]:
    """Return people with the opinions of searches, and new people.

    The pose of a strip that cuts a person counts only without any other: the next strip sees all of the person.
    """
    joint_sigmas = setup.recipe.sources.sigmas
    known = np.array([person.pose for person in people], np.float32).reshape(-1, len(joint_sigmas), 3)
    nowhere = Person(np.full((len(joint_sigmas), 3), (np.nan, np.nan, 0), np.float32))
    result: List[Person] = []
    groups = group([known, *(one.poses.keypoints for one in found)], joint_sigmas)
    competing = [person.number >= 0 and person.visibility >= EXISTENCE.free_view and person.crop is None
                 for person in people]
    for index in range(1, len(found) + 1):
        groups[:len(people)] = reassigned_keypoints(groups[:len(people)], index, known, np.array(competing, bool))
    for i, poses in enumerate(groups):
        person = people[i] if i < len(people) else nowhere
        opinions = dict(person.opinions)
        for index, pose in sorted(poses.items()):
            if index > 0:
                number, part, _ = found[index - 1]
                low, high = extent(pose) if i >= len(people) else person.box
                if part.contains(low[0], high[0]) or not any(one is not None for one in opinions.values()):
                    opinions[number] = pose
        expected = person.expected
        given = {number: pose for number, pose in opinions.items() if pose is not None}
        if given and person.crop is None:
            weights = np.array([weight * (number in given) for number, weight in enumerate(setup.recipe.weights)])
            expected = vote(stacked([given], len(weights), len(joint_sigmas))[0], weights, joint_sigmas)
            expected = np.where(np.isfinite(expected[:, :1]), expected, person.expected)
        result.append(_searched(replace(person, expected=expected, opinions=opinions), found))
    return result[:len(people)], result[len(people):]


def reassigned_keypoints(groups: Sequence[Opinions], number: int, known: np.ndarray, competing: np.ndarray
                         ) -> List[Opinions]:
    """Return groups of poses in which people without a pose of a source got keypoints of the others.

    Networks make one skeleton of two people who touch: the head of one, the legs of the other. A keypoint goes to a
    person without a pose who is expected nearer to it than its own person, unless that would take all of them.

    Args:
        groups: poses of each of the P people, by the numbers of their sources.
        known: (P, K, 3) where the people are expected.
        competing: (P,) bool, people who may get keypoints.
    """
    result = [dict(of_person) for of_person in groups]
    missing = [i for i, of_person in enumerate(groups) if number not in of_person and competing[i]]
    sizes = person_sizes(known[..., :2])
    for i, of_person in enumerate(groups):
        if number not in of_person or not missing:
            continue
        pose = of_person[number]
        apart = np.linalg.norm(pose[:, :2] - known[..., :2], axis=2) / sizes[:, None]
        apart = np.where(np.isfinite(apart), apart, np.inf)
        lost = (apart[missing].min(axis=0) < apart[i]) & (apart[i] > _STAYS)
        if not lost.any() or not (np.isfinite(pose[:, 0]) & ~lost).any():
            continue
        nearest = np.array(missing)[apart[missing].argmin(axis=0)]
        result[i][number] = _only(pose, ~lost)
        for winner in np.unique(nearest[lost]).tolist():
            won = lost & (nearest == winner)
            before = result[winner].get(number, _only(pose, won))
            result[winner][number] = np.where(won[:, None], pose, before)
    return result


def _only(pose: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return a pose, (K, 3), with the chosen keypoints alone."""
    return np.where(chosen[:, None], pose, np.array([np.nan, np.nan, 0], pose.dtype))


def _searched(person: Person, found: Sequence[PartPeople]) -> Person:
    """Return a person with empty opinions of the searches that contain the person and did not find it."""
    low, high = person.box
    missed = dict.fromkeys(number for number, part, _ in found if part.contains(low[0], high[0]))
    return replace(person, opinions={**missed, **person.opinions})
