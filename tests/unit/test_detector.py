"""From an image to people in its pixels, with a stand-in for the network and, where its weights are, the real one."""
import threading

import cv2
import numpy as np
import pytest
from test_decode import mirrored_fields, render_fields, standing_person

from openpose_ros_pkg.backends import BackendParams
from openpose_ros_pkg.backends.self_check import reference_path
from openpose_ros_pkg.decode import DecodeParams
from openpose_ros_pkg.detector import Detector, DetectorParams, create_detector, fitted_to_rate
from openpose_ros_pkg.errors import BadInputError, ModelError, ParameterError
from openpose_ros_pkg.models import MOBILENET_THIN, weights_path
from openpose_ros_pkg.preprocess import fit_image
from openpose_ros_pkg.skeletons import COCO_18


class DrawingBackend:
    """Stands in for the network: answers with the ideal fields of given people, whatever the picture.

    Args:
        people: (18, 2) each, pixels of the image of `size`.
        size: (width, height) of the image.
    """

    name = description = 'drawing'

    def __init__(self, people=(), size=(640, 480)):
        self._people, self._size = people, size
        self.inputs = []

    def infer(self, images):
        self.inputs.append(images)
        height, width = images.shape[1:3]
        # The plan whose padded size this is, found among zooms, as the detector may ask for several scales.
        plan = next(plan for plan in (fit_image(self._size, 656, 368, 8, zoom) for zoom in (1, 0.7, 0.5, 0.4))
                    if plan.net_size == (width, height))
        return render_fields([plan.to_net(person) for person in self._people], (height, width))[np.newaxis]


def detector(backend, decode_params=None, **params):
    return Detector(MOBILENET_THIN, backend, DetectorParams(**params), decode_params or DecodeParams())


def grey(width, height):
    return np.full((height, width, 3), 128, np.uint8)


def test_nobody():
    people = detector(DrawingBackend()).detect(grey(640, 480))
    assert len(people) == 0 and people.keypoints.shape == (0, 18, 3) and people.skeleton is COCO_18


@pytest.mark.parametrize('size', [(640, 480), (641, 479), (959, 541), (321, 243)])
@pytest.mark.parametrize('place', [0.2, 0.5, 0.8], ids=['left', 'centre', 'right'])
def test_joints_come_back_in_pixels_of_the_image(size, place):
    """Half a pixel of the network, whatever the sizes round to."""
    width, height = size
    person = standing_person(place * width, 0.15 * height, 0.75 * height)
    people = detector(DrawingBackend([person], size)).detect(grey(*size))
    assert people.keypoints.shape == (1, 18, 3) and people.ids.tolist() == [-1]
    assert people.scores[0] > 0.8
    scale = fit_image(size, 656, 368, 8).scale.min()
    np.testing.assert_allclose(people.xy[0], person, atol=0.5 / scale)


def test_several_scales_agree_on_where_people_are():
    """Each scale is padded differently; the averaged fields must not be shifted against each other."""
    size = (641, 479)
    people = [standing_person(150, 60, 380), standing_person(480, 60, 380)]
    backend = DrawingBackend(people, size)
    found = detector(backend, num_scales=3, scale_gap=0.3).detect(grey(*size))
    assert [image.shape[1] for image in backend.inputs] == [368, 264, 152]
    assert len(found) == 2
    order = np.argsort(found.xy[:, 1, 0])
    np.testing.assert_allclose(found.xy[order], np.stack(people), atol=2.5)


def test_joints_stay_within_the_image():
    """A person half beyond each side: what is found lies on pixels that exist, the rest is missing."""
    size = (641, 479)
    people = [standing_person(0, 60, 380), standing_person(640, 60, 380)]
    found = detector(DrawingBackend(people, size)).detect(grey(*size))
    assert len(found) == 2
    xy = found.xy[found.present]
    assert (xy >= 0).all() and (xy <= np.subtract(size, 1)).all()
    assert (~found.present).sum() >= 4
    assert np.isnan(found.xy[~found.present]).all()


def test_mirrored_image_gives_mirrored_people():
    size = (656, 368)
    person = standing_person(200.4, 60.2, 250)
    person[4] += (-40, -100)

    class Mirrored(DrawingBackend):
        def infer(self, images):
            return mirrored_fields(super().infer(images)[0])[np.newaxis]

    plain = detector(DrawingBackend([person], size)).detect(grey(*size)).xy[0]
    mirrored = detector(Mirrored([person], size)).detect(grey(*size)).xy[0]
    expected = plain[list(COCO_18.swap)]
    expected[:, 0] = size[0] - 1 - expected[:, 0]
    np.testing.assert_allclose(mirrored, expected, atol=1e-3)


@pytest.mark.parametrize('image, text', [
    (None, 'NoneType'), (np.zeros((480, 640), np.uint8), r'\(480, 640\) uint8'),
    (np.zeros((480, 640, 4), np.uint8), r'\(480, 640, 4\)'), (np.zeros((480, 640, 3), np.float32), 'float32'),
    (np.zeros((0, 640, 3), np.uint8), '640x0'), (np.zeros((0, 0, 3), np.uint8), '0x0')],
    ids=['None', 'grey', 'four channels', 'float', 'no rows', '0x0'])
