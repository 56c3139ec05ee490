"""Detection by networks in the images of cameras: expected people are found on crops, others by search."""
import time
from dataclasses import dataclass, field, replace
from typing import Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.detection import DepthView, ImageFrame, Looks, NextPart
from openpose_ros_pkg.detect.detector import Detector, check_image, create_detector
from openpose_ros_pkg.detect.existence import EXISTENCE
from openpose_ros_pkg.detect.following import FOLLOWING, NEVER_FOLLOWED, FollowingParams, Person, PersonMemory, voted
from openpose_ros_pkg.detect.head_recovery import HEADS
from openpose_ros_pkg.detect.look import Look, Networks, Run, SearchPlan
from openpose_ros_pkg.detect.recipe_choice import RATE
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.schedule import NO_GREY, Budget, Part, Schedule, changed_columns, small_grey
from openpose_ros_pkg.detect.tracking import TRACKING, PerCamera
from openpose_ros_pkg.ensemble import accepted_people, person_scores
from openpose_ros_pkg.people import ExpectedPeople, People2D, keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel


@dataclass(frozen=True, eq=False)
class CameraMemory:
    """What is known of the newest image of a camera, and what is remembered of those before."""

    image: ImageFrame  # the newest one, without its source
    started: float  # time that all cameras had taken the networks when it began [s]
    plan: SearchPlan  # that it is searched with
    schedule: Schedule
    budget: Budget
    detections: People2D  # the P detections in the image
    persons: Sequence[Person] = ()  # all people looked for in it, those of the detections first
    # of the tracked people, by their ids, and of people that the search found, which are looked at in the next image
    memories: Mapping[int, PersonMemory] = field(default_factory=dict)
    candidates: Sequence[Person] = ()
    grey: np.ndarray = field(default_factory=lambda: NO_GREY)  # small image of the one that was searched last
    boxes: Sequence[np.ndarray] = ()  # (2, 2) each [px], of the people in that
    heads: float = -np.inf  # stamp of the last image whose depth was searched for heads [s]

    @classmethod
    def first(cls, frame: ImageFrame, plan: SearchPlan) -> 'CameraMemory':
        """Return what is known of the first image of a camera."""
        return cls(frame, 0.0, plan, Schedule(plan.parts(frame.size), constants=plan.schedule),
                   Budget(plan.schedule.most_saved, constants=plan.schedule),
                   People2D.empty(plan.setup.recipe.skeleton))

    def expected(self, people: ExpectedPeople) -> List[Person]:
        """Return the people to look for in the image: those of tracks, and candidates of the image before."""
        persons = []
        for pose, number, *numbers in zip(people.keypoints, people.ids.tolist(), people.spread.tolist(),
                                          people.existence.tolist(), people.visibility.tolist()):
            memory = self.memories.get(number)
            if memory is not None:
                scores = np.where(pose[:, 2] > 0, np.maximum(memory.scores, _LEAST_SCORE), 0.0)
                pose = np.concatenate([pose[:, :2], scores[:, None]], axis=1).astype(np.float32)
            persons.append(Person(pose, number, memory, *numbers))
        return [*persons, *self.candidates]

    def with_ids(self, ids: np.ndarray) -> 'CameraMemory':
        """Return the memory with the ids (P,) that the tracker gave to the detections; -1: none."""
        named = [replace(person, number=int(number)) for person, number in zip(self.persons, ids)]
        memories = {person.number: person.remembered(scores, self.image.stamp)
                    for person, scores in zip(named, self.detections.confidence)}
        others = self.persons[len(named):]
        missed = {one.number: one.remembered(one.scores, self.image.stamp) for one in others if one.opinions}
        memories = {**self.memories, **missed, **memories}
        memories.pop(-1, None)
        return replace(self, persons=[*named, *others], memories=memories, candidates=self._candidates(named))

    def in_full(self) -> 'CameraMemory':
        """Return the memory after all of the image was searched."""
        searched = dict.fromkeys(self.schedule.parts, self.image.stamp)
        return replace(self, budget=Budget(constants=self.plan.schedule), heads=self.image.stamp,
                       schedule=replace(self.schedule, searched=searched, urgency={}))

    def after_crops(self, people: Sequence[Person], interval: float, spent: float, cameras: int) -> 'CameraMemory':
        """Return the memory after crops of people; see `Budget.after_frame`."""
        urgent = [person.box for person in people if not person.found and person.existence >= EXISTENCE.reported
                  and person.number >= 0 and (person.opinions or person.visibility < EXISTENCE.free_view)]
        return replace(self, schedule=self.schedule.in_boxes(urgent),
                       budget=self.budget.after_frame(interval, spent, self.whole(), cameras))

    def whole(self) -> float:
        """Return what a search of all of the image, and of its depth for heads, takes [s]."""
        return sum(self.plan.of_part(part, self.image.size[1]) for part in self.schedule.parts) + self.of_heads()

    def of_heads(self) -> float:
        """Return what a search of the depth for heads takes at most [s]."""
        return 0.0 if self.image.depth is None else HEADS.most * self.plan.of_person

    def with_changes(self, people: Sequence[Person]) -> 'CameraMemory':
        """Return the memory with the parts urgent in which the image changed outside of all people."""
        schedule = self.plan.schedule
        grey, boxes = small_grey(self.image.bgr, schedule), [person.box for person in people]
        columns = changed_columns(grey, self.grey, self.image.size, [*boxes, *self.boxes], schedule)
        return replace(self, grey=grey, boxes=boxes, schedule=self.schedule.changed(columns))

    def next(self, at_once: bool = False) -> Optional['Step']:
        """Return what is searched next in the image; None: there is no time for it.

        Args:
            at_once: parts alone, and for urgent ones time may be taken that is not saved yet.
        """
        plan, schedule = self.plan, self.plan.schedule
        part = self.schedule.next(self.image.stamp)
        if not at_once and self._heads_are_next(part):
            part = None
        elif part is None:
            return None
        seconds = plan.of_part(part, self.image.size[1]) if part else self.of_heads()
        owed, credit = self.budget.owes(seconds), schedule.most_saved if part in self.schedule.urgency else 0.0
        if not (owed or self.budget.affords(seconds - credit * at_once)):
            return None
        return Step(part, NextPart(seconds, owed))

    def _heads_are_next(self, part: Optional[Part]) -> bool:
        """Return whether the search for heads is due, and has waited longer than a part of the image; None: no part."""
        return (self.image.depth is not None and self.image.stamp - self.heads >= self.plan.schedule.search_time
                and (part is None or self.heads < self.schedule.searched.get(part, -np.inf)))

    def after(self, step: 'Step', runs: Sequence[Run]) -> 'CameraMemory':
        """Return the memory after a step, with the runs of the networks in it."""
        spent = expected = step.announced.seconds
        if not self.plan.pace.fixed:  # the debt of a stall of the machine would leave the image unsearched for seconds
            spent = min(sum(run.seconds for run in runs), max(expected, self.plan.schedule.search_time))
        after = replace(self, budget=self.budget.after_part(spent))
        return (replace(after, schedule=self.schedule.done(step.part, self.image.stamp)) if step.part
                else replace(after, heads=self.image.stamp))

    def after_search(self, people: Sequence[Person]) -> 'CameraMemory':
        """Return the memory after a search for people of the next image, with the people found so far."""
        memories = {person.number: person.remembered(person.scores, self.image.stamp) for person in people
                    if person.number >= 0 and person.found}
        return replace(self, persons=people, memories={**self.memories, **memories},
                       candidates=self._candidates(people))

    def _candidates(self, people: Sequence[Person]) -> List[Person]:
        """Return the people without a track who are worth a look in the next image."""
        setup = self.plan.setup
        new = [person for person in people if person.number < 0 and person.found]
        poses = np.array([person.pose for person in new], np.float32).reshape(-1, len(setup.recipe.skeleton.joints), 3)
        scores = person_scores(poses, setup.recipe.sources.observable([person.opinions for person in new]))
        joints = (poses[..., 2] >= setup.acceptance.joint_score).sum(axis=1)
        return [person for person, score, count in zip(new, scores, joints)
                if score >= setup.acceptance.person_score and count >= setup.acceptance.person_joints]


