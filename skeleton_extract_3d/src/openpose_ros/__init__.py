"""People in photos, videos and RGB-D folders, without ROS.

    import openpose_ros

    openpose_ros.people('photo.jpg').draw('people.jpg')
    for frame in openpose_ros.sequence('folder'):     # with depth, in metres
        print(frame.table())
"""
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterator, Optional, Tuple, Union

import numpy as np

from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.output.files import write_image
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.stream.video_source import VideoSource, read_image
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.chain_settings import create_chain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import INFERRED, People3D
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

if TYPE_CHECKING:
    import pandas

__all__ = ['PeopleFrame', 'people', 'sequence']

# Of images and videos that state none [Hz].
_RATE = 25.0


@dataclass(frozen=True, eq=False)
class PeopleFrame:
    """The people in an image and, with depth, in space, in the same order, also those who are hidden."""

    bgr: np.ndarray  # (H, W, 3) uint8
    time: float  # since the first frame [s]
    in_image: People2D  # keypoints (P, K, 3): x, y [px], score; NaN, NaN, 0 where missing
    # xyz (P, K, 3) [m]: right, down, forward of the camera; NaN where missing; None: without depth
    in_space: Optional[People3D]

    def __len__(self) -> int:
        return len(self.in_image)

    def draw(self, path: Union[str, Path, None] = None) -> np.ndarray:
        """Return the image with people drawn into it, (H, W, 3) uint8 BGR; also write it to a file, if one is named."""
        hidden = None if self.in_space is None else self.in_space.status == INFERRED
        drawn = draw_people(self.bgr, self.in_image, DrawParams(), hidden)
        if path is not None:
            write_image(Path(path), drawn)
        return drawn

    def table(self) -> 'pandas.DataFrame':
        """Return a row for each joint: time, person_ID, joint, u, v [px], score; with depth x, y, z, status, sigma."""
        import pandas
        count, joints = len(self), self.in_image.skeleton.joints
        columns = {'time': self.time, 'person_ID': np.repeat(self.in_image.ids, len(joints)), 'joint': joints * count}
        columns.update(zip(('u', 'v', 'score'), self.in_image.keypoints.reshape(-1, 3).T))
        if self.in_space is not None:
            columns.update(zip('xyz', self.in_space.xyz.reshape(-1, 3).T), status=self.in_space.status.ravel(),
                           sigma=self.in_space.sigma.ravel())
        return pandas.DataFrame(columns)


def people(image: Union[str, Path, np.ndarray], **parameters: Any) -> PeopleFrame:
    """Return the people in an image: a file, or (H, W, 3) uint8 BGR.

    Args:
        parameters: any of config/*.yaml, as mode='accurate'.

    Raises:
        BadInputError: the file is no image.
        ModelError: the weights of a network are missing.
    """
    bgr = image if isinstance(image, np.ndarray) else read_image(Path(image).expanduser())
    return _found(bgr, 0.0, _image_chain(tuple(sorted(parameters.items()))).update(Frame('image', 0.0, bgr)))


def sequence(source: Union[str, Path], **parameters: Any) -> Iterator[PeopleFrame]:
    """Yield the people of each frame, who keep their ids.

    Args:
        source: RGB-D folder (rgb/, depth/, camera.yaml, or as images_to_bag reads), folder of images, or video.
        parameters: as of `people`.

    Raises:
        BadInputError: there is no such source, or an image can not be read.
        ModelError: the weights of a network are missing.
    """
    chain = create_chain(parameters)
    for time, bgr, points in _images(Path(source).expanduser()):
        yield _found(bgr, time, chain.update(Frame('camera', 1.0 + time, bgr, points)))


def _images(source: Path) -> Iterator[Tuple[float, np.ndarray, Optional[DepthImage]]]:
    """Yield the time of each frame [s], its image and its depth."""
    if (source / 'depth').is_dir() or (source / 'depth.txt').is_file():
        recording = RgbdSequence.read(source)
        for frame in recording:
            yield frame.time, frame.bgr, DepthImage(frame.depth, recording.camera)
        return
    video = VideoSource(str(source))
    for number, bgr in enumerate(video.frames()):
        yield number / (video.rate or _RATE), bgr, None


@functools.lru_cache(maxsize=1)
def _image_chain(parameters: Tuple[Tuple[str, Any], ...]) -> PeopleChain:
    """Return the chain for single images, whose networks are loaded once."""
    return create_chain(dict(parameters))


def _found(bgr: np.ndarray, time: float, result: Result) -> PeopleFrame:
    estimate = result.estimate
    if estimate is None:
        return PeopleFrame(bgr, time, result.people_2d, None)
    in_image, hidden = estimate.people_2d, estimate.people.ids[len(estimate.people_2d):]
    nowhere = np.full((len(hidden), len(in_image.skeleton.joints), 3), (np.nan, np.nan, 0), np.float32)
    hidden_in_image = People2D(in_image.skeleton, nowhere, np.zeros(len(hidden)), hidden)
    return PeopleFrame(bgr, time, in_image.joined(hidden_in_image), estimate.people)
