"""Follow people instead of searching for them: networks look where people are expected."""
from dataclasses import dataclass

from openpose_ros_pkg.detect.recipes import DetectorParams
from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class FollowingParams(Parameters):
    """Whether people are followed in the images of a stream, instead of being searched for in every image."""

    following: str = parameter(
        'auto', 'Look for people where they are expected, and search the rest of the image little by little; auto: '
                'where target_rate is set and mode is not accurate; never: search every image in full.',
        choices=('auto', 'always', 'never'))
    search_period: int = parameter(
        5, 'Without a target_rate, every image of this number is searched in full.', minimum=1, maximum=1000)
    follow_requests: bool = parameter(
        True, 'Follow people also in images that clients send one by one, by the frame_id and stamp of their headers; '
              'false: search each of these in full.')

    def wanted(self, detector: DetectorParams) -> bool:
        """Return whether people are followed with a detector of these parameters."""
        if self.following == 'auto':
            return detector.target_rate > 0 and detector.mode != 'accurate'
        return self.following == 'always'
