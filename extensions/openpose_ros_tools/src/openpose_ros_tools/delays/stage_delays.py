"""Delays of the frames of a recording at each stage of the chain: camera, 2D, 3D, markers.

A stage is a topic; a message belongs to the frame with its stamp, and arrives when the recorder gets it (its time in
the bag). All times are int64 nanoseconds, all durations float64 seconds.
"""
from dataclasses import dataclass
from typing import Dict, List, Mapping, Sequence, Tuple

import numpy as np

# Roles of topics in the order of the chain; those before TAKEN are of the camera, those after it are results.
IMAGE, DEPTH, CLOUD, TAKEN = 'image', 'depth', 'cloud', 'taken'
PEOPLE_2D, PEOPLE_3D, MARKERS, DRAWN = 'people_2d', 'people_3d', 'markers', 'drawn'
ROLES: Dict[str, str] = {IMAGE: 'colour image', DEPTH: 'depth image', CLOUD: 'point cloud', TAKEN: 'input taken',
                         PEOPLE_2D: 'people in 2D', PEOPLE_3D: 'people in 3D', MARKERS: 'markers',
                         DRAWN: 'annotated image'}
CAMERA_ROLES = (IMAGE, DEPTH, CLOUD)
RESULT_ROLES = (PEOPLE_2D, PEOPLE_3D, MARKERS, DRAWN)
# The step to a stage begins at the first of these stages that the recording has. CAMERA: all camera messages of the
# frame have arrived.
CAMERA = 'camera'
_BEFORE = {TAKEN: (CAMERA,), PEOPLE_2D: (TAKEN, CAMERA), PEOPLE_3D: (PEOPLE_2D, TAKEN, CAMERA),
           MARKERS: (PEOPLE_3D, PEOPLE_2D), DRAWN: (PEOPLE_3D, PEOPLE_2D)}

# Stamps that differ from the recorder's clock by this time [s] are of another clock, as of a recording that is played:
# the chain drops frames rather than fall behind by seconds.
_ANOTHER_TIME = 10.0
# Share of messages with the time of their stamp or of another message, from which on a program has written the bag: a
# recorder never gets a message in the nanosecond of its stamp, or two in the same one.
_WRITTEN_SHARE = 0.9
_WRITTEN_NOTE = (
    "No live recording: the results have exactly the time of their stamp, of the camera's message or of each other, as "
    'process_bag and csv_to_bag write them. They tell no delays of a live chain; for these, record the topics with '
    '`rosbag record` while the nodes are running.')
_NO_CAMERA_NOTE = (
    'No camera topic with the stamps of these results was recorded: shares are of the frames that had any result.')
# Share of messages with the time of another message, from which on the clock was simulated: it moves in steps.
_SIMULATED_SHARE = 0.2


@dataclass(frozen=True)
class Stage:
    """The frames of a topic."""

    topic: str  # its name
    role: str  # key of ROLES
    stamps: np.ndarray  # (F,) int64 [ns], of the camera; ascending, each once
    # (F,) int64 [ns], when the last message of that stamp was recorded: then the frame is complete
    arrivals: np.ndarray
    messages: int  # their number; several per frame where there is one per person
    frame_id: str = ''  # of the first message
    unstamped: int = 0  # messages that have no stamp (zero); they belong to no frame

    @classmethod
    def of_messages(cls, topic: str, role: str, stamps: Sequence[int], arrivals: Sequence[int],
                    frame_id: str = '') -> 'Stage':
        """Return the stage of a topic's messages.

        Args:
            stamps, arrivals: (M,) [ns] of each message, in any order.
        """
        stamped = np.asarray(stamps, np.int64) > 0
        frames, number = np.unique(np.asarray(stamps, np.int64)[stamped], return_inverse=True)
        last = np.full(len(frames), np.iinfo(np.int64).min)
        np.maximum.at(last, number, np.asarray(arrivals, np.int64)[stamped])
        return cls(topic, role, frames, last, len(stamps), frame_id, int((~stamped).sum()))

    @property
    def repeated(self) -> int:
        """Messages beyond the first of their stamp."""
        return self.messages - self.unstamped - len(self.stamps)

    @property
    def delays(self) -> np.ndarray:
        """(F,) float64 [s], from the stamp to the arrival."""
        return (self.arrivals - self.stamps) * 1e-9

    @property
    def rate(self) -> float:
        """Frames per second between the first and the last arrival [Hz]; NaN of less than two."""
        if len(self.arrivals) < 2:
            return float('nan')
        span = (self.arrivals.max() - self.arrivals.min()) * 1e-9
        return (len(self.arrivals) - 1) / span if span > 0 else float('nan')


