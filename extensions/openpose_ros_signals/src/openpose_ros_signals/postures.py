"""Postures, by the inclinations of trunk, thighs and shins; how far each one holds."""
from typing import Dict, List, NamedTuple

import numpy as np

from openpose_ros_signals.constants import SIGNALS, PostureConstants
from openpose_ros_signals.geometry import LEGS, Body, angle, least, most, ramp, unless_hidden
from openpose_ros_signals.records import POSTURES


class _Leg(NamedTuple):
    """A leg: how far the thigh is level, the knee bent, and the shin level, 0 to 1; NaN if hidden, or guessed."""

    level: float
    bent: float
    on_knee: float


def posture_degrees(body: Body, constants: PostureConstants = SIGNALS.posture) -> Dict[str, float]:
    """Return how far each of `POSTURES` holds, 0 to 1; NaN where the joints do not tell."""
    upright = ramp(angle(body.shoulders - body.hips, body.up), constants.upright)
    legs = [leg for leg in (_leg(body, joints, constants) for joints in LEGS) if not np.isnan(leg.bent)]
    if not legs:
        return dict(dict.fromkeys(POSTURES, 0.0 if upright == 0 else np.nan), lying=0.0 if upright == 1 else np.nan)
    crouched = _crouching(body, legs, constants)
    lying = least(1 - upright, unless_hidden(1 - crouched), *(leg.level for leg in legs))
    standing = most(*(least(1 - leg.level, 1 - leg.bent) for leg in legs))
    kneeling = least(1 - standing, most(*(least(leg.on_knee, leg.bent, 1 - leg.level) for leg in legs)))
    crouching = least(1 - standing, 1 - kneeling, crouched, upright)
    sitting = least(1 - standing, 1 - kneeling, 1 - crouching, upright, most(*(leg.level for leg in legs)))
    return {'standing': standing, 'sitting': sitting, 'crouching': crouching, 'kneeling': kneeling, 'lying': lying}


def _leg(body: Body, joints: np.ndarray, constants: PostureConstants) -> _Leg:
    hip, knee, ankle = body.joints[joints]
    return _Leg(ramp(angle(knee - hip, -body.up), constants.level_thigh),
                ramp(angle(hip - knee, ankle - knee), constants.bent_knee),
                ramp(angle(ankle - knee, -body.up), constants.level_shin) if body.sure[joints[2]] else np.nan)


def _crouching(body: Body, legs: List[_Leg], constants: PostureConstants) -> float:
    """Return how far the hips are low over the feet, the trunk over them, all knees bent and no shin on the floor."""
    ankles = body.joints[LEGS[:, 2]]
    ankles = ankles[np.isfinite(ankles[:, 0])]
    over = float(body.hips @ body.up - (ankles @ body.up).min()) / body.stature
    lean = body.place - ankles.mean(axis=0)
    away = float(np.linalg.norm(lean - (lean @ body.up) * body.up)) / body.stature
    return least(ramp(over, constants.low_hips), ramp(away, constants.balance),
                 *(least(leg.bent, unless_hidden(1 - leg.on_knee)) for leg in legs))
