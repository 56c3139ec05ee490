"""A detector for streams: it remembers, for each camera, who was seen where, and looks there first."""
import threading
import time
from dataclasses import dataclass, replace
from typing import Callable, Dict, Hashable, List, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.detect.crop_search import Found, Pace, Plan, assign, look, search
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.detector import (
    USUAL_SIZE,
    ComputedFrame,
    Detector,
    PreparedFrame,
    Setup,
    people_of,
    prepare_frame,
    with_missed,
)
from openpose_ros_pkg.detect.ensemble import Opinions, person_scores
from openpose_ros_pkg.detect.following import FOLLOWING, Followed, Follower, FollowingParams, refuse_slides
from openpose_ros_pkg.detect.head_recovery import MISSED
from openpose_ros_pkg.detect.schedule import SCHEDULE, Budget, Changes, Part, Schedule
from openpose_ros_pkg.detect.tracking import TRACKING, PerCamera, PersonIds, TrackingParams
from openpose_ros_pkg.people import FIRST_ID, People2D, Poses
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock


@dataclass(frozen=True)
class PreparedDetection:
    """An image that is ready for the networks, and how it is searched, whatever is reconfigured meanwhile."""

    frame: ImageFrame
    image: PreparedFrame
    plan: Plan


@dataclass(frozen=True)
class ComputedDetection:
    """What the networks found in an image.

    Attributes:
        frame: the image.
        network_seconds: time that the networks took [s].
        found: output of a full search; where people are followed: the people, with ids.
    """

    frame: ImageFrame
    network_seconds: float
    found: Union[ComputedFrame, People2D]


class _Camera:
    """What is remembered of the images of one size of a camera."""

    def __init__(self, tracking: TrackingParams, skeleton: SkeletonModel) -> None:
        self.follower = Follower(tracking, skeleton)
        self._stamp = 0.0  # of the newest frame [s]
        self._searched_by: Tuple[object, ...] = ()  # what makes the schedule
        self._taken = 0.0  # by the newest frame [s]
        self._full = 0.0  # time that full searches of all cameras took until then [s]
        self.budget = Budget(0.0)
        self.people = 0  # in the newest frame
        self.interval = 0.0  # between the newest two frames [s]
        self.waited = 0.0  # time before the newest frame in which the networks were at work, not the camera silent [s]

    def shows(self, stamp: float) -> bool:
        """Return whether images come from the camera at a time [s]."""
        return abs(stamp - self._stamp) <= FOLLOWING.lost_time

    def begin(self, plan: Plan, size: Tuple[int, int], stamp: float, full: float, beside: Sequence[Budget]) -> bool:
        """Begin a frame; return whether it is to be searched in full, as no person is expected.

        Args:
            full: time that full searches of all cameras took so far [s].
            beside: budgets of other cameras.
        """
        interval, self._stamp = stamp - self._stamp, max(stamp, self._stamp)
        # an interval that the networks were at work is none of the camera's: on a slow machine, each full search would
        # make a gap that asks for the next one
        worked = self._taken + full - self._full
        busy = plan.rate > 0 and worked > SCHEDULE.network_share * interval
        searched_by = (plan.pace, plan.setup.recipe)
        anew = (self._searched_by != searched_by or interval < -TRACKING.reset_backstep
                or interval >= self.follower.tracker.timeout or (interval > self.follower.memory and not busy))
        late = busy and interval > self.follower.memory and not anew
        if anew:
            self._searched_by, self._stamp, self.people = searched_by, stamp, 0
            self.schedule, self.changes = Schedule(plan.parts(size)), Changes()
            self.budget = Budget(plan.rate)
            self.frames = -1  # since the image was searched in full
            self.follower.forget()
        self.frames += 1
        self.interval, self.waited = interval, interval if late else 0.0
        # a client that asks seldom gives time, also where a full search takes most of it
        gives_time = not busy or (late and interval - worked > 1 / plan.rate)
        self.budget.begin(interval if gives_time and not anew else 0.0, plan.least(size), self.people * plan.of_person,
                          plan.search(size), beside)
        return anew

    def end(self, taken: float, full: float) -> None:
        """Note what the frame took, and full searches of all cameras until now [s]."""
        self._taken, self._full = taken, full