@dataclass(frozen=True)
class Spread:
    """Statistics of durations [s]; NaN of none. p95: 95 % are at most this, linearly interpolated."""

    count: int
    median: float
    mean: float
    p95: float
    greatest: float
    least: float

    @classmethod
    def of(cls, seconds: np.ndarray) -> 'Spread':
        """Return the statistics of an array of any shape; NaN in it is left out."""
        known = seconds[np.isfinite(seconds)]
        if not len(known):
            return cls(0, *[float('nan')] * 5)
        return cls(len(known), *(float(value) for value in (
            np.median(known), known.mean(), np.percentile(known, 95), known.max(), known.min())))


@dataclass(frozen=True)
class Chain:
    """The stages of one camera's frames."""

    namespace: str  # of the results, as /openpose_ros/skeleton_3d
    stages: Tuple[Stage, ...]  # (S) in the order of ROLES
    frames: np.ndarray  # (N,) int64 [ns] stamps of all frames, ascending
    # (N, S) int64 [ns] that each frame has at each stage: image and cloud of a frame may differ; 0 where the frame did
    # not reach the stage
    stamps: np.ndarray
    arrivals: np.ndarray  # (N, S) int64 [ns] of each frame at each stage, 0 where it did not reach it
    counted_from: str  # what delays begin at: 'stamp', or 'arrival' of the frame's first camera message
    is_live: bool  # False where a program wrote the results into the bag, so that their times are no delays
    notes: Tuple[str, ...]  # what a reader of the numbers has to know

    @property
    def reached(self) -> np.ndarray:
        """(N, S) bool: the frame was recorded at that stage."""
        return self.stamps > 0

    @property
    def delays(self) -> np.ndarray:
        """(N, S) float64 [s]; NaN where a frame did not reach a stage, all of them where the chain is not live."""
        begin = self.stamps
        if self.counted_from == 'arrival':
            begin = _first(self.arrivals[:, _of_camera(self.stages)])[:, None]
        known = self.reached & (begin > 0) & self.is_live
        return np.where(known, (self.arrivals - begin) * 1e-9, np.nan)

    @property
    def shares(self) -> np.ndarray:
        """(S,) float64, of the frames that reached each stage; NaN without frames."""
        return self.reached.sum(axis=0) / (len(self.frames) or np.nan)

    @property
    def main_stages(self) -> Tuple[int, ...]:
        """One stage of each role: the one that has most frames, of equal ones the first."""
        best: Dict[str, int] = {}
        for number, stage in enumerate(self.stages):
            if stage.role not in best or len(stage.stamps) > len(self.stages[best[stage.role]].stamps):
                best[stage.role] = number
        return tuple(best[role] for role in ROLES if role in best)

    @property
    def seconds(self) -> np.ndarray:
        """(N,) float64 [s], stamps of the frames since the first."""
        return (self.frames - self.frames[:1]) * 1e-9


@dataclass(frozen=True)
class Step:
    """What a frame took from one stage to the next."""

    before: str  # role at which it begins, or CAMERA
    after: str  # role at which it ends
    seconds: np.ndarray  # (N,) float64 of each frame; NaN where it did not reach both

    @property
    def before_name(self) -> str:
        """Name of the stage at which it begins."""
        return ROLES.get(self.before, 'camera topics')


def build_chains(results: Mapping[str, Sequence[Stage]], cameras: Sequence[Stage], simulated: bool = False,
                 counted_from: str = 'auto') -> Tuple[Chain, ...]:
    """Return one chain for each namespace of results.

    A camera topic belongs to the results that carry its stamps, of equal ones to those with its frame_id.

    Args:
        results: stages of TAKEN and RESULT_ROLES by namespace.
        cameras: stages of CAMERA_ROLES.
        simulated: the recording holds a simulated clock.
        counted_from: 'stamp', 'arrival', or 'auto': from the stamp unless the clocks differ.
    """
    owners = {camera.topic: _owners(camera, results) for camera in cameras}
    chains = []
    for namespace, stages in results.items():
        own = [camera for camera in cameras if namespace in owners[camera.topic]]
        chains.append(_chain(namespace, own, stages, simulated, counted_from))
    return tuple(chains)


def cameras_of_none(results: Mapping[str, Sequence[Stage]], cameras: Sequence[Stage]) -> Tuple[Stage, ...]:
    """Return the camera topics of whose frames there is no result."""
    return tuple(camera for camera in cameras if not _owners(camera, results))


