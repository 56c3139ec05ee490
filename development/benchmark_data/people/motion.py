"""Smooth body motion from a few key frames: path, heading, arms, spine and head; legs follow from the path."""
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from .geometry import unit
from .rig import Pose, Rig

Track = Callable[[float], Any]
Keys = Sequence[Tuple[float, Any]]

# Upper arm and forearm directions (outward, forward, up).
ARMS: Dict[str, Tuple[Tuple[float, float, float], Tuple[float, float, float]]] = {
    'down': ((0.20, 0.02, -1), (0.10, 0.22, -1)),
    'down2': ((0.26, -0.06, -1), (0.16, 0.16, -1)),
    'bent': ((0.22, -0.10, -1), (-0.05, 1, -0.10)),
    'bent_up': ((0.25, 0.10, -1), (0.05, 0.75, 0.75)),
    'lowwave_in': ((0.40, 0.15, -1), (0.10, 0.65, 0.75)),
    'lowwave_out': ((0.45, 0.10, -1), (0.80, 0.45, 0.60)),
    'point_fwd': ((0.12, 1, -0.12), (0.02, 1, 0.02)),
    'point_fwdside': ((0.65, 0.80, -0.05), (0.60, 0.85, 0.05)),
    'chest': ((0.38, 0.30, -1), (-0.80, 0.55, 0.30)),
    'chest_low': ((0.32, 0.20, -1), (-0.65, 0.80, 0.0)),
    'open': ((0.60, 0.35, -0.75), (0.55, 0.80, 0.10)),
    'hip': ((0.85, -0.25, -0.75), (-0.70, 0.25, -0.50)),
    'phone': ((0.35, 0.45, -0.80), (-0.10, 0.25, 1)),
    'chin': ((0.15, 0.45, -1), (-0.35, 0.40, 1)),
    'side_up': ((1, 0.10, 0.30), (0.80, 0.15, 0.75)),
    'lap': ((0.15, 0.25, -1), (-0.20, 1, -0.25)),
    'cross': ((0.22, 0.30, -1), (-0.95, 0.35, 0.12)),
    'reach': ((0.20, 0.75, -0.70), (0.0, 1, -0.05)),
}
LOOSE = ('down', 'down2')  # arms that swing while walking
STEP_RATE = 240.0  # [Hz] of the gait's integration


def track(keys: Keys) -> Track:
    """Return a monotone cubic through (t, value) key frames, constant outside."""
    times, values = np.array([key[0] for key in keys], float), np.array([key[1] for key in keys], float)
    if len(times) == 1:
        return lambda t: values[0]
    curve = PchipInterpolator(times, values, axis=0)
    return lambda t: curve(np.clip(t, times[0], times[-1]))


def direction_track(keys: Keys) -> Track:
    """Return a track of unit vectors. A far turn gets a way point outward and forward, so that no limb whips round."""
    keys = [(t, unit(value)) for t, value in keys]
    way = list(keys[:1])
    for (start, a), (end, b) in zip(keys, keys[1:]):
        cosine = float(a @ b)
        if cosine < 0.2:
            way.append(((start + end) / 2, unit(a + b + (0.2 - cosine) * np.array([0.75, 0.65, 0]))))
        way.append((end, b))
    return track(way)


def walk(points: Sequence[Tuple[float, float]], speed: float, start: float = 0.0) -> List[Tuple[float, Any]]:
    """Return path key frames through points [m] at a constant speed [m/s]."""
    keys: List[Tuple[float, Any]] = [(start, points[0])]
    for a, b in zip(points, points[1:]):
        start += float(np.hypot(b[0] - a[0], b[1] - a[1])) / speed
        keys.append((start, b))
    return keys


class MotionKeys(NamedTuple):
    """Key frames (t [s], value). arms: names of ARMS per side; angles [deg]; path [m]."""

    path: Keys
    yaw: Keys
    arms: Mapping[str, Keys] = {}
    lean: Keys = ((0, 2),)
    twist: Keys = ((0, 0),)
    side: Keys = ((0, 0),)
    head_yaw: Keys = ((0, 0),)
    head_pitch: Keys = ((0, 0),)
    stance: float = 0.06  # feet apart: horizontal part of the unit vector of a leg