class Step(NamedTuple):
    """A step of a search: the part, None: heads in the depth, and how it is announced."""

    part: Optional[Part]
    announced: NextPart


# Score of an expected joint that was not detected lately.
_LEAST_SCORE = 1e-3


class NetworkDetection:
    """Finds people by networks; one thread at a time uses it.

    `look` lets a network see crops of the expected people whose turn it is. `search` goes on with the rest of the
    image: it is cut into parts, one pass over one strip each. People that it finds are looked at in the
    next image.

    Args:
        detector: the networks.
        following: whether frames are published before the search.
        pace: [s] per pixel of the networks, by their names, from then on fixed; None: it is measured.
        clock: that times the networks [s].
    """

    gives_ids = False

    def __init__(self, detector: Detector, following: FollowingParams, pace: Optional[Dict[str, float]] = None,
                 clock: Callable[[], float] = time.perf_counter) -> None:
        self.detector = detector
        self._following, self._fixed_pace, self._clock = following, pace, clock
        self._memories: PerCamera[Optional[CameraMemory]] = PerCamera(lambda: None)  # by camera and size of images
        self._plan = SearchPlan.of(detector, following, pace)
        self._worked = 0.0  # time that the images of all cameras took so far [s]

    @property
    def skeleton(self) -> SkeletonModel:
        return self.detector.skeleton

    @property
    def description(self) -> str:
        """When frames are published, for the log."""
        return ('looked at where they are expected; the rest of the image is searched after publishing'
                if self._plan.follows else 'searched for in every image')

    def reconfigure(self) -> None:
        """Use the present parameters of the detector from the next image on."""
        setup = self.detector.setup
        if self._plan.setup.settings.detector == setup.settings.detector:
            self._plan = replace(self._plan, setup=setup)
        else:
            self._plan = SearchPlan.of(self.detector, self._following, self._fixed_pace)

    def warm_up(self) -> None:
        """Let the networks see crops and parts of a blank image, so that they are compiled before the first one."""
        plan, (width, height) = self._plan, RATE.image_size
        networks = Networks(plan.setup, ImageFrame('', 0.0, np.zeros((height, width, 3), np.uint8)), self._clock)
        joints = plan.setup.recipe.skeleton
        rows = np.linspace(0.0, height - 1.0, len(joints.joints))
        pose = np.stack([np.full_like(rows, width / 2), rows, np.ones_like(rows)], axis=1).astype(np.float32)
        for people in (1, 2):  # several are computed side by side, by a network that is compiled for it
            networks.look(people * [Person(pose)], range(people))
            blank = People2D(joints, np.stack(people * [pose]), np.ones(people), np.full(people, -1))
            networks.feet(blank, people * [None], 0.0)
            self._learn(networks.feet(blank, people * [None], 0.0)[1], self._clock())
        by_size = {(part.number, part.right - part.left): part for part in plan.parts(RATE.image_size)}
        for part in by_size.values():
            networks.search_part(part)
            self._learn(networks.search_part(part)[1], self._clock())

    def look(self, frame: ImageFrame, expected: ExpectedPeople, in_full: bool = True) -> Looks:
        check_image(frame.bgr)
        frame = replace(frame, source=None)  # messages are not kept until the next image
        begin, plan = self._clock(), self._plan
        joints = plan.setup.recipe.skeleton
        expected = replace(expected, skeleton=joints, keypoints=keypoints_in(expected.keypoints, expected.skeleton,
                                                                             joints))
        memory, interval, idle = self._started(frame, expected)
        networks = Networks(plan.setup, frame, self._clock)
        if not plan.setup.recipe.is_ensemble:
            return self._one_network(networks, memory, expected)
        in_full |= not plan.follows or idle > plan.schedule.search_time
        persons = memory.expected(expected)
        chosen = _chosen(persons, memory, interval)
        if in_full:
            look = _searched(persons, networks, memory)
            memory = memory.in_full()
        else:
            look = networks.look(persons, chosen)
            memory = memory.after_crops(look.people, interval, len(chosen) * plan.of_person, self._cameras(frame.stamp))
            look, memory = _searched_at_once(look, networks, memory)
        looks, memory = _decided(look.people, memory)
        allowed = plan.schedule.followed_share * min(interval, plan.schedule.search_time) / self._cameras(frame.stamp)
        hurried = not in_full and len(chosen) * plan.of_person > allowed
        looks, memory, runs = _with_feet(looks, networks, memory, hurried)
        self._keep(frame, memory)
        self._learn((*look.runs, *runs), begin)
        return looks

    def remember(self, frame: ImageFrame, ids: np.ndarray) -> None:
        memory = self._newest(frame)
        if memory is not None:
            self._keep(frame, memory.with_ids(ids))

    def search(self, frame: ImageFrame) -> Iterator[NextPart]:
        memory = self._newest(frame)
        if memory is None or not memory.plan.follows:
            return
        memory = memory.with_changes(memory.persons)
        networks, step = Networks(memory.plan.setup, memory.image, self._clock), memory.next()
        while step is not None:
            self._keep(frame, memory)
            yield step.announced
            begin, people = self._clock(), memory.persons
            look = networks.search(people, step.part) if step.part else networks.heads(people, frame.stamp)
            self._learn(look.runs, begin)
            memory = memory.after_search(look.people).after(step, look.runs)
            step = memory.next()
        self._keep(frame, memory)

    def _started(self, frame: ImageFrame, expected: ExpectedPeople) -> Tuple[CameraMemory, float, float]:
        """Return the memory at the begin of an image, the time since the one before, and how long no image of any
        camera was computed in it [s]; infinite: no image before helps.
        """
        plan, memory = self._plan, self._memories.of((frame.camera, frame.size))
        if (memory is None or memory.plan.first_pace is not plan.first_pace or frame.stamp <= 0
                or frame.stamp < memory.image.stamp - TRACKING.reset_backstep):
            return replace(CameraMemory.first(frame, plan), started=self._worked), np.inf, np.inf
        interval = max(frame.stamp - memory.image.stamp, 0.0)
        idle = interval - (self._worked - memory.started)
        candidates = [_seen_before(person, memory, interval) for person in memory.candidates]
        memories = {number: one for number, one in memory.memories.items() if number in expected.ids}
        return replace(memory, image=frame, started=self._worked, plan=plan, memories=memories,
                       candidates=candidates if idle <= plan.schedule.search_time else ()), interval, idle

    def _one_network(self, networks: Networks, memory: CameraMemory, expected: ExpectedPeople) -> Looks:
        """Return the people that one network alone finds, as it has them."""
        (found,), _ = networks.search_part(memory.schedule.parts[0])
        people = accepted_people(found.poses, memory.plan.setup.acceptance, memory.image.size)[0]
        return Looks.of_all(networks.feet(people, [None] * len(people), memory.image.stamp)[0].people, expected)

    def _newest(self, frame: ImageFrame) -> Optional[CameraMemory]:
        """Return the memory of an image, if it is the newest one of its camera."""
        memory = self._memories.of((frame.camera, frame.size))
        return memory if memory is not None and memory.image.stamp == frame.stamp and frame.stamp > 0 else None

    def _keep(self, frame: ImageFrame, memory: CameraMemory) -> None:
        if frame.stamp > 0:
            self._memories.put((frame.camera, frame.size), memory)

    def _cameras(self, stamp: float) -> int:
        """Return the number of cameras in use at a stamp [s]."""
        return sum(abs(stamp - memory.image.stamp) <= memory.plan.schedule.search_time
                   for memory in self._memories.all() if memory is not None) or 1

    def _learn(self, runs: Sequence[Run], begin: float) -> None:
        """Take account of the runs of networks in a step that began at a time of the clock [s]."""
        self._plan = replace(self._plan, pace=self._plan.pace.after(runs))
        self._worked += self._clock() - begin


