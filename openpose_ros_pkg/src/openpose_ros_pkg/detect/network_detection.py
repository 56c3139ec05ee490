"""Detection by networks in the images of any number of cameras: tracked people are expected, and found on crops."""
import threading
import time
from dataclasses import dataclass, field, replace
from typing import Dict, Hashable, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.detect.crop_search import Run, SearchPlan, assign, likely, look, search_part
from openpose_ros_pkg.detect.detection import ImageFrame, Wanted, never_wanted
from openpose_ros_pkg.detect.detector import ComputedImage, Detector, prepare_frame
from openpose_ros_pkg.detect.following import FollowedPerson, Following, FollowingParams, voted, without_shared_crops
from openpose_ros_pkg.detect.head_recovery import recover
from openpose_ros_pkg.detect.recipe_choice import RATE
from openpose_ros_pkg.detect.schedule import NO_GREY, Budget, Schedule, changed_columns, small_grey
from openpose_ros_pkg.detect.tracking import (
    TRACKING,
    ImageTracks,
    PerCamera,
    PersonIds,
    TrackingConstants,
    TrackingParams,
)
from openpose_ros_pkg.detect.views import PreparedImage, Setup
from openpose_ros_pkg.ensemble import Opinions, accepted_people
from openpose_ros_pkg.people import FIRST_ID, ExpectedPeople, People2D, Poses, keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock


@dataclass(frozen=True)
class PreparedDetection:
    """An image that is ready for the networks, and how it is searched, whatever is reconfigured meanwhile."""

    frame: ImageFrame
    image: PreparedImage
    plan: SearchPlan


@dataclass(frozen=True)
class ComputedDetection:
    """What the networks found in an image."""

    frame: ImageFrame  # the image
    network_seconds: float  # time that the networks took [s]
    found: Union[ComputedImage, People2D]  # output of a full search; where people are followed: the people, with ids
    followed: Optional['Followed'] = None  # where the rest of the image is to be searched


class Followed(NamedTuple):
    """An image after the crops of the people that were expected in it."""

    prepared: PreparedDetection
    persons: Sequence[FollowedPerson]  # the P people that were found
    people: People2D  # the same, with ids
    lost: bool  # whether crops no longer show a person who was there a moment ago


@dataclass(frozen=True, eq=False)
class CameraMemory:
    """What is remembered of the images of one size of a camera; each step replaces it as a whole."""

    following: Following  # the tracked people
    stamp: float = 0.0  # of the newest frame [s]
    searched_by: object = None  # pace's networks and recipe of the schedule
    schedule: Schedule = field(default_factory=Schedule)  # of the parts of the image
    budget: Budget = field(default_factory=lambda: Budget(0.0))  # of the newest frame
    grey: np.ndarray = field(default_factory=lambda: NO_GREY)  # small image of the frame that was searched last
    people: int = 0  # number of people in the newest frame
    taken: float = 0.0  # time that the newest frame took [s]
    full: float = 0.0  # time that full searches of all cameras had taken until then [s]
    interval: float = 0.0  # between the newest two frames, in a stream those that came, not only computed ones [s]
    waited: float = 0.0  # part of it in which the networks were busy, not the camera silent [s]

    def begun(self, plan: SearchPlan, frame: ImageFrame, full: float, beside: Sequence[Budget]
              ) -> Tuple['CameraMemory', bool]:
        """Return the memory at the begin of a frame, and whether it is searched in full, as no person is expected.

        Args:
            full: time that full searches of all cameras took so far [s].
            beside: budgets of other cameras.
        """
        stamp, (height, width) = frame.stamp, frame.bgr.shape[:2]
        interval, tracks = stamp - self.stamp, self.following.tracks
        # the camera is not silent while the networks work: else, on a slow machine, each full search would make a gap
        # that asks for the next one
        worked = self.taken + full - self.full
        busy = plan.rate > 0 and worked > plan.schedule.followed_share * interval
        searched_by = (plan.first_pace, plan.setup.recipe)
        anew = (self.searched_by != searched_by or interval < -tracks.constants.reset_backstep
                or interval >= tracks.timeout or (interval > self.following.lost_time and not busy))
        late = busy and interval > self.following.lost_time and not anew
        in_stream = frame.interval is not None and plan.rate > 0
        between = interval if frame.interval is None else frame.interval
        begun = replace(self, stamp=max(stamp, self.stamp), interval=between, waited=interval if late else 0.0,
                        schedule=replace(self.schedule, frames=self.schedule.frames + 1))
        if anew:
            begun = replace(begun, following=replace(self.following, memories={}), stamp=stamp, people=0,
                            searched_by=searched_by, schedule=Schedule(plan.parts((width, height)), period=plan.period,
                                                                       constants=plan.schedule),
                            budget=Budget.of_rate(plan.rate, plan.schedule, in_stream), grey=NO_GREY)
        # a client that asks seldom gives time, also where a full search takes most of it
        gives_time = not anew and (not busy or (late and interval - worked > 1 / plan.rate))
        costs = plan.costs(begun.schedule.parts, height, begun.people)
        known = between if gives_time or (in_stream and not anew) else 0.0
        return replace(begun, budget=begun.budget.begun(known, costs, beside)), anew and not in_stream


