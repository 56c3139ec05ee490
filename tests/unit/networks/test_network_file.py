"""A network's file as `pose_model`: what it is told by its inputs and outputs, or refused with what was found."""
import numpy as np
import pytest

import tiny_networks
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.models import find_model, weights_path
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import BODY_25, COCO_18

ov = pytest.importorskip('openvino')

# Pixels of a standing person of 100 px from the corner of the input, in COCO's order of the joints.
STANDING = np.array([
    (50, 10), (53, 7), (47, 7), (57, 9), (43, 9), (62, 25), (38, 25), (68, 42), (32, 42), (70, 58), (30, 58), (58, 60),
    (42, 60), (59, 82), (41, 82), (60, 104), (40, 104)], np.float32)


def raw(cells=30):
    """(1, 56, N): one person in the first cell."""
    output = np.zeros((1, 56, cells), np.float32)
    output[0, :, 0] = [50, 55, 40, 100, 0.9, *np.c_[STANDING, np.full(17, 0.8)].ravel()]
    return output


def end_to_end(rows=30):
    """(1, N, 57): one person in the first row."""
    output = np.zeros((1, rows, 57), np.float32)
    output[0, 0] = [30, 5, 70, 105, 0.9, 0, *np.c_[STANDING, np.full(17, 0.8)].ravel()]
    return output


def network_file(folder, size=('height', 'width'), **form):
    """A network that finds the same people in every white image; form: outputs, and of `tiny_networks.onnx_people`."""
    options = {key: form.pop(key) for key in ('batch', 'first') if key in form}
    path = folder / 'mine.onnx'
    path.write_bytes(tiny_networks.onnx_people(form, size, **options))
    return path


def zeros(*shape):
    return np.zeros(shape, np.float32)


def bins(points=17, width=192, height=256, ratio=2):
    """Outputs of a SimCC network."""
    return {'simcc_x': zeros(1, points, ratio * width), 'simcc_y': zeros(1, points, ratio * height)}


FORMS = pytest.mark.parametrize('people', [raw(), end_to_end()], ids=['raw', 'end to end'])


@FORMS
def test_yolo_pose_is_told_by_the_shape_of_its_output(tmp_path, people):
    path = network_file(tmp_path, output0=people)
    model = find_model(str(path))
    assert (model.name, model.decoder, model.skeleton) == ('mine.onnx', 'yolo_pose', COCO_18)
    assert (model.input.channels, model.input.padding, model.input.multiple_of) == ('RGB', 114, 32)
    assert model.input.scale == pytest.approx(1 / 255) and model.input.fixed_size is None
    assert weights_path(model) == path


@FORMS
def test_openvino_s_own_format_whose_outputs_have_no_name(tmp_path, people):
    graph = ov.Core().read_model(str(network_file(tmp_path, output0=people)))
    graph.reshape([1, 3, 96, 128])
    graph.outputs[0].get_tensor().set_names(set())
    ov.save_model(graph, str(tmp_path / 'mine.xml'))
    model = find_model(str(tmp_path / 'mine.xml'))
    assert [file.name for file in model.files] == ['mine.xml', 'mine.bin']
    assert model.decoder == 'yolo_pose' and model.input.fixed_size == (128, 96)
    network = create_backend(model, weights_path(model), BackendParams(backend='openvino', compiled_cache='off'))
    output, = network.infer(np.full((1, 96, 128, 3), 255, np.uint8))
    np.testing.assert_allclose(output, people, rtol=2e-3)  # weights are kept in float16


def test_rtmo_is_told_by_the_names_of_its_outputs(tmp_path):
    boxes, joints = np.zeros((1, 9, 5), np.float32), np.zeros((1, 9, 17, 3), np.float32)
    model = find_model(str(network_file(tmp_path, keypoints=joints, dets=boxes)))
    assert (model.decoder, model.outputs, model.input.channels) == ('rtmo', ('dets', 'keypoints'), 'BGR')


@pytest.mark.parametrize('points, skeleton', [(17, COCO_18), (26, BODY_25), (133, BODY_25)])
@pytest.mark.parametrize('width, height, batch', [(192, 256, 1), (288, 384, 'batch')])
def test_simcc_is_told_by_its_bins(tmp_path, points, skeleton, width, height, batch):
    outputs = bins(points, width, height)
    model = find_model(str(network_file(tmp_path, size=(height, width), batch=batch, **outputs)))
    assert (model.decoder, model.points, model.skeleton) == ('simcc', points, skeleton)
    assert model.outputs == ('simcc_x', 'simcc_y')
    assert (model.input.fixed_size, model.input.channels) == ((width, height), 'RGB')
    assert model.input.mean == pytest.approx([123.675, 116.28, 103.53])
    assert 1 / np.array(model.input.scale) == pytest.approx([58.395, 57.12, 57.375])


