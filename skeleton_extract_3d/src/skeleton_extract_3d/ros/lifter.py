"""What becomes of a pair of image and points: the steps that the extractor and whoever works on recordings share."""
from typing import Callable, Optional, Sequence, Tuple, Union

import numpy as np
from genpy import Time
from geometry_msgs.msg import TransformStamped
from openpose_ros_msgs.msg import PersonDetection
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS, check_pixels
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.estimator import Estimate
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import Transform, transform_landmarks, transform_people
from skeleton_extract_3d.ros import convert

PointsMessage = Union[PointCloud2, Image, CompressedImage]


class Lifter:
    """Turns people of an image and the points of the same view into people in space, as messages have them.

    Args:
        params: kind of the points, and the frames.
        chain: what people in the image go through.
        lookup: returns the transform that takes points of the second frame to the first at a time; raises
            NoTransformError where there is none. Called only for `target_frame` and `tracking_frame`;
            may be None without these.
        most: points of a message, `max_image_megapixels`.
    """

    def __init__(self, params: ExtractorParams, chain: PeopleChain,
                 lookup: Optional[Callable[[str, str, Time], TransformStamped]],
                 most: float = MOST_MEGAPIXELS) -> None:
        self._params = params
        self._chain = chain
        self._lookup = lookup
        self._most = most

    def points(self, message: PointsMessage, info: Optional[CameraInfo], image_size: Tuple[int, int]) -> PointGrid:
        """Return a view of the points of a message, of which is checked what can be before people are known.

        Args:
            message: cloud or depth image, as `points_source` says; a CompressedImage is a compressedDepth.
            info: of the depth image; None with a cloud, and where none has come.
            image_size: width and height of the image that they are of [px].

        Raises:
            BadInputError: it can not be used; see `convert` and `PeopleChain.check_points`.
        """
        if message._type == CompressedImage._type:
            message = convert_2d.compressed_depth_to_image(message, self._most)
        if self._params.points_source == 'point_cloud':
            points: PointGrid = convert.cloud_from_message(message)
        elif info is None:
            raise BadInputError('no camera info came before the depth image')
        else:
            points = convert.depth_image_from_messages(message, info, self._params.rectified)
        check_pixels(self._params.points_source, points.width, points.height, self._most)
        self._chain.check_points(points, image_size)
        return points

    def tracking_from_points(self, header: Header) -> Optional[Transform]:
        """Return what takes the points of a message to the frame in which the room stands still, if one is named.

        Raises:
            NoTransformError: there is no such transform.
        """
        return self._transform_to(self._params.tracking_frame, header)

    def estimate(self, detections: Sequence[PersonDetection], frame: Frame) -> Estimate:
        """Return the people of a frame, in the frame of the points.

        Args:
            detections: what the detection service answers.
            frame: see `camera_frame`.

        Raises:
            BadInputError: image and points differ in aspect ratio, or the points are in no optical frame.
        """
        return self._chain.in_space(convert_2d.people_from_messages(detections, self._chain.skeleton), frame)

    def in_target_frame(self, people: People3D, header: Header) -> Tuple[People3D, Header]:
        """Return the people as they are published, and their header; `header` is that of the points.

        Raises:
            NoTransformError: there is no transform to `target_frame`.
        """
        header, target_from_points = self._target(header)
        return people if target_from_points is None else transform_people(people, *target_from_points), header

    def landmarks_in_target_frame(self, landmarks: Landmarks3D, header: Header) -> Tuple[Landmarks3D, Header]:
        """Return hands and faces as they are published; see `in_target_frame`."""
        header, target_from_points = self._target(header)
        return (landmarks if target_from_points is None else transform_landmarks(landmarks, *target_from_points),
                header)

    def _target(self, header: Header) -> Tuple[Header, Optional[Transform]]:
        """Return the header of what is published, and the transform from the points to its frame; None: the same."""
        target_from_points = self._transform_to(self._params.target_frame, header)
        frame_id = header.frame_id if target_from_points is None else self._params.target_frame
        return Header(stamp=header.stamp, frame_id=frame_id), target_from_points

    def _transform_to(self, frame: str, header: Header) -> Optional[Transform]:
        """Return rotation and translation from the frame of a message to another one at its stamp.

        None where that is the same frame, or no other one is wanted.
        """
        if frame in ('', header.frame_id):
            return None
        return convert.rotation_and_translation(self._lookup(frame, header.frame_id, header.stamp))


def camera_frame(bgr: np.ndarray, points: PointGrid, header: Header, tracking_from_points: Optional[Transform],
                 floor: Optional[np.ndarray] = None) -> Frame:
    """Return what a camera gives at one time.

    Args:
        bgr: (H, W, 3) uint8, the image.
        header: of the points.
        tracking_from_points, floor: see `Frame`.
    """
    return Frame(header.frame_id, header.stamp.to_sec(), bgr, points, tracking_from_points, floor)
