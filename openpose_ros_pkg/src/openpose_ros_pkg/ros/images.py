"""Message filters that subscribe to the nodes' inputs; images raw or compressed, by one parameter."""
import functools
import time
from typing import Any, Callable, Optional, Tuple, Type, Union

import genpy
import message_filters
import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.ros import convert

AnyImage = Union[Image, CompressedImage]


class InputSubscriber(message_filters.SimpleFilter):
    """Passes on what a message_filters.Subscriber receives, and can rest, as that of C++ can.

    It rests until `subscribe` is called. Only the newest message waits until the callbacks have taken the one before.

    Attributes:
        optional: the node does without its messages: it says nothing while none comes.
        start: command that starts a publisher; named where there is none.
        kind: type of its messages, as package/Type.
        lost: messages that were sent while it was subscribed and did not come: gaps in `header.seq` of one publisher.
        on_error: called with a BadInputError for bytes that are no message of this type; they are not passed on.
    """

    def __init__(self, topic: str, message_type: Any, optional: bool = False, start: str = '') -> None:
        super().__init__()
        self.resolved_name: str = rospy.resolve_name(topic)
        self.kind: str = message_type._type
        self.optional, self.start = optional, start
        self._waits_since = 0.0
        self.lost = 0
        self.on_error: Callable[[Exception], None] = lambda error: None
        self._suffices = message_type is CameraInfo  # one message, which holds for those that follow
        self._message_type = _tolerant(message_type)
        self._subscriber: Optional[message_filters.Subscriber] = None
        self._newest: Tuple[Any, int] = None, 0

    def subscribe(self) -> None:
        """Let messages come."""
        self._waits_since = time.monotonic()
        self._subscriber = message_filters.Subscriber(self.resolved_name, self._message_type, queue_size=1)
        self._subscriber.registerCallback(self._receive)

    @property
    def subscribed(self) -> bool:
        """Whether messages may come."""
        return self._subscriber is not None

    @property
    def silence(self) -> float:
        """For how long no message has come while it was subscribed [s]; 0 while it is not, or a camera info holds."""
        holds = self._suffices and self._newest[0] is not None
        return time.monotonic() - self._waits_since if self.subscribed and not holds else 0.0

    @property
    def connected(self) -> bool:
        """Whether there is a connection to a publisher."""
        subscriber = self._subscriber
        connections = subscriber and subscriber.sub.impl  # None, too, where it is just being ended
        return connections is not None and connections.get_num_connections() > 0

    def unsubscribe(self) -> None:
        """Let no message come, and let the publisher know, until `subscribe` is called."""
        if self._subscriber is not None:
            self._subscriber.sub.unregister()
            self._subscriber = None

    def _receive(self, message: Any) -> None:
        self._waits_since = time.monotonic()
        if message.unreadable is not None:
            self.on_error(BadInputError(f'{self.resolved_name}: {message.unreadable} bytes are no '
                                        f'{message._type}: its publisher is damaged'))
            return
        # rospy gives all messages of a connection the same header of the connection
        connection, seq = message._connection_header, message.header.seq
        last_connection, last_seq = self._newest
        self._newest = connection, seq
        if connection is last_connection:
            self.lost += max(seq - last_seq - 1, 0)
        self.signalMessage(message)


@functools.lru_cache(maxsize=None)
def _tolerant(message_type: Type[genpy.Message]) -> Type[genpy.Message]:
    """Return a message type without a slash before its frame, with the number of bytes that are none as `unreadable`.

    Where a message raises, rospy leaves its bytes in the buffer of the connection: they are read again with each
    message that follows, so that none arrives any more while the buffer grows.
    """
    class Tolerant(message_type):  # type: ignore[valid-type, misc]
        unreadable: Optional[int] = None

        def deserialize(self, data: bytes) -> 'Tolerant':
            try:
                super().deserialize(data)
                self.header.frame_id = frame_name(self.header.frame_id)
            except genpy.DeserializationError:
                self.unreadable = len(data)
            return self

    return Tolerant


def image_subscriber(topic: str, transport: str) -> InputSubscriber:
    """Return a subscriber of images as image_transport publishes them; 'auto' or 'raw': Image, else CompressedImage."""
    if transport in ('auto', 'raw'):
        return InputSubscriber(topic, Image)
    # resolved first, so that a remapping of the image topic holds for its compressed sibling too
    return InputSubscriber(f'{rospy.resolve_name(topic)}/{transport}', CompressedImage)


def raw_image(message: AnyImage, most: float, degrees: int = 0) -> Image:
    """Return the message itself if it is raw, else the image as bgr8, turned clockwise; BadInputError: it has none."""
    if not degrees and message._type == Image._type:
        return message
    raw = convert.bgr_to_image(convert.any_image_to_bgr(message, most), message.header)
    return convert.turned_image(raw, degrees) if degrees else raw
