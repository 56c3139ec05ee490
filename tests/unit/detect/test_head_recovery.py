"""People that the networks missed: heads in the depth that no skeleton explains."""
import cv2
import numpy as np
import pytest

from followed_stream import FollowedStream
from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.head_recovery import heads
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import MovenetNetwork, PafNetwork, ThunderNetwork, Together, chart, in_order, person_at

# Depth and image of one camera, 1.4 m above the floor, which looks straight ahead in a room 7 m long.
WIDTH, HEIGHT, FOCAL = 480, 270, 270.0
SIZE = (2 * WIDTH, 2 * HEIGHT)
CAMERA_HEIGHT, WALL = 1.4, 6.5
HEAD = 1.6  # height of the middle of the head of a standing person [m]


def room():
    """Return the depth of floor and wall, (h, w) float32 [m]."""
    rows = np.arange(HEIGHT) - (HEIGHT - 1) / 2
    floor = CAMERA_HEIGHT * FOCAL / np.maximum(rows, 1e-6)
    return np.repeat(np.minimum(floor, WALL)[:, None], WIDTH, axis=1).astype(np.float32)


def pixel(x, height, depth):
    """Return the pixel of the depth at x to the right of the camera's axis and a height above the floor [m]."""
    return (WIDTH - 1) / 2 + FOCAL * x / depth, (HEIGHT - 1) / 2 + FOCAL * (CAMERA_HEIGHT - height) / depth


def draw(scene, depth, *parts):
    """Draw what is nearer than the scene: ellipses of middle x, height, and half axes [m]; negative axes: a box."""
    mask = np.zeros(scene.shape, np.uint8)
    for x, height, half_width, half_height in parts:
        middle = tuple(round(at) for at in pixel(x, height, depth))
        axes = tuple(round(abs(half) * FOCAL / depth) for half in (half_width, half_height))
        if half_width > 0:
            cv2.ellipse(mask, middle, axes, 0, 0, 360, 1, cv2.FILLED)
        else:
            cv2.rectangle(mask, tuple(np.subtract(middle, axes)), tuple(np.add(middle, axes)), 1, cv2.FILLED)
    return np.where((mask > 0) & (depth < scene), np.float32(depth), scene)


def draw_person(scene, x, depth, head=HEAD):
    """Draw a person who stands, or with a lower head sits."""
    return draw(scene, depth, (x, head, 0.09, 0.12), (x, head - 0.5, 0.22, 0.36), (x, head / 2 - 0.5, -0.15, head / 2))


def found(scene):
    """Return x [m], height [m] and depth [m] of the heads that are found, (N, 3), by their x."""
    places = [((head.x - (WIDTH - 1) / 2) * head.depth / FOCAL,
               CAMERA_HEIGHT - (head.y - (HEIGHT - 1) / 2) * head.depth / FOCAL, head.depth)
              for head in heads(DepthView(scene, FOCAL))]
    return np.array(sorted(places)).reshape(-1, 3)


@pytest.mark.parametrize('depth', [1.2, 2.5, 4.0, 5.5])
def test_a_head_is_found_at_its_place(depth):
    assert found(draw_person(room(), 0.3, depth)) == pytest.approx(np.array([[0.3, HEAD, depth]]), abs=0.06)


@pytest.mark.parametrize('scene', [
    np.full((HEIGHT, WIDTH), np.nan, np.float32),
    np.full((HEIGHT, WIDTH), 2.0, np.float32),
    room(),
    draw(room(), 2.5, (0.0, 0.45, -0.25, 0.45)),
    draw(room(), 2.5, (0.0, 0.25, -0.25, 0.25), (0.0, 0.7, -0.22, 0.3)),
    draw(room(), 3.0, (0.0, 1.0, -0.5, 1.0)),
    draw(room(), 3.0, (0.0, 0.8, -0.05, 0.8)),
    draw(room(), 3.0, (0.0, 1.6, 0.1, 0.12)),
], ids=['no depth', 'wall before the camera', 'room', 'stool', 'chair', 'cupboard', 'pole', 'balloon'])
def test_what_is_no_head(scene):
    assert len(found(scene)) == 0


# The person in the image who stands at x = 0, 3 m away: its height there from nose to ankle [px].
BEHIND = person_at(SIZE[0] / 2, 2 * pixel(0, HEAD - 0.02, 3.0)[1], 1.45 * 2 * FOCAL / 3.0)
SEEN = person_at(180, 200, 240)


def image():
    return chart(*SIZE)


@pytest.fixture()
def networks():
    """The networks of the full image see one of two people, that of the crops both."""
    return Together(mobilenet_thin=PafNetwork([SEEN], SIZE), movenet_multipose=MovenetNetwork([SEEN], SIZE),
                    movenet_thunder=ThunderNetwork([SEEN, BEHIND], SIZE))


@pytest.fixture()
def detector(networks):
    return Detector(build(DetectorSettings, {'mode': 'balanced', 'pose_model': 'COCO'}), networks)


def the_scene():
    """Return the depth of the one who stands, with broad arms as that person has them, and ears."""
    return draw(draw_person(room(), 0.0, 3.0), 3.0, (0.0, 1.1, 0.42, 0.28), (0.0, HEAD, 0.12, 0.06))


def test_a_missed_person_is_found_by_depth(detector):
    assert len(people_in(image(), detector)) == 1
    people = people_in(image(), detector, DepthView(the_scene(), FOCAL))
    assert len(people) == 2
    person = people.xy[people.xy[:, 0, 0].argmax()]
    nose, hip = COCO_18.index['nose'], COCO_18.index['right_hip']
    assert person[[nose, hip]] == pytest.approx(BEHIND[[nose, hip]], abs=6)


@pytest.mark.parametrize('change', [
    {'people': [SEEN]}, {'confidence': 0.2}, {'people': [SEEN, np.add(BEHIND, (0, 90))]}],
    ids=['no person there', 'unsure', 'a head elsewhere'])
def test_a_head_in_the_depth_alone_is_no_person(detector, networks, change):
    vars(networks.networks['movenet_thunder']).update(change)
    assert len(people_in(image(), detector, DepthView(the_scene(), FOCAL))) <= 1


def test_a_missed_person_is_followed(detector):
    stream, view = FollowedStream(detector, dict.fromkeys(detector.setup.networks, 1e-9)), DepthView(the_scene(), FOCAL)
    frames = [stream.frame(1 + 0.1 * i, image(), view) for i in range(8)]
    assert [len(people) for people in frames] == 8 * [2]
    assert len({tuple(sorted(people.ids)) for people in frames}) == 1
    neck = COCO_18.index['neck']
    assert in_order(frames[-1])[:, neck] == pytest.approx(in_order(frames[0])[:, neck], abs=4)
