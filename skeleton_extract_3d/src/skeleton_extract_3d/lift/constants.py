"""Constants of the way from keypoints and points to joints in space, step by step."""
from dataclasses import dataclass
from functools import cached_property
from typing import Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from skeleton_extract_3d.body.body import by_joint

_WORLDS = 'BlazePose full on the rays of keypoints in rendered scenes with known joints'


@dataclass(frozen=True)
class WindowConstants:
    """The window of points around a keypoint."""

    half_side: float = constant(0.045, 'Half the side of the window, about the error of a keypoint.', unit='m')
    limits: Tuple[float, float] = constant(
        (1.5, 40.0), 'Limits of half the side in the image; the first one is that of people of unknown size.',
        unit='px', source='chosen')
    spread: float = constant(0.6, 'Standard deviation of the Gaussian weights of the samples.', unit='half sides')

    @cached_property
    def offsets(self) -> np.ndarray:
        """(5,) places of the rows and columns of samples in the window [half sides]: near people cost no more."""
        return np.linspace(-1.0, 1.0, 5)

    @cached_property
    def weights(self) -> np.ndarray:
        """(25,) weights of the samples, row by row, with sum 1."""
        squares = self.offsets ** 2
        weights = np.exp(-(squares[:, None] + squares) / (2 * self.spread ** 2)).ravel()
        return weights / weights.sum()


@dataclass(frozen=True, eq=False)
class TrunkConstants:
    """Depth of the trunk, by the samples of all joints, the size in the image, and the time before."""

    nearest: float = constant(0.35, 'Least depth that is considered, of trunk and joints.', unit='m', source='chosen')
    furthest: float = constant(12.0, 'Greatest depth that is considered.', unit='m', source='chosen')
    step: float = constant(0.04, 'Step from depth to depth, of the logarithm.', unit='share', source='chosen')
    reach: float = constant(
        0.35, "Most surfaces of a body are within this distance of the trunk's depth; what lies further behind a joint "
              'does not hide it.', unit='m')
    front: float = constant(0.12, 'Likelihood of a surface in front of the body: the joint is occluded.')
    behind: float = constant(0.03, 'Likelihood of a surface behind the body: the keypoint lies beside it.')
    foreshortening: float = constant(
        0.15, 'Even the second longest bone may be turned out of the image plane by this much.', unit='share')

    @cached_property
    def depths(self) -> np.ndarray:
        """(depths,) candidates of the trunk [m]."""
        return np.exp(np.arange(np.log(self.nearest), np.log(self.furthest), self.step))

    @cached_property
    def low(self) -> np.ndarray:
        """(depths,) number of the first of `depths` that is on a body at each depth."""
        return np.searchsorted(self.depths, self.depths - self.reach)

    @cached_property
    def high(self) -> np.ndarray:
        """(depths,) number of the first of `depths` that is behind a body at each depth."""
        return np.searchsorted(self.depths, self.depths + self.reach)


