"""process_bag makes one set of people of what several cameras recorded, in one bag or in one each."""
import genpy
import numpy as np
import pytest
import rosbag
from known_recording import (
    ASIDE,
    CAMERA,
    EMPTY,
    FRAMES,
    frame,
    known_people,
    messages,
    positions,
    stamp_of,
)
from std_msgs.msg import Header, String

from openpose_ros_fusion.rig import Rig, rig_camera, write_rig
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_tools.ros.bag_files import write_static_transforms
from openpose_ros_tools.ros.keypoints.keypoints_to_csv import main as keypoints_to_csv
from openpose_ros_tools.ros.process_bag.program import main
from skeleton_extract_3d.people import MEASURED
from skeleton_extract_3d.ros.convert import camera_to_message, depth_to_message, transform_from_matrix

SPACE = '/openpose_ros/skeleton_3d'
FUSED = f'/people{SPACE}/detected_poses_3d'
# The cameras are 1 m above the origin of the world and look along its y axis, and from the right along its -x axis.
POSES = {'left': np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1], [0, 0, 0, 1]]),
         'right': np.array([[0.0, 0, -1, ASIDE[0]], [1, 0, 0, ASIDE[1]], [0, -1, 0, 1], [0, 0, 0, 1]])}
# Exact pixels and depth: what is left is the shape of the bodies, which rays do not show [m].
MEDIAN_ERROR = {'depth': 0.04, 'rays': 0.01}
# Frames until a person that only one camera sees is reported.
CONFIRMED = 5


def write_camera(bag, name, clock=0.0, has_depth=True, tf=('left', 'right'), namespace=None, frames=FRAMES,
                 has_info=True):
    """Write what a camera sees, with stamps and times of its clock [s]."""
    root = f'/{name if namespace is None else namespace}'.rstrip('/')
    shift = genpy.Duration.from_sec(clock)
    if name in tf:
        transform = transform_from_matrix(POSES[name], Header(0, stamp_of(0) + shift, 'world'), f'{name}_frame')
        write_static_transforms(bag, [transform], stamp_of(0) + shift, 'test')
    for number in range(frames):
        shown, stamp = frame(number, name == 'right'), stamp_of(number) + shift
        time, header = stamp + genpy.Duration.from_sec(0.02), Header(number, stamp, f'{name}_frame')
        bag.write(f'{root}/image_color', convert_2d.bgr_to_image(shown.bgr, header), time)
        if has_info:
            bag.write(f'{root}/camera_info', camera_to_message(CAMERA, header), time)
        if has_depth:
            bag.write(f'{root}/image_depth', depth_to_message(shown.depth, header), time)


def write_room(path, *names, **options):
    with rosbag.Bag(str(path), 'w') as bag:
        for name in names or POSES:
            write_camera(bag, name, **options)
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / 'out.bag'


@pytest.fixture
def run(out):
    """Run the command on bags of two cameras; return the exit status."""
    def run(sources, *arguments, output=out, cameras=('left', 'right')):
        sources = [str(source) for source in (sources if isinstance(sources, list) else [sources])]
        return main([*sources, '-o', str(output), *map(str, arguments),
                     *(['--cameras', *cameras] if cameras else [])], known_people)
    return run


@pytest.fixture
def room(tmp_path):
    return write_room(tmp_path / 'room.bag')


def fused(path, topic=FUSED):
    return [message for message, _ in messages(path, topic)]


def content(path, topic):
    """Return the messages of a topic, serialized, with their times."""
    with rosbag.Bag(str(path)) as bag:
        return [(message[1], time) for _, message, time in bag.read_messages(topics=[topic], raw=True)]


def in_world(number):
    """Return the true joints of a frame, (2, 18, 3) [m]."""
    rotation, translation = POSES['left'][:3, :3], POSES['left'][:3, 3]
    return frame(number).xyz @ rotation.T + translation