class Motion:
    """Walking and standing. The phase of the gait is the integral of the speed, so that feet hardly slide."""

    def __init__(self, rig: Rig, keys: MotionKeys, seed: int = 0, duration: float = 8.0) -> None:
        self.rig, self.stance = rig, keys.stance
        self.path, self.yaw = track(keys.path), track(keys.yaw)
        arms = {side: keys.arms.get(side, [(0, 'down')]) for side in 'LR'}
        self.arms = {side: [direction_track([(t, ARMS[name][k]) for t, name in arms[side]]) for k in (0, 1)]
                     for side in 'LR'}
        self.loose = {side: track([(t, float(name in LOOSE)) for t, name in arms[side]]) for side in 'LR'}
        self.lean, self.twist, self.side = track(keys.lean), track(keys.twist), track(keys.side)
        self.head_yaw, self.head_pitch = track(keys.head_yaw), track(keys.head_pitch)
        rng = np.random.default_rng(seed + 17)
        self.phases, self.rates = rng.uniform(0, 2 * np.pi, 12), rng.uniform(0.25, 0.55, 12)
        self._integrate_gait(duration)

    def _integrate_gait(self, duration: float) -> None:
        self.times = np.arange(-0.5, duration, 1 / STEP_RATE)
        path = np.broadcast_to(np.asarray(self.path(self.times)).reshape(-1, 2), (len(self.times), 2))
        yaw = np.broadcast_to(np.asarray(self.yaw(self.times)), self.times.shape)
        speed = np.linalg.norm(np.gradient(path, 1 / STEP_RATE, axis=0), axis=1)
        turning = np.clip(np.abs(np.gradient(yaw, 1 / STEP_RATE)) / 120, 0, 1)
        kernel = np.hanning(49) / np.hanning(49).sum()

        def smoothed(values: np.ndarray) -> np.ndarray:
            return np.convolve(np.pad(values, 24, mode='edge'), kernel, 'valid')

        self.walking = smoothed(np.clip(speed / 1.1, 0, 1.15))  # amplitude
        self.turning = smoothed(turning) * (1 - np.clip(self.walking, 0, 1))
        step = 2 * self.rig.leg * np.sin(np.deg2rad(24 * np.clip(self.walking, 0.5, 1.15)))
        rate = speed / step * np.pi + smoothed(turning) * 7.0 * (self.walking < 0.35)
        self.phase = np.cumsum(rate) / STEP_RATE + self.phases[0]

    def sway(self, i: int, t: float, amplitude: float) -> float:
        """Return a slow oscillation, as no person stands still."""
        return amplitude * np.sin(2 * np.pi * self.rates[i] * t + self.phases[i])

    def at(self, t: float) -> Pose:
        """Return the pose at t [s]."""
        phase, walking, turning = (float(np.interp(t, self.times, values))
                                   for values in (self.phase, self.walking, self.turning))
        legs, arms = {}, {}
        for side, offset in (('L', 0.0), ('R', np.pi)):
            legs[side] = self._leg(t, phase + offset, walking, turning)
            arms[side] = self._arm(t, side, phase + offset, walking)
        x, y = self.path(t)
        return Pose(
            x=float(x) + self.sway(9, t, 0.010) * (1 - min(walking, 1)), y=float(y),
            yaw=float(self.yaw(t)) + self.sway(10, t, 1.2), arms=arms, legs=legs,
            lean=float(self.lean(t)) + 2.5 * walking, twist=float(self.twist(t)) + 5 * walking * np.sin(phase),
            side=float(self.side(t)) + self.sway(11, t, 0.6), head_yaw=float(self.head_yaw(t)) + self.sway(8, t, 2.5),
            head_pitch=float(self.head_pitch(t)) + self.sway(3, t, 1.5))

    def _leg(self, t: float, phase: float, walking: float, turning: float) -> Tuple[np.ndarray, np.ndarray, float]:
        """Return thigh and shin directions and foot pitch: the thigh swings, the knee bends, the foot rolls."""
        swing = walking * (23 * np.sin(phase) + 3) + turning * (7 * np.sin(phase) + 5) + (1 - walking) * 3
        knee = 6 + walking * 42 * _bump(phase, -0.15, 0.85) + turning * 22 * _bump(phase, 0.4, 0.9)
        foot = walking * (24 * _bump(phase, -1.5, 0.6) - 12 * _bump(phase, 1.45, 0.55)) \
            + turning * 8 * _bump(phase, 0.2, 0.8)
        thigh, shin = np.deg2rad(swing), np.deg2rad(swing - knee)
        outward = (1 - walking) * self.stance + 0.015 + self.sway(1, t, 0.004)
        return (np.array([outward, np.sin(thigh), -np.cos(thigh)]), np.array([outward, np.sin(shin), -np.cos(shin)]),
                foot)

    def _arm(self, t: float, side: str, phase: float, walking: float) -> Tuple[np.ndarray, np.ndarray]:
        """Return upper arm and forearm directions; loose arms swing against the legs."""
        upper, fore = (unit(direction(t)) for direction in self.arms[side])
        loose, left = float(self.loose[side](t)), side == 'L'
        swing = -np.sin(phase) * walking * loose
        upper = np.add(upper, (self.sway(2 + left, t, 0.015), 0.33 * swing + self.sway(4 + left, t, 0.02), 0))
        fore = np.add(fore, (self.sway(6, t, 0.02),
                             0.38 * swing + 0.14 * walking * loose + self.sway(7 + left, t, 0.025), 0))
        return upper, fore


def _bump(phase: float, centre: float, width: float) -> float:
    distance = (phase - centre + np.pi) % (2 * np.pi) - np.pi
    return float(np.exp(-(distance / width) ** 2))