class NetworkDetection:
    """Find people in the images of any number of cameras; they keep their ids. Any thread may call it.

    `detect` does it all. To prepare the next image and finish the last one while the networks are busy, call `prepare`,
    `compute` and `finish` separately, the latter two in the order of the frames of a camera.

    With following, networks look at crops round the people who are expected in an image. The search for others is cut
    into parts, one pass over one strip of the image each, which are spread over the frames as the time allows. Where no
    person is expected, in the first image, after a gap or when stamps jump back, the image is searched in full, as
    `Detector.detect` does. What is remembered is that of images of one size; where a camera changes to a new one of the
    same aspect, ids stay. An image with a stamp of 0 or less has no history: it is searched in full, and its people get
    new ids.

    Args:
        detector: what finds the people.
        tracking: limits of following people.
        following: whether people are followed instead of being searched for in every image.
        pace: what the networks take for a pixel, by their names, from then on fixed [s]; None: it is measured.
    """

    def __init__(self, detector: Detector, tracking: TrackingParams, following: FollowingParams,
                 pace: Optional[Dict[str, float]] = None) -> None:
        self.detector = detector
        self._tracking, self._following = tracking, following
        self._cameras = PerCamera(lambda: _Camera(self._tracking, self.skeleton))  # by camera and size of the images
        self._first_id = FIRST_ID  # of a camera that is not remembered
        self._ids = PerCamera(lambda: PersonIds(self._first_id), self._forget_ids)
        self._full = 0.0  # time that full searches of all cameras took so far [s]
        self._tracking_lock = threading.Lock()
        self._fixed_pace = pace
        self._plan = Plan.of(detector, following, pace)

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
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
        """To be held during `compute`."""
        return self.detector.lock

    def reconfigure(self, tracking: TrackingParams) -> None:
        """Use other limits, and the present parameters of the detector, from the next frame on; ids stay."""
        with self.lock, self._tracking_lock:
            self._tracking = tracking
            for camera in self._cameras.all():
                camera.follower.tracker.reconfigure(tracking)
            setup = self.detector.setup
            if self._plan.setup.settings.detector == setup.settings.detector:
                self._plan = replace(self._plan, setup=setup)
            else:
                self._plan = Plan.of(self.detector, self._following, self._fixed_pace)

    def warm_up(self) -> None:
        """Let the networks see blank images, as `Detector.warm_up` does, and the parts that they will see."""
        self.detector.warm_up()
        plan, (width, height) = self._plan, USUAL_SIZE
        blank = np.zeros((height, width, 3), np.uint8)
        parts = plan.parts(USUAL_SIZE) if plan.follows else []
        by_size = {(part.number, part.right - part.left): part for part in parts if part.right - part.left < width}
        with self.lock:
            for part in by_size.values():
                search(plan.setup, blank, part, plan.pace)

    def detect(self, frame: ImageFrame, expected: Optional[People2D] = None) -> People2D:
        """Return the people in an image, with ids that they keep in the images of a camera; see `Detection`.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        prepared = self.prepare(frame)
        with self.lock:
            computed = self.compute(prepared, expected)
        return self.finish(computed)

    def prepare(self, frame: ImageFrame) -> PreparedDetection:
        """Check an image and bring it to the sizes that the networks want; see `Detection.prepare`."""
        plan = self._plan
        follows = plan.follows and frame.follow and frame.stamp > 0
        return PreparedDetection(frame, prepare_frame(frame.bgr, plan.setup, not follows, frame.depth), plan)

    def compute(self, prepared: PreparedDetection, expected: Optional[People2D] = None) -> ComputedDetection:
        """Compute the networks for a prepared image, with `lock` held; see `Detection.compute`."""
        plan, image, frame = prepared.plan, prepared.image, prepared.frame
        camera, stamp = frame.camera, frame.stamp
        size, begin = (image.bgr.shape[1], image.bgr.shape[0]), time.perf_counter()
        if image.views:
            computed = self.detector.compute(image)
            with self._tracking_lock:
                self._full += plan.search(size) if plan.pace.fixed else time.perf_counter() - begin
            return ComputedDetection(frame, computed.network_seconds, computed)
        with self._tracking_lock:
            memory, ids = self._remembered(camera, size, stamp), self._ids.of(camera)
            beside = [other.budget for other in self._cameras.all() if other is not memory and other.shows(stamp)]
            full = memory.begin(plan, size, stamp, self._full, beside)
            if full:
                people, seconds = self._search_all(image, plan, memory, stamp, ids)
                foreseen = plan.search(size) + len(people) * plan.of_person
            else:
                people, seconds = _follow(image, plan, memory, stamp, ids, expected)
                foreseen = memory.budget.spent
            taken = foreseen if plan.pace.fixed else time.perf_counter() - begin
            self._full += taken if full else 0.0
            memory.end(taken, self._full)
        return ComputedDetection(frame, seconds, people)

    def finish(self, computed: ComputedDetection) -> People2D:
        """Return the people of a computed image; see `Detection.finish`."""
        if isinstance(computed.found, People2D):
            return computed.found
        people, stamp = self.detector.finish(computed.found), computed.frame.stamp
        with self._tracking_lock:
            ids = self._ids.of(computed.frame.camera)
            if stamp <= 0:
                return replace(people, ids=ids.give(len(people)))
            camera = self._remembered(computed.frame.camera, computed.found.image_size, stamp)
            return camera.follower.tracker.update(people, stamp, ids)

    def _remembered(self, name: Hashable, size: Tuple[int, int], stamp: float) -> _Camera:
        """Return what is remembered of images of (width, height) [px] of a camera.

        Where that is nothing, as the camera showed images of another resolution just now, their tracks go on.
        """
        camera = self._cameras.of((name, size))
        tracker = camera.follower.tracker
        if not tracker.shows(stamp):
            for key, other in reversed(self._cameras.items()):  # the newest first
                scale = np.divide(size, key[1])
                if (key[0] == name and abs(scale[0] / scale[1] - 1) <= TRACKING.same_aspect
                        and other.follower.tracker.shows(stamp)):
                    tracker.take_over(other.follower.tracker, scale)
                    break
        return camera

    def _forget_ids(self, ids: PersonIds) -> None:
        """Let no camera have ids that one had that is forgotten: it may be the same."""
        self._first_id = max(self._first_id, ids.next)

    def _search_all(self, frame: PreparedFrame, plan: Plan, camera: _Camera, stamp: float, ids: PersonIds
                    ) -> Tuple[People2D, float]:
        """Return the people of an image that is searched in full, remember them, and the time of the networks [s]."""
        computed = self.detector.compute(frame)
        poses, opinions, setup = computed.poses, computed.opinions, plan.setup
        persons = [_person(pose, of_person, setup) for pose, of_person in zip(poses.keypoints, opinions)]
        persons += [_missed(pose, setup) for pose in poses.keypoints[len(persons):]]
        people, kept = people_of(poses, setup, computed.image_size)
        for part in camera.schedule.parts:
            camera.schedule.done(part, stamp)
        camera.changes.columns(frame.bgr, [])
        camera.people = len(kept)
        return camera.follower.update(people, [persons[i] for i in kept], stamp, ids), computed.network_seconds


def _follow(frame: PreparedFrame, plan: Plan, camera: _Camera, stamp: float, ids: PersonIds,
            expected: Optional[People2D]) -> Tuple[People2D, float]:
    """Return the people of an image, expected ones and those in parts that are searched, and the networks' time [s]."""
    setup, bgr, size = plan.setup, frame.bgr, (frame.bgr.shape[1], frame.bgr.shape[0])
    people = camera.follower.expected(stamp, expected, camera.waited)
    camera.schedule.changed(camera.changes.columns(bgr, [person.box for person in people]))
    cost = plan.of_person
    looked = sorted(people, key=lambda person: -person.urgency)[:_crops(camera, len(people), cost)]
    seconds = look(frame, looked, people, plan.pace)
    refuse_slides(people, setup.recipe)
    camera.budget.save(cost * len(looked))
    parts = _due(camera, plan, stamp, people, lambda part: plan.of_part(part, size))
    found, more = _search(frame, camera, stamp, parts, plan.pace)
    new = _likely(assign(found, people, setup.recipe), setup)
    seconds += more + look(frame, new, [*people, *new], plan.pace)
    camera.budget.spend(cost * len(new))
    refuse_slides([*people, *new], setup.recipe)
    reported = [person for person in (*people, *new) if person.reported]
    keypoints = np.array([person.voted(setup.recipe, stamp) for person in reported], np.float32)
    keypoints = keypoints.reshape(-1, len(setup.recipe.skeleton.joints), 3)
    poses = Poses(keypoints, person_scores(keypoints))
    if parts and camera.budget.affords(MISSED.most * cost):
        poses, missed = with_missed(poses, frame)
        camera.budget.spend(cost * missed.crops)
        seconds += missed.seconds
        reported += [_missed(pose, setup) for pose in missed.poses.keypoints]
    accepted, kept = people_of(poses, setup, size)
    camera.people = len(kept)
    return camera.follower.update(accepted, [reported[i] for i in kept], stamp, ids), seconds


