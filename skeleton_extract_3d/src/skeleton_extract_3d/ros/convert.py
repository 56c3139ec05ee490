"""Turn messages into core types and back: the only place of this package that knows both."""
from typing import List, Optional, Sequence, Tuple, Union

import numpy as np
import rospy
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    FaceDetection_3d,
    FaceDetection_3dArray,
    HandDetection_3d,
    HandDetection_3dArray,
    PersonDetection_3d,
    PersonDetection_3dArray,
    PersonVelocity_3d,
)
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINTS
from openpose_ros_pkg.ros.convert import (
    calibration_from_message,
    check_side,
    existence_of,
    in_order_of_fields,
    skeleton_of,
)
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.body.joint_frames import joint_frames
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera
from skeleton_extract_3d.points.cloud import CloudLayout, OrganizedCloud, coordinate_views
from skeleton_extract_3d.points.depth import XYZRGB, DepthImage, ImageLayout
from skeleton_extract_3d.points.transform import TURNED, UPRIGHT, quaternions
from skeleton_extract_3d.show.markers import MarkerSpec

_DATATYPES = {PointField.INT8: 'int8', PointField.UINT8: 'uint8', PointField.INT16: 'int16',
              PointField.UINT16: 'uint16', PointField.INT32: 'int32', PointField.UINT32: 'uint32',
              PointField.FLOAT32: 'float32', PointField.FLOAT64: 'float64'}
# And the scale in x, y and z, as RViz reads it: of lines and texts, one; of arrows, shaft, width and length of the head
_MARKER_TYPES = {'sphere_list': (Marker.SPHERE_LIST, (1, 1, 1)), 'line_list': (Marker.LINE_LIST, (1, 0, 0)),
                 'arrow': (Marker.ARROW, (1, 2, 3)), 'text': (Marker.TEXT_VIEW_FACING, (0, 0, 1))}
_MARKER_ACTIONS = {'add': Marker.ADD, 'delete': Marker.DELETE}
_MISSING_PART = BodypartDetection_3d(x=np.nan, y=np.nan, z=np.nan, confidence=0.0, status=MISSING, sigma=np.nan)
_UNKNOWN_VELOCITY = Vector3(np.nan, np.nan, np.nan)


def cloud_from_message(message: PointCloud2) -> OrganizedCloud:
    """Return a view of an organized cloud.

    Raises:
        BadInputError: empty, unorganized, without x, y and z, truncated, or with contradicting steps.
    """
    return OrganizedCloud(*coordinate_views(message.data, _layout_of(message)))


def sampled_points(message: PointCloud2, most: int) -> np.ndarray:
    """Return about `most` points of a cloud, organized or not, evenly over its rows and columns, (N, 3) float64 [m].

    Those that are missing are left out.

    Raises:
        BadInputError: empty, without x, y and z, truncated, or with contradicting steps.
    """
    excess = message.width * message.height / most
    step = max(1, int(np.ceil(np.sqrt(excess) if message.height > 1 else excess)))
    views = coordinate_views(message.data, _layout_of(message))
    points = np.stack([axis[::step, ::step].ravel() for axis in views], axis=1).astype(np.float64)
    return points[np.isfinite(points).all(axis=1) & points.any(axis=1)]


def _layout_of(message: PointCloud2) -> CloudLayout:
    fields = {field.name: (field.offset, _DATATYPES.get(field.datatype, f'unknown type {field.datatype}'))
              for field in message.fields}
    return CloudLayout(message.width, message.height, message.point_step, message.row_step, fields,
                       bool(message.is_bigendian))


def cloud_to_message(cloud: np.ndarray, header: Header) -> PointCloud2:
    """Return the message of a (H, W) array of dtype XYZRGB."""
    height, width = cloud.shape
    fields = [PointField(name=name, offset=XYZRGB.fields[name][1], datatype=PointField.FLOAT32, count=1)
              for name in XYZRGB.names]
    return PointCloud2(header=header, height=height, width=width, fields=fields, is_bigendian=False,
                       point_step=XYZRGB.itemsize, row_step=XYZRGB.itemsize * width, data=cloud.tobytes(),
                       is_dense=False)


