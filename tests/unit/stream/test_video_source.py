"""Pictures come from folders and video files in order, and what is no source is refused with a clear text."""
import cv2
import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.stream.video_source import VideoSource


def grey(level):
    return np.full((48, 64, 3), level, np.uint8)


def write_video(path, *frames):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 12.0, (64, 48))
    for frame in frames:
        writer.write(frame)
    writer.release()


@pytest.fixture
def folder(tmp_path):
    for name, level in (('b.png', 20), ('a.png', 10), ('c.PNG', 30)):
        cv2.imwrite(str(tmp_path / name.lower()), grey(level))
    (tmp_path / 'notes.txt').write_text('not a picture')
    return tmp_path


def test_a_video_file_that_is_cut_off_says_so(tmp_path, caplog):
    path = tmp_path / 'video.avi'
    write_video(path, *[np.random.default_rng(1).integers(0, 256, (48, 64, 3), dtype=np.uint8)] * 40)
    assert len(list(VideoSource(str(path)).frames())) == 40 and not caplog.text
    path.write_bytes(path.read_bytes()[:path.stat().st_size // 2])
    number = len(list(VideoSource(str(path)).frames()))
    assert 10 < number < 30 and f'video.avi ended after {number} of 40 frames' in caplog.text


def test_what_is_neither_device_nor_path_is_refused():
    with pytest.raises(BadInputError, match='neither a device number nor an existing file'):
        VideoSource('no/such/place')


def test_a_file_that_is_no_picture_is_named(folder):
    (folder / 'b.png').write_text('broken')
    frames = VideoSource(str(folder)).frames()
    next(frames)
    with pytest.raises(BadInputError, match=r'b\.png'):
        next(frames)
    skipped = []
    frames = VideoSource(str(folder)).frames(skip=skipped.append)
    assert [frame[0, 0, 0] for frame in frames] == [10, 30]
    assert [path for error in skipped for path in ('a.png', 'b.png', 'c.png') if path in str(error)] == ['b.png']
