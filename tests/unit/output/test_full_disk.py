"""What is not saved is never reported as saved: files and videos on disks that are full, gone, or not ours alone.

A limit for the size of files stands for a full disk, as it needs no rights.
"""
import errno
import os
import shutil

import cv2
import numpy as np
import pytest

from disk_limits import file_size_limit
from openpose_ros_pkg.output import video_file
from openpose_ros_pkg.output.files import write_whole
from openpose_ros_pkg.output.frame_writer import REFUSE, FrameWriter, SaveParams
from openpose_ros_pkg.output.video_file import VideoFile
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18

EMPTY = People2D.empty(COCO_18)
NOISE = np.random.RandomState(0).randint(0, 256, (240, 320, 3)).astype(np.uint8)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def readable(path):
    capture = cv2.VideoCapture(str(path))
    count = 0
    while capture.read()[0]:
        count += 1
    return count


# --- whole files

def test_a_failed_write_names_the_file_leaves_the_old_one_and_nothing_else(tmp_path):
    path = tmp_path / 'a.json'
    write_whole(path, b'old')
    with file_size_limit(1000), pytest.raises(OSError, match=r'too large: .*/a\.json') as error:
        write_whole(path, bytes(2000))
    assert error.value.errno == errno.EFBIG
    assert path.read_bytes() == b'old'
    assert names(tmp_path) == ['a.json']


def test_what_fails_when_the_disk_is_told_to_keep_it_is_seen(tmp_path, monkeypatch):
    def fails(_):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, 'fsync', fails)
    with pytest.raises(OSError, match=r'error: .*/a\.json'):
        write_whole(tmp_path / 'a.json', b'content')
    assert names(tmp_path) == []


# --- videos

def test_no_frame_is_accepted_that_leaves_no_room_to_complete_the_video(tmp_path):
    video = VideoFile(tmp_path / 'v.avi', 30.0)
    refused = 0
    with file_size_limit(5 << 20):
        for _ in range(40):
            try:
                video.write(NOISE)  # 80 kB each
            except OSError as error:
                assert (error.errno, error.filename) == (errno.EFBIG, str(tmp_path / 'v.avi'))
                refused += 1
        video.close()
    assert 0 < video.frames < 40
    assert (video.frames + refused, video.lost) == (40, 0)
    assert readable(tmp_path / 'v.avi') == video.frames


@pytest.mark.parametrize('suffix, limit', [('mp4', 100000), ('avi', 1 << 20), ('avi', 1000)])
def test_a_video_that_can_not_be_completed_is_lost_and_says_so(tmp_path, monkeypatch, suffix, limit):
    monkeypatch.setattr(video_file, '_RESERVE', -1 << 60)  # the disk fills up in the last moment
    video = VideoFile(tmp_path / f'v.{suffix}', 30.0)
    with file_size_limit(limit):
        for _ in range(40):
            video.write(NOISE)
        with pytest.raises(OSError, match=rf'the video is damaged.*v\.{suffix}'):
            video.close()
    assert (video.frames, video.lost) == (0, 40)
    assert (tmp_path / f'v.{suffix}').exists() == (readable(tmp_path / f'v.{suffix}') > 0)


def test_after_a_video_was_deleted_a_new_one_begins(tmp_path):
    folder = tmp_path / 'out'
    folder.mkdir()
    video = VideoFile(folder / 'v.avi', 30.0)
    for _ in range(3):
        video.write(NOISE)
    shutil.rmtree(str(folder))
    with pytest.raises(FileNotFoundError, match='deleted while it was written, with 3 frames'):
        video.write(NOISE)
    with pytest.raises(FileNotFoundError, match='out'):
        video.write(NOISE)
    folder.mkdir()
    video.write(NOISE)
    video.close()
    assert (video.frames, video.lost, readable(folder / 'v.avi')) == (1, 3, 1)


def test_two_do_not_write_the_same_video(tmp_path):
    with VideoFile(tmp_path / 'v.avi', 30.0) as first:
        first.write(NOISE)
        with VideoFile(tmp_path / 'v.avi', 30.0) as second, pytest.raises(BlockingIOError, match='another program'):
            second.write(NOISE)
        first.write(NOISE)
    assert readable(tmp_path / 'v.avi') == 2


# --- all files of a frame

def test_files_of_an_earlier_run_stay_and_the_numbers_go_on_after_them(tmp_path):
    params = SaveParams(write_json=str(tmp_path / 'j'), write_images=str(tmp_path / 'i'))
    writer = FrameWriter(params, existing=REFUSE)
    assert writer.next_number() == 0
    writer.write(0, NOISE, EMPTY)
    (tmp_path / 'i/000000000007_rendered.png').write_text('older')
    (tmp_path / 'j/000000000009_rendered.png').write_text('no JSON')
    after = FrameWriter(params, existing=REFUSE)
    assert after.next_number() == 8
    assert 'i/000000000007_rendered.png: is there already' in after.write(7, NOISE, EMPTY)
    assert (after.written, after.failed) == (1, 1)
    assert (tmp_path / 'i/000000000007_rendered.png').read_text() == 'older'


def test_faults_last_until_it_can_be_saved_again_and_the_rest_is_written(tmp_path):
    writer = FrameWriter(SaveParams(write_json=str(tmp_path / 'j'), write_keypoint=str(tmp_path / 'k')))
    (tmp_path / 'j').rmdir()
    for number in range(5):
        assert f'j/{number:012d}_keypoints.json: No such file' in writer.write(number, NOISE, EMPTY)
    assert (writer.written, writer.failed) == (5, 5)
    assert len(names(tmp_path / 'k')) == 5
    assert 'No such file or directory (5 frames in a row)' in writer.fault(5)
    assert writer.fault(6) == ''
    (tmp_path / 'j').mkdir()
    assert writer.write(5, NOISE, EMPTY) == writer.fault() == ''
    assert (writer.written, writer.failed) == (7, 5)
