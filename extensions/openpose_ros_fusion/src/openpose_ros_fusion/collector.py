"""Which people of several cameras make one update: common stamps for cameras of any rates, that come and go.

An update leaves as soon as every camera whose next message belongs to it has sent one. Cameras that share a detector
send people of one time one after the other: how much later a camera is than the first one is learnt, and sets the wait
for it, `patience` at most. The stamp of an update is the newest of its messages; the fusion moves earlier ones to it.
A slow camera does not slow down the others; one that has died costs its usual delay until it counts as silent.

A camera whose stamps are beside those of the others is out of time: its messages are dropped, unless no other camera
sends any, as when a recording begins anew.
"""
from collections import deque
from dataclasses import dataclass
from typing import Deque, List, NamedTuple, Optional, Sequence, Set, Tuple

from openpose_ros_fusion.constants import FUSION, CollectorConstants
from openpose_ros_fusion.observations import Sighting

# Updates by which the delays of cameras are learnt.
_REMEMBERED = 32


class Update(NamedTuple):
    """The input of the fusion at a time: the stamp [s], and of each camera one sighting at most."""

    stamp: float
    sightings: Tuple[Sighting, ...]


@dataclass
class _Camera:
    """Messages of one camera."""

    pending: Optional[Sighting] = None  # waits for the next update
    stamp: float = float('-inf')        # of the newest message [s]
    arrival: float = float('-inf')      # when that came [s]
    interval: float = 0.0               # between arrivals, a maximum that fades [s]
    period: float = 0.0                 # between stamps [s]; 0 while unknown
    delay: float = 0.0                  # after the first message of a time, a maximum that fades [s]


class Collector:
    """Gathers sightings for updates; not thread-safe.

    Args:
        cameras: names of all that may send.

    Attributes:
        dropped: messages by camera that were replaced by newer ones before an update.
        out_of_time: messages by camera that were dropped, as their stamps are beside those of the others.
        cameras_out_of_time: names of those whose newest message was.
    """

    def __init__(self, cameras: Sequence[str], constants: CollectorConstants = FUSION.collector) -> None:
        self._constants = constants
        self._cameras = {name: _Camera() for name in cameras}
        self.dropped, self.out_of_time = dict.fromkeys(cameras, 0), dict.fromkeys(cameras, 0)
        self.cameras_out_of_time: Set[str] = set()
        self._opened: Optional[float] = None  # when the first message of the open update came [s]
        self._last = float('-inf')
        self._updated = float('-inf')
        # stamps of updates, and when their first messages came [s]
        self._past: Deque[Tuple[float, float]] = deque(maxlen=_REMEMBERED)

    @property
    def deadline(self) -> Optional[float]:
        """Time at which `due` has an update, whatever comes [s]; None while no message waits."""
        if self._opened is None:
            return None
        delay = max((camera.delay for camera in self._cameras.values() if self._is_expected(camera, self._opened)),
                    default=0.0)
        return self._opened + min(self._constants.least_wait + delay, self._constants.patience)

    def add(self, sighting: Sighting, now: float) -> List[Update]:
        """Take a sighting; return the updates that are complete by it.

        Args:
            now: time of its arrival, on any clock that only goes forward [s].
        """
        updates: List[Update] = []
        camera = self._cameras[sighting.camera]
        silent, step, elapsed = self._constants.silent, sighting.stamp - self._last, now - self._updated
        if step <= 0 and elapsed > silent:
            self._last = float('-inf')
        # out of time: not near the last update, which may be some time ago; the step is inf without one
        elif step < float('inf') and not -silent <= step <= silent + max(elapsed, 0.0):
            if elapsed <= silent:
                self.cameras_out_of_time.add(sighting.camera)
                self.out_of_time[sighting.camera] += 1
                return []
            self._last = float('-inf')
        if self._last == float('-inf') and self._opened is None:
            # forget what came before, and expect a message of every camera
            for each in self._cameras.values():
                each.pending, each.stamp, each.arrival, each.period = None, float('-inf'), now, 0.0
            self._past.clear()
        if camera.pending is not None:
            if camera.pending.stamp > self._last:
                updates.append(self._flush(now))
            else:
                self.dropped[sighting.camera] += 1
        self._learn(camera, sighting.stamp, now)
        camera.pending, camera.stamp, camera.arrival = sighting, sighting.stamp, now
        if self._opened is None and sighting.stamp > self._last:
            self._opened = now
        return updates + self.due(now)

    def due(self, now: float) -> List[Update]:
        """Return the update that is complete, or has waited long enough; an empty list where there is none."""
        deadline = self.deadline
        if deadline is None or (now < deadline and any(self._is_expected(camera, now)
                                                       for camera in self._cameras.values())):
            return []
        return [self._flush(now)]

    def _learn(self, camera: _Camera, stamp: float, now: float) -> None:
        """Learn how often and how late a camera sends."""
        fading = self._constants.fading
        step = stamp - camera.stamp
        if 0 < step < self._constants.silent:
            # a lost message lengthens a step, nothing shortens it
            camera.period = step if not camera.period else min(step, self._constants.growth * camera.period)
            camera.interval = max(now - camera.arrival, fading * camera.interval)
        opened = [opened for past, opened in self._past if abs(past - stamp) <= self._near]
        if self._opened is not None and abs(self._newest - stamp) <= self._near:
            opened.append(self._opened)
        camera.delay = max(now - opened[-1] if opened else 0.0, fading * camera.delay)

    @property
    def _newest(self) -> float:
        """Return the newest stamp that waits [s]."""
        return max((camera.pending.stamp for camera in self._cameras.values() if camera.pending is not None),
                   default=float('-inf'))

    @property
    def _near(self) -> float:
        """Return how far apart stamps of one time are at most [s]."""
        periods = [camera.period for camera in self._cameras.values() if camera.period]
        return min(self._constants.near * min(periods), self._constants.most_near) if periods else 0.0

    def _is_expected(self, camera: _Camera, now: float) -> bool:
        """Return whether a message of a camera is on its way that belongs to the open update."""
        if now - camera.arrival > max(self._constants.silent, camera.interval):
            return False
        if not camera.period:
            return camera.pending is None
        return camera.stamp + camera.period <= self._newest + self._near

    def _flush(self, now: float) -> Update:
        """Return the update of what waits; those whose stamps are beside those of most are left out.

        What came too late for the update before joins this one where it is near, but does not tell its stamp.
        """
        waiting = sorted((camera.pending for camera in self._cameras.values() if camera.pending is not None),
                         key=lambda sighting: sighting.stamp)
        new = [sighting for sighting in waiting if sighting.stamp > self._last]
        middle = new[(len(new) - 1) // 2].stamp
        sightings = [sighting for sighting in waiting if abs(sighting.stamp - middle) <= self._constants.silent]
        for sighting in waiting:
            self.cameras_out_of_time.discard(sighting.camera)
            self._cameras[sighting.camera].pending = None
            if sighting not in sightings:
                if sighting in new:
                    self.cameras_out_of_time.add(sighting.camera)
                (self.out_of_time if sighting in new else self.dropped)[sighting.camera] += 1
        self._last = max(sighting.stamp for sighting in sightings)
        if self._opened is not None:
            self._past.append((self._last, self._opened))
        self._opened, self._updated = None, now
        return Update(self._last, tuple(sightings))
