"""Saved files have OpenPose's names, layout and digits, and no mishap ends the program."""
import json
import threading

import cv2
import numpy as np
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output import recorder as recorder_module
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams
from openpose_ros_pkg.output.openpose_json import people_to_json
from openpose_ros_pkg.output.recorder import REFUSE, Recorder, SaveParams
from openpose_ros_pkg.output.video_file import VideoFile
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import BODY_25, COCO_17, COCO_18, MPI_15

GREY = np.full((48, 64, 3), 100, np.uint8)
EMPTY = People2D.empty(COCO_18)


def some_people(skeleton=COCO_18, count=3, seed=0):
    """People with about a third of their joints missing; the first has all, with awkward numbers."""
    rng = np.random.default_rng(seed)
    keypoints = rng.uniform(0, 1920, (count, len(skeleton.joints), 3)).astype(np.float32)
    keypoints[..., 2] = rng.uniform(1e-6, 1, keypoints.shape[:2])
    missing = rng.random(keypoints.shape[:2]) < 0.3
    missing[0] = False
    keypoints[missing] = (np.nan, np.nan, 0)
    keypoints[0, 0] = (0, np.float32(1) / 3, np.float32(1e-7))  # in the corner, yet there
    scores = keypoints[..., 2].sum(axis=1) / (~missing).sum(axis=1)
    return People2D(skeleton, keypoints, scores, np.arange(count) * 7)


# --- JSON


def test_json_has_the_layout_of_openpose():
    assert people_to_json(People2D.empty(COCO_18)) == '{"version":1.3,"people":[]}'
    keypoints = np.full((1, 18, 3), np.nan, np.float32)
    keypoints[..., 2] = 0
    keypoints[0, 1] = (320.5, 0.1, 0.9)
    people = People2D(COCO_18, keypoints, [0.9], [-1])
    # the order of the keys is that of OpenPose 1.7's wPeopleJsonSaver.hpp
    assert people_to_json(people) == (
        '{"version":1.3,"people":[{"person_id":[-1],"pose_keypoints_2d":[0.0,0.0,0.0,320.5,0.1,0.9'
        + ',0.0' * 48 + '],"face_keypoints_2d":[],"hand_left_keypoints_2d":[],"hand_right_keypoints_2d":[],'
        '"pose_keypoints_3d":[],"face_keypoints_3d":[],"hand_left_keypoints_3d":[],"hand_right_keypoints_3d":[]}]}')


def keypoints_in_file(path):
    """Return the keypoints of the people in a JSON file, (K, 3) each."""
    entries = json.loads(path.read_text())['people']
    return [np.array(entry['pose_keypoints_2d'], np.float32).reshape(-1, 3) for entry in entries]


# --- joint sets


@pytest.mark.parametrize('source, target, joint, ends', [
    (COCO_18, BODY_25, 'mid_hip', ('left_hip', 'right_hip')),
    (COCO_17, MPI_15, 'neck', ('left_shoulder', 'right_shoulder'))])
def test_neck_and_mid_hip_are_in_the_middle_where_both_sides_are_there(source, target, joint, ends):
    keypoints = some_people(source, count=1).keypoints.copy()
    left, right = (keypoints[0, source.index[end]] for end in ends)
    middle = keypoints_in(keypoints, source, target)[0, target.index[joint]]
    np.testing.assert_allclose(middle, [*(left[:2] + right[:2]) / 2, min(left[2], right[2])], rtol=1e-6)
    keypoints[0, source.index[ends[0]]] = (np.nan, np.nan, 0)
    assert not keypoints_in(keypoints, source, target)[0, target.index[joint], 2]


# --- video

def video_frames(path):
    capture = cv2.VideoCapture(str(path))
    frames = []
    while True:
        there, frame = capture.read()
        if not there:
            return frames, capture.get(cv2.CAP_PROP_FPS)
        frames.append(frame)


@pytest.mark.parametrize('name', ['v.mp4', 'v.avi', 'V.AVI'])
def test_video_has_its_frames_and_rate(tmp_path, name):
    with VideoFile(tmp_path / name, 12.0) as video:
        for level in (40, 120, 200):
            video.write(np.full((48, 64, 3), level, np.uint8))
    frames, rate = video_frames(tmp_path / name)
    assert rate == pytest.approx(12.0)
    np.testing.assert_allclose([frame.mean() for frame in frames], [40, 120, 200], atol=4)


def test_frames_of_another_size_are_fitted_into_a_video(tmp_path):
    with VideoFile(tmp_path / 'v.avi', 10.0) as video:
        video.write(GREY)
        video.write(np.full((96, 64, 3), 200, np.uint8))  # twice as high: half as wide in the middle
    frame = video_frames(tmp_path / 'v.avi')[0][1].astype(float)
    assert frame.shape == GREY.shape
    assert frame[:, 18:46].mean() == pytest.approx(200, abs=4)
    assert frame[:, :14].mean() == pytest.approx(0, abs=4)
    assert frame[:, 50:].mean() == pytest.approx(0, abs=4)


def test_video_that_can_not_be_begun_leaves_what_was_there(tmp_path):
    (tmp_path / 'earlier.mp4').write_bytes(b'a video')
    for name in ('earlier.mp4', 'new.mp4'):
        with VideoFile(tmp_path / name, 10.0) as video, pytest.raises(OSError, match=f'70000x16 pixels.*{name}'):
            video.write(np.zeros((16, 70000, 3), np.uint8))
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [('earlier.mp4', b'a video')]


# --- all files of a frame