class _Answer(NamedTuple):
    """The people of a frame, the camera's memory after it, time of the networks [s], their runs, and what is left."""

    people: People2D
    memory: CameraMemory
    seconds: float
    runs: Tuple[Run, ...] = ()
    followed: Optional[Followed] = None


class NetworkDetection:
    """Find people in the images of any number of cameras; they keep their ids. Any thread may call it.

    With following, `compute` lets networks see crops of the people expected in an image. `search` goes on with the rest
    of it, for people of the next images: it is cut into parts, one pass over one strip each, which are spread over the
    images as the time allows. Where no person is to be reported, `compute` searches at once. Without history (first
    image, gap, stamps that jump back, stamp 0) it searches the image in full, but for a stream: there the first images
    are searched as the time allows, too. Each size of the images of a camera has
    its own memory; where a camera changes to a new size of the same aspect, ids stay.

    Args:
        detector: finds the people.
        tracking: limits of tracks.
        following: whether people are followed instead of being searched for in every image.
        pace: [s] per pixel of the networks, by their names, from then on fixed; None: it is measured.
    """

    def __init__(self, detector: Detector, tracking: TrackingParams, following: FollowingParams,
                 pace: Optional[Dict[str, float]] = None, constants: TrackingConstants = TRACKING) -> None:
        self.detector = detector
        self._tracking, self._following, self._constants = tracking, following, constants
        # by camera and size of the images
        self._memories = PerCamera(lambda: CameraMemory(Following(ImageTracks(self._tracking, constants))))
        self._first_id = FIRST_ID  # of a camera that is not remembered
        self._ids = PerCamera(lambda: PersonIds(self._first_id), self._forget_ids)
        self._full = 0.0  # time that full searches of all cameras took so far [s]
        self._tracking_lock = threading.Lock()
        self._fixed_pace = pace
        self._plan = SearchPlan.of(detector, following, pace)

    @property
    def skeleton(self) -> SkeletonModel:
        return self.detector.skeleton

    @property
    def description(self) -> str:
        """Whether people are followed, for the log."""
        if not self._plan.follows:
            return 'searched for in every image'
        return 'followed, and searched for ' + (
            'as far as the rate allows' if self._plan.rate > 0 else f'in every image of {self._plan.period}')

    @property
    def lock(self) -> FairLock:
        return self.detector.lock

    def reconfigure(self, tracking: TrackingParams) -> None:
        """Use other limits, and the present parameters of the detector, from the next frame on; ids stay."""
        with self.lock, self._tracking_lock:
            self._tracking = tracking
            for key, memory in self._memories.items():
                tracks = replace(memory.following.tracks, params=tracking)
                self._memories.put(key, replace(memory, following=replace(memory.following, tracks=tracks)))
            setup = self.detector.setup
            if self._plan.setup.settings.detector == setup.settings.detector:
                self._plan = replace(self._plan, setup=setup)
            else:
                self._plan = SearchPlan.of(self.detector, self._following, self._fixed_pace)

    def warm_up(self, streams: bool) -> None:
        """Let the networks compute crops of a blank image and the parts of it that they will search.

        Args:
            streams: whether all images belong to streams, so that none is searched in full where people are followed.
        """
        in_full = not (streams and self._plan.follows and self._plan.rate > 0)
        self.detector.warm_up(in_full)
        plan, (width, height) = self._plan, RATE.image_size
        blank = np.zeros((height, width, 3), np.uint8)
        parts = plan.parts(RATE.image_size) if plan.follows else ()
        by_size = {(part.number, part.right - part.left): part for part in parts if part.right - part.left < width}
        with self.lock:
            for part in by_size.values():
                self._learn(search_part(plan.setup, blank, part).runs)

    def detect(self, frame: ImageFrame, expected: Optional[ExpectedPeople] = None) -> People2D:
        """Do `prepare`, `compute`, `search` and `finish`."""
        prepared = self.prepare(frame)
        with self.lock:
            computed = self.compute(prepared, expected)
            self.search(computed)
        return self.finish(computed)

    def prepare(self, frame: ImageFrame) -> PreparedDetection:
        plan = self._plan
        follows = plan.follows and frame.follow and frame.stamp > 0
        return PreparedDetection(frame, prepare_frame(frame.bgr, plan.setup, not follows, frame.depth), plan)

    def compute(self, prepared: PreparedDetection, expected: Optional[ExpectedPeople] = None) -> ComputedDetection:
        plan, frame, begin = prepared.plan, prepared.frame, time.perf_counter()
        if prepared.image.views:
            computed = self.detector.compute(prepared.image, expected)
            height, width = frame.bgr.shape[:2]
            foreseen = plan.costs(plan.parts((width, height)), height, 0).search if plan.pace.fixed else 0.0
            with self._tracking_lock:
                self._full += foreseen if plan.pace.fixed else time.perf_counter() - begin
            return ComputedDetection(frame, computed.network_seconds, computed)
        with self._tracking_lock:
            key, memory = self._remembered(frame)
            beside = [other.budget for name, other in self._memories.items()
                      if name != key and abs(frame.stamp - other.stamp) <= other.following.constants.lost_time]
            memory, in_full = memory.begun(plan, frame, self._full, beside)
            ids = self._ids.of(frame.camera)
            if in_full:
                answer = _search_in_full(self.detector, prepared, memory, ids)
                foreseen = memory.budget.costs.search + answer.memory.people * plan.of_person
            else:
                in_space = None if expected is None else keypoints_in(expected.keypoints, expected.skeleton,
                                                                      plan.setup.recipe.skeleton)
                wanted = never_wanted if frame.interval is None else lambda seconds: self.lock.wanted
                answer = _follow(prepared, memory, in_space, ids, wanted)
                foreseen = answer.memory.budget.spent
            taken = foreseen if plan.pace.fixed else time.perf_counter() - begin
            self._full += taken if in_full else 0.0
            self._memories.put(key, replace(answer.memory, taken=taken, full=self._full))
            self._learn(answer.runs)
        return ComputedDetection(frame, answer.seconds, answer.people, answer.followed)

    def search(self, computed: ComputedDetection, wanted: Wanted = never_wanted) -> bool:
        followed, frame, begin = computed.followed, computed.frame, time.perf_counter()
        if followed is None:
            return False
        with self._tracking_lock:
            key, memory = self._remembered(frame)
            if memory.stamp != frame.stamp:
                return False  # of a newer image, of another run of the clock, or of a camera that was forgotten
            answer = _search(followed, memory, self._ids.of(frame.camera), wanted)
            spent = answer.memory.budget.spent - memory.budget.spent
            taken = spent if followed.prepared.plan.pace.fixed else time.perf_counter() - begin
            self._memories.put(key, replace(answer.memory, taken=memory.taken + taken))
            self._learn(answer.runs)
        return bool(answer.runs)

    def finish(self, computed: ComputedDetection) -> People2D:
        if isinstance(computed.found, People2D):
            return computed.found
        people, frame = self.detector.finish(computed.found), computed.frame
        with self._tracking_lock:
            ids = self._ids.of(frame.camera)
            if frame.stamp <= 0:
                return replace(people, ids=ids.give(len(people)))
            key, memory = self._remembered(frame)
            tracks, people = memory.following.tracks.updated(people, frame.stamp, ids)
            self._memories.put(key, replace(memory, following=replace(memory.following, tracks=tracks)))
            return people

    def _remembered(self, frame: ImageFrame) -> Tuple[Hashable, CameraMemory]:
        """Return camera and size of a frame, and the memory of such images.

        Where they have no tracks, those of the camera's images of another resolution a moment ago go on.
        """
        size = (frame.bgr.shape[1], frame.bgr.shape[0])
        memory = self._memories.of((frame.camera, size))
        if not memory.following.tracks.covers(frame.stamp):
            for (camera, other_size), other in reversed(self._memories.items()):  # the newest first
                tracks, scale = other.following.tracks, np.divide(size, other_size)
                if (camera == frame.camera and abs(scale[0] / scale[1] - 1) <= self._constants.same_aspect
                        and tracks.covers(frame.stamp)):
                    following = replace(memory.following, tracks=tracks.scaled(scale))
                    return (frame.camera, size), replace(memory, following=following)
        return (frame.camera, size), memory

    def _learn(self, runs: Sequence[Run]) -> None:
        self._plan = replace(self._plan, pace=self._plan.pace.after(runs))

    def _forget_ids(self, ids: PersonIds) -> None:
        """Give no camera the ids of one that is forgotten: it may be the same."""
        self._first_id = max(self._first_id, ids.next)


