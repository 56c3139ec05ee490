"""The coordinate transform between image and network input, and the picture that the network sees."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.networks.model_types import InputRecipe
from openpose_ros_pkg.networks.preprocess import cut, fit_image, fit_recipe

STRIDE = 8


@pytest.mark.parametrize('image_size, box, scaled, net', [
    ((640, 480), (656, 368), (491, 368), (496, 368)),      # height limits; padded to the stride, not to the box
    ((960, 540), (656, 368), (654, 368), (656, 368)),
    ((1280, 400), (656, 368), (656, 205), (656, 208)),     # width limits
    ((480, 640), (656, 368), (276, 368), (280, 368)),
    ((656, 368), (656, 368), (656, 368), (656, 368)),      # nothing to do
    ((320, 240), (-1, 368), (491, 368), (496, 368)),       # free width; enlarged
    ((1280, 400), (-1, 368), (1178, 368), (1184, 368)),    # free width goes beyond 656
    ((640, 480), (328, -1), (328, 246), (328, 248)),       # free height
    ((1, 1), (656, 368), (368, 368), (368, 368)),
    ((10000, 1), (656, 368), (656, 1), (656, 8)),          # never thinner than a pixel
])
def test_image_is_fitted_into_the_box_with_aspect_kept(image_size, box, scaled, net):
    plan = fit_image(image_size, *box, STRIDE)
    assert (plan.image_size, plan.scaled_size, plan.net_size) == (image_size, scaled, net)


@pytest.mark.parametrize('size, width, text', [
    ((0, 0), 656, '0x0'), ((0, 480), 656, '0x480'), ((640, 0), 656, '640x0'),
    ((10000, 10), -1, '368000x368.*at most 4096')])
def test_empty_images_and_the_free_side_of_a_long_thin_one_are_refused(size, width, text):
    with pytest.raises(BadInputError, match=text):
        fit_image(size, width, 368, STRIDE)


@pytest.mark.parametrize('size, offset', [((640, 480), (0, 0)), ((640, 426), (0, 11)), ((427, 640), (10, 0)),
                                          ((640, 425), (0, 11))])
def test_a_centred_image_has_its_padding_on_both_sides(size, offset):
    plan = fit_image(size, 640, 640, 32).centred()
    assert plan.offset == offset
    image = np.full((*size[::-1], 3), 200, np.uint8)
    left, top = offset
    padded = plan.apply(image, 114)
    assert padded.shape[:2] == plan.net_size[::-1]
    assert (padded[top:top + size[1], left:left + size[0]] == 200).all()
    assert (padded == 200).sum() == image.size and set(np.unique(padded)) <= {114, 200}
    np.testing.assert_allclose(plan.to_net([0, 0]), offset)
    np.testing.assert_allclose(plan.to_image(plan.to_net([[3, 7]])), [[3, 7]])


@pytest.mark.parametrize('size', [(641, 479), (959, 541), (201, 117), (1968, 1107), (1921, 1081)],
                         ids=['smaller', 'odd', 'enlarged', 'a third', 'less than half'])
@pytest.mark.parametrize('place', [0.12, 0.5, 0.88], ids=['left', 'centre', 'right'])
def test_a_spot_lands_where_the_transform_says(size, place):
    """The picture and the coordinates go through the same transform, to a twentieth of a network pixel."""
    width, height = size
    spot = np.array([place * (width - 1) + 0.3, place * (height - 1) - 0.2])
    v, u = np.mgrid[:height, :width]
    blob = 255 * np.exp(-((u - spot[0]) ** 2 + (v - spot[1]) ** 2) / (2 * 3.0 ** 2))
    plan = fit_image(size, 656, 368, STRIDE)
    net = plan.apply(np.repeat(blob.round().astype(np.uint8)[..., None], 3, axis=2))[..., 0].astype(float)
    seen = net[:plan.scaled_size[1], :plan.scaled_size[0]]
    v, u = np.mgrid[:seen.shape[0], :seen.shape[1]]
    measured = np.array([(u * seen).sum(), (v * seen).sum()]) / seen.sum()
    np.testing.assert_allclose(measured, plan.to_net(spot), atol=0.05)


@pytest.mark.parametrize('size', [(1312, 736), (1920, 1080), (1921, 1081)], ids=['half', 'even', 'odd'])
def test_what_is_finer_than_the_pixels_of_a_network_is_averaged(size):
    v, u = np.mgrid[:size[1], :size[0]]
    board = np.repeat(((u + v) % 2 * 200).astype(np.uint8)[..., None], 3, axis=2)
    seen = fit_image(size, 656, 368, STRIDE).apply(board)
    np.testing.assert_allclose(seen, 100.0, atol=15)


def test_an_image_fills_the_input_of_a_network_that_was_trained_so():
    plan = fit_recipe((800, 450), InputRecipe(fixed_size=(640, 640), stretched=True), (656, 368))
    assert (plan.scaled_size, plan.net_size, plan.offset) == ((640, 640), (640, 640), (0, 0))
    np.testing.assert_allclose(plan.to_image([(-0.5, -0.5), (639.5, 639.5)]), [(-0.5, -0.5), (799.5, 449.5)])
    free = fit_recipe((800, 450), InputRecipe(stretched=True), (640, 640), 0.5)
    assert free == fit_image((800, 450), 640, 640, 8, 0.5)


def test_a_part_reaches_beyond_the_image():
    image = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    part = cut(image, (-1, -2, 5, 7), 7)
    assert part.shape == (7, 5, 3) and (part[2:4, 1:4] == image).all() and (part[[0, 1, 4, 5, 6]] == 7).all()
    assert (cut(image, (1, 0, 2, 1), 7) == image[:1, 1:]).all()
    assert (cut(image, (-1, 0, 4, 2), None)[:, 0] == image[:, 0]).all()