def test_all_files_of_a_frame_have_the_names_of_openpose(tmp_path):
    params = SaveParams(write_json=str(tmp_path / 'j'), write_images=str(tmp_path / 'i/deep'),
                        write_video=str(tmp_path / 'v.avi'))
    people = some_people()
    with Recorder(params) as recorder:
        recorder.submit('street', GREY, people)
        recorder.submit(12, GREY, EMPTY)
    files = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob('*') if path.is_file()}
    assert files == {'j/street_keypoints.json', 'j/000000000012_keypoints.json', 'i/deep/street_rendered.png',
                     'i/deep/000000000012_rendered.png', 'v.avi'}
    assert set(recorder.files('street').values()) == {tmp_path / name for name in files if 'street' in name}
    assert (recorder.counters['written'], recorder.counters['failed']) == (6, 0)
    np.testing.assert_array_equal(keypoints_in_file(tmp_path / 'j/street_keypoints.json'),
                                  np.nan_to_num(people.keypoints))
    assert len(keypoints_in_file(tmp_path / 'j/000000000012_keypoints.json')) == 0
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / 'i/deep/street_rendered.png')),
                                  draw_people(GREY, people, DrawParams()))
    frames, rate = video_frames(tmp_path / 'v.avi')
    assert (len(frames), rate) == (2, 10.0)


def test_a_video_has_the_rate_of_its_source_and_units_and_joint_set_can_be_chosen(tmp_path):
    params = SaveParams(write_json=str(tmp_path), write_joint_set='BODY_25', write_video=str(tmp_path / 'v.avi'))
    people = some_people()
    with Recorder(params, scale=KeypointScaleParams(keypoint_scale=3), source_rate=25.0) as recorder:
        recorder.submit('a', GREY, people)
    assert {path.name for path in tmp_path.iterdir()} == {'a_keypoints.json', 'v.avi'}
    read = keypoints_in_file(tmp_path / 'a_keypoints.json')
    assert read[0].shape == (25, 3)
    np.testing.assert_allclose(read[0][0, :2], people.xy[0, 0] / (63, 47), rtol=1e-6)
    assert video_frames(tmp_path / 'v.avi')[1] == 25.0


@pytest.mark.parametrize('key', ['write_json', 'write_images', 'write_video'])
def test_a_place_that_can_not_be_written_is_an_error_at_start(tmp_path, key):
    (tmp_path / 'file').write_text('in the way')
    with pytest.raises(ParameterError, match=f"'{key}'.*in the way|'{key}'.*file"):
        Recorder(SaveParams(**{key: str(tmp_path / 'file' / 'v.avi')}))


# --- the queue

@pytest.fixture
def held(monkeypatch):
    """Let no JSON file be written until `go` is set; `busy`: the first one is begun."""
    go, busy, write = threading.Event(), threading.Event(), recorder_module.write_whole

    def wait(path, content):
        busy.set()
        assert go.wait(60)
        if path.name.startswith('bad'):
            raise RuntimeError('bad frame')
        write(path, content)

    monkeypatch.setattr(recorder_module, 'write_whole', wait)
    return go, busy


def written(folder):
    return sorted(int(path.name.partition('_')[0]) for path in folder.iterdir())


def test_a_full_queue_drops_new_frames_and_counts_them(tmp_path, held, monkeypatch):
    (go, busy), faults = held, []
    monkeypatch.setattr(recorder_module, '_QUEUE_SIZE', 2)
    recorder = Recorder(SaveParams(write_json=str(tmp_path)), existing=REFUSE)
    recorder.on_fault = faults.append
    assert recorder.submit(0, GREY, EMPTY)
    assert busy.wait(60)  # frame 0 is being written, the queue is empty
    assert [recorder.submit(number, GREY, EMPTY) for number in range(1, 6)] == [True, True, False, False, False]
    assert recorder.counters == {'written': 0, 'failed': 0, 'dropped': 3, 'waiting': 2}
    go.set()
    recorder.close()
    assert written(tmp_path) == [0, 1, 2]
    assert faults == ['saving is slower than the frames: 2 are waiting'] * 3


def test_a_waiting_recorder_loses_nothing(tmp_path, held):
    go, busy = held
    recorder = Recorder(SaveParams(write_json=str(tmp_path)))
    caller = threading.Thread(target=lambda: [recorder.submit(number, GREY, EMPTY) for number in range(30)])
    caller.start()
    assert busy.wait(60)
    caller.join(0.05)
    assert caller.is_alive()  # it waits for a place
    go.set()
    caller.join(10)
    recorder.close()
    assert written(tmp_path) == list(range(30)) and recorder.counters['dropped'] == 0


def test_a_frame_that_fails_does_not_end_the_recorder(tmp_path, held):
    held[0].set()
    with Recorder(SaveParams(write_json=str(tmp_path))) as recorder:
        for frame in ('1', 'bad', '2'):
            recorder.submit(frame, GREY, EMPTY)
    assert written(tmp_path) == [1, 2]
    assert not recorder.submit('late', GREY, EMPTY)
    assert recorder.counters['failed'] == 1


def test_people_in_space_stand_beside_those_in_the_image():
    people = some_people()
    in_space = np.random.default_rng(1).normal(0, 3, (3, 18, 4)).astype(np.float32)
    entries = json.loads(people_to_json(people, in_space))['people']
    assert [entry['person_id'] for entry in entries] == [[0], [7], [14]]
    for entry, values in zip(entries, in_space):
        np.testing.assert_array_equal(np.array(entry['pose_keypoints_3d'], np.float32).reshape(18, 4), values)
