"""A detector for streams: it remembers, for each camera, who was seen where, and looks there first."""
import threading
from dataclasses import dataclass, field
from typing import Callable, Dict, Hashable, List, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.detect.depth import DepthView
from openpose_ros_pkg.detect.detector import (
    USUAL_SIZE,
    ComputedFrame,
    Detector,
    PreparedFrame,
    Setup,
    people_of,
    with_missed,
)
from openpose_ros_pkg.detect.ensemble import person_scores
from openpose_ros_pkg.detect.following import FOLLOWING, Followed, Follower, FollowingParams, refuse_slides
from openpose_ros_pkg.detect.looking import Found, Pace, assign, look, search
from openpose_ros_pkg.detect.missed import MISSED
from openpose_ros_pkg.detect.recipes import DetectorParams
from openpose_ros_pkg.detect.schedule import SCHEDULE, Budget, Changes, Part, Schedule, strips
from openpose_ros_pkg.detect.target_rate import RATE, seconds_per_pixel
from openpose_ros_pkg.detect.tracking import TRACKING, PerCamera, TrackingParams
from openpose_ros_pkg.people import People2D, Poses
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock


@dataclass(frozen=True)
class StreamFrame:
    """What was found in an image of a stream.

    Attributes:
        network_seconds: that the networks took [s].
        camera: which stream it is.
        stamp: of the image [s].
        found: what the networks gave; where people are followed: they, with their ids.
    """

    network_seconds: float
    camera: Hashable
    stamp: float
    found: Union[ComputedFrame, People2D]


@dataclass(frozen=True, eq=False)
class _Plan:
    """How the images of all cameras are searched.

    Attributes:
        made_for: parameters of the detector.
        follows: whether people are followed.
        rate: that is wanted [Hz]; 0: none.
        period: without a rate, every image of this number is searched in full.
        pace: what the networks take.
        cuts: parts by the size of the images, of the newest sizes. They stay, as a network is compiled for each size of
            a part.
    """

    made_for: DetectorParams
    follows: bool
    rate: float
    period: int
    pace: Pace
    cuts: Dict[Tuple[int, int], List[Part]] = field(default_factory=dict)

    @classmethod
    def of(cls, detector: Detector, following: FollowingParams, fixed: Optional[Dict[str, float]]) -> '_Plan':
        """Return the plan for the present parameters, after measuring the networks where none are given."""
        setup = detector.setup
        params = setup.settings.detector
        follows = bool(setup.recipe.refinements) and following.wanted(params)
        pace = fixed or {}
        if follows and params.target_rate > 0 and fixed is None:
            pace = seconds_per_pixel(setup.recipe, setup.networks, detector.threads)
        return cls(params, follows, params.target_rate, following.search_period, Pace(pace, fixed is not None))

    def parts(self, setup: Setup, size: Tuple[int, int]) -> List[Part]:
        """Return the parts of a search of an image of (width, height) [px]."""
        if size not in self.cuts:
            self.cuts[size] = self._cut(setup, size)
        parts = self.cuts[size]
        if len(self.cuts) > TRACKING.most_cameras:
            del self.cuts[next(iter(self.cuts))]
        return parts

    def least(self, setup: Setup, size: Tuple[int, int]) -> float:
        """Return what there is time for in any frame [s]."""
        return SCHEDULE.least_work * (self.search(setup, size) + RATE.expected_people * self.pace.of_person(setup))

    def search(self, setup: Setup, size: Tuple[int, int]) -> float:
        """Return what all parts of an image of (width, height) [px] take [s]."""
        return sum(self.pace.of_part(part, setup, size[1]) for part in self.parts(setup, size))

    def _cut(self, setup: Setup, size: Tuple[int, int]) -> List[Part]:
        """Cut each pass into as many strips as it takes to fit into a frame beside the expected number of people."""
        most, (width, height) = SCHEDULE.most_strips if self.rate > 0 else 1, size
        left = 1 / self.rate - RATE.expected_people * self.pace.of_person(setup) if self.rate > 0 else 0.0
        parts = []
        for number, one in enumerate(setup.recipe.passes):
            counts = range(1, 2 if one.model.input.fixed_size else most + 1)
            cuts = [[Part(number, *columns, width) for columns in strips(width, count)] for count in counts]
            parts += next((cut for cut in cuts if self.pace.of_part(cut[0], setup, height) <= left), cuts[-1])
        return parts


