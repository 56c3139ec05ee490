"""People become messages of other packages, value by value."""
import numpy as np
import pytest
import rospy
from openpose_ros_msgs.msg import PersonDetectionArray
from std_msgs.msg import Header

from foreign_packages import DEFINITIONS, forget_packages, write_packages
from openpose_ros_bridges.node_params import VisionParams
from openpose_ros_bridges.ros import jsk_node, vision_msgs_node
from openpose_ros_bridges.ros.hri_messages import HriMessages
from openpose_ros_bridges.ros.people_nodes import people_msgs, spencer
from openpose_ros_pkg.errors import BadInputError, ForeignPackageError
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.records import Facing, FloorPose, Gesture, PersonSignals, Posture, Walk
from openpose_ros_signals.ros.convert import signals_to_array
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.ros import convert

CAMERA = Header(stamp=rospy.Time(12, 500000000), frame_id='camera')
ROOM = Header(stamp=CAMERA.stamp, frame_id='room')
UNKNOWN = 999999.0
# As `rosmsg md5` tells of the packages that `foreign_packages` names.
MD5SUMS = {'people_msgs/People': '18722f4b8db20cc2369740732357847b',
           'spencer_tracking_msgs/TrackedPersons': '21c0b1a57c4933e68f39aa3802861828',
           'vision_msgs/Detection2DArray': '402071f61477de256df9f1aa45e6e4c8',
           'vision_msgs/Detection3DArray': '05c51d9aea1fb4cfdc8effb94f197b6f',
           'hri_msgs/IdsList': '84a63f55b5676f78b625e8a8bb809fe5',
           'hri_msgs/NormalizedRegionOfInterest2D': '33eb96af02d4b1dd1457132b5c2149c2',
           'hri_msgs/Skeleton2D': 'efedc2dc59671380a1d9b497f0740be4',
           'hri_msgs/BodyPosture': '52f95070a71954a985e0ab92dd4d4eb9',
           'hri_msgs/Gesture': 'c64cc745a3c18d0a7abe6aed5be4f345',
           'jsk_recognition_msgs/PeoplePoseArray': '57d49e8e639421734a0ce15bfde9d80d',
           'jsk_recognition_msgs/HumanSkeletonArray': '4013ce44abe9aafa9055e095797a9d50'}


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """The packages as they are, and what writes others in their place."""
    def write(definitions):
        forget_packages()
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        write_packages(folder, definitions)
        monkeypatch.syspath_prepend(str(folder))
    write(DEFINITIONS)
    yield write
    forget_packages()


def people():
    """Return a visible person with two joints, and a hidden one."""
    xyz = np.full((2, 18, 3), np.nan)
    xyz[:, :2] = [[[1.0, 2.0, 3.0], [2.0, 4.0, 3.5]], [[5.0, 0.0, 3.0], [5.0, 1.0, 3.0]]]
    there = np.isfinite(xyz[..., 0])
    status = np.where(there, np.array([[MEASURED], [INFERRED]]), MISSING)
    confidence = np.where(there, np.array([[0.75], [0.0]]), 0.0)
    sigma = np.where(there, np.array([[0.06], [0.3]]), np.nan)
    return convert.people_to_array(People3D(COCO_18, xyz, confidence, status, sigma, np.array([7, 9])), CAMERA)


SIGNALS = [
    PersonSignals(7, np.zeros(3), Posture('sitting', 11.5, 0.75), (Gesture('wave', 'left', 12.25, 0.5),),
                  Facing(np.array([1.0, 0.0, 0.0]), 0.25), walk=Walk(True, 1.5, np.array([0.0, 1.0, 0.0])),
                  floor=FloorPose(np.array([0.5, 0.25, 0.0]), np.array([0.0, 0.0, 0.6, 0.8]))),
    PersonSignals(9, np.full(3, np.nan), floor=FloorPose(np.array([3.0, 2.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])))]


def vision(**params):
    return vision_msgs_node.outputs(VisionParams(**params))


def numbers(message):
    return [getattr(message, name) for name in message.__slots__]


def checked(message):
    """Return a message whose types are right."""
    message._check_types()
    assert MD5SUMS[message._type] == message._md5sum
    return message