def camera_from_message(message: CameraInfo, rectified: bool = False) -> CameraModel:
    """Return the camera of the images of a CameraInfo; see `calibrated_camera`."""
    return calibrated_camera(calibration_from_message(message), rectified)


def camera_to_message(camera: CameraModel, header: Header) -> CameraInfo:
    (fx, _, cx), (_, fy, cy), _ = camera.matrix.tolist()
    return CameraInfo(header=header, width=camera.width, height=camera.height,
                      distortion_model=camera.distortion_model or 'plumb_bob',
                      D=camera.distortion.tolist() or [0.0] * 5, K=camera.matrix.ravel().tolist(),
                      R=np.eye(3).ravel().tolist(), P=[fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])


def depth_image_from_messages(image: Image, info: CameraInfo, rectified: bool = False) -> DepthImage:
    """Return a view of an aligned depth image; BadInputError: it is damaged, or its camera not calibrated."""
    layout = ImageLayout(image.width, image.height, image.step, image.encoding, bool(image.is_bigendian))
    return DepthImage.from_buffer(image.data, layout, camera_from_message(info, rectified))


def depth_to_message(depth: np.ndarray, header: Header) -> Image:
    """Return the message of a (H, W) depth image: 16UC1 of uint16 [mm], 32FC1 of float32 [m]."""
    height, width = depth.shape
    encoding, dtype = ('32FC1', '<f4') if depth.dtype == np.float32 else ('16UC1', '<u2')
    data = np.ascontiguousarray(depth, dtype)
    return Image(header=header, height=height, width=width, encoding=encoding, is_bigendian=0, step=data.strides[0],
                 data=data.tobytes())


def people_to_messages(people: People3D, header: Header) -> List[PersonDetection_3d]:
    """Return one PersonDetection_3d per person; parts outside the skeleton are MISSING."""
    return [PersonDetection_3d(header, len(people), max(track, 0),
                               *in_order_of_fields(parts, people.skeleton, _MISSING_PART))
            for parts, track in zip(_parts_of(people), people.ids.tolist())]


def velocities_to_messages(people: People3D) -> List[PersonVelocity_3d]:
    """Return one PersonVelocity_3d per person; parts outside the skeleton are NaN."""
    return [PersonVelocity_3d(max(track, 0), *in_order_of_fields([_vector(*values) for values in velocities],
                                                                 people.skeleton, _UNKNOWN_VELOCITY))
            for track, velocities in zip(people.ids.tolist(), people.velocity.tolist())]


def people_to_array(people: People3D, header: Header) -> PersonDetection_3dArray:
    """Return the message of one frame: positions, velocities and existence of all people."""
    return PersonDetection_3dArray(header=header, pose_model=people.skeleton.name,
                                   persons=people_to_messages(people, header),
                                   velocities=velocities_to_messages(people), existence=people.existence.tolist())


def people_from_array(message: PersonDetection_3dArray) -> People3D:
    """Return the people of one frame; velocities are NaN, and existence 1, where the message has none at all.

    Raises:
        BadInputError: the message names an unknown joint set, a joint has a status without a position, an existence is
            no probability, or there are velocities or existences of some persons only.
    """
    skeleton = skeleton_of(message.pose_model)
    xyz, confidence, status, sigma = _values_of([[getattr(person, joint) for joint in skeleton.joints]
                                                 for person in message.persons], len(skeleton.joints))
    ids = np.array([person.person_ID for person in message.persons], np.int64)
    try:
        return People3D(skeleton, xyz, confidence, status, sigma, ids, _velocities(message, skeleton),
                        existence_of(message))
    except ValueError as error:
        raise BadInputError(str(error)) from error