def test_the_bins_of_rtmw_are_ten_times_as_high(tmp_path):
    for first, scale in (('DepthToSpace', 0.1), ('Cast', 1.0)):
        model = find_model(str(network_file(tmp_path, size=(256, 192), first=first, **bins(133))))
        assert (model.points, model.output_scale) == (133, scale)


@pytest.mark.parametrize('size, outputs', [
    ((256, 192), {'simcc_x': bins()['simcc_y'], 'simcc_y': bins()['simcc_x']}), ((256, 192), bins(21)),
    ((256, 192), {'one': zeros(1, 17, 384), 'two': zeros(1, 17, 512)}),
    ((256, 192), {'simcc_x': zeros(1, 17, 384), 'simcc_y': zeros(1, 26, 512)}), (('h', 'w'), bins())],
    ids=['exchanged', '21 points', 'other names', 'other points', 'free size'])
def test_simcc_whose_bins_do_not_fit_is_refused(tmp_path, size, outputs):
    with pytest.raises(ModelError, match=r'does not tell what network it is.*simcc_x'):
        find_model(str(network_file(tmp_path, size=size, **outputs)))


@pytest.mark.parametrize('outputs', [{'dets': zeros(1, 100, 5), 'labels': zeros(1, 100)},
                                     {'output': zeros(1, 3549, 6)}, {'output': zeros(1, 3549, 85)}],
                         ids=['end to end', 'people', 'COCO'])
def test_yolox_is_told_by_its_cells(tmp_path, outputs):
    model = find_model(str(network_file(tmp_path, size=(416, 416), first='Slice', **outputs)))
    assert (model.decoder, model.outputs) == ('yolox', tuple(outputs))
    assert (model.input.channels, model.input.padding, model.input.mean) == ('BGR', 114, 0.0)


def test_yolox_and_rtmdet_are_told_apart_by_the_beginning(tmp_path):
    outputs = {'dets': zeros(1, 100, 5), 'labels': zeros(1, 100)}
    model = find_model(str(network_file(tmp_path, size=(640, 640), first='Slice', **outputs)))
    assert (model.decoder, model.input.fixed_size) == ('yolox', (640, 640))
    for form in ({'first': 'Conv', 'size': (640, 640)}, {'first': 'Conv', 'size': (416, 416)}, {'first': 'Slice'}):
        with pytest.raises(ModelError, match='does not tell'):
            find_model(str(network_file(tmp_path, **form, **outputs)))


@pytest.mark.parametrize('outputs, found', [
    ({'output0': np.zeros((1, 84, 30), np.float32)}, 'output0 (1, 84, 30)'),
    ({'boxes': raw(), 'masks': raw()}, 'boxes (1, 56, 30), masks (1, 56, 30)'),
    ({'heatmaps': np.zeros((1, 19, 8, 8), np.float32)}, 'heatmaps (1, 19, 8, 8)')])
def test_another_network_is_refused_with_what_was_found_and_the_way_by_yaml(tmp_path, outputs, found):
    with pytest.raises(ModelError) as caught:
        find_model(str(network_file(tmp_path, **outputs)))
    assert found in str(caught.value) and '(1, 3, ?, ?)' in str(caught.value)
    assert str(tmp_path / 'mine.onnx') in str(caught.value) and '.yaml' in str(caught.value)


@FORMS
def test_its_people_lie_where_the_network_saw_them(tmp_path, people):
    """An image of 100 x 128 in an input of 128 x 128: 14 columns of padding at the left, 14 at the right.

    All that the network gives is smaller by the padding, which is darker than the white image.
    """
    shifted = people.copy()
    joints = shifted[0, :, 0][5:] if people.shape[1] == 56 else shifted[0, 0][6:]
    joints[0::3] += 20
    path = network_file(tmp_path, output0=shifted)
    mean = (100 + 28 * 114 / 255) / 128
    detector = create_detector(build(DetectorSettings, {
        'pose_model': str(path), 'net_input_width': 128, 'net_input_height': 128, 'look_closer': 0,
        'compiled_cache': 'off'}))
    found = people_in(np.full((128, 100, 3), 255, np.uint8), detector)
    assert len(found) == 1
    np.testing.assert_allclose(found.scores, [0.9 * mean], atol=1e-3)
    expected = (STANDING + np.array([20, 0])) * mean - 0.5 - np.array([14, 0])
    for joint, place in zip(('nose', 'left_eye', 'right_eye'), expected):
        np.testing.assert_allclose(found.xy[0, COCO_18.index[joint]], place, atol=0.05)
