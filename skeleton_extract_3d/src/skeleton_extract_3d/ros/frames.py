"""Points of messages, and the frames of reference in which people are tracked and published."""
from typing import Callable, Optional, Tuple, TypeVar, Union

import numpy as np
from genpy import Time
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS, check_pixels
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.depth import NoDepth
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import (
    IDENTITY,
    Transform,
    quarter_turns,
    transform_landmarks,
    transform_people,
)
from skeleton_extract_3d.ros import convert

PointsMessage = Union[PointCloud2, Image, CompressedImage]
Found = TypeVar('Found', People3D, Landmarks3D)


def points_from_message(message: PointsMessage, info: Optional[CameraInfo], params: ExtractorParams,
                        most: float = MOST_MEGAPIXELS) -> PointGrid:
    """Return a view of the points of a message: a cloud, a depth image, or an image without depth, as `points_source`
    says.

    Args:
        info: of the depth image, or the image; None with a cloud, and where none has come.
        most: megapixels of a message.

    Raises:
        BadInputError: it can not be used; see `convert`.
    """
    degrees = params.rotate_image
    if params.points_source != 'point_cloud' and info is None:
        raise BadInputError('no camera info came before the image')
    if params.points_source == 'none':
        return NoDepth(convert.camera_from_message(convert_2d.turned_info(info, degrees) if degrees else info,
                                                   params.rectified == 'true'))
    if message._type == CompressedImage._type:
        message = convert_2d.compressed_depth_to_image(message, most)
    if params.points_source == 'point_cloud':
        cloud = convert.cloud_from_message(message)
        points: PointGrid = cloud.turned(degrees) if degrees else cloud
    else:
        if degrees:
            message, info = convert_2d.turned_image(message, degrees), convert_2d.turned_info(info, degrees)
        points = convert.depth_image_from_messages(message, info, params.rectified == 'true')
    check_pixels(params.points_source, points.width, points.height, most)
    return points


class FrameTransforms:
    """The transforms from the frame of the points to the `tracking_frame` and `target_frame` of the parameters.

    Args:
        lookup: returns the transform that takes points of the second frame to the first at a time, or raises
            NoTransformError. Called only for frames that are named; may be None without these.

    Attributes:
        degrees: by which the images are turned clockwise.
    """

    def __init__(self, params: ExtractorParams,
                 lookup: Optional[Callable[[str, str, Time], TransformStamped]]) -> None:
        self._params, self._lookup, self.degrees = params, lookup, params.rotate_image

    def tracking_from_points(self, header: Header) -> Optional[Transform]:
        """Return what takes the points of a message to `tracking_frame`; None: none is named; NoTransformError."""
        return self._transform_to(self._params.tracking_frame, header)

    def floor(self, header: Header) -> Optional[np.ndarray]:
        """Return the floor before a camera without depth, see `Frame`: z = 0 of `tracking_frame`, with `use_floor`."""
        is_wanted = self._params.use_floor and self._params.points_source == 'none'
        pose = self.tracking_from_points(header) if is_wanted else None
        return None if pose is None else np.append(pose[0][2], pose[1][2])

    def in_target_frame(self, found: Found, header: Header) -> Tuple[Found, Header]:
        """Return people, or hands and faces, as they are published, and their header; raises NoTransformError."""
        target_from_points = self._transform_to(self._params.target_frame, header)
        if target_from_points is None:
            return found, Header(stamp=header.stamp, frame_id=header.frame_id)
        transform = transform_people if isinstance(found, People3D) else transform_landmarks
        return transform(found, *target_from_points), Header(stamp=header.stamp, frame_id=self._params.target_frame)

    def _transform_to(self, frame: str, header: Header) -> Optional[Transform]:
        """Return the transform to another frame at the stamp of a message; None: the same, or none is named."""
        if frame in ('', header.frame_id):
            return None
        own = self._untouched(header.frame_id)
        rotation, translation = IDENTITY if frame == own else convert.rotation_and_translation(
            self._lookup(frame, own, header.stamp))
        return rotation @ quarter_turns(self.degrees).T, translation

    def _untouched(self, frame: str) -> str:
        """Return the frame of the camera that is turned."""
        return frame[:-len(convert_2d.TURNED_FRAME)] if self.degrees else frame

    def of_camera(self, header: Header) -> Optional[TransformStamped]:
        """Return the transform from the frame of the turned points to that of the camera; None: none are turned."""
        own = Header(stamp=header.stamp, frame_id=self._untouched(header.frame_id))
        turn = quarter_turns(self.degrees).T
        return convert.turned_frame(own, turn, header.frame_id) if self.degrees else None
