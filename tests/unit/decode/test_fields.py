"""The mean of fields over sizes and the mirror image shows the people who are there."""
import numpy as np

from known_fields import NETWORKS, render_fields, two_people
from openpose_ros_pkg.decode.fields import average_fields
from openpose_ros_pkg.decode.paf import DecodeParams, decode_fields
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.preprocess import fit_image

COCO = MODELS['mobilenet_thin']


def look(people, size, model, zoom=1.0, mirror=False):
    """Return plan and ideal fields of a network that sees the picture at a zoom, or its mirror image."""
    plan = fit_image(size, 656, 368, model.input.multiple_of, zoom)
    if mirror:
        people = [np.stack([size[0] - 1 - person[:, 0], person[:, 1]], axis=1)[list(model.skeleton.swap)]
                  for person in people]
    return plan, render_fields([plan.to_net(person) for person in people], plan.net_size[::-1],
                               skeleton=model.skeleton)


def mean_of(people, size, model, *looks):
    """Return the first plan and the mean over looks, (zoom, mirror) each."""
    plans, fields = zip(*(look(people, size, model, *one) for one in looks))
    return plans[0], average_fields(fields, plans, [mirror for _, mirror in looks], model)


def assert_people(plan, fields, people, model, atol):
    """All people and no others, whole, each joint under its name and within `atol` pixels of the network."""
    keypoints, *_ = decode_fields(fields, model, DecodeParams(), plan.scaled_size)
    assert len(keypoints) == len(people)
    order = np.argsort(keypoints[:, model.skeleton.index['neck'], 0])
    for found, person in zip(keypoints[order], people):
        np.testing.assert_allclose(found[:, :2], plan.to_net(person), atol=atol)


def test_one_look_is_handed_on():
    plan, fields = look([], (641, 479), COCO)
    assert average_fields([fields], [plan], [False], COCO) is fields


@NETWORKS
def test_scales_and_mirror_images(model):
    size = (641, 479)
    people = two_people(model.skeleton, size)
    plan, fields = mean_of(people, size, model, (1.0, False), (1.0, True), (2 / 3, False), (2 / 3, True))
    assert_people(plan, fields, people, model, atol=1.0)
