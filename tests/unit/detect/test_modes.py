"""Modes keep their order of accuracy, whatever is installed: on the committed pictures with true joints."""
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.detect import recipe_choice
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import MODES, DetectorSettings
from openpose_ros_pkg.ensemble import sigmas, similarity
from openpose_ros_pkg.networks.model_registry import (
    MOBILENET_THIN,
    MOVENET_MULTIPOSE,
    MOVENET_THUNDER,
    PICODET,
    TINYPOSE,
)
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from optional_weights import need_weights

SCENES = Path(__file__).parents[3] / 'development/benchmark_data/scenes'
# What the pictures can not tell apart: the mean similarity of so many people varies by it between frames.
EQUAL = 0.03


def pictures():
    """Images (H, W, 3), and (P, 18, 3) of the visible joints of the people who show eight at least."""
    for scene in sorted(SCENES.iterdir()):
        frames = json.loads((scene / 'gt.json').read_text())['frames']
        for path, frame in list(zip(sorted((scene / 'rgb').iterdir()), frames))[::12]:
            people = [[(*xy, 1.0) if seen == 2 else (np.nan, np.nan, 0.0) for xy, seen in zip(one['uv'], one['vis'])]
                      for one in frame['people']]
            people = np.array(people, np.float32).reshape(-1, 18, 3)
            yield cv2.imread(str(path)), people[np.isfinite(people[..., 0]).sum(axis=1) >= 8]


@pytest.mark.parametrize('small', [(PICODET, TINYPOSE), ()], ids=['small networks', 'without them'])
def test_no_mode_is_less_accurate_than_a_faster_one(monkeypatch, small):
    if not small:
        monkeypatch.setattr(recipe_choice, 'SMALL_MODES', MODES)
    for model in (MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER, *small):
        need_weights(model)
    mean = []
    for mode in MODES:
        detector = create_detector(build(DetectorSettings, {'mode': mode, 'pose_model': 'COCO'}))
        assert (PICODET in detector.recipe.models) == bool(small)
        alike = []
        for image, truth in pictures():
            found = keypoints_in(people_in(image, detector).keypoints, detector.skeleton, COCO_18)
            each = similarity(truth[:, None], found, sigmas(COCO_18))
            alike += each.max(axis=1).tolist() if len(found) else len(truth) * [0.0]
        mean.append(np.mean(alike))
    assert len(alike) > 10 and mean[0] > 0.75
    assert (np.diff(mean) > -EQUAL).all(), mean
