"""Two people are seen, one of them leaves: what hri_node publishes. With --without: what it says without hri_msgs.

Run by test_hri.py, with a roscore of its own.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Bool, Header, String
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'support'))

from animated_skeleton import Limb, Pose, joints_of, people_of
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.skeletons import COCO_18
from session import Recorder, Session, await_true
from skeleton_extract_3d.ros import convert

INPUT, BODIES, PERSONS = '/openpose_ros/skeleton_3d', '/humans/bodies', '/humans/persons'
SIZE = (640, 480)
# One raises the left hand, 1 m to the left of the other one.
RAISED = Limb((0.3, 0.0, 1.0), (-0.1, 0.0, 1.0))
POSES = {5: Pose(left=RAISED, place=(2.0, 1.0), facing=180.0), 6: Pose(place=(2.0, 0.0), facing=180.0)}
TIMEOUT = 30.0


class Scene:
    """Sends what a camera sees, until it is told that a person leaves, or that it is to be silent."""

    def __init__(self):
        self.ids, self.sends = [5, 6], True
        self._space = rospy.Publisher(f'{INPUT}/detected_poses_3d', PersonDetection_3dArray, queue_size=5)
        self._image = rospy.Publisher(f'{INPUT}/detected_poses', PersonDetectionArray, queue_size=5)
        self._info = rospy.Publisher(f'{INPUT}/camera_info', CameraInfo, queue_size=5)
        self._timer = rospy.Timer(rospy.Duration(0.1), self._send)

    def _send(self, _event):
        if not self.sends:
            return
        header = Header(stamp=rospy.Time.now(), frame_id='room')
        people = people_of([POSES[name] for name in self.ids], self.ids, np.random.RandomState(0))
        keypoints = np.full((len(self.ids), 18, 3), (np.nan, np.nan, 0.0), np.float32)
        keypoints[:, COCO_18.index['left_eye']] = (320, 120, 0.5)
        keypoints[:, COCO_18.index['right_eye']] = (304, 120, 0.75)
        in_image = People2D(COCO_18, keypoints, np.ones(len(self.ids)), people.ids)
        persons = convert_2d.people_to_messages(in_image, header)
        self._info.publish(CameraInfo(header=header, width=2 * SIZE[0], height=2 * SIZE[1], binning_x=2, binning_y=2))
        self._image.publish(convert_2d.people_to_array(persons, header, COCO_18))
        self._space.publish(convert.people_to_array(people, header))


def newest(topic, kind):
    return rospy.wait_for_message(topic, kind, timeout=TIMEOUT)


def topics_of(body):
    return [topic for topic, _ in rospy.get_published_topics('/humans') if body in topic]


def check(session):
    from hri_msgs.msg import BodyPosture, Gesture, IdsList, NormalizedRegionOfInterest2D, Skeleton2D
    session.start('hri', ['roslaunch', 'openpose_ros_bridges', 'hri.launch', 'persons:=true', 'fixed_frame:=room'])
    scene, frames = Scene(), Recorder('/tf', TFMessage)
    ids = newest(f'{BODIES}/tracked', IdsList)
    assert (ids.ids, ids.header.frame_id) == (['p5', 'p6'], 'room'), ids
    region = newest(f'{BODIES}/p5/roi', NormalizedRegionOfInterest2D)
    # two points 16 px apart, and a tenth of that on each side
    np.testing.assert_allclose([region.xmin, region.xmax, region.ymin, region.ymax],
                               [302.4 / 640, 321.6 / 640, 118.4 / 480, 121.6 / 480], rtol=1e-5)
    assert abs(region.c - 0.625) < 1e-6, region
    points = newest(f'{BODIES}/p5/skeleton2d', Skeleton2D).skeleton
    left, right = points[Skeleton2D.LEFT_EYE], points[Skeleton2D.RIGHT_EYE]
    np.testing.assert_allclose([left.x, left.y, left.c, right.x, right.c], [0.5, 0.25, 0.5, 0.475, 0.75], rtol=1e-6)
    assert len(points) == 18 and points[Skeleton2D.NOSE].c == 0.0, points
    assert newest(f'{BODIES}/p5/posture', BodyPosture).posture == BodyPosture.STANDING
    assert newest(f'{BODIES}/p5/gesture', Gesture).gesture == Gesture.LEFT_HAND_RAISED
    check_space(frames)
    assert newest(f'{PERSONS}/tracked', IdsList).ids == ['anonymous_p5', 'anonymous_p6']
    assert newest(f'{PERSONS}/anonymous_p5/anonymous', Bool).data
    assert newest(f'{PERSONS}/anonymous_p5/body_id', String).data == 'p5'  # latched: said once, before
    scene.ids = [6]
    await_true(lambda: newest(f'{BODIES}/tracked', IdsList).ids == ['p6'], 'one has left')
    await_true(lambda: not topics_of('p5'), 'the topics of the person that left end')
    assert topics_of('p6')
    check_end(scene, [Recorder(f'{BODIES}/tracked', IdsList), Recorder(f'{PERSONS}/tracked', IdsList),
                      Recorder(f'{PERSONS}/known', IdsList)])


def check_end(scene, lists):
    def last(ids):
        return all(one.messages and one.messages[-1].ids == wanted for one, wanted in zip(lists, ids))
    here = [['p6'], ['anonymous_p6'], ['anonymous_p6']]
    await_true(lambda: last(here), 'one is there')
    scene.sends = False
    await_true(lambda: last([[], [], []]), 'lists are empty when no people come any more')
    await_true(lambda: not topics_of('p6'), 'all topics of bodies and persons end')
    assert all([message.ids for message in one.messages].count([]) == 1 for one in lists)
    assert lists[0].messages[-1].header.frame_id == 'room'
    scene.sends = True
    await_true(lambda: last(here), 'one is there again')
    assert newest(f'{PERSONS}/anonymous_p6/body_id', String).data == 'p6'
    assert newest(f'{BODIES}/p6/joint_states', JointState).name
    assert len(topics_of('p6')) > 6


def check_space(frames):
    from geometry_msgs.msg import PointStamped
    hips = joints_of(POSES[5])[[COCO_18.index['left_hip'], COCO_18.index['right_hip']]].mean(axis=0)
    position = newest(f'{BODIES}/p5/position', PointStamped)
    np.testing.assert_allclose([position.point.x, position.point.y, position.point.z], hips, atol=0.02)
    joints = newest(f'{BODIES}/p5/joint_states', JointState)
    angles = dict(zip(joints.name, joints.position))
    # the arm is up: turned by nearly half a turn; the other one hangs
    assert angles['l_p_shoulder_p5'] > 2.5 and angles['r_p_shoulder_p5'] < 0.5, angles
    wanted = {'body_p5': 'room', 'l_wrist_p5': 'body_p5', 'head_p5': 'body_p5', 'body_p6': 'room',
              'person_anonymous_p5': 'body_p5'}

    def found():
        return {one.child_frame_id: one for message in frames.messages for one in message.transforms}
    await_true(lambda: set(wanted) <= set(found()), 'frames')
    assert {name: found()[name].header.frame_id for name in wanted} == wanted
    body = found()['body_p5'].transform
    np.testing.assert_allclose([body.translation.x, body.translation.y, body.translation.z], hips, atol=0.02)
    assert abs(body.rotation.z) > 0.99, body  # faces along -x of the room


def main():
    with tempfile.TemporaryDirectory() as folder, Session(Path(folder)) as session:
        if '--without' in sys.argv:
            ended = subprocess.run(['rosrun', 'openpose_ros_bridges', 'hri_node'], stdout=subprocess.PIPE, timeout=60,
                                   stderr=subprocess.STDOUT, text=True, check=False)
            assert ended.returncode == 1, ended.stdout
            sys.stdout.write(ended.stdout)
            return
        rospy.init_node('check_hri', disable_signals=True)
        check(session)


if __name__ == '__main__':
    main()
