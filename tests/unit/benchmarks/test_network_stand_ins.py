"""Stand-ins for networks with random weights: their decoders find the people that MoveNet found."""
from dataclasses import replace

import numpy as np
import pytest

from networks.stand_ins import ANSWERS, Call, Recorder, StandIn, _smaller, _square, read_calls, write_calls
from openpose_ros_pkg.decode.boxes import decode_boxes
from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import Decoder
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.skeletons import COCO_17, COCO_18

SIZE = (640, 384)
SHAPES = {Decoder.RTMO: [(1, 0, 5), (1, 0, 17, 3)], Decoder.YOLO_POSE: [(1, 56, 5040)],
          Decoder.DETR_POSE: [(1, 60), (1, 60), (1, 60, 17, 2)], Decoder.SIMCC: [(1, 17, 384), (1, 17, 512)]}


class Network:
    name = description = fallback = 'network'

    def __init__(self, *outputs):
        self.outputs, self.images = outputs, []

    def infer(self, images):
        self.images.append(images)
        return self.outputs

    def infer_many(self, images):
        return [self.infer(image) for image in images]


def model_of(decoder):
    return replace(MODELS['rtmo_s'], decoder=decoder)


def decoded(decoder, network, teacher, size, fit=_smaller):
    """Return joints of COCO's 17 that are found in an image of a size (width, height)."""
    stand_in = StandIn(network, teacher, fit, ANSWERS[decoder])
    outputs = stand_in.infer(np.zeros((1, size[1], size[0], 3), np.uint8))
    people = decode_direct([output[0] for output in outputs], model_of(decoder), DirectDecodeParams(),
                           ImageToNet(size, size, size))
    common = [joint for joint in COCO_17.joints if joint in COCO_18.index]
    return people.keypoints[:, [COCO_18.index[joint] for joint in common]], [COCO_17.index[one] for one in common]


def people_rows():
    """MoveNet MultiPose's rows of two people, and noise."""
    rows = np.zeros((1, 6, 56), np.float32)
    rows[0, :2, :51] = np.random.default_rng(1).uniform(0.1, 0.4, (2, 51))
    rows[0, 1, :51] += 0.5
    rows[0, :, 2:51:3], rows[0, :2, 55] = 0.8, 0.9
    places = rows[0, :, :51].reshape(6, 17, 3)[..., :2]
    rows[0, :, 51:53], rows[0, :, 53:55] = places.min(axis=1), places.max(axis=1)
    return rows


@pytest.mark.parametrize('decoder', [Decoder.RTMO, Decoder.YOLO_POSE, Decoder.DETR_POSE])
def test_people_of_multipose_are_found(decoder):
    rows = people_rows()
    found, order = decoded(decoder, Network(*map(np.zeros, SHAPES[decoder])), Network(rows), SIZE)
    expected = rows[0, :2, :51].reshape(2, 17, 3)[:, order][..., [1, 0]] * SIZE
    assert found[np.argsort(found[:, 0, 0]), :, :2] == pytest.approx(expected, abs=0.6)


def test_the_person_of_thunder_is_found_on_a_crop():
    """In the middle three quarters of its square."""
    joints = np.random.default_rng(1).uniform(0.2, 0.8, (1, 1, 17, 3)).astype(np.float32)
    found, order = decoded(Decoder.SIMCC, Network(*map(np.zeros, SHAPES[Decoder.SIMCC])), Network(joints), (192, 256),
                           _square)
    expected = np.stack([joints[0, 0, :, 1] * 256 - 32, joints[0, 0, :, 0] * 256], axis=1)[order]
    assert found[0, :, :2] == pytest.approx(expected, abs=0.6)


def test_boxes_are_those_of_multipose():
    rows = people_rows()
    stand_in = StandIn(Network(np.zeros((1, 0, 5)), np.zeros((1, 0))), Network(rows), _smaller,
                       ANSWERS[Decoder.BOXES])
    outputs = stand_in.infer(np.zeros((1, 416, 416, 3), np.uint8))
    found = decode_boxes([output[0] for output in outputs], 0.0, (416, 416))
    assert np.sort(found.boxes[:, 0]) == pytest.approx(np.sort(rows[0, :2, 52]) * 416 - 0.5, abs=0.01)


def test_each_input_is_computed_once_by_movenet_and_each_time_by_the_network():
    network, teacher = Network(np.zeros((1, 0, 5)), np.zeros((1, 0, 17, 3))), Network(people_rows())
    stand_in = StandIn(network, teacher, _smaller, ANSWERS[Decoder.RTMO])
    images = [np.full((1, 64, 64, 3), grey, np.uint8) for grey in (10, 20, 10)]
    stand_in.infer_many(images)
    stand_in.infer(images[1])
    assert (len(network.images), len(teacher.images)) == (4, 2)


def test_passes_are_recorded_with_their_images():
    calls = []
    network = Recorder('rtmo_s.onnx', Network(np.zeros((1, 0, 5))), calls)
    image = np.zeros((1, 8, 16, 3), np.uint8)
    network.infer(image)
    network.infer_many([image, image])
    assert [call[1:4] for call in calls] == [('rtmo_s.onnx', [(1, 8, 16, 3)], False),
                                             ('rtmo_s.onnx', 2 * [(1, 8, 16, 3)], True)]
    assert all(0 <= call.seconds < call.end for call in calls)


def test_calls_are_read_as_they_were_written(tmp_path):
    calls = [Call(1.5, 'rtmo_s.onnx', [[1, 640, 640, 3]], False, 0.2),
             Call(2.5, 'a', [[1, 8, 8, 3], [1, 8, 8, 3]], True, 0.1)]
    write_calls(calls, tmp_path / 'calls.txt')
    assert read_calls(tmp_path / 'calls.txt') == calls
