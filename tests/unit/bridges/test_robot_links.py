"""Parts of a robot that were taken for people are left out; people beside it are not."""
import numpy as np
import pytest

from animated_skeleton import Limb, Pose, joints_of, people_of
from openpose_ros_bridges.robot_links import RobotLink, read_links, without_links
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import PARTS, capsules_of

FORWARDS = Limb((0.0, 1.0, 0.0), (0.0, 1.0, 0.0))
POSE = Pose(left=FORWARDS)
PEOPLE = people_of([POSE], [3], np.random.RandomState(0))


def left_out(ends, radii):
    capsules = capsules_of(PEOPLE)
    kept = without_links(capsules, np.array(ends), radii)
    return {PARTS[part] for part in set(capsules.parts) - set(kept.parts)}


def at(joint, *offset):
    return joints_of(POSE)[COCO_18.index[joint]] + np.array(offset or (0.0, 0.0, 0.0))


def test_links_are_read():
    assert read_links('', 'robot_links') == ()
    assert read_links('/tool0:0.08  /arm/elbow>/arm/wrist:.1', 'robot_links') == (
        RobotLink('tool0', 'tool0', 0.08), RobotLink('arm/elbow', 'arm/wrist', 0.1))


@pytest.mark.parametrize('text', ['tool0', 'tool0:', 'tool0:-1', 'a>b>c:1', 'tool0:wide', ':0.1'])
def test_what_is_no_link_is_refused(text):
    with pytest.raises(ParameterError, match=r'robot_links: .* is no link, expected FRAME:RADIUS'):
        read_links(text, 'robot_links')


ARM = [at('left_elbow'), at('left_wrist', 0.3, 0.0, 0.0)]


@pytest.mark.parametrize('ends, radii, parts', [
    ([ARM], [0.1], {'left_forearm', 'left_hand'}),
    # two links that meet hold what goes from one to the other
    ([ARM, [at('left_shoulder'), at('left_elbow')]], [0.1, 0.1], {'left_forearm', 'left_hand', 'left_upper_arm'}),
    ([[at('left_wrist')] * 2], [0.1], set()),  # a ball at the wrist: forearm and hand go on
    ([[at('left_elbow', 0.0, 0.0, 0.2), at('left_wrist', 0.3, 0.0, 0.2)]], [0.1], set()),
    ([[[np.nan] * 3, [0.0] * 3]], [10.0], set()),
    ([[[0.0] * 3] * 2], [10.0], {part for part in PARTS if not part.endswith('foot')})],
    ids=['within a link', 'within two', 'touches one', 'beside one', 'place not known', 'all of it'])
def test_parts_within_links_are_the_robots(ends, radii, parts):
    assert left_out(ends, radii) == parts