def test_bad_image_is_refused_and_the_next_one_works(image, text):
    unit = detector(DrawingBackend([standing_person(320, 60, 380)]))
    with pytest.raises(BadInputError, match=f'expected.*{text}|{text}.*expected'):
        unit.detect(image)
    assert len(unit.detect(grey(640, 480))) == 1


def test_image_of_one_pixel():
    backend = DrawingBackend(size=(1, 1))
    assert len(detector(backend).detect(grey(1, 1))) == 0


def test_read_only_image_is_left_alone():
    image = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    before = image.copy()
    image.flags.writeable = False
    detector(DrawingBackend()).detect(image)
    np.testing.assert_array_equal(image, before)


def test_only_one_thread_at_a_time_computes_the_network():
    inside, most = [], []

    class Watching(DrawingBackend):
        def infer(self, images):
            inside.append(1)
            most.append(len(inside))
            out = super().infer(images)
            inside.pop()
            return out

    unit = detector(Watching([standing_person(320, 60, 380)]))
    found = []
    threads = [threading.Thread(target=lambda: found.append(len(unit.detect(grey(640, 480))))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [1] * 8 and max(most) == 1


@pytest.mark.parametrize('values, text', [
    ({'net_input_width': -1, 'net_input_height': -1}, "'net_input_width', 'net_input_height' = -1, -1"),
    ({'net_input_width': 0}, '0, 368'), ({'net_input_height': 9999}, 'net_input_height'),
    ({'num_scales': 5}, "'num_scales', 'scale_gap' = 5, 0.3"), ({'num_scales': 0}, 'num_scales')])
def test_bad_parameters_are_refused(values, text):
    with pytest.raises(ParameterError, match=text):
        DetectorParams(**values)


def test_unknown_model_is_refused():
    with pytest.raises(ParameterError, match='pose_model'):
        create_detector(DetectorParams(pose_model='MPI_2'), BackendParams(), DecodeParams())


def test_missing_weights_say_how_to_get_them(tmp_path):
    with pytest.raises(ModelError, match='model get mobilenet_thin'):
        create_detector(DetectorParams(model_folder=str(tmp_path)), BackendParams(), DecodeParams())


# --- the real network -----------------------------------------------------------------------------------------------

@pytest.fixture(scope='module')
def real():
    try:
        weights_path(MOBILENET_THIN)
    except ModelError as error:
        pytest.skip(str(error))
    return create_detector(DetectorParams(pose_model='COCO'), BackendParams(), DecodeParams())


def mannequin(x):
    """Return a 480 x 360 picture with the self-check's drawn person, 240 x 336, at x."""
    with np.load(str(reference_path(MOBILENET_THIN))) as reference:
        person = cv2.resize(reference['image'], (240, 336), interpolation=cv2.INTER_CUBIC)
    image = np.full((360, 480, 3), (150, 165, 160), np.uint8)
    image[12:348, x:x + 240] = person
    return image


def test_real_network_finds_nobody_in_an_empty_picture(real):
    assert len(real.detect(grey(480, 360))) == 0


@pytest.mark.parametrize('x', [0, 120, 240], ids=['left', 'centre', 'right'])
def test_real_network_finds_the_drawn_person_where_it_is(real, x):
    people = real.detect(mannequin(x))
    assert len(people) == 1
    index = COCO_18.index
    for joint, (u, v) in {'nose': (40, 15), 'neck': (40, 27), 'right_shoulder': (30, 29),
                          'left_shoulder': (50, 29)}.items():
        drawn = ((u + 0.5) * 3 - 0.5 + x, (v + 0.5) * 3 - 0.5 + 12)
        # A drawing without joints' shapes: good to a fifteenth of its height.
        np.testing.assert_allclose(people.xy[0, index[joint]], drawn, atol=22)


def test_real_network_swaps_left_and_right_in_the_mirror(real):
    image = mannequin(120)
    plain, mirrored = real.detect(image), real.detect(np.ascontiguousarray(image[:, ::-1]))
    swapped = mirrored.xy[0, list(COCO_18.swap)]
    swapped[:, 0] = 479 - swapped[:, 0]
    difference = np.linalg.norm(swapped - plain.xy[0], axis=1)
    assert np.isfinite(difference).sum() >= 10 and np.nanmedian(difference) < 8


@pytest.mark.parametrize('seconds, box', [
    # 10 Hz leave the network 50 ms of each 100
    (0.030, (656, 368)), (0.050, (656, 368)),
    # 128 ms are too long: the area shrinks by 50 / 128, the sides by 0.625, to multiples of 8
    (0.128, (408, 224)),
    # never below half the sides
    (2.0, (328, 184)),
])
def test_the_input_shrinks_as_far_as_the_target_rate_needs(seconds, box):
    fitted = fitted_to_rate(DetectorParams(target_rate=10.0), seconds, stride=8)
    assert (fitted.net_input_width, fitted.net_input_height) == box


def test_a_free_side_stays_free_when_the_input_shrinks():
    fitted = fitted_to_rate(DetectorParams(net_input_width=-1, target_rate=10.0), 0.24, stride=8)
    assert (fitted.net_input_width, fitted.net_input_height) == (-1, 184)