def empty(kind, header=CAMERA):
    """Return the message of a frame without people."""
    return kind(header=header, **({'pose_model': 'COCO_18'} if 'pose_model' in kind.__slots__ else {}))


def test_without_people_messages_are_empty(packages):
    for output in (*people_msgs(), *spencer(), *vision(), *jsk_node.outputs()):
        none = checked(output.convert(*(empty(kind) for _, kind in output.inputs)))
        assert none.header == CAMERA
        assert all(getattr(none, name) == [] for name in none.__slots__ if name != 'header')
        if output.end is not None:
            assert checked(output.end(ROOM)) == output.convert(*(empty(kind, ROOM) for _, kind in output.inputs))
        if output.inputs[0][1] is PersonDetectionArray:
            with pytest.raises(BadInputError, match="pose_model 'no such' is unknown"):
                output.convert(PersonDetectionArray(pose_model='no such'))


def test_people(packages):
    (output,) = people_msgs()
    message = checked(output.convert(people(), signals_to_array(SIGNALS, ROOM)))
    assert message.header == ROOM
    one, other = message.people
    assert (one.name, one.reliability, one.tagnames, one.tags) == ('7', 0.75, ['posture', 'gesture'],
                                                                   ['sitting', 'wave left'])
    assert (numbers(one.position), numbers(one.velocity)) == ([0.5, 0.25, 0.0], [0.0, 1.5, 0.0])
    assert (other.name, other.reliability, other.tagnames, other.tags) == ('9', 0.0, [], [])
    assert (numbers(other.position), numbers(other.velocity)) == ([3.0, 2.0, 0.0], [0.0, 0.0, 0.0])


def test_tracked_persons(packages):
    (output,) = spencer()
    output.convert(people(), signals_to_array(SIGNALS[:1], ROOM))
    later = Header(stamp=rospy.Time(14), frame_id='room')
    message = checked(output.convert(people(), signals_to_array(SIGNALS, later)))
    assert message.header == later
    one, other = message.tracks
    assert (one.track_id, one.detection_id, one.age.to_sec()) == (7, 7, 1.5)
    assert (one.is_matched, one.is_occluded) == (True, False)
    assert (other.track_id, other.is_matched, other.is_occluded, other.age.to_sec()) == (9, False, True, 0.0)
    assert numbers(one.pose.pose.position) == [0.5, 0.25, 0.0]
    assert numbers(one.pose.pose.orientation) == [0.0, 0.0, 0.6, 0.8]
    along = 0.06 ** 2 / 3
    np.testing.assert_allclose(np.reshape(one.pose.covariance, (6, 6)),
                               np.diag([along] * 3 + [UNKNOWN] * 2 + [0.0625]), rtol=1e-6)
    assert other.pose.covariance[35] == UNKNOWN
    assert (numbers(one.twist.twist.linear), numbers(one.twist.twist.angular)) == ([0.0, 1.5, 0.0], [0.0] * 3)
    # the difference of two positions, 0.4 s apart
    np.testing.assert_allclose(np.diag(np.reshape(one.twist.covariance, (6, 6))),
                               [2 * along / 0.16] * 3 + [UNKNOWN] * 3, rtol=1e-6)
    np.testing.assert_array_equal(np.diag(np.reshape(other.twist.covariance, (6, 6))), UNKNOWN)
    output.end(later)
    assert output.convert(people(), signals_to_array(SIGNALS, later)).tracks[0].age.to_sec() == 0.0


def in_image():
    """Return a person with two keypoints, and one without any."""
    keypoints = np.full((2, 18, 3), (np.nan, np.nan, 0.0), np.float32)
    keypoints[0, :2] = [[100.0, 50.0, 0.75], [140.0, 250.0, 0.25]]
    return convert_2d.people_to_array(People2D(COCO_18, keypoints, np.ones(2), np.array([7, 9])), CAMERA)