def create_detection(settings: DetectorSettings) -> NetworkDetection:
    """Return a detection, with its own networks, that searches every image in full."""
    return NetworkDetection(create_detector(settings), NEVER_FOLLOWED)


def people_in(bgr: np.ndarray, detector: Detector, depth: Optional[DepthView] = None) -> People2D:
    """Return the people, without ids, in an image without history, (H, W, 3) uint8 BGR; the surest first.

    Raises:
        BadInputError: not such an image, or an empty one.
    """
    detection = NetworkDetection(detector, NEVER_FOLLOWED)
    return detection.look(ImageFrame('', 0.0, bgr, depth), ExpectedPeople.none(detection.skeleton)).people


def _seen_before(person: Person, memory: CameraMemory, interval: float) -> Person:
    """Return a candidate of the image before, as it is expected in this one, after a time [s]."""
    pose = person.expected if person.crop is None else person.crop
    remembered = person.remembered(pose[:, 2], memory.image.stamp)
    return Person(pose, memory=remembered, spread=TRACKING.spread_growth * interval)


def _chosen(people: Sequence[Person], memory: CameraMemory, interval: float) -> List[int]:
    """Return the indices of the people who are looked at in an image, a time [s] after the one before."""
    plan, stamp, schedule = memory.plan, memory.image.stamp, memory.plan.schedule
    shares = [max(person.visibility, schedule.least_visibility) for person in people]
    waits = [share * (person.since_look(stamp) + interval / 2) for share, person in zip(shares, people)]
    # an image that comes twice, or late, is looked at anew
    due = [person.number < 0 or interval <= 0 or wait >= schedule.look_interval for wait, person in zip(waits, people)]
    allowed = (1 - schedule.search_share) * schedule.followed_share * min(interval, schedule.search_time)
    most = max(sum(due), int(min(allowed / max(plan.of_person, 1e-9), len(people))))
    order = sorted(range(len(people)), key=lambda i: (not due[i], -waits[i]))
    return order[:min(most, plan.setup.recipe.max_refined)]


