"""Postures, by the inclinations of trunk, thighs and shins; how far each one holds."""
from typing import Dict, List, NamedTuple

import numpy as np

from openpose_ros_signals.constants import SIGNALS, PostureConstants
from openpose_ros_signals.geometry import LEGS, Body, angle, least, most, ramp, unless_hidden
from openpose_ros_signals.records import POSTURES


class _Leg(NamedTuple):
    """A leg: angles of thigh and shin to straight down, and of the knee [deg]; sigma of the ankle [statures]."""

    thigh: float
    shin: float
    knee: float
    sigma: float


def posture_degrees(body: Body, constants: PostureConstants = SIGNALS.posture) -> Dict[str, float]:
    """Return how far each of `POSTURES` holds, 0 to 1; NaN where the joints do not tell."""
    trunk = angle(body.shoulders - body.hips, body.up)
    heights = body.joints[LEGS[:, 2]] @ body.up
    foot = float(np.nanmin(heights)) if np.isfinite(heights).any() else np.nan
    legs = [leg for leg in (_leg(body, joints) for joints in LEGS) if not np.isnan(leg.knee)]
    if not legs:
        flat = ramp(trunk, constants.lying)
        return dict(dict.fromkeys(POSTURES, np.nan if flat < 1 else 0.0), lying=0.0 if flat == 0 else np.nan)
    crouched = _crouching(body, legs, foot, constants)
    lying = least(ramp(trunk, constants.lying), unless_hidden(1 - crouched),
                  *(ramp(leg.thigh, constants.thigh_not_down) for leg in legs))
    standing = most(*(least(ramp(leg.thigh, constants.thigh_down), ramp(leg.knee, constants.straight_knee))
                      for leg in legs))
    kneeling = least(1 - standing, most(*(_kneeling(leg, constants) for leg in legs)))
    crouching = least(1 - standing, 1 - kneeling, crouched, ramp(trunk, constants.upright))
    sitting = least(1 - standing, 1 - kneeling, 1 - crouching, ramp(trunk, constants.upright),
                    most(*(ramp(leg.thigh, constants.thigh_level) for leg in legs)))
    return {'standing': standing, 'sitting': sitting, 'crouching': crouching, 'kneeling': kneeling, 'lying': lying}


def _leg(body: Body, joints: np.ndarray) -> _Leg:
    hip, knee, ankle = body.joints[joints]
    return _Leg(angle(knee - hip, -body.up), angle(ankle - knee, -body.up), angle(hip - knee, ankle - knee),
                float(np.nan_to_num(body.sigma[joints[2]])) / body.stature)


def _kneeling(leg: _Leg, constants: PostureConstants) -> float:
    seen = 1.0 if leg.sigma <= constants.foot_sigma else np.nan
    return least(seen, ramp(leg.shin, constants.shin_level), ramp(leg.knee, constants.bent_knee),
                 ramp(leg.thigh, constants.over_knee))


def _crouching(body: Body, legs: List[_Leg], foot: float, constants: PostureConstants) -> float:
    """Return how far the hips are low over the feet, the trunk over them, and all knees bent."""
    over = (float(body.hips @ body.up) - foot) / body.stature
    ankles = body.joints[LEGS[:, 2]]
    feet = ankles[np.isfinite(ankles[:, 0])].mean(axis=0)
    lean = body.place - feet
    away = float(np.linalg.norm(lean - (lean @ body.up) * body.up)) / body.stature
    return least(ramp(over, constants.low_hips), ramp(over, constants.off_floor), ramp(away, constants.balance),
                 *(ramp(leg.knee, constants.bent_knee) for leg in legs))