def _velocities(message: PersonDetection_3dArray, skeleton: SkeletonModel) -> Optional[np.ndarray]:
    """Return the velocities of a frame, (P, K, 3) [m/s]; None: the message has none."""
    if not message.velocities:
        return None
    if len(message.velocities) != len(message.persons):
        raise BadInputError(f'{len(message.velocities)} velocities of {len(message.persons)} persons, expected one of '
                            'each or none')
    return np.array([[(vector.x, vector.y, vector.z) for vector in (getattr(person, j) for j in skeleton.joints)]
                     for person in message.velocities])


def hands_to_array(hands: Hands3D, header: Header) -> HandDetection_3dArray:
    return HandDetection_3dArray(header=header, hands=[
        HandDetection_3d(header=header, person_ID=max(person, 0), confidence=score, keypoints=parts,
                         side=HandDetection_3d.LEFT if left else HandDetection_3d.RIGHT)
        for parts, score, person, left in zip(_parts_of(hands.points), hands.scores.tolist(), hands.people.tolist(),
                                              hands.left.tolist())])


def hands_from_array(message: HandDetection_3dArray) -> Hands3D:
    """Return the hands in space; BadInputError: a wrong side, or a point with a status without a position."""
    for hand in message.hands:
        check_side(hand.side)
    return Hands3D(_points([hand.keypoints for hand in message.hands], HAND_POINTS),
                   np.array([hand.confidence for hand in message.hands], np.float32),
                   np.array([hand.person_ID for hand in message.hands], np.int64),
                   np.array([hand.side == HandDetection_3d.LEFT for hand in message.hands], bool))


def faces_to_array(faces: Faces3D, header: Header) -> FaceDetection_3dArray:
    rows = zip(_parts_of(faces.points), faces.scores.tolist(), faces.people.tolist(), faces.orientations.tolist(),
               faces.orientation_sigma.tolist())
    return FaceDetection_3dArray(header=header, faces=[
        FaceDetection_3d(header=header, person_ID=max(person, 0), confidence=score, keypoints=parts,
                         orientation=Quaternion(*turn), orientation_sigma=sigma)
        for parts, score, person, turn, sigma in rows])


def faces_from_array(message: FaceDetection_3dArray) -> Faces3D:
    """Return the faces in space; BadInputError: a point has a status without a position."""
    turns = [(face.orientation.x, face.orientation.y, face.orientation.z, face.orientation.w) for face in message.faces]
    return Faces3D(_points([face.keypoints for face in message.faces], FACE_POINTS),
                   np.array([face.confidence for face in message.faces], np.float32),
                   np.array([face.person_ID for face in message.faces], np.int64),
                   np.array(turns, np.float32).reshape(-1, 4),
                   np.array([face.orientation_sigma for face in message.faces], np.float32))


def _parts_of(points: Union[People3D, Points3D]) -> List[List[BodypartDetection_3d]]:
    return [[_part(*xyz, *others) for xyz, *others in zip(*row)]
            for row in zip(points.xyz.tolist(), points.confidence.tolist(), points.status.tolist(),
                           points.sigma.tolist())]


def _part(x: float, y: float, z: float, confidence: float, status: int, sigma: float) -> BodypartDetection_3d:
    part = BodypartDetection_3d()  # with arguments, genpy takes 5 to 25 times as long
    part.x, part.y, part.z, part.confidence, part.status, part.sigma = x, y, z, confidence, status, sigma
    return part


def _vector(x: float, y: float, z: float) -> Vector3:
    vector = Vector3()
    vector.x, vector.y, vector.z = x, y, z
    return vector


def _values_of(parts: Sequence[Sequence[BodypartDetection_3d]], number: int) -> Tuple[np.ndarray, ...]:
    """Return positions (N, number, 3), confidence, status and sigma (N, number) of body parts."""
    values = np.array([[(part.x, part.y, part.z, part.confidence, part.status, part.sigma) for part in row]
                       for row in parts], np.float64).reshape(-1, number, 6)
    return (values[..., :3], *np.moveaxis(values[..., 3:], -1, 0))