def _searched(people: Sequence[Person], networks: Networks, memory: CameraMemory) -> Look:
    """Return the people of an image after a search of all of it, and a look at all who are expected or were found."""
    found = list(people)
    runs: List[Run] = []
    for part in memory.schedule.parts:
        passed, _ = networks.passed(found, part)
        found, runs = passed.people, [*runs, *passed.runs]
    # sources that saw the place of a new person before another one found it did not find the person
    unfound = dict.fromkeys(range(memory.plan.setup.recipe.pass_opinions))
    found = [*found[:len(people)], *(replace(one, opinions={**unfound, **one.opinions}) for one in found[len(people):])]
    chosen = [*range(len(people)), *networks.likely(found, len(people))][:memory.plan.setup.recipe.max_refined]
    look = networks.look(found, chosen)
    runs += look.runs
    if memory.image.depth is not None and memory.plan.setup.recipe.refinements:
        look = networks.heads(look.people, memory.image.stamp)
        runs += look.runs
    return Look(look.people, tuple(runs))


def _searched_at_once(look: Look, networks: Networks, memory: CameraMemory) -> Tuple[Look, CameraMemory]:
    """Return the people of an image after a search for those who are missing in it, as far as there is time.

    These are people whose crop did not show them, those who may be gone, and any person where none is likely: such an
    image has the time of the crops that it does not need.
    """
    runs, before = list(look.runs), sum(person.found for person in look.people)
    missing = sum(not person.found and (bool(person.opinions) or person.existence < EXISTENCE.reported)
                  for person in look.people)
    likely = any(_is_likely(person) for person in look.people)
    if likely and not missing:
        return look, memory
    missing, memory = missing if likely else len(memory.schedule.parts), memory.with_changes(look.people)
    budget, more = memory.budget, 0.0 if likely else RATE.expected_people * memory.plan.of_person
    memory = replace(memory, budget=budget.with_more(more))
    step = memory.next(at_once=True)
    while step is not None and step.part is not None and sum(person.found for person in look.people) < before + missing:
        look = networks.search(look.people, step.part)
        runs += look.runs
        memory = memory.after(step, look.runs)
        step = memory.next(at_once=True)
    return Look(look.people, tuple(runs)), replace(memory, budget=memory.budget.at_most(budget))


