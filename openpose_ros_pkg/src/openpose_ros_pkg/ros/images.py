"""Subscribe to images, raw or compressed, by one parameter."""
from typing import Union

import message_filters
import rospy
from sensor_msgs.msg import CompressedImage, Image

from openpose_ros_pkg.node_params import ImageTransportParams
from openpose_ros_pkg.ros import convert

AnyImage = Union[Image, CompressedImage]


def image_subscriber(topic: str, params: ImageTransportParams) -> message_filters.Subscriber:
    """Return a subscriber that keeps only the newest image; register callbacks on it."""
    if params.image_transport == 'compressed':
        # resolved first, so that a remapping of the image topic holds for its compressed sibling too
        return message_filters.Subscriber(rospy.resolve_name(topic) + '/compressed', CompressedImage, queue_size=1)
    return message_filters.Subscriber(topic, Image, queue_size=1)


def raw_image(message: AnyImage) -> Image:
    """Return the message itself if it is raw, else the decoded picture as bgr8."""
    if message._type == CompressedImage._type:
        return convert.bgr_to_image(convert.compressed_image_to_bgr(message), message.header)
    return message
