"""Topics of bodies and persons, which come and go with them."""
import time
from typing import Callable, Dict, Sequence

import genpy
import rospy


class BodyTopics:
    """The topics of bodies, or of persons, which come and go with them; `ended` is called with names that go."""

    def __init__(self, root: str, forget: float, ended: Callable[[Sequence[str]], None] = lambda names: None
                 ) -> None:
        self._root, self._forget, self._ended = root, forget, ended
        self._publishers: Dict[str, Dict[str, rospy.Publisher]] = {}
        self._seen: Dict[str, float] = {}

    def publish(self, name: str, topic: str, message: genpy.Message, latch: bool = False) -> None:
        """Publish a message on a topic of one that is tracked; of others, nothing."""
        if name not in self._seen:
            return
        own = self._publishers.setdefault(name, {})
        new = topic not in own
        if new:
            own[topic] = rospy.Publisher(f'{self._root}/{name}/{topic}', type(message), queue_size=10, latch=latch)
        if new or not latch:
            own[topic].publish(message)

    def keep(self, names: Sequence[str]) -> None:
        """Take the names that are tracked now, and end the topics of names that were not for a while."""
        now = time.monotonic()
        self._seen.update(dict.fromkeys(names, now))
        self._end([name for name, seen in self._seen.items() if now - seen > self._forget])

    def clear(self) -> None:
        """End the topics of all."""
        self._end(list(self._seen))

    def _end(self, names: Sequence[str]) -> None:
        for name in names:
            del self._seen[name]
            for publisher in self._publishers.pop(name, {}).values():
                publisher.unregister()
        self._ended(names)