def _is_likely(person: Person) -> bool:
    """Return whether a person is likely in the image. A crop of one who may be gone may show a part of another one."""
    if person.existence >= EXISTENCE.reported:
        return person.found or not person.opinions
    return person.found and person.error <= FOLLOWING.agreement


def _decided(people: Sequence[Person], memory: CameraMemory) -> Tuple[Looks, CameraMemory]:
    """Return the detections in an image by all opinions on its people, and the memory with them."""
    setup, image = memory.plan.setup, memory.image
    found = [person for person in people if person.found]
    detections, kept = accepted_people(voted(found, setup.recipe, image.stamp), setup.acceptance, image.size)
    refused = [found[i] for i in np.setdiff1d(np.arange(len(found)), kept)]
    named = [found[i] for i in kept]
    rest = [*refused, *(person for person in people if not person.found)]
    detections = replace(detections, ids=np.array([-1 if one.elsewhere else one.number for one in named], np.int64))
    missed = [one.number for one in rest if one.number >= 0 and one.opinions] + [
        one.number for one in named if one.elsewhere]
    memory = replace(memory, detections=detections, persons=[*named, *rest])
    return Looks(detections, np.array(missed, np.int64)), memory


def _with_feet(looks: Looks, networks: Networks, memory: CameraMemory, hurried: bool
               ) -> Tuple[Looks, CameraMemory, Tuple[Run, ...]]:
    """Return what was looked at with toes and heels, the memory with them, and the runs; see `Networks.feet`."""
    named = memory.persons[:len(looks.people)]
    known = [one.memory.feet if one.memory and memory.plan.follows else None for one in named]
    (people, feet, _), runs = networks.feet(looks.people, known, memory.image.stamp, hurried)
    persons = [*(replace(one, feet=seen) for one, seen in zip(named, feet)), *memory.persons[len(named):]]
    return looks._replace(people=people), replace(memory, persons=persons), runs
