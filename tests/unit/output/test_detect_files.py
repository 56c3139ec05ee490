"""The command detect_files works through pictures, folders and videos, whatever is wrong with some of them."""
import json
import os
import signal

import cv2
import numpy as np
import pytest

from disk_limits import file_size_limit
from openpose_ros_pkg.detect.detection import KnownPeople
from openpose_ros_pkg.detect_files import main
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18


class People:
    """As many people as the grey level of the picture tells: level 20 is two people, side by side."""

    def __init__(self):
        self.levels, self.stamps = [], []

    def __call__(self, frame):
        count = round(float(frame.bgr.mean()) / 10)
        self.levels.append(count * 10)
        self.stamps.append(frame.stamp)
        keypoints = np.full((count, 18, 3), 0.5, np.float32)
        keypoints[..., :2] = np.arange(18 * 2).reshape(18, 2) / 2
        keypoints[..., 0] += 25 * np.arange(count)[:, np.newaxis]
        return People2D(COCO_18, keypoints, np.full(count, 0.5), np.full(count, -1))


@pytest.fixture
def shown():
    return People()


@pytest.fixture
def run(shown):
    """Run the command, told who is in the pictures; return the exit status."""
    return lambda *arguments: main([str(argument) for argument in arguments],
                                   create=lambda settings: KnownPeople(COCO_18, shown))


def picture(path, level):
    path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(path), np.full((48, 64, 3), level, np.uint8))
    return path


def video(path, levels, rate=12.0):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), rate, (64, 48))
    for level in levels:
        writer.write(np.full((48, 64, 3), level, np.uint8))
    writer.release()
    return path


def people_in(path):
    """Return the people in a JSON file."""
    return json.loads(path.read_text())['people']


def ids_in(path):
    return [person['person_id'][0] for person in people_in(path)]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_nothing_to_save_is_refused(run, tmp_path, capsys):
    assert run(picture(tmp_path / 'a.png', 10)) == 2
    assert 'nothing to save: give --write-json' in capsys.readouterr().err


def test_pictures_are_saved_under_their_names_without_ids(run, shown, tmp_path, capsys):
    folder = tmp_path / 'in'
    for name, level in (('street.png', 20), ('empty.png', 0)):
        picture(folder / name, level)
    assert run(folder, '--write-json', tmp_path / 'j', '--write-images', tmp_path / 'i') == 0
    assert names(tmp_path / 'j') == ['empty_keypoints.json', 'street_keypoints.json']
    assert names(tmp_path / 'i') == ['empty_rendered.png', 'street_rendered.png']
    assert ids_in(tmp_path / 'j/street_keypoints.json') == [-1, -1]
    assert people_in(tmp_path / 'j/street_keypoints.json')[1]['pose_keypoints_2d'][6:8] == [27.0, 2.5]
    assert people_in(tmp_path / 'j/empty_keypoints.json') == []
    assert shown.stamps == [0.0, 0.0]  # without a history
    assert capsys.readouterr().out == '2 frames with 2 people; 4 files written\n'


def test_people_of_a_video_have_ids_and_the_frames_openpose_names(run, shown, tmp_path):
    source, other = video(tmp_path / 'walk.avi', [20, 20, 10]), video(tmp_path / 'other.avi', [10])
    assert run(source, '--write-json', tmp_path / 'j', '--write-video', tmp_path / 'out.avi') == 0
    assert names(tmp_path / 'j') == [f'walk_00000000000{number}_keypoints.json' for number in range(3)]
    ids = [ids_in(path) for path in sorted((tmp_path / 'j').iterdir())]
    assert ids == [[1, 2], [1, 2], [1]]
    written = cv2.VideoCapture(str(tmp_path / 'out.avi'))
    assert (written.get(cv2.CAP_PROP_FRAME_COUNT), written.get(cv2.CAP_PROP_FPS)) == (3, 12)
    assert shown.stamps == pytest.approx([1 / 12, 2 / 12, 3 / 12])  # above 0, which would mean that there is none
    assert run(source, other, '--write-json', tmp_path / 'both') == 0
    assert ids_in(tmp_path / 'both/other_000000000000_keypoints.json') == [1]


