"""What is not saved is never reported as saved: files and videos on disks that are full or gone.

A limit for the size of files stands for a full disk, as it needs no rights.
"""
import errno
import time

import cv2
import numpy as np
import pytest

from disk_limits import file_size_limit
from openpose_ros_pkg.output import video_file
from openpose_ros_pkg.output.files import write_whole
from openpose_ros_pkg.output.recorder import REFUSE, Recorder, SaveParams
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


# --- all files of a frame

def test_files_of_an_earlier_run_stay_and_the_numbers_go_on_after_them(tmp_path):
    params, faults = SaveParams(write_json=str(tmp_path / 'j'), write_images=str(tmp_path / 'i')), []
    with Recorder(params, existing=REFUSE) as recorder:
        assert recorder.next_number() == 0
        recorder.submit(0, NOISE, EMPTY)
    (tmp_path / 'i/000000000007_rendered.png').write_text('older')
    (tmp_path / 'j/000000000009_rendered.png').write_text('no JSON')
    with Recorder(params, existing=REFUSE) as after:
        after.on_fault = faults.append
        assert after.next_number() == 8
        after.submit(7, NOISE, EMPTY)
    assert 'i/000000000007_rendered.png: is there already' in faults[0]
    assert (after.counters['written'], after.counters['failed']) == (1, 1)
    assert (tmp_path / 'i/000000000007_rendered.png').read_text() == 'older'


def test_faults_last_until_it_can_be_saved_again_and_the_rest_is_written(tmp_path):
    faults = []
    with Recorder(SaveParams(write_json=str(tmp_path / 'j'), write_images=str(tmp_path / 'k'))) as recorder:
        recorder.on_fault = faults.append
        (tmp_path / 'j').rmdir()
        for number in range(5):
            recorder.submit(number, NOISE, EMPTY)
        while recorder.counters['written'] < 5 or recorder.counters['failed'] < 5:
            time.sleep(0.001)
        assert [f'j/{number:012d}_keypoints.json: No such file' in fault for number, fault in enumerate(faults)] == [
            True] * 5
        assert 'No such file or directory' in recorder.fault()
        (tmp_path / 'j').mkdir()
        recorder.submit(5, NOISE, EMPTY)
    assert (recorder.fault(), recorder.counters['written'], recorder.counters['failed']) == ('', 7, 5)