def errors_of(found, first=0):
    """Return the errors of joints that a camera sees [m]; each person has one id and is found in each frame."""
    errors = []
    ids = [person.person_ID for person in found[first].persons]
    for number, array in enumerate(found):
        assert (array.header.frame_id, array.header.stamp) == ('world', stamp_of(number))
        if not first <= number < FRAMES - EMPTY:
            continue
        assert [person.person_ID for person in array.persons] == ids
        apart = np.linalg.norm(positions(array)[:, np.newaxis] - in_world(number), axis=3)
        nearest = np.nanmean(apart, axis=2).argmin(axis=1)
        assert sorted(nearest) == [0, 1]
        visible = (frame(number).vis == 2) | (frame(number, True).vis == 2)
        errors.append(apart[range(2), nearest][visible[nearest]])
    errors = np.concatenate(errors)
    assert np.isfinite(errors).mean() > 0.6  # without depth only what two cameras see has a position
    return errors[np.isfinite(errors)]


def test_fused_people_are_where_they_truly_are(run, room, out, tmp_path, capsys):
    assert run(room, '--csv', tmp_path / 'a.csv', '--markers') == 0
    found = fused(out)
    assert len(found) == FRAMES
    assert np.median(errors_of(found)) < MEDIAN_ERROR['depth']
    assert {part.status for part in (found[2].persons[0].neck, found[2].persons[0].mid_hip)} == {MEASURED, 0}
    assert messages(out, f'/people{SPACE}/visualization_skeleton')
    assert messages(out, '/tf_static')
    assert f'{FRAMES} fused frames with' in capsys.readouterr().out
    # the table is that which keypoints_to_csv makes of the bag
    assert keypoints_to_csv([str(out), '-o', str(tmp_path / 'b.csv'), '--extended', '--topic',
                             f'/people{SPACE}/detected_poses_keypoints_3d']) == 0
    table = [(tmp_path / name).read_text().splitlines() for name in ('a.csv', 'b.csv')]
    assert [line.partition(',')[2] for line in table[0]] == [line.partition(',')[2] for line in table[1]]


def test_each_camera_has_the_people_that_it_has_alone(run, room, out, tmp_path):
    assert run(room, '--json', tmp_path / 'json') == 0
    for name in POSES:
        alone = write_room(tmp_path / f'{name}.bag', name)
        assert run(alone, output=tmp_path / f'{name}_out.bag', cameras=()) == 0
        for topic in ('detected_poses', 'detected_poses_3d', 'detected_poses_keypoints_3d'):
            expected = content(tmp_path / f'{name}_out.bag', f'{SPACE}/{topic}')
            assert len(expected) >= FRAMES
            assert content(out, f'/{name}{SPACE}/{topic}') == expected
        assert len(list((tmp_path / 'json' / name).iterdir())) == FRAMES


def test_cameras_without_depth_give_people_in_space(run, tmp_path, out, room):
    assert run(write_room(tmp_path / 'images.bag', has_depth=False)) == 0
    assert np.median(errors_of(fused(out))) < MEDIAN_ERROR['rays']
    assert len(messages(out, '/left/openpose_ros/detected_poses')) == FRAMES
    # points that are ignored make no difference
    assert run(room, '--rgb-cameras', 'left', 'right', output=tmp_path / 'b.bag', cameras=()) == 0
    assert content(out, FUSED) == content(tmp_path / 'b.bag', FUSED)
    # beside a camera with depth
    assert run(room, '--rgb-cameras', 'right', output=tmp_path / 'c.bag', cameras=['left']) == 0
    assert np.median(errors_of(fused(tmp_path / 'c.bag'))) < MEDIAN_ERROR['depth']


def rig(**clocks):
    return Rig('world', tuple(rig_camera(name, f'{name}_frame', (pose[:3, :3], pose[:3, 3]), clocks.get(name, 0.0))
                              for name, pose in POSES.items()))