def _points(parts: Sequence[Sequence[BodypartDetection_3d]], number: int) -> Points3D:
    """Return the points of messages, `number` of each hand or face."""
    xyz, confidence, status, sigma = _values_of(parts, number)
    try:
        return Points3D(xyz, confidence, status, sigma)
    except ValueError as error:
        raise BadInputError(str(error)) from error


def turned_frame(header: Header, rotation: np.ndarray, child_frame: str) -> TransformStamped:
    """Return the transform of a frame at the same place, with axes that are columns of a rotation (3, 3)."""
    return transform_from_matrix(np.block([[rotation, np.zeros((3, 1))], [np.zeros(3), 1.0]]), header, child_frame)


def upright_transform(header: Header) -> TransformStamped:
    """Return the transform from the upright frame of a level camera to its optical frame, that of a header."""
    return turned_frame(header, UPRIGHT, header.frame_id + TURNED)


def people_to_transforms(people: People3D, header: Header) -> List[TransformStamped]:
    """Return a frame `person_<id>/<joint>` for each joint that is not MISSING, with the axes of `joint_frames`."""
    transforms = []
    there = people.status != MISSING
    rotations = quaternions(joint_frames(people)[there])
    for (p, j), rotation in zip(np.argwhere(there).tolist(), rotations.tolist()):
        frame = f'person_{people.ids[p]}/{people.skeleton.joints[j]}'
        transform = TransformStamped(header=header, child_frame_id=frame)
        transform.transform.translation = Vector3(*people.xyz[p, j].tolist())
        transform.transform.rotation = Quaternion(*rotation)
        transforms.append(transform)
    return transforms


def marker_to_message(marker: MarkerSpec, header: Header) -> Marker:
    kind, scales = _MARKER_TYPES[marker.kind]
    number = int(np.array(marker.id).astype(np.int32))  # ids of people are unsigned
    message = Marker(header=header, ns=marker.ns, id=number, type=kind, action=_MARKER_ACTIONS[marker.action],
                     text=marker.text, lifetime=rospy.Duration(marker.lifetime), color=ColorRGBA(*marker.rgba),
                     scale=Vector3(*(marker.scale * each for each in scales)),
                     points=[Point(*point) for point in marker.points.tolist()])
    message.pose.orientation.w = 1.0
    if marker.kind == 'text' and message.points:
        # RViz puts a text at the pose and looks at no points
        message.pose.position, message.points = message.points[0], []
    return message


def rotation_and_translation(transform: TransformStamped) -> Tuple[np.ndarray, np.ndarray]:
    """Return R (3, 3) and t (3,) [m] of a transform: x in the parent frame = R x + t.

    Raises:
        BadInputError: its numbers are not finite, or its quaternion has no length.
    """
    rotation, translation = transform.transform.rotation, transform.transform.translation
    quaternion = [rotation.x, rotation.y, rotation.z, rotation.w]
    moved = [translation.x, translation.y, translation.z]
    # squares of numbers beyond have no length in float64
    if not (1e-3 < np.abs(quaternion).max() < 1e3 and np.isfinite([*quaternion, *moved]).all()):
        raise BadInputError(f'the transform from {transform.child_frame_id} to {transform.header.frame_id} has '
                            f'translation {moved} and quaternion {quaternion}, expected finite numbers and length 1')
    return (np.array(Rotation.from_quat(quaternion).apply(np.eye(3))).T,
            np.array(moved))


def transform_from_matrix(matrix: np.ndarray, header: Header, child_frame: str) -> TransformStamped:
    """Return the transform of a (3, 4) or (4, 4) matrix that takes points of child_frame to header.frame_id."""
    matrix = np.asarray(matrix, np.float64)
    transform = TransformStamped(header=header, child_frame_id=child_frame)
    transform.transform.translation = Vector3(*matrix[:3, 3])
    transform.transform.rotation = Quaternion(*quaternions(matrix[None, :3, :3])[0])
    return transform