class _Camera:
    """What is remembered of a camera."""

    def __init__(self, tracking: TrackingParams, skeleton: SkeletonModel) -> None:
        self.follower = Follower(tracking, skeleton)
        self._stamp = 0.0  # of the newest frame [s]
        self._searched_by: Tuple[object, ...] = ()  # what makes the schedule
        self.budget = Budget(0.0)
        self.people = 0  # in the newest frame

    def shows(self, stamp: float) -> bool:
        """Return whether images come from the camera at a time [s]."""
        return abs(stamp - self._stamp) <= FOLLOWING.most_gap

    def begin(self, plan: _Plan, setup: Setup, size: Tuple[int, int], stamp: float, beside: Sequence[Budget]) -> bool:
        """Begin a frame beside the budgets of other cameras; return whether it is the first of a stream."""
        interval, self._stamp = stamp - self._stamp, max(stamp, self._stamp)
        searched_by = (plan, setup.recipe, size)
        first = self._searched_by != searched_by or not -TRACKING.reset_backstep <= interval <= FOLLOWING.most_gap
        if first:
            self._searched_by, self._stamp, self.people = searched_by, stamp, 0
            self.schedule, self.changes = Schedule(plan.parts(setup, size)), Changes()
            self.budget = Budget(plan.rate)
            self.frames = -1  # since the image was searched in full
        self.frames += 1
        self.budget.begin(0.0 if first else interval, plan.least(setup, size), self.people * plan.pace.of_person(setup),
                          plan.search(setup, size), beside)
        return first