def test_detections(packages):
    of_image, of_space = vision(class_id=0, margin_2d=0.1, margin_3d=0.25)
    (detection,) = checked(of_image.convert(in_image())).detections
    assert detection.header == CAMERA
    assert numbers(detection.bbox.center) == [120.0, 150.0, 0.0]
    assert (detection.bbox.size_x, detection.bbox.size_y) == (80.0, 240.0)
    (result,) = detection.results
    assert (result.id, result.score) == (0, 0.5)
    np.testing.assert_array_equal(np.diag(np.reshape(result.pose.covariance, (6, 6))), UNKNOWN)
    one, other = checked(of_space.convert(people())).detections
    assert numbers(one.bbox.center.position) == [1.5, 3.0, 3.25]
    assert numbers(one.bbox.center.orientation) == [0.0, 0.0, 0.0, 1.0]
    assert numbers(one.bbox.size) == [1.5, 2.5, 1.0]
    (result,) = one.results
    assert (result.id, result.score, result.pose.pose) == (0, 0.75, one.bbox.center)
    np.testing.assert_allclose(np.diag(np.reshape(result.pose.covariance, (6, 6))),
                               [0.06 ** 2 / 3] * 3 + [UNKNOWN] * 3, rtol=1e-6)
    assert other.results[0].score == 0.0


def test_poses_and_skeletons(packages):
    of_space, of_image, of_bones = jsk_node.outputs()
    one, other = checked(of_image.convert(in_image())).poses
    assert (one.limb_names, one.scores) == (['Nose', 'Neck'], [0.75, 0.25])
    assert [numbers(pose.position) for pose in one.poses] == [[100.0, 50.0, 0.0], [140.0, 250.0, 0.0]]
    assert all(numbers(pose.orientation) == [0.0, 0.0, 0.0, 1.0] for pose in one.poses)
    assert (other.limb_names, other.poses, other.scores) == ([], [], [])
    one, other = checked(of_space.convert(people())).poses
    assert (one.limb_names, one.scores) == (['Nose', 'Neck'], [0.75, 0.75])
    assert [numbers(pose.position) for pose in one.poses] == [[1.0, 2.0, 3.0], [2.0, 4.0, 3.5]]
    assert other.scores == [0.0, 0.0]  # INFERRED
    message = checked(of_bones.convert(people()))
    assert [number.data for number in message.human_ids] == [7, 9]
    for skeleton, nose, neck in zip(message.skeletons, ([1.0, 2.0, 3.0], [5.0, 0.0, 3.0]),
                                    ([2.0, 4.0, 3.5], [5.0, 1.0, 3.0])):
        assert (skeleton.header, skeleton.bone_names) == (CAMERA, ['Neck->Nose'])
        (bone,) = skeleton.bones
        assert (numbers(bone.start_point), numbers(bone.end_point)) == (neck, nose)


def test_messages_of_hri_msgs_are_those_of_its_release(packages):
    messages = HriMessages()
    for made in (messages.ids, messages.region, messages.skeleton, messages.posture, messages.gesture):
        checked(made.kind())


@pytest.mark.parametrize(('make', 'package', 'message', 'other', 'text'), [
    (people_msgs, 'people_msgs', 'Person', 'string name\ngeometry_msgs/Point position', 'velocity is missing'),
    (spencer, 'spencer_tracking_msgs', 'TrackedPerson', 'uint32 track_id', 'track_id is uint32, not uint64'),
    (vision, 'vision_msgs', 'ObjectHypothesisWithPose',
     'string id\nfloat64 score\ngeometry_msgs/PoseWithCovariance pose', 'id is string, not int64'),
    (jsk_node.outputs, 'jsk_recognition_msgs', 'PeoplePose', 'string[] limb_names\ngeometry_msgs/Pose[] poses',
     'scores is missing'),
    (HriMessages, 'hri_msgs', 'IdsList', 'std_msgs/Header header\nuint32[] ids', r'ids is uint32\[\], not string\[\]')],
    ids=['people', 'spencer', 'vision', 'jsk', 'hri'])
def test_other_definitions_are_refused(packages, make, package, message, other, text):
    packages({package: {**DEFINITIONS.get(package, {}), message: other}})
    with pytest.raises(ForeignPackageError, match=f'{package}/{message} is defined otherwise than .*: .*{text}'):
        make()
