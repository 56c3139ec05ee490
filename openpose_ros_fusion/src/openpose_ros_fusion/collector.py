"""Which people of several cameras make one update: common stamps for cameras of any rates, that come and go.

An update leaves as soon as every camera whose next message belongs to it has sent one, and after `patience` at the
latest. Its stamp is the newest of its messages; what was seen a little earlier is moved to it by the fusion. So a slow
camera never slows down the others, and a camera that has died costs `patience` until it counts as silent.

A camera whose stamps are beside those of the others is out of time: its messages are dropped, unless no other camera
sends any, as when a recording begins anew.
"""
from dataclasses import dataclass
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from openpose_ros_fusion.constants import FUSION, CollectorConstants
from openpose_ros_fusion.sightings import Sighting


class Update(NamedTuple):
    """What the fusion gets at a time: the stamp [s], and of each camera one sighting at most."""

    stamp: float
    sightings: Tuple[Sighting, ...]


@dataclass
class _Camera:
    """Messages of one camera.

    Attributes:
        pending: waits for the next update.
        stamp: of its newest message [s].
        arrival: time at which that came [s].
        period: between its messages [s]; 0 while unknown.
        dropped: messages that were replaced by newer ones before an update.
        out_of_time: messages that were left out.
        is_out_of_time: whether the newest one was.
    """

    pending: Optional[Sighting] = None
    stamp: float = float('-inf')
    arrival: float = float('-inf')
    period: float = 0.0
    dropped: int = 0
    out_of_time: int = 0
    is_out_of_time: bool = False


class Collector:
    """Gathers sightings for updates; not thread-safe.

    Args:
        cameras: names of all that may send.
        patience: longest time that a message waits for those of other cameras [s].
        constants: the other numbers.
    """

    def __init__(self, cameras: Sequence[str], patience: float, constants: CollectorConstants = FUSION.collector
                 ) -> None:
        self.patience, self._constants = patience, constants
        self._cameras = {name: _Camera() for name in cameras}
        self._begun: Optional[float] = None
        self._last = float('-inf')
        self._updated = float('-inf')

    @property
    def dropped(self) -> Dict[str, int]:
        """Messages by camera that were replaced by newer ones before an update."""
        return {name: camera.dropped for name, camera in self._cameras.items()}

    @property
    def out_of_time(self) -> Dict[str, int]:
        """Messages by camera that were left out, as their stamps are beside those of the others."""
        return {name: camera.out_of_time for name, camera in self._cameras.items()}

    def is_out_of_time(self, camera: str) -> bool:
        """Return whether the newest message of a camera was left out for its stamp."""
        return self._cameras[camera].is_out_of_time

    @property
    def deadline(self) -> Optional[float]:
        """Time at which `due` has an update, whatever comes [s]; None while nothing waits."""
        return None if self._begun is None else self._begun + self.patience

    def add(self, sighting: Sighting, now: float) -> List[Update]:
        """Take a sighting; return the updates that are complete by it.

        Args:
            now: time of its arrival, on any clock that only goes forward [s].
        """
        updates: List[Update] = []
        camera = self._cameras[sighting.camera]
        if sighting.stamp <= self._last and now - self._updated > self._constants.reset:
            self._last = float('-inf')
        elif not self._in_time(sighting.stamp, now):
            if now - self._updated <= self._constants.reset:
                camera.is_out_of_time = True
                camera.out_of_time += 1
                return []
            self._last = float('-inf')
        if self._last == float('-inf') and self._begun is None:
            self._begin(now)
        if camera.pending is not None:
            if camera.pending.stamp > self._last:
                updates.append(self._flush(now))
            else:
                camera.dropped += 1
        step = sighting.stamp - camera.stamp
        if 0 < step < self._constants.silent:
            # a lost message lengthens a step, nothing shortens it
            camera.period = step if not camera.period else min(step, self._constants.growth * camera.period)
        camera.pending, camera.stamp, camera.arrival = sighting, sighting.stamp, now
        if self._begun is None and sighting.stamp > self._last:
            self._begun = now
        return updates + self.due(now)

    def due(self, now: float) -> List[Update]:
        """Return the update that is complete, or has waited long enough; an empty list where there is none."""
        if self._begun is None or (now < self._begun + self.patience and self._expects(now)):
            return []
        return [self._flush(now)]

    def _in_time(self, stamp: float, now: float) -> bool:
        """Return whether a stamp is near the last update, which may be some time ago."""
        if self._last == float('-inf'):
            return True
        apart, elapsed = stamp - self._last, now - self._updated
        return -self._constants.reset <= apart <= self._constants.reset + max(elapsed, 0.0)

    def _begin(self, now: float) -> None:
        """Forget what came before, and expect something of every camera."""
        for camera in self._cameras.values():
            camera.pending, camera.stamp, camera.arrival, camera.period = None, float('-inf'), now, 0.0

    def _expects(self, now: float) -> bool:
        """Return whether a message of another camera is on its way that belongs to the open update."""
        newest = max(camera.pending.stamp for camera in self._cameras.values() if camera.pending is not None)
        periods = [camera.period for camera in self._cameras.values() if camera.period]
        near = self._constants.near * min(periods) if periods else 0.0
        return any(camera.pending is None and now - camera.arrival <= self._constants.silent
                   and camera.stamp + camera.period <= newest + near for camera in self._cameras.values())

    def _flush(self, now: float) -> Update:
        """Return the update of what waits; those whose stamps are beside those of most are left out."""
        waiting = sorted((camera for camera in self._cameras.values() if camera.pending is not None),
                         key=lambda camera: camera.stamp)
        middle = waiting[(len(waiting) - 1) // 2].stamp
        sightings = [camera.pending for camera in waiting
                     if camera.pending is not None and abs(camera.stamp - middle) <= self._constants.reset]
        for camera in waiting:
            camera.is_out_of_time = camera.pending not in sightings
            camera.out_of_time += camera.is_out_of_time
            camera.pending = None
        self._begun, self._updated, self._last = None, now, max(sighting.stamp for sighting in sightings)
        return Update(self._last, tuple(sightings))