def steps(chain: Chain) -> Tuple[Step, ...]:
    """Return the steps between the stages of a chain; none where it is not live."""
    if not chain.is_live:
        return ()
    arrivals = {chain.stages[number].role: chain.arrivals[:, number] for number in chain.main_stages}
    camera = _of_camera(chain.stages)
    if camera.any():
        # 0 where one of them is missing: the frame was never complete
        own = chain.arrivals[:, camera]
        arrivals[CAMERA] = np.where((own > 0).all(axis=1), own.max(axis=1), 0)
    found = []
    for after in _BEFORE:
        before = next((role for role in _BEFORE[after] if role in arrivals), None)
        if after in arrivals and before is not None:
            both = (arrivals[before] > 0) & (arrivals[after] > 0)
            found.append(Step(before, after, np.where(both, (arrivals[after] - arrivals[before]) * 1e-9, np.nan)))
    return tuple(found)


def _of_camera(stages: Sequence[Stage]) -> np.ndarray:
    """(S,) bool: which stages are topics of the camera."""
    return np.array([stage.role in CAMERA_ROLES for stage in stages], bool)


def _first(arrivals: np.ndarray) -> np.ndarray:
    """Return the first arrival of each frame, (N,) int64; 0 where there is none."""
    none = np.iinfo(np.int64).max
    first = np.where(arrivals > 0, arrivals, none).min(axis=1, initial=none)
    return np.where(first == none, 0, first)


def _owners(camera: Stage, results: Mapping[str, Sequence[Stage]]) -> List[str]:
    """Return the namespaces that a camera topic belongs to."""
    shares = {namespace: max((np.isin(stage.stamps, camera.stamps).mean() for stage in stages if len(stage.stamps)),
                             default=0.0) for namespace, stages in results.items()}
    best = max(shares.values(), default=0.0)
    found = [namespace for namespace, share in shares.items() if share > 0 and share >= 0.5 * best]
    same_frame = [namespace for namespace in found if camera.frame_id in {s.frame_id for s in results[namespace]}]
    return same_frame or found


def _chain(namespace: str, cameras: Sequence[Stage], results: Sequence[Stage], simulated: bool,
           counted_from: str) -> Chain:
    order = list(ROLES)
    stages = tuple(sorted([*cameras, *results], key=lambda stage: order.index(stage.role)))
    frames = _frames(cameras, results)
    pairs = [_by_frame(stage, frames) for stage in stages]
    stamps, arrivals = (np.stack([pair[side] for pair in pairs], axis=1) for side in (0, 1))
    camera = _of_camera(stages)
    live = not _is_written(stamps, arrivals, camera, simulated)
    # the clocks are compared by those of the camera, which has nothing to compute
    delays = np.concatenate([stage.delays for stage in cameras or results])
    if not cameras:
        counted_from = 'stamp'
    elif counted_from == 'auto':
        clocks_differ = len(delays) > 0 and not 0 <= np.median(delays) <= _ANOTHER_TIME
        counted_from = 'arrival' if clocks_differ else 'stamp'
    lost = int((arrivals[:, camera] == 0).all(axis=1).sum())
    notes = [
        *([] if live else [_WRITTEN_NOTE]),
        *([] if cameras else [_NO_CAMERA_NOTE]),
        *([_simulated_note(stages)] if live and (simulated or _in_steps(stages)) else []),
        *(_clock_notes(stages, delays, counted_from) if live else []),
        *([_lost_note(lost, len(frames))] if cameras and lost else []),
        *[f'{stage.unstamped} of {stage.messages} messages on {stage.topic} have no stamp: they belong to no frame.'
          for stage in stages if stage.unstamped],
        *[f'Frames of {stage.topic} come again with the same stamp ({stage.repeated} messages), as if played in a '
          'loop: the last of them count.' for stage in cameras if stage.repeated]]
    return Chain(namespace, stages, frames, stamps, arrivals, counted_from, live, tuple(notes))


def _frames(cameras: Sequence[Stage], results: Sequence[Stage]) -> np.ndarray:
    """Return the stamps of all frames, (N,) int64: those of the camera topic that most results come from, and those of
    later results that are near none of them; earlier ones are of frames from before the recording."""
    of_results = np.unique(np.concatenate([stage.stamps for stage in results]))
    if not cameras:
        return of_results
    camera = max(cameras, key=lambda stage: (np.isin(stage.stamps, of_results).sum(), len(stage.stamps)))
    later = of_results[of_results > camera.stamps[0]]
    return np.union1d(camera.stamps, later[_nearest(later, camera.stamps) < 0])