def _crops(camera: _Camera, people: int, cost: float) -> int:
    """Return how many people are looked at on crops that take some seconds each.

    All are where frames are so rare that a person who waits for the next one would not be reported any more.
    """
    fits = people * cost <= SCHEDULE.network_share * camera.interval
    if camera.interval > FOLLOWING.unlooked_time or (fits and 2 * camera.interval > FOLLOWING.unlooked_time):
        return people
    return camera.budget.crops(cost)


def _person(pose: np.ndarray, opinions: Opinions, setup: Setup) -> Followed:
    """Return a person, (K, 3), as a full search found them; sources without an opinion did not find the person."""
    crops = [opinions[number] for number in sorted(opinions) if number >= setup.recipe.pass_opinions]
    return Followed(pose, crop=crops[0] if crops else None,
                    opinions={number: opinions.get(number) for number in range(len(setup.recipe.weights))})


def _missed(pose: np.ndarray, setup: Setup) -> Followed:
    """Return a person, (K, 3), found by the depth alone."""
    return Followed(pose, crop=pose, opinions={setup.recipe.pass_opinions: pose})


def _search(frame: PreparedFrame, camera: _Camera, stamp: float, parts: Sequence[Part], pace: Pace
            ) -> Tuple[List[Found], float]:
    found: List[Found] = []
    seconds = 0.0
    for part in parts:
        more, taken = search(frame.setup, frame.bgr, part, pace)
        found += more
        seconds += taken
        camera.schedule.done(part, stamp)
    return found, seconds


def _due(camera: _Camera, plan: Plan, stamp: float, people: Sequence[Followed], cost: Callable[[Part], float]
         ) -> List[Part]:
    """Return the parts that are searched in a frame."""
    just_lost = False
    for person in people:
        if person.opinions and person.crop is None:
            low, high = person.box
            camera.schedule.urge(low[0], high[0], SCHEDULE.lost)
            just_lost |= person.unseen <= FOLLOWING.unlooked_time
    if plan.rate <= 0:
        if not just_lost and camera.frames < plan.period:
            return []
        camera.frames = 0
        return camera.schedule.parts
    due: List[Part] = []
    for part in camera.schedule.order(stamp):
        if not camera.budget.affords(cost(part)):
            break
        camera.budget.spend(cost(part))
        due.append(part)
    return due


def _likely(new: Sequence[Followed], setup: Setup) -> List[Followed]:
    """Return those of new people who are worth a crop, the surest first."""
    least = setup.recipe.acceptance * setup.settings.decode.person_min_score
    scores = [float(person_scores(person.expected[np.newaxis])[0]) for person in new]
    order = np.argsort([-score for score in scores], kind='stable')[:setup.recipe.max_refined]
    return [new[i] for i in order if scores[i] >= least]