def _search_in_full(detector: Detector, prepared: PreparedDetection, memory: CameraMemory, ids: PersonIds) -> _Answer:
    frame, setup = prepared.frame, prepared.plan.setup
    computed = detector.compute(prepared.image)
    poses, opinions = computed.poses, computed.opinions
    persons = [_person(pose, of_person, setup) for pose, of_person in zip(poses.keypoints, opinions)]
    persons += [_recovered(pose, setup) for pose in poses.keypoints[len(persons):]]
    people, kept = accepted_people(poses, setup.acceptance, computed.image_size)
    following, people = memory.following.updated(people, [persons[i] for i in kept], frame.stamp, ids)
    memory = replace(memory, following=following, people=len(kept), grey=small_grey(frame.bgr, prepared.plan.schedule),
                     schedule=memory.schedule.all_done(frame.stamp))
    return _Answer(people, memory, computed.network_seconds)


def _follow(prepared: PreparedDetection, memory: CameraMemory, in_space: Optional[np.ndarray], ids: PersonIds,
            wanted: Wanted) -> _Answer:
    """Return the people of an image who are found on crops where they are expected; if there are none, search at once.

    Args:
        in_space: (P, K, 3) people expected by tracks in space; None: no such tracks.
        wanted: whether other cameras need the networks.
    """
    frame, image, plan, setup = prepared.frame, prepared.image, prepared.plan, prepared.plan.setup
    recipe, cost, size = setup.recipe, plan.of_person, (frame.bgr.shape[1], frame.bgr.shape[0])
    people = memory.following.expected(frame.stamp, in_space, memory.waited)
    crops = memory.budget.crops_of(len(people), cost, memory.interval, memory.following.constants.unlooked_time)
    looked = look(image, people, sorted(range(len(people)), key=lambda i: -people[i].urgency)[:crops])
    people = without_shared_crops(looked.people, recipe)
    lost = [person for person in people if person.lost]
    reported = [person for person in people if person.reported]
    accepted, kept = accepted_people(voted(reported, recipe, frame.stamp), setup.acceptance, size)
    found = [reported[i] for i in kept]
    accepted = replace(accepted, looked=np.array([person.found for person in found], bool))
    following = memory.following.looked_for([person for person in people if person.opinions], frame.stamp)
    following, accepted = following.updated(accepted, found, frame.stamp, ids)
    memory = replace(memory, following=following, schedule=memory.schedule.lost(person.box for person in lost),
                     budget=memory.budget.after_crops(cost * crops), people=len(found))
    followed = Followed(prepared, found, accepted, any(person.recent for person in lost))
    if found:
        return _Answer(accepted, memory, looked.seconds, looked.runs, followed)
    answer = _search(followed, memory, ids, wanted)
    return answer._replace(seconds=looked.seconds + answer.seconds, runs=looked.runs + answer.runs)


