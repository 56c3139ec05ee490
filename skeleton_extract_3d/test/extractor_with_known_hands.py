#!/usr/bin/python3
"""The extractor, in which hands and faces are found by something that knows where they are, and says what it is asked.

A hand is at the wrist, a face at the nose of the person. ~asked tells of each image what was looked for.
"""
import numpy as np
import rospy
from std_msgs.msg import String

from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINTS, MESH_POINTS, Faces2D, Hands2D, Landmarks2D
from skeleton_extract_3d.ros import extractor


class KnownLandmarks:
    """See the module."""

    faults = ''

    def __init__(self, params):
        self._params = params
        self._asked = rospy.Publisher('~asked', String, queue_size=100)

    def reconfigure(self, params):
        self._params = params

    def warm_up(self):
        pass

    def detect(self, bgr, people, hidden, camera, stamp, seconds=None):
        self._asked.publish(f'{self._params.hands * "hands"} {self._params.face * "face"}'.strip())
        hands = [(people.ids[p], side == 'left', self._at(people, p, f'{side}_wrist', HAND_POINTS))
                 for p in range(len(people)) for side in ('left', 'right') if self._params.hands]
        hands = [hand for hand in hands if np.isfinite(hand[2]).all()]
        faces = [(people.ids[p], self._at(people, p, 'nose', FACE_POINTS))
                 for p in range(len(people)) if self._params.face]
        faces = [face for face in faces if np.isfinite(face[1]).all()]
        return Landmarks2D(
            Hands2D(np.reshape([points for *_, points in hands], (-1, HAND_POINTS, 3)), np.ones(len(hands)),
                    [person for person, *_ in hands], [left for _, left, _ in hands]),
            Faces2D(np.reshape([points for _, points in faces], (-1, FACE_POINTS, 3)),
                    np.random.RandomState(0).uniform(0, 9, (len(faces), MESH_POINTS, 3)), np.ones(len(faces)),
                    [person for person, _ in faces]))

    def _at(self, people, person, joint, points):
        return np.tile(people.keypoints[person, people.skeleton.index[joint]], (points, 1))


if __name__ == '__main__':
    extractor.create_landmark_detector = lambda params, backend: KnownLandmarks(params)
    extractor.main()