class StreamDetector:
    """Find people in the images of any number of cameras; they keep their ids. Any thread may call it.

    `detect` does it all. To prepare the next image and finish the last one while the networks are busy, call `prepare`,
    `compute` and `finish` separately, the latter two in the order of the frames of a camera.

    With following, networks look at crops round the people who are expected in an image. The search for others is cut
    into parts, one pass over one strip of the image each, which are spread over the frames as the time allows. Stamps
    that jump and a new size of the images begin anew. An image with a stamp of 0 is searched in full.

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
        self._cameras = PerCamera(lambda: _Camera(self._tracking, self.skeleton))
        self._tracking_lock = threading.Lock()
        self._fixed_pace = pace
        self._plan = _Plan.of(detector, following, pace)

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
            if self._plan.made_for != self.detector.setup.settings.detector:
                self._plan = _Plan.of(self.detector, self._following, self._fixed_pace)

    def warm_up(self) -> None:
        """Let the networks see blank images, as `Detector.warm_up` does, but the parts that they will see."""
        setup = self.detector.setup
        if not self._plan.follows:
            self.detector.warm_up()
            return
        width, height = USUAL_SIZE
        blank = np.zeros((height, width, 3), np.uint8)
        by_size = {(part.number, part.right - part.left): part for part in self._plan.parts(setup, USUAL_SIZE)}
        somebody = np.full((len(self.skeleton.joints), 3), 1.0, np.float32)
        somebody[0, :2] = width / 2, height - 1
        with self.lock:
            for part in by_size.values():
                search(setup, blank, part, self._plan.pace)
            for people in (1, 2):  # several are computed side by side, by a network that is compiled for it
                look(PreparedFrame(blank, [], setup), [Followed(somebody)] * people, [], self._plan.pace)

    def detect(self, bgr: np.ndarray, camera: Hashable, stamp: float, expected: Optional[People2D] = None,
               depth: Optional[DepthView] = None) -> People2D:
        """Return the people in an image of a camera, with ids that they keep in its images.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.
            camera: whatever tells the cameras apart.
            stamp: of the image [s].
            expected: where people who are followed in space are expected in the image, with their ids there; None:
                nobody is followed in space.
            depth: of the image; None: it is not known.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        prepared = self.prepare(bgr, depth=depth)
        with self.lock:
            computed = self.compute(prepared, camera, stamp, expected)
        return self.finish(computed)

    def prepare(self, bgr: np.ndarray, follow: bool = True, depth: Optional[DepthView] = None) -> PreparedFrame:
        """Check an image and bring it to the sizes that the networks want; see `detect`.

        Args:
            follow: False: search this image in full in any case.
        """
        return self.detector.prepare(bgr, not (follow and self._plan.follows), depth)

    def compute(self, frame: PreparedFrame, camera: Hashable, stamp: float, expected: Optional[People2D] = None
                ) -> StreamFrame:
        """Compute the networks for a prepared image, with `lock` held; see `detect`."""
        if frame.views:
            computed = self.detector.compute(frame)
            return StreamFrame(computed.network_seconds, camera, stamp, computed)
        with self._tracking_lock:
            people, seconds = self._follow(frame, self._cameras.of(camera), stamp, expected)
        return StreamFrame(seconds, camera, stamp, people)

    def finish(self, computed: StreamFrame) -> People2D:
        """Return the people of a computed image; see `detect`."""
        if isinstance(computed.found, People2D):
            return computed.found
        people = self.detector.finish(computed.found)
        with self._tracking_lock:
            return self._cameras.of(computed.camera).follower.tracker.update(people, computed.stamp)

    def _follow(self, frame: PreparedFrame, camera: _Camera, stamp: float, expected: Optional[People2D]
                ) -> Tuple[People2D, float]:
        setup, bgr, plan = frame.setup, frame.bgr, self._plan
        size = (bgr.shape[1], bgr.shape[0])
        beside = [other.budget for other in self._cameras.all() if other is not camera and other.shows(stamp)]
        first = camera.begin(plan, setup, size, stamp, beside)
        people = camera.follower.expected(stamp, expected)
        camera.schedule.changed(camera.changes.columns(bgr, [person.box for person in people]))
        cost = plan.pace.of_person(setup)
        looked = sorted(people, key=lambda person: -person.urgency)[:camera.budget.crops(cost)]
        seconds = look(frame, looked, people, plan.pace)
        refuse_slides(people, setup.recipe)
        camera.budget.save(cost * len(looked))
        parts = _due(camera, plan, stamp, first, people, lambda part: plan.pace.of_part(part, setup, size[1]))
        found, more = self._search(frame, camera, stamp, parts)
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
            reported += [Followed(pose, crop=pose, opinions={setup.recipe.pass_opinions: pose})
                         for pose in missed.poses.keypoints]
        accepted, kept = people_of(poses, setup, size)
        camera.people = len(kept)
        return camera.follower.update(accepted, [reported[i] for i in kept], stamp), seconds

    def _search(self, frame: PreparedFrame, camera: _Camera, stamp: float, parts: Sequence[Part]
                ) -> Tuple[List[Found], float]:
        found: List[Found] = []
        seconds = 0.0
        for part in parts:
            more, taken = search(frame.setup, frame.bgr, part, self._plan.pace)
            found += more
            seconds += taken
            camera.schedule.done(part, stamp)
        return found, seconds


def _due(camera: _Camera, plan: _Plan, stamp: float, first: bool, people: Sequence[Followed],
         cost: Callable[[Part], float]) -> List[Part]:
    """Return the parts that are searched in a frame."""
    just_lost = False
    for person in people:
        if person.opinions and person.crop is None:
            low, high = person.box
            camera.schedule.urge(low[0], high[0], SCHEDULE.lost)
            just_lost |= person.unseen <= FOLLOWING.unlooked_time
    if stamp <= 0 or (plan.rate <= 0 and (first or just_lost or camera.frames >= plan.period)):
        camera.frames = 0
        return camera.schedule.parts
    if plan.rate <= 0:
        return []
    due: List[Part] = []
    for part in sorted(camera.schedule.parts, key=cost) if first else camera.schedule.order(stamp):
        # the first frame searches something in any case: nobody is known
        if not camera.budget.affords(cost(part)) and (due or not first):
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
