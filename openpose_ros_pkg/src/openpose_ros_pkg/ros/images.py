"""Subscribe to images, raw or compressed, by one parameter."""
from typing import Any, Callable, Union

import rospy
from sensor_msgs.msg import CompressedImage, Image

from openpose_ros_pkg.params.nodes import ImageTransportParams
from openpose_ros_pkg.ros import convert

AnyImage = Union[Image, CompressedImage]


def image_subscriber(topic: str, params: ImageTransportParams, callback: Callable[[Any], None]) -> rospy.Subscriber:
    """Return a subscriber that keeps only the newest image until the callback takes it."""
    if params.image_transport == 'compressed':
        # resolved first, so that a remapping of the image topic holds for its compressed sibling too
        return rospy.Subscriber(rospy.resolve_name(topic) + '/compressed', CompressedImage, callback, queue_size=1)
    return rospy.Subscriber(topic, Image, callback, queue_size=1)


def raw_image(message: AnyImage) -> Image:
    """Return the message itself if it is raw, else the decoded image as bgr8."""
    if message._type == CompressedImage._type:
        return convert.bgr_to_image(convert.compressed_image_to_bgr(message), message.header)
    return message
