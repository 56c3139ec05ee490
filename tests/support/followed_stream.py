"""Images of a camera as a node handles them: looked at, published, then searched until the next one waits."""
from openpose_ros_pkg.detect.detection import ImageFrame
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.image_chain import ImageChain
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.tracking import TrackingParams


class FollowedStream:
    """People who are tracked in the images of cameras; pace: [s] per pixel of the networks, by their names."""

    def __init__(self, detector, pace, following='always'):
        self.detection = NetworkDetection(detector, FollowingParams(following=following), pace)
        self.chain = ImageChain(self.detection, TrackingParams())

    def frame(self, stamp, image, depth=None, camera='camera', waits=False):
        """Return the people of an image, after which it is searched; `waits`: only as far as that is owed."""
        people = self.chain.look(ImageFrame(camera, stamp, image, depth))
        for part in self.chain.search():
            if waits and not part.owed:
                break
        return people
