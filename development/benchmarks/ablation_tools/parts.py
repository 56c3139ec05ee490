"""What the ablation of people varies: the constants of each part of the chain, and mechanisms that are off."""
from typing import Any, Dict

import numpy as np

from ablation_tools.variants import Paths, Variant, constant_paths
from openpose_ros_pkg import ensemble
from openpose_ros_pkg.decode import direct, paf
from openpose_ros_pkg.detect import (
    crops,
    detector,
    existence,
    following,
    head_recovery,
    occlusion_masks,
    recipe_choice,
    schedule,
    tracking,
)
from skeleton_extract_3d import constants

PARTS = ('estimator', 'floor', 'detection', 'following', 'images', 'lives')
# Shared instances of the constants of parts, by the names of their modules.
SHARED: Dict[str, Dict[str, Any]] = {
    'detection': {
        'ensemble.area': ensemble.AREA, 'ensemble': ensemble.ENSEMBLE, 'decode.paf': paf.DECODE,
        'decode.direct': direct.DIRECT, 'detect.candidates': detector.CANDIDATES, 'detect.crops': crops.CROP,
        'detect.cover': occlusion_masks.COVER, 'detect.layers': occlusion_masks.LAYERS,
        'detect.head_recovery': head_recovery.HEADS},
    'following': {
        'detect.following': following.FOLLOWING, 'detect.schedule': schedule.SCHEDULE,
        'detect.existence': existence.EXISTENCE, 'detect.target_rate': recipe_choice.RATE},
    'images': {'detect.tracking': tracking.TRACKING},
    'lives': {
        'detect.following': following.FOLLOWING, 'detect.schedule': schedule.SCHEDULE,
        'detect.existence': existence.EXISTENCE,
        **{f'track.{name}': getattr(constants.METHOD.track, name)
           for name in ('existence', 'identity', 'one_body', 'out_of_sight', 'returning')}}}
IN_DETECTION = {name: shared for part in SHARED.values() for name, shared in part.items()}
# Parts of the method that the people of these scenes do not show: guards against bad input, hands and faces, joints
# that COCO_18 does not have.
NOT_SHOWN = tuple(f'{path}.' for path in (
    'camera_fit', 'camera_limits', 'plausibility', 'landmarks', 'extra_joints', 'feet', 'joint_frames', 'track.memory'))

FAR = 1e6

# Of the estimator.
METHOD = (
    Variant('depth of the frame before, joints', {'track.expectation.depth_sigma': FAR}),
    Variant('surfaces spread over candidates', {'costs.kernel_shares': (1.0,)}),
    Variant('low scores make hidden likelier', {'costs.hidden_slope': 0.0}),
    Variant('covered by the own body', {'costs.hidden_covered': 1.0}),
    Variant('registration between crops', {'registration.least_fit': 2.0}),
    Variant('surfaces of other people', {'occluders.others_reach': 0.0}),
    Variant('arms stand out from the trunk', {'occluders.stands_out': -FAR}),
    Variant('far side of the body', {'occluders.turned_away': 2.0}),
    Variant('turn of the head by its keypoints', {'head.error': 1e3}),
    Variant('facing by the head', {'head.most_pixel': 0.0}),
    Variant('lengths of bones in the inference', {'inference.length_limit': 0.0}),
    Variant('directions of limbs', {'body.upper_direction_spreads': np.full((4, 2), FAR),
                                    'body.lower_direction_spreads': np.full((4, 2), FAR)}),
    Variant('turn of shoulders and hips', {'inference.turn_spread': np.full(2, FAR)}),
    Variant('all three of these', {'costs.limit': 0.0}),
    Variant('facing of the frame before', {'track.expectation.turning_frames': 0.0}),
    Variant('impossible bones', {'measuring.shortest': 0.0, 'measuring.longest': FAR}),
    Variant('folded limbs', {'measuring.folded': 0.0}),
    Variant('learnt sizes', {'sizes.least_bones': 1000, 'sizes.most_frames': FAR}),
    Variant('errors that repeat', {'track.innovation.repeated': 1 - FAR}),
    Variant('wild measurements', {'track.joint_filter.trusted_deviations': FAR}),
    Variant('joints come along after a gap', {'track.identity.gap': FAR}),
    Variant('joints off the smoothed path are inferred', {'track.correction.measured_reach': FAR}),
    Variant('joints without a keypoint hang down', {'track.completion.rest_time': FAR}),
    Variant('hidden people walk on', {'track.out_of_sight.greatest_speed': 1e-3}),
    Variant('one body in one place', {'track.one_body.thickness': 0.0}),
    Variant('same place overrules the depth', {'track.identity.same_place': 0.0}),
    Variant('clothes', {}, {'use_clothes': False}),
    Variant('reidentification', {}, {'return_timeout': 0.0}),
    Variant('places in reidentification', {'track.returning.spread': FAR}),
    Variant('smoothing', {}, {'smoothing': False}),
    Variant('occlusion', {}, {'occlusion': False}),
)
FLOOR = (Variant('contact with the floor', {'track.standing.reach': 0.0}),)

# Of the search of an image.
DETECTION = (
    Variant('mean shift of the vote', {'ensemble.mean_shift_steps': 0}),
    Variant('candidates below the thresholds', {'detect.candidates.decoded_person': 1.0,
                                                'detect.candidates.direct_person': 0.15}),
    Variant('peaks beside limbs', {'decode.paf.peak_weight': 0.0}),
    Variant('foreshortened limbs', {'decode.paf.foreshortened_limb': 0.0}),
    Variant('long limbs', {'decode.paf.long_limb': FAR}),
    Variant('others covered in crops', {'detect.cover.sure_joint': 2.0}),
    Variant('order by depth', {'detect.layers.breadth': 0.0}),
    Variant('doubted opinions', {'detect.layers.doubt': 1.0}),
    Variant('two limbs in one place', {'detect.layers.one_place': 0.0}),
    Variant('head recovery', {'detect.head_recovery.most': 0}),
    Variant('crop refinement', {}, {'look_closer': 0}),
)

# Of people who are published before the search.
FOLLOWING = (
    Variant('opinions of frames before', {'detect.following.fading': 1e-6}),
    Variant('urgency of parts', {'detect.schedule.urgent': 1.0}),
    Variant('looks that are due', {'detect.schedule.look_interval': FAR}),
)

# Of tracks in the image.
IMAGES = (
    Variant('velocity in the image', {'detect.tracking.gain': 0.0}),
    Variant('extrapolation in the image', {'detect.tracking.extrapolation': 0.0}),
)

MECHANISMS = {'estimator': METHOD, 'floor': FLOOR, 'detection': DETECTION, 'following': FOLLOWING, 'images': IMAGES,
              'lives': FOLLOWING}


def paths_of(part: str) -> Paths:
    """Return path, value and metadata of the constants of a part, one of `PARTS`."""
    if part in SHARED:
        return constant_paths(SHARED[part])
    return [(path, value) for path, value in constant_paths(constants.METHOD) if not f'{path}.'.startswith(NOT_SHOWN)
            and path.startswith('track.standing.') == (part == 'floor')]