def test_bags_of_clocks_that_differ(run, room, tmp_path, out, capsys):
    """The second camera's clock is 100 s ahead; both bags have the same topics."""
    bags = []
    for name, clock in (('left', 0.0), ('right', 100.0)):
        bags.append(write_room(tmp_path / f'{name}.bag', name, clock=clock, namespace=''))
        with rosbag.Bag(str(bags[-1]), 'a') as bag:
            bag.write('/notes', String(name), stamp_of(0) + genpy.Duration.from_sec(clock))
    assert run(bags) == 2
    assert 'left was recorded while no other camera was' in capsys.readouterr().err
    write_rig(tmp_path / 'rig.yaml', rig(right=-100.0))
    assert run(bags, '--rig', tmp_path / 'rig.yaml', '--copy', '/notes') == 0
    assert run(room, output=tmp_path / 'one.bag') == 0
    for one, other in zip(fused(out), fused(tmp_path / 'one.bag')):
        assert one.header == other.header
        np.testing.assert_allclose(positions(one), positions(other), atol=1e-6)
    # stamps of cameras are by their own clocks, times in the bag by the common one
    array, time = messages(out, f'/right{SPACE}/detected_poses_3d')[0]
    assert (array.header.stamp - stamp_of(0)).to_sec() == 100.0
    assert abs((time - stamp_of(0)).to_sec()) < 0.1
    assert [message.data for name in POSES for message in fused(out, f'/{name}/notes')] == ['left', 'right']


def test_a_rig_takes_the_place_of_tf(run, room, tmp_path, out):
    write_rig(tmp_path / 'rig.yaml', rig())
    assert run(write_room(tmp_path / 'without_tf.bag', tf=()), '--rig', tmp_path / 'rig.yaml') == 0
    assert run(room, output=tmp_path / 'by_tf.bag') == 0
    for one, other in zip(fused(out), fused(tmp_path / 'by_tf.bag')):
        np.testing.assert_allclose(positions(one), positions(other), atol=1e-6)
    assert [each.child_frame_id for each in messages(out, '/tf_static')[0][0].transforms] == ['left_frame',
                                                                                            'right_frame']


def test_a_camera_without_transform_is_left_out_and_told(run, tmp_path, out, capsys):
    assert run(write_room(tmp_path / 'a.bag', tf=('left',))) == 0
    output = capsys.readouterr()
    assert f'0 fused; {FRAMES} not: no transform to world' in output.out
    assert 'camera right: a message is left out' in output.err
    assert np.median(errors_of(fused(out), CONFIRMED)) < 2 * MEDIAN_ERROR['depth']
    assert run(write_room(tmp_path / 'b.bag', tf=()), output=tmp_path / 'b_out.bag') == 2
    assert 'nothing could be fused' in capsys.readouterr().err
    assert not (tmp_path / 'b_out.bag').exists()
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith('.')] == []


@pytest.mark.parametrize(('cameras', 'arguments', 'words'), [
    (('left', 'door'), (), 'has no topics in the namespace /door; it has /left/camera_info'),
    (('left', 'left'), (), "names 'left' twice"),
    (('left', 'people'), (), "names 'people', which is for the fused people"),
    (('left', 'right'), ('--rgb-cameras', 'right'), "names 'right' twice"),
    (('left', 'right'), ('--rig', '/nowhere.yaml'), 'rig /nowhere.yaml can not be read'),
    (('left', 'right'), ('--set', 'target_frame=world'), 'contradicts --cameras'),
    (('left', 'right'), ('--scheduler', 'tcp://x'), '--scheduler is for several recordings'),
    ((), ('--fixed-frame', 'map'), '--fixed-frame belongs to --cameras'),
])
def test_what_can_not_be_done_is_refused_before_the_networks(room, out, capsys, cameras, arguments, words):
    named = ['--cameras', *cameras] if cameras else []
    assert main([str(room), '-o', str(out), *arguments, *named], None) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()
