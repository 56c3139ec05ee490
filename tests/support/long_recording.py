"""A recording of people who walk in circles, wave and sit down, as the page of a recording reads it."""
import numpy as np

from animated_skeleton import SITTING, Limb, Pose, between, joints_of
from known_tables import known_table
from openpose_ros_tools.report.recording import Recording
from openpose_ros_tools.tables.keypoint_selection import select
from openpose_ros_tools.tables.signal_timeline import computed_signals
from skeleton_extract_3d.people import INFERRED

BEGIN = 1_700_000_000.0
UP = np.array([0.0, 0.0, 1.0])
_PERIOD = 20.0  # of what a person does [s]
_NOISE = 0.01  # of joints [m]
_RAISED = (Limb((0.4, 0.5, -0.5), (-0.35, 0.2, 1.0)), Limb((0.4, 0.5, -0.5), (0.6, 0.2, 1.0)))
_STRIDE = 1.6  # [m]


def pose_at(time: float, person: int) -> Pose:
    """Return what a person does: 12 s of walking in a circle, 4 s of waving, 4 s of sitting."""
    phase = (time + 3.0 * person) % _PERIOD
    turn = 0.4 * (time - phase + min(phase, 12.0)) + 2 * person
    place = (3.0 + 1.2 * person + 0.8 * np.cos(turn), 1.5 * (person - 2) + 0.8 * np.sin(turn))
    facing = float(np.degrees(turn)) + 90
    if phase < 12:
        swing = 0.4 * np.sin(2 * np.pi * 0.32 * time * 2 / _STRIDE)
        legs = {'left_leg': Limb((0, swing, -1), (0, swing - 0.1, -1)), 'right_leg': Limb((0, -swing, -1), (0, -swing - 0.1, -1))}
        return Pose(place=place, facing=facing, **legs)
    if phase < 16:
        share = 0.5 - 0.5 * np.cos(2 * np.pi * 1.5 * phase)
        first, second = (Pose(right=arm, place=place, facing=facing) for arm in _RAISED)
        return between(first, second, share)
    return Pose(left_leg=SITTING.left_leg, right_leg=SITTING.right_leg, place=place, facing=facing)


def long_recording(seconds: float, rate: float = 15.0, people: int = 3, name: str = 'long.bag', seed: int = 1) -> Recording:
    """Return a recording; a fifth of the joints is inferred."""
    noise = np.random.default_rng(seed)
    times = np.arange(round(seconds * rate)) / rate
    rows = [(round((BEGIN + time) * 1e9), person, joints_of(pose_at(time, person)))
            for time in times for person in range(1, people + 1)]
    stamps, ids, joints = (np.array(column) for column in zip(*rows))
    table = known_table(stamps, ids, joints + noise.normal(0, _NOISE, joints.shape))
    inferred = (table.status != 0) & (noise.random(table.status.shape) < 0.2)
    table.status[inferred] = INFERRED
    table.sigma[:] = np.where(table.status == 0, np.nan, noise.uniform(0.02, 0.1, table.sigma.shape))
    return Recording(name, '2023-11-14 22:13:20 UTC', select(table), list(computed_signals(table, UP)), UP)