@dataclass(frozen=True)
class CostConstants:
    """What it costs a joint to be at each candidate depth: -2 log likelihood."""

    steps: int = constant(45, 'Candidates of a joint, odd: the middle one is the depth of the trunk.', source='chosen')
    step: float = constant(0.04, 'Distance between two candidates.', unit='m', source='chosen')
    kernel_shares: Tuple[float, ...] = constant(
        (0.40, 0.25, 0.05), 'Share of a surface at its candidate, and at each one beside it and next to that on both '
                            'sides: noise, and what clothes add, make a surface a step thick.')
    hidden: float = constant(0.5, 'Likelihood that a joint is hidden anywhere behind a surface.', unit='1/m')
    hidden_score: float = constant(0.8, 'Below this score, being hidden grows more likely.')
    hidden_slope: float = constant(4.0, 'It does so by exp(slope * difference of the score).')
    hidden_covered: float = constant(
        3.3, 'Factor where another part of the same body is in the image: as likely hidden as not.')
    under: float = constant(0.02, 'Likelihood of a surface in front of the joint that is too near to hide it.')
    anything: float = constant(
        0.002, 'Likelihood of anything else, for joints and trunk: a keypoint that is elsewhere, a hole.')
    limit: float = constant(9.0, 'Greatest cost of a depth that differs from that of the frame before, of where a limb '
                                 'points, and of shoulders or hips that are turned against the person: three standard '
                                 'deviations.')

    @cached_property
    def deltas(self) -> np.ndarray:
        """(steps,) depths of the candidates from that of the trunk [m]."""
        return (np.arange(self.steps) - self.steps // 2) * self.step


@dataclass(frozen=True)
class OccluderConstants:
    """Which body, or none, the surface at a keypoint belongs to."""

    others_reach: float = constant(
        0.22, 'A sample is on another person if it is this near to that body, and nearer than to its own.', unit='m')
    covering_share: float = constant(0.8, 'Inner share of the breadth of a part of the own body that covers joints.',
                                     unit='share')
    beside: float = constant(0.10, 'This far to the side of a limb, an arm stands out from the trunk.', unit='m')
    stands_out: float = constant(0.035, 'An arm before the trunk stands out from it by this, at least on one side.',
                                 unit='m')
    turned_away: float = constant(
        0.4, 'The side of a body whose direction points away by more is the far one.', unit='cosine')
    covered: float = constant(
        0.15, 'Likelihood that the surface at a joint that another part of the body covers in the image is its own, if '
              'the joint is on the far side, or an arm that does not stand out.')


@dataclass(frozen=True)
class DetachedConstants:
    """Surfaces that are detached from the body, see `lift.detached`."""

    steep: float = constant(0.05, 'A surface that changes its depth by more within a 24th of the way from joint to '
                                  'joint has a step.', unit='m')
    step: float = constant(0.15, 'Steps of more than this from the body to the surface at a joint: it is before the '
                                 'body. Nearer ones do not put the joint far off.', unit='m')
    face: float = constant(0.6, 'Median score of the joints of the head from which on it is seen.')
    flat: float = constant(0.8, 'A bone that looks shorter than this share of its length may point at the camera.',
                           unit='share')


@dataclass(frozen=True)
class HeadConstants:
    """The head: its turn, and the depth of its middle."""

    most_pixel: float = constant(0.012, 'Greatest size of a pixel on a head that tells where its person faces.',
                                 unit='m')
    error: float = constant(0.015, 'Error of the keypoints of a head.', unit='m')
    yaw_spread: float = constant(0.6, 'Standard deviation of sine and cosine of the yaw, given the shoulders.')


@dataclass(frozen=True, eq=False)
class InferenceConstants:
    """Depths of all joints of a person together."""

    keypoint_error: float = constant(
        0.02, 'Error of the length of a bone by those of its ends, of the line between shoulders or hips, and of the '
              'distance from neck to head by nodding.', unit='m')
    length_limit: float = constant(30.0, 'Greatest cost of a length: a keypoint may be elsewhere.')
    turn_spread: np.ndarray = constant(
        np.array([0.10, 0.07]), 'Standard deviation of the depth between shoulders, and hips, given the facing.',
        unit='m')
    mode: int = constant(3, 'A depth is the mean of this many candidates on both sides of the best one.',
                         unit='steps', source='chosen')


@dataclass(frozen=True)
class MeasuringConstants:
    """Which joints count as measured."""

    agreement: float = constant(
        0.09, 'Samples within this distance of where the surface should be support a joint or head.', unit='m')
    least_support: float = constant(0.12, 'A measured joint is supported by more than this weight of its window.')
    shortest: float = constant(0.62, 'A bone below this share of its length has a keypoint that is elsewhere.',
                               unit='share')
    longest: float = constant(1.45, 'So has a bone above this share of its length and the error of keypoints.',
                              unit='share')
    folded: float = constant(0.45, 'A limb below this share of its length is folded.', unit='share')


@dataclass(frozen=True, eq=False)
class MonocularConstants:
    """People in space by one image, see `lift.monocular`."""

    scale: float = constant(1.035, "Size of an adult of mean stature, by that of the network's bodies.", source=_WORLDS)
    least_joints: int = constant(5, 'Keypoints that a person needs to be placed by the body.', source='chosen')
    least_depth: float = constant(0.2, 'A body of which a joint is nearer is not placed.', unit='m', source='chosen')
    iterations: int = constant(4, 'Rounds of the weights of the joints.')
    outlier: float = constant(0.06, 'Distance from its ray at which a joint counts a quarter (Geman-McClure).',
                              unit='m')
    depth_errors: np.ndarray = constant(
        by_joint((('nose', 0.07), ('eye', 0.07), ('ear', 0.07), ('neck', 0.05), ('shoulder', 0.06), ('elbow', 0.09),
                  ('wrist', 0.14), ('hip', 0.03), ('knee', 0.07), ('ankle', 0.10))),
        "Depth of an adult's joint from the middle of the hips.", unit='m', source=_WORLDS)
    fit_error: float = constant(0.03, 'Error of the distance of a person of known stature.', unit='share',
                                source=_WORLDS)
    ankle_score: float = constant(0.5, 'Score of an ankle that stands on the floor.')
    border: float = constant(0.10, 'An ankle that is as near to the border of the image may be outside.', unit='m')
    ankle_error: float = constant(0.10, 'Error of its depth.', unit='m', source=_WORLDS)
    floor_error: float = constant(0.03, 'Error of its height above the floor, with that of its keypoint.', unit='m')


@dataclass(frozen=True)
class RegistrationConstants:
    """Registration of tracked bodies with the points of a frame."""

    spacing: float = constant(0.012, 'Distance of the points that are read: a wrist is five of them broad.', unit='m')
    margin: float = constant(0.35, 'Points are read as far around the joints: hands, feet, and how far people get.',
                             unit='m')
    least_radius: float = constant(0.04, 'Least radius of a part; of others, the depth of the joints under the skin.',
                                   unit='m', source='chosen')
    thickness: float = constant(1.3, 'Points within this many radii of a part are on it.', unit='radii')
    most_points: int = constant(30, 'Points of a part, twice as many of the trunk: more tell no more.')
    least_points: int = constant(20, 'A body with fewer points is not registered.', source='chosen')
    agreement: float = constant(0.10, 'Maximum distance along the ray between a point and its surface; a nearer '
                                      'surface hides it.', unit='m')
    reach: float = constant(0.12, 'Distance within which a point beside the body looks for it.', unit='m')
    rigid_reach: float = constant(0.25, 'The same while the body moves as a whole.', unit='m')
    rigid_iterations: int = constant(2, 'First iterations, in which the body moves as a whole.')
    iterations: int = constant(6, 'Iterations in all; the last one gives covariances alone.')
    surface_error: float = constant(0.015, 'Error of a point from its surface: clothes, noise.', unit='m')
    edge_error: float = constant(0.03, 'Error of a point beside the body from it.', unit='m')
    bone_error: float = constant(0.01, 'Error of the length of a bone; of the neck twice as much.', unit='m')
    outlier: float = constant(0.03, 'Distance from the surface at which a point counts a quarter (Geman-McClure).',
                              unit='m')
    independent: float = constant(8.0, 'Independent points of a part, as neighbours err together; half as many beside '
                                       'the body, twice as many of the trunk.')
    least_fit: float = constant(0.5, 'Least share of the points in view that are on a surface: else the registration '
                                     'is dropped.')
    least_in_view: float = constant(0.3, 'Least share of the points that are in view.')
    most_error: float = constant(0.05, 'Joints with a greater error per axis are not placed by registration.', unit='m')
    longest: float = constant(0.6, 'People are registered for this long after a network saw them.', unit='s')


@dataclass(frozen=True)
class LandmarkConstants:
    """Points of hands and faces in space."""

    window: int = constant(3, 'The depth of a point is the median of a window with this side.', unit='px')
    least_points: int = constant(3, 'Points in the window that need a depth.')
    flesh: Tuple[float, ...] = constant(
        (0.020, 0.012, 0.014, 0.014, 0.006), 'Depth under the skin of the wrist, the base of the thumb, the thumb\'s '
        'next joint, the knuckles and all other joints of a hand: half of its thickness there.', unit='m')
    hand_depth: float = constant(0.1, 'Points of a hand further from its median depth belong to something else.',
                                 unit='m')
    wrist_depth: float = constant(0.25, "A hand further from the depth of the person's measured wrist is not theirs.",
                                  unit='m')
    half_finger: float = constant(0.01, 'Half the thickness of a finger: points nearer to a bone before them are '
                                        'hidden.', unit='m')
    in_front: float = constant(0.02, 'A hand whose wrist is nearer by more is in front of another; the hidden one is '
                                     'this far behind the surface.', unit='m')
    back: float = constant(0.25, 'A hand shows its back where the area between the knuckles of index and little finger '
                                 'is larger than this, per square of the distance from the wrist to the middle one.')
    face_depth: float = constant(0.04, 'Points of a face further from where its mesh has them belong '
                                       'to something else.', unit='m')
    measured_sigma: float = constant(0.018, 'Error of a measured point.', unit='m')
    inferred_sigma: float = constant(0.04, 'Error of an inferred point.', unit='m')
    pixel_sigma: float = constant(5.0, 'Error of a point in the image.', unit='px')
    face_turn_sigma: float = constant(0.07, 'Error of the turn of a head that faces the camera, by the mesh.',
                                      unit='rad')
    face_tilt_sigma: float = constant(0.11, 'Error of its tilt by the mesh, which depth corrects.', unit='rad')
    face_shape_sigma: float = constant(0.08, 'Error of its tilt that stays: eyes and mouth of a face are not where '
                                             'those of the mesh are.', unit='rad')
    face_front: float = constant(70.0, 'Percentage of the points of a mesh that count for its tilt: the nearest ones. '
                                       'The others are at hair and edges.')
    face_points: int = constant(40, 'Least number of points with depth that tell the tilt.')
    face_alike: float = constant(16.0, 'So many neighbouring points have the same error of depth.')