class _Searched(NamedTuple):
    """What the search of parts of an image found: its people, first those of the crops, and what it took."""

    persons: List[FollowedPerson]
    schedule: Schedule
    budget: Budget
    seconds: float = 0.0
    runs: Tuple[Run, ...] = ()


def _search(followed: Followed, memory: CameraMemory, ids: PersonIds, wanted: Wanted) -> _Answer:
    """Search parts of an image after the crops; return the people who are found besides.

    They are confirmed on crops, and expected in the next image. What the search tells of the others takes part in the
    vote from the next image on.
    """
    prepared, plan, setup = followed.prepared, followed.prepared.plan, followed.prepared.plan.setup
    frame, image, known = prepared.frame, prepared.image, followed.people
    size, nothing = (frame.bgr.shape[1], frame.bgr.shape[0]), People2D.empty(setup.recipe.skeleton)
    if _may_wait(memory, frame.stamp) and wanted(min(memory.budget.costs.parts.values(), default=0.0)):
        return _Answer(nothing, memory, 0.0)
    grey = small_grey(frame.bgr, plan.schedule)
    columns = changed_columns(grey, memory.grey, size, [person.box for person in followed.persons], plan.schedule)
    memory = replace(memory, grey=grey, schedule=memory.schedule.changed(columns))
    searched = _search_parts(followed, memory, wanted)
    if searched.schedule is memory.schedule:
        return _Answer(nothing, memory, 0.0)
    persons, budget, seconds = without_shared_crops(searched.persons, setup.recipe), searched.budget, searched.seconds
    new = [person for person in persons[len(known):] if person.found]
    poses = Poses(known.keypoints, np.full(len(known), np.inf)).joined(voted(new, setup.recipe, frame.stamp))
    cost = plan.most_heads * plan.of_person
    if frame.depth is not None and budget.affords(cost) and not wanted(cost):
        recovered = recover(image, accepted_people(poses, setup.acceptance, size)[0])
        poses, budget = poses.joined(recovered.poses), budget.after(plan.of_person * recovered.crops)
        seconds += recovered.seconds
        new += [_recovered(pose, setup) for pose in recovered.poses.keypoints]
    people, kept = accepted_people(poses, setup.acceptance, size)
    others = np.flatnonzero(kept >= len(known))
    following = memory.following.told(dict(zip(known.ids.tolist(), persons)), frame.stamp)
    following, people = following.updated(people.select(others), [new[i - len(known)] for i in kept[others]],
                                          frame.stamp, ids, known.ids.tolist())
    memory = replace(memory, following=following, schedule=searched.schedule, budget=budget,
                     people=len(known) + len(people))
    return _Answer(people, memory, seconds, searched.runs)


