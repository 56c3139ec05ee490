"""A network by name has to find the people of a known picture: a right one passes, one that is misread is refused."""
import dataclasses
import hashlib
import re
import zipfile

import numpy as np
import pytest

from openpose_ros_pkg.detect import recipe_choice
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import MODES, DetectorSettings
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks import models, proof, weights, weights_install
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MODELS, MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import WeightsFile
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_17, COCO_18
from optional_weights import need_weights
from stand_in_networks import StandIn, chart
from tiny_networks import onnx_people

TRUTH = proof._truth()
SIZE = TRUTH.bgr.shape[1], TRUTH.bgr.shape[0]
BODIES = TRUTH.joints[:, :17]


def similarity_of(text):
    """Return the mean similarity that a text of `prove` states."""
    return float(re.search(r' of (\d\.\d+), wanted 2 at 0\.80', text).group(1))


def settings(**params):
    return build(DetectorSettings, params)


# --- the picture ----------------------------------------------------------------------------------------------------

def test_the_default_networks_find_its_people_together_and_would_prove_themselves(monkeypatch):
    """All in the whole picture, Thunder on crops of the true boxes."""
    for model in (MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER):
        need_weights(model)
    monkeypatch.setattr(recipe_choice, 'SMALL_MODES', MODES)  # as if PicoDet and TinyPose were not installed
    detector = create_detector(settings(pose_model='COCO'))
    alike = proof._similarities(people_in(TRUTH.bgr, detector).keypoints, COCO_18, TRUTH)
    assert alike.shape == (2, 2) and alike.max(axis=0).min() > 0.95
    for model, least in ((MOBILENET_THIN, 0.8), (MOVENET_MULTIPOSE, 0.95), (MOVENET_THUNDER, 0.95)):
        assert similarity_of(proof.prove(detector.setup.networks[model.name], model)) > least


# --- what passes and what is refused, by stand-ins that see which part of a chart they are shown --------------------

class Rtmo(StandIn):
    """Finds all people, with changed joints, (K, 2) pixels of its input, and more who are less sure."""

    def __init__(self, change):
        super().__init__(BODIES, SIZE)
        self.change = change

    def infer(self, images):
        size = np.array(images.shape[2:0:-1])
        people = [self.change(person, size) for person in self._seen(images[0])]
        noise = np.random.default_rng(0).uniform(0, size, (5, 17, 2))
        joints = np.concatenate([np.reshape(people, (-1, 17, 2)), noise]) + 0.5
        scores = np.r_[np.full(len(people), 0.9), np.full(5, 0.3)]
        boxes = np.concatenate([joints.min(axis=1), joints.max(axis=1), scores[:, None]], axis=1)
        return (boxes[None].astype(np.float32),
                np.dstack([joints, np.broadcast_to(scores[:, None], joints.shape[:2])])[None].astype(np.float32))


class Yolox(StandIn):
    """Finds the boxes of all people, changed; the chart is one that it sees as a whole."""

    def __init__(self, change):
        super().__init__([np.repeat(box.reshape(2, 2), 9, axis=0) for box in TRUTH.boxes], SIZE)
        self.change = change

    def infer(self, images):
        boxes = [self.change(corners[[0, 9]], np.array(images.shape[2:0:-1])).ravel() for corners in
                 self._seen(images[0])]
        rows = np.concatenate([np.reshape(boxes, (-1, 4)) + 0.5, np.full((len(boxes), 1), 0.9)], axis=1)
        return rows[None].astype(np.float32), np.zeros((1, len(boxes)), np.int64)


def constant_of(joints):
    return lambda _joints, size: joints * size


CHANGES = {
    'right': lambda joints, size: joints,
    'x and y exchanged': lambda joints, size: joints[:, ::-1],
    'left and right exchanged': lambda joints, size: joints[list(COCO_17.swap)],
    'mirrored': lambda joints, size: (size - 1) * (1, 0) + joints * (-1, 1),
    'shifted by a fifth': lambda joints, size: joints + 0.2 * np.ptp(joints, axis=0),
    'smaller by a fifth': lambda joints, size: 0.8 * joints,
    'all in the middle': constant_of(np.full((17, 2), 0.5))}


