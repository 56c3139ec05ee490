"""Constants of measured sizes and of feet."""
from dataclasses import dataclass

import numpy as np

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class SizeConstants:
    """How stature and bones of a person are learnt."""

    least_score: float = constant(
        0.5, 'Keypoints with a lower score may be beside the body: they measure neither sizes nor clothes.')
    least_bones: int = constant(3, 'A stature is measured by at least this many bones at once.', source='chosen')
    most_frames: float = constant(
        30.0, 'A frame counts at least one in this many, so sizes and colours may still change; '
              "an adult's proportions count like so many.", unit='frames')
    known: float = constant(
        0.06, 'Standard deviation that a measured length tends to (where `most_frames` count, half of the way there '
              'from that of proportions), that of the size in the image where the depth of the trunk is sure, and '
              'that of a depth by it.', unit='share')


_FEET = 'rendered, dressed bodies with known toes and heels'


@dataclass(frozen=True, eq=False)
class FootConstants:
    """Toes and heels, see `track.feet`."""

    shape: np.ndarray = constant(
        np.array([[0.20, 0.005, -0.083], [0.153, 0.062, -0.081], [-0.035, 0.0, -0.06]]),
        "Big toe, small toe and heel from the ankle of an adult's left foot: forwards, left, up.", unit='m',
        source=_FEET)
    shape_spread: float = constant(0.015, 'Standard deviation of these per axis.', unit='m', source=_FEET)
    shin_spread: float = constant(0.25, 'Standard deviation per axis of the turn of a foot against its shin.',
                                  unit='rad', source=_FEET)
    turning: float = constant(0.5, 'Growth of the error of the turn of a foot, by the root of the time.',
                              unit='rad/s^0.5')
    reach: float = constant(0.30, 'Keypoints whose ray passes further from the ankle are not of the foot.', unit='m',
                            source='chosen')
    window: float = constant(0.03, 'Half the side of the window around a keypoint; feet are narrow.', unit='m',
                             source='chosen')
    inwards: float = constant(0.15, 'The surface is sampled nearer to the ankle than the keypoint, by this share: '
                                    'beyond the tip of a toe is the floor.')
    under_skin: np.ndarray = constant(
        np.array([0.0, 0.01, 0.035]), 'Depth of big toe, small toe and heel under the surface at their pixels.',
        unit='m', source=_FEET)
    along: float = constant(0.03, 'Error of this depth.', unit='m', source=_FEET)
    support: float = constant(0.3, 'Share of the window that the own surface needs.')
    gate: float = constant(2.5, 'A surface is the own one within so many standard deviations of its expected depth.')
