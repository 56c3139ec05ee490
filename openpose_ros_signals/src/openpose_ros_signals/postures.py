"""Postures, by the inclinations of trunk, thighs and shins; how far each one holds."""
from typing import Dict

import numpy as np

from openpose_ros_signals.constants import PostureConstants
from openpose_ros_signals.geometry import LEGS, Body, angle, ramp

POSTURES = ('standing', 'sitting', 'crouching', 'kneeling', 'lying')


def posture_degrees(body: Body, constants: PostureConstants) -> Dict[str, float]:
    """Return how far each posture holds, 0 to 1; NaN where the joints do not tell."""
    trunk = angle(body.shoulders - body.hips, body.up)
    upright = ramp(trunk, constants.upright)
    legs = [_leg(body, leg, constants) for leg in LEGS]
    known = [leg for leg in legs if not np.isnan(leg['standing'])]
    result = {'lying': ramp(trunk, constants.lying)}
    for posture in POSTURES[:-1]:
        of_legs = [leg[posture] for leg in known]
        # of one knee down and one up is kneeling; who stands has both legs straight
        both = min(of_legs, default=np.nan) if posture == 'standing' else max(of_legs, default=np.nan)
        result[posture] = min(upright, both) if upright > 0 and not np.isnan(both) else (0.0 if upright == 0 else both)
    return result


def _leg(body: Body, leg: np.ndarray, constants: PostureConstants) -> Dict[str, float]:
    """Return how far each posture holds by one leg: hip, knee, ankle."""
    hip, knee, ankle = body.joints[leg]
    thigh, shin = angle(knee - hip, -body.up), angle(ankle - knee, -body.up)
    bend = angle(hip - knee, ankle - knee)
    near = float(np.linalg.norm(hip - ankle)) / body.stature
    standing = min(ramp(thigh, constants.thigh_down), ramp(bend, constants.straight_knee))
    kneeling = min(ramp(shin, constants.shin_level), ramp(bend, constants.bent_knee), 1 - ramp(thigh, (75.0, 95.0)))
    crouching = min(ramp(near, constants.hip_to_ankle), ramp(bend, constants.bent_knee), 1 - kneeling)
    sitting = min(ramp(thigh, constants.thigh_level), 1 - kneeling, 1 - crouching)
    return {'standing': standing, 'sitting': sitting, 'crouching': crouching, 'kneeling': kneeling}