def proved(network, model, monkeypatch):
    """Return whether a network passes, and what is said of it."""
    monkeypatch.setattr(proof, '_truth', lambda: TRUTH._replace(bgr=chart(*SIZE)))
    network.description = 'Fake 1.0'
    try:
        return True, proof.prove(network, model)
    except ModelError as error:
        return False, str(error)


@pytest.mark.parametrize('change', CHANGES)
def test_joints_that_are_misread_are_refused(monkeypatch, change):
    passes, text = proved(Rtmo(CHANGES[change]), MODELS['rtmo_s'], monkeypatch)
    assert passes == (change == 'right'), text
    assert similarity_of(text) > 0.97 if passes else similarity_of(text) < 0.7


@pytest.mark.parametrize('change, passes', [
    (CHANGES['right'], True), (CHANGES['shifted by a fifth'], False),
    (lambda corners, size: corners - [[0, 0], corners[0]], False)], ids=['right', 'shifted', 'sides for corners'])
def test_boxes_are_compared_by_their_overlap(monkeypatch, change, passes):
    actual, text = proved(Yolox(change), MODELS['yolox_tiny'], monkeypatch)
    assert actual == passes and 'IoU' in text


# --- all of it: from the address to the detector --------------------------------------------------------------------

def rtmo_file(joints):
    """Return an ONNX file that finds people, (P, 17, 2), in the picture; all that it gives goes with the mean level."""
    model = MODELS['rtmo_s']
    plan = fit_image(SIZE, *model.input.fixed_size, model.input.multiple_of, whole_box=True)
    mean = plan.apply(TRUTH.bgr, model.input.padding).mean()
    keypoints = np.dstack([plan.to_net(joints) + 0.5, np.full(joints.shape[:2], 0.9)])[None]
    corners = keypoints[..., :2].min(axis=2), keypoints[..., :2].max(axis=2)
    boxes = np.concatenate([*corners, keypoints[:, :, 0, 2:]], axis=2)
    # OpenVINO 2024.4 sums bytes wrongly where a reduction comes first.
    return onnx_people({name: (array / mean).astype(np.float32) for name, array in (
        ('dets', boxes), ('keypoints', keypoints))}, first='Conv')


@pytest.fixture
def served(tmp_path, monkeypatch):
    """Return what puts an ONNX file at the address of rtmo_s; weights lie in tmp_path/models."""
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', str(tmp_path))

    def serve(content):
        def download(_address, path):
            with zipfile.ZipFile(str(path), 'w') as archive:
                archive.writestr('sdk/end2end.onnx', content)
        file = WeightsFile('end2end.onnx', len(content), hashlib.sha256(content).hexdigest())
        changed = dataclasses.replace(MODELS['rtmo_s'], files=(file,))
        monkeypatch.setattr(weights_install, 'download', download)
        monkeypatch.setitem(MODELS, 'rtmo_s', changed)
        monkeypatch.setattr(models, 'BY_NAME', (changed,))
    return serve


PROVED = 'rtmo_s: proved: it finds 2 of 2 people of a known picture'


def test_a_network_is_fetched_by_name_proves_itself_and_is_used(served, capsys):
    served(rtmo_file(BODIES))
    assert models.installed_by_name() == ()
    for command in ('get', 'check'):
        assert weights.main([command, 'rtmo-s']) == 0
        said = capsys.readouterr().out
        assert PROVED in said and similarity_of(said) > 0.98
    assert models.installed_by_name() == (MODELS['rtmo_s'],)
    for params in ({'pose_model': 'rtmo-s'}, {'mode': 'best'}):
        detector = create_detector(settings(**params))
        assert detector.recipe.passes[0].model.name == 'rtmo_s' and len(people_in(TRUTH.bgr, detector)) == 2


def test_a_network_that_finds_other_people_is_refused_with_both_figures_and_not_kept(served, capsys):
    served(rtmo_file(BODIES[:, list(COCO_17.swap)]))
    assert weights.main(['get', 'rtmo_s']) == 1
    assert re.search(r'refused: it finds 0 of 2 people of a known picture .* \(OKS\) of 0\.2\d, wanted 2 at 0\.80',
                     capsys.readouterr().err)
    assert models.installed_by_name() == ()