def _nearest(stamps: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return for each stamp the number of the frame that it belongs to, (F,) int64, -1 for none.

    That is the nearest one, within half of the median period: image and cloud of a frame may differ in their stamps.
    """
    if not len(frames):
        return np.full(len(stamps), -1)
    right = np.clip(np.searchsorted(frames, stamps), 0, len(frames) - 1)
    left = np.maximum(right - 1, 0)
    nearest = np.where(np.abs(frames[left] - stamps) < np.abs(frames[right] - stamps), left, right)
    reach = np.median(np.diff(frames)) / 2 if len(frames) > 1 else 0
    return np.where(np.abs(frames[nearest] - stamps) <= reach, nearest, -1)


def _by_frame(stage: Stage, frames: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return stamps and arrivals of a stage for each frame, (N,) int64 each, 0 where it has none."""
    stamps, arrivals = np.zeros((2, len(frames)), np.int64)
    number = _nearest(stage.stamps, frames)
    near = np.flatnonzero(number >= 0)
    # the nearest of several comes last, and stays
    near = near[np.argsort(-np.abs(frames[number[near]] - stage.stamps[near]), kind='stable')]
    stamps[number[near]], arrivals[number[near]] = stage.stamps[near], stage.arrivals[near]
    return stamps, arrivals


def _is_written(stamps: np.ndarray, arrivals: np.ndarray, camera: np.ndarray, simulated: bool) -> bool:
    """Return whether a program wrote the results: with the time of the stamp or of the camera's message, or all
    results of a frame with one time, which a simulated clock gives as well."""
    results, reached = arrivals[:, ~camera], stamps[:, ~camera] > 0
    same = (results == stamps[:, ~camera]) | (results[:, :, None] == arrivals[:, None, camera]).any(axis=2)
    if not simulated:
        # each is equal to itself
        same |= (results[:, :, None] == results[:, None, :]).sum(axis=2) > 1
    return bool(reached.any() and (same & reached).sum() >= _WRITTEN_SHARE * reached.sum())


def _in_steps(stages: Sequence[Stage]) -> bool:
    """Return whether many frames of different stages were recorded at one time, as with a simulated clock."""
    times = np.concatenate([stage.arrivals for stage in stages])
    return len(times) > 1 and 1 - len(np.unique(times)) / len(times) > _SIMULATED_SHARE


def _simulated_note(stages: Sequence[Stage]) -> str:
    """Return what simulated time means for the numbers."""
    gaps = np.diff(np.unique(np.concatenate([stage.arrivals for stage in stages])))
    step = f'steps of {1e-6 * gaps.min():.3g} ms' if len(gaps) else 'steps'
    return (f'Recorded in simulated time (use_sim_time), which goes in {step}: delays are no finer, may be negative by '
            'a step, and with `rosbag play --rate R` they are R times the real ones.')


def _clock_notes(stages: Sequence[Stage], delays: np.ndarray, counted_from: str) -> List[str]:
    """Return notes on stamps that disagree with the recorder's clock.

    Args:
        delays: [s] by which the clocks are compared.
    """
    from_arrival = "Delays are counted from the arrival of the frame's first camera message instead."
    median = float(np.median(delays)) if len(delays) else 0.0
    if abs(median) > _ANOTHER_TIME:
        side = 'before' if median > 0 else 'after'
        counting = {'arrival': from_arrival,
                    'stamp': 'Delays from the stamp tell nothing; the steps between the stages do.'}[counted_from]
        return [f'The stamps are {_long_time(abs(median))} {side} the time at which they were recorded: the camera '
                'topics came from a recording that was played without its clock, or the clocks of the computers '
                f'differ. {counting}']
    negative = np.concatenate([stage.delays for stage in stages]) < 0
    if not negative.any():
        return []
    ahead = min((stage for stage in stages if len(stage.stamps)), key=lambda stage: float(stage.delays.min()))
    counting = {'arrival': from_arrival,
                'stamp': 'Delays from the stamp are too small by at least this.'}[counted_from]
    return [f'{100 * np.mean(negative):.2g} % of the messages were recorded before their stamp, by up to '
            f"{-1000 * ahead.delays.min():.3g} ms ({ahead.topic}): the clock that stamps is ahead of the recorder's, "
            f'or the driver stamps into the future. {counting}']


def _lost_note(lost: int, frames: int) -> str:
    return (f'{lost} of {frames} frames have results, but no message of a camera topic in the bag: the recorder lost '
            'these, and may have lost results as well. Record without clouds, or with a larger `--buffsize`.')


def _long_time(seconds: float) -> str:
    for unit, length in (('days', 86400.0), ('h', 3600.0), ('min', 60.0)):
        if seconds >= 2 * length:
            return f'{seconds / length:.1f} {unit}'
    return f'{seconds:.1f} s'
