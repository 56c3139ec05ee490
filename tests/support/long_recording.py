"""A recording of people who walk in circles, wave and sit down, as the page of a recording reads it."""
import numpy as np

from animated_skeleton import SITTING, Limb, Pose, between, joints_of
from known_tables import known_table
from openpose_ros_signals.records import Facing, Gesture, PersonSignals, Posture, Walk
from openpose_ros_tools.report.recording import Recording
from openpose_ros_tools.tables.keypoint_selection import select
from openpose_ros_tools.tables.signal_timeline import SignalFrame
from skeleton_extract_3d.people import INFERRED

BEGIN = 1_700_000_000
UP = np.array([0.0, 0.0, 1.0])
# Of what a person does [s]: it walks a circle, waves, and sits.
PERIOD, WAVES, SITS = 20, 12, 16
_NOISE = 0.01  # of joints [m]
_RAISED = (Limb((0.4, 0.5, -0.5), (-0.35, 0.2, 1.0)), Limb((0.4, 0.5, -0.5), (0.6, 0.2, 1.0)))


def pose_at(phase: float, person: int) -> Pose:
    """Return what a person does at a time of its period."""
    turn = 2 * np.pi * min(phase / WAVES, 1.0) + person
    at = {'place': (3.0 + 1.2 * person + 0.8 * np.cos(turn), 1.5 * (person - 2) + 0.8 * np.sin(turn)),
          'facing': float(np.degrees(turn)) + 90}
    if phase < WAVES:
        swing = 0.4 * np.sin(2 * np.pi * 0.75 * phase)
        return Pose(left_leg=Limb((0, swing, -1), (0, swing - 0.1, -1)),
                    right_leg=Limb((0, -swing, -1), (0, -swing - 0.1, -1)), **at)
    if phase < SITS:
        first, second = (Pose(right=arm, **at) for arm in _RAISED)
        return between(first, second, 0.5 - 0.5 * np.cos(2 * np.pi * 1.5 * phase))
    return Pose(left_leg=SITTING.left_leg, right_leg=SITTING.right_leg, **at)


def long_recording(seconds: float, rate: int = 15, people: int = 3, name: str = 'long.bag', word: str = 'wave'
                   ) -> Recording:
    """Return a recording; a fifth of the joints is inferred. `word`: name of the gesture."""
    noise, frames = np.random.default_rng(1), round(seconds * rate)
    cycle = np.array([[joints_of(pose_at(step / rate, person)) for person in range(1, people + 1)]
                      for step in range(min(PERIOD * rate, frames))])
    joints = np.concatenate([cycle] * (frames // len(cycle) + 1))[:frames].reshape(-1, 18, 3)
    stamps = BEGIN * 10 ** 9 + np.arange(frames) * 10 ** 9 // rate
    table = known_table(np.repeat(stamps, people), np.tile(np.arange(1, people + 1), frames),
                        joints + noise.normal(0, _NOISE, joints.shape))
    table.status[(table.status != 0) & (noise.random(table.status.shape) < 0.2)] = INFERRED
    table.sigma[:] = np.where(table.status == 0, np.nan, noise.uniform(0.02, 0.1, table.sigma.shape))
    signals = [SignalFrame(stamp * 1e-9, tuple(_signals(number, step / rate % PERIOD, stamp * 1e-9, noise, word)
                                               for number in range(1, people + 1)))
               for step, stamp in enumerate(stamps.tolist())]
    return Recording(name, '2023-11-14 22:13:20 UTC', select(table), signals, UP)


def _signals(person: int, phase: float, stamp: float, noise: np.random.Generator, word: str) -> PersonSignals:
    way = noise.normal(size=3)
    facing = Facing(way / np.linalg.norm(way), 0.1)
    begin = stamp - phase
    posture = Posture('sitting', begin + SITS, 0.9) if phase >= SITS else Posture('standing', begin, 0.9)
    gestures = (Gesture(word, 'right', begin + WAVES, 0.8),) if WAVES <= phase < SITS else ()
    return PersonSignals(person, noise.normal(size=3), posture, gestures, facing, facing,
                         Walk(phase < WAVES, abs(noise.normal(0.8, 0.1)) * (phase < WAVES), np.zeros(3)))
