"""A person with hands and a face, as a network for whole bodies sees one, and what stands in for the networks."""
from dataclasses import replace

import numpy as np

from openpose_ros_pkg.landmarks.face_points import SHAPE
from openpose_ros_pkg.networks.model_types import SIMCC_INPUT, Decoder, Model, UserFiles
from openpose_ros_pkg.people import keypoints_in
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, WHOLE_BODY_133
from stand_in_networks import MovenetNetwork, PafNetwork, SimccNetwork, ThunderNetwork, person_at

MODEL = Model('whole', BODY_25, (), 'ours', UserFiles('here'), replace(SIMCC_INPUT, fixed_size=(192, 256)),
              ('simcc_x', 'simcc_y'), Decoder.SIMCC, points=133)
HANDS = {'left': slice(91, 112), 'right': slice(112, 133)}
FACE = slice(23, 91)


def with_feet(person):
    """Return (25, 2) of a person, (18, 2), with toes in front of the ankles and heels behind, below them."""
    result = keypoints_in(np.insert(person, 2, 1.0, axis=1)[None], COCO_18, BODY_25)[0, :, :2]
    height = np.ptp(person[:, 1])
    for side, out in (('left', 1), ('right', -1)):
        ankle = person[COCO_18.index[f'{side}_ankle']]
        for joint, (x, y) in {'big_toe': (0.03, 0.08), 'small_toe': (0.08, 0.06), 'heel': (-0.03, 0.04)}.items():
            result[BODY_25.index[f'{side}_{joint}']] = ankle + np.array([out * x, y]) * height
    return result


def whole(person):
    """Return (133, 2) of a person of BODY_25, (25, 2), with hands that hang from the wrists and an average face."""
    result = keypoints_in(np.insert(person, 2, 1.0, axis=1)[None], BODY_25, WHOLE_BODY_133)[0, :, :2]
    for side, points in HANDS.items():
        result[points] = person[BODY_25.index[f'{side}_wrist']] + [(2 * (k % 4), k) for k in range(21)]
    width = np.ptp(person[[BODY_25.index['left_ear'], BODY_25.index['right_ear']], 0])
    result[FACE] = person[BODY_25.index['nose']] + width / 15 * (SHAPE[:68] - SHAPE[30])[:, :2] * (1, -1)
    return result


# Two people on a chart.
SIZE = (640, 480)
PEOPLE = with_feet(person_at(130, 120, 250)), with_feet(person_at(480, 130, 220))


def networks_of(people, size):
    """Return stand-ins by their names; people: (25, 2) each, in pixels of a chart of a size (width, height)."""
    found = [keypoints_in(np.insert(one, 2, 1.0, axis=1)[None], BODY_25, COCO_18)[0, :, :2] for one in people]
    return {'mobilenet_thin': PafNetwork(found, size), 'movenet_multipose': MovenetNetwork(found, size),
            'movenet_thunder': ThunderNetwork(found, size),
            'whole': SimccNetwork([whole(one) for one in people], size, skeleton=WHOLE_BODY_133, order=WHOLE_BODY_133)}