def _search_parts(followed: Followed, memory: CameraMemory, wanted: Wanted) -> _Searched:
    """Search parts of an image, the most urgent first, as far as the budget goes.

    Another image, or one that will come before the end of the next part, ends it, unless that has waited too long. The
    first image is searched by the pass that takes least, whatever the budget.
    """
    image, plan = followed.prepared.image, followed.prepared.plan
    stamp, setup = followed.prepared.frame.stamp, plan.setup
    state = _Searched(list(followed.persons), memory.schedule, memory.budget)
    may_wait = _may_wait(memory, stamp)
    at_first = memory.schedule.parts[0].number if not memory.schedule.searched else None
    for part in memory.schedule.due(stamp, memory.budget.rate > 0 or followed.lost):
        cost = memory.budget.costs.parts[part]
        if not (state.budget.affords(cost) or part.number == at_first) or (may_wait and wanted(cost)):
            break
        found = search_part(setup, image.bgr, part, state.persons)
        persons, new = assign(found.found, state.persons, setup)
        new = likely(new, setup)
        looked = look(image, [*persons, *new], range(len(persons), len(persons) + len(new)))
        state = _Searched(looked.people, state.schedule.done(part, stamp),
                          state.budget.after(cost + plan.of_person * (found.crops + len(new))),
                          state.seconds + found.seconds + looked.seconds, state.runs + found.runs + looked.runs)
        may_wait = True
    return state


def _may_wait(memory: CameraMemory, stamp: float) -> bool:
    """Return whether the search can be put off at a time [s]."""
    return stamp - memory.schedule.newest < memory.schedule.constants.patience


def _person(pose: np.ndarray, opinions: Opinions, setup: Setup) -> FollowedPerson:
    """Return a person, (K, 3), found by a full search; sources without an opinion did not find the person."""
    crops = [opinions[number] for number in sorted(opinions) if number >= setup.recipe.pass_opinions]
    return FollowedPerson(pose, crop=crops[0] if crops else None,
                          opinions={number: opinions.get(number) for number in range(len(setup.recipe.weights))})


def _recovered(pose: np.ndarray, setup: Setup) -> FollowedPerson:
    """Return a person, (K, 3), found by the depth alone."""
    return FollowedPerson(pose, crop=pose, opinions={setup.recipe.pass_opinions: pose})