def test_what_can_not_be_read_is_reported_and_the_rest_is_done(run, tmp_path, capsys):
    picture(tmp_path / 'in/a.png', 10)
    (tmp_path / 'in/b.png').write_text('broken')
    (tmp_path / 'in/c.mp4').write_text('broken')
    picture(tmp_path / 'in/d.png', 10)
    (tmp_path / 'empty').mkdir()
    assert run(tmp_path / 'in', tmp_path / 'gone.png', tmp_path / 'empty', '--write-json', tmp_path / 'j') == 1
    output = capsys.readouterr()
    assert names(tmp_path / 'j') == ['a_keypoints.json', 'd_keypoints.json']
    assert 'b.png is not an image' in output.err
    assert 'can not open video file' in output.err
    assert 'gone.png does not exist' in output.err and 'empty holds no images or videos' in output.err
    assert '4 inputs could not be read' in output.out


def test_what_is_there_is_skipped_unless_overwritten(run, shown, tmp_path, capsys):
    picture(tmp_path / 'in/a.png', 10)
    video(tmp_path / 'in/v.avi', [20, 20])
    command = (tmp_path / 'in', '--write-json', tmp_path / 'j')
    assert run(*command) == 0
    assert shown.levels == [10, 20, 20]
    picture(tmp_path / 'in/b.png', 30)
    (tmp_path / 'j/v_000000000001_keypoints.json').unlink()
    assert run(*command) == 0
    assert shown.levels[3:] == [30, 20, 20]  # a is there; the video is done as a whole, as ids go on in it
    assert '1 inputs skipped' in capsys.readouterr().out
    assert run(*command, '--overwrite') == 0
    assert shown.levels[6:] == [10, 30, 20, 20]


def test_results_in_the_folder_of_the_inputs_are_no_inputs(run, shown, tmp_path):
    picture(tmp_path / 'a.png', 10)
    command = (tmp_path, '--write-images', tmp_path, '--write-video', tmp_path / 'v.avi', '--overwrite')
    assert [run(*command), run(*command)] == [0, 0]
    assert shown.levels == [10, 10]


def test_inputs_of_the_same_name_are_refused(run, tmp_path, capsys):
    inputs = picture(tmp_path / 'one/a.png', 10), picture(tmp_path / 'two/a.jpg', 10)
    assert run(*inputs, '--write-json', tmp_path / 'j') == 2
    assert 'would write the same files' in capsys.readouterr().err


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_complete_files(run, tmp_path, capsys, monkeypatch, number):
    source, people_of = video(tmp_path / 'v.avi', [10] * 10), People.__call__

    def interrupted(self, frame):
        if len(self.levels) == 4:
            os.kill(os.getpid(), number)
        return people_of(self, frame)

    monkeypatch.setattr(People, '__call__', interrupted)
    # a shell without job control has what it starts in the background ignore SIGINT
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    assert run(source, '--write-json', tmp_path / 'j', '--write-video', tmp_path / 'out.avi') == 130
    signal.signal(signal.SIGINT, before)
    assert [len(people_in(path)) for path in (tmp_path / 'j').iterdir()] == [1] * 4
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    assert cv2.VideoCapture(str(tmp_path / 'out.avi')).get(cv2.CAP_PROP_FRAME_COUNT) == 4
    assert '4 frames with 4 people' in capsys.readouterr().out


@pytest.mark.parametrize('suffix', ['mp4', 'avi'])
def test_a_video_on_a_full_disk_is_not_reported_as_written(run, tmp_path, capsys, suffix):
    source = video(tmp_path / 'v.avi', [10] * 40)
    with file_size_limit(64 << 10):
        assert run(source, '--write-video', tmp_path / f'out.{suffix}') == 1
    output = capsys.readouterr()
    assert output.out == ('40 frames with 40 people; 0 files and video frames written; '
                          '40 files and video frames could not be written\n')
    assert f'not saved: {tmp_path}/out.{suffix}: File too large' in output.err
    assert names(tmp_path) == ['v.avi']


def test_of_a_longer_video_of_the_same_name_nothing_stays(run, tmp_path):
    out = tmp_path / 'out'
    for levels, frames in (((10, 20, 10, 20), 4), ((20, 10), 2)):
        assert run(video(tmp_path / 'a.avi', levels), '--write-json', out, '--overwrite') == 0
        (out / 'a_1_keypoints.json').write_text('{}')
        assert names(out) == [*(f'a_{number:012d}_keypoints.json' for number in range(frames)), 'a_1_keypoints.json']
