"""What is looked at in an image, what is found there, and what is searched after it."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.crops import CROP, CrowdImage, prepare_crops
from openpose_ros_pkg.detect.detection import DepthView, ImageFrame
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.look import Look, Networks
from openpose_ros_pkg.detect.network_detection import NetworkDetection, people_in
from openpose_ros_pkg.detect.recipes import MODES, DetectorSettings
from openpose_ros_pkg.detect.schedule import SCHEDULE
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import ExpectedPeople
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import MovenetNetwork, PafNetwork, ThunderNetwork, Together, chart, in_order, person_at

SIZE, BEGIN = (640, 480), 1000.0
IMAGE = chart(*SIZE)
LEFT, RIGHT = person_at(130, 120, 250), person_at(480, 150, 220)
CROWD = [person_at(x, 150, 200) for x in (80, 195, 310, 425, 540)]
# Of a machine on which one pass of mobilenet_thin over 656 x 368 pixels takes 50 ms [s per pixel].
PACE = {'mobilenet_thin': 0.05 / (656 * 368), 'movenet_multipose': 0.0175 / (512 * 288),
        'movenet_thunder': 0.007 / 256 ** 2}


def slower(factor):
    return {name: factor * seconds for name, seconds in PACE.items()}


class Scene:
    """A camera before people, and networks that see them truly."""

    def __init__(self, people, pace=PACE, following='always', **values):
        self.thin, self.searching, self.looking = PafNetwork(), MovenetNetwork(), ThunderNetwork()
        self.networks = self.thin, self.searching, self.looking
        networks = Together(mobilenet_thin=self.thin, movenet_multipose=self.searching, movenet_thunder=self.looking)
        self.detector = Detector(build(DetectorSettings, {'mode': 'fast', 'pose_model': 'COCO', **values}), networks)
        self.detection = NetworkDetection(self.detector, FollowingParams(following=following), pace, lambda: 0.0)
        self.show(people)

    def show(self, people, size=SIZE):
        for network in self.networks:
            network.people, network.size = people, size

    def look(self, stamp, tracks=(), image=IMAGE, camera='camera', in_full=False, **values):
        """Return the looks at a stamp since `BEGIN` [s], and how many searches and crops they took.

        Args:
            tracks: id and pose (18, 2) of those who are expected; `values` are of all.
        """
        before = self.counts
        looks = self.detection.look(ImageFrame(camera, BEGIN + stamp, image), expected(*tracks, **values), in_full)
        return (looks, *np.subtract(self.counts, before))

    def remember(self, stamp, ids, image=IMAGE, camera='camera'):
        self.detection.remember(ImageFrame(camera, BEGIN + stamp, image), np.array(ids))

    def search(self, stamp, image=IMAGE, camera='camera'):
        return self.detection.search(ImageFrame(camera, BEGIN + stamp, image))

    def begin(self, ids, stamp=0.0):
        """Look at a first image, whose people get ids by their order from the left."""
        looks, *_ = self.look(stamp)
        order = np.argsort(looks.people.xy[:, 1, 0])
        self.remember(stamp, np.array(ids)[np.argsort(order)])

    @property
    def counts(self):
        return len(self.thin.inputs) + len(self.searching.inputs), len(self.looking.inputs)


def expected(*tracks, existence=0.99, visibility=1.0, spread=0.0):
    keypoints = np.array([np.insert(pose, 2, 1.0, axis=1) for _, pose in tracks], np.float32).reshape(-1, 18, 3)
    values = [np.full(len(tracks), value) for value in (existence, visibility, spread)]
    return ExpectedPeople(COCO_18, keypoints, np.array([number for number, _ in tracks], np.int64), *values)


def right_of(person, pixels):
    return person + np.array([pixels, 0.0])


def near(found, person):
    return np.abs(found - person)[:14].max() < 4


def assert_same(found, other):
    np.testing.assert_array_equal(found.keypoints, other.keypoints)
    np.testing.assert_array_equal(found.scores, other.scores)


# --- looks at expected people -----------------------------------------------------------------------------------------

def test_a_person_who_is_found_on_the_crop_keeps_the_id_and_one_who_is_not_there_is_searched_and_missed():
    scene = Scene([LEFT, RIGHT])
    scene.begin([7, 9])
    scene.show([right_of(LEFT, 10.0)])
    looks, searches, crops = scene.look(0.1, [(7, LEFT), (9, RIGHT)])
    assert looks.people.ids.tolist() == [7] and looks.missed.tolist() == [9]
    assert near(looks.people.xy[0], right_of(LEFT, 10.0)) and (searches, crops) == (1, 2)


def test_a_person_whose_look_is_not_due_is_neither_found_nor_missed():
    """On a slow machine; sooner or later each one is looked at."""
    scene = Scene([LEFT, RIGHT], slower(8))
    scene.begin([7, 9])
    tracks = [(7, LEFT), (9, RIGHT)]
    looks, searches, crops = scene.look(0.02, tracks)
    assert len(looks.people) == len(looks.missed) == searches == crops == 0
    looks, _, crops = scene.look(SCHEDULE.look_interval + 0.01, tracks)
    assert sorted(looks.people.ids) == [7, 9] and crops == 2


def test_an_image_that_comes_twice_is_looked_at_twice():
    scene = Scene([LEFT, RIGHT], slower(8))
    scene.begin([7, 9])
    for _ in range(2):
        looks, searches, crops = scene.look(0.0, [(7, LEFT), (9, RIGHT)])
        assert sorted(looks.people.ids) == [7, 9] and (searches, crops) == (0, 2)


def test_an_image_in_which_no_look_is_due_is_not_searched_before_the_answer():
    scene, track = Scene([LEFT], slower(3)), [(7, LEFT)]
    scene.begin([7])
    for i in range(1, 7):  # there would be time for it
        scene.look(0.1 * i, track)
        scene.remember(0.1 * i, [7])
    looks, searches, crops = scene.look(0.62, track)
    assert len(looks.people) == len(looks.missed) == searches == crops == 0


@pytest.mark.parametrize('visibility', [1.0, 0.2])
def test_a_person_beside_the_crop_is_searched_at_once(visibility):
    """Also where the expected place is hidden: the person may have come out elsewhere."""
    scene = Scene([LEFT, right_of(LEFT, 120.0)])
    scene.begin([7, 9])
    scene.show([LEFT, RIGHT])
    tracks = [(7, LEFT), (9, right_of(LEFT, 60.0))]
    looks, searches, _ = scene.look(0.4, tracks, visibility=[1.0, visibility])
    assert searches > 0 and looks.people.ids.tolist() == [7, -1] and looks.missed.tolist() == [9]


def test_a_person_who_may_be_gone_is_searched_at_once():
    """One who came out from behind another, far from the expected place, is there before the next search."""
    scene = Scene([LEFT, RIGHT])
    scene.begin([7, 9])
    scene.show([right_of(LEFT, -40.0), right_of(LEFT, 140.0)])
    tracks = [(7, right_of(LEFT, -40.0)), (9, right_of(RIGHT, 60.0))]
    looks, searches, _ = scene.look(0.3, tracks, existence=[0.99, 0.3])
    assert searches > 0 and len(looks.people) == 2


@pytest.mark.parametrize('existence, is_searched', [(0.9, False), (0.3, True)])
def test_a_crop_that_shows_a_person_beside_one_who_may_be_gone_does_not_replace_the_search(existence, is_searched):
    """It may be another person, of which the crop shows a part."""
    scene = Scene([LEFT])
    scene.begin([7])
    scene.show([right_of(LEFT, 60.0)])
    looks, searches, crops = scene.look(0.3, [(7, LEFT)], existence=existence, spread=0.5)
    assert (searches > 0) == is_searched and len(looks.people) == 1 and crops >= 1


def test_the_first_image_with_a_person_after_some_without_any_shows_it():
    """On a slow machine, where the search for a person who left took more time than there was."""
    scene = Scene([LEFT], slower(8))
    scene.begin([7])
    scene.show([])
    for i in range(1, 5):
        scene.look(0.1 * i, [(7, LEFT)], spread=0.5)
    scene.show([RIGHT])
    looks, *_ = scene.look(0.5)
    assert near(looks.people.xy[0], RIGHT)


def test_a_person_who_is_hidden_in_part_is_looked_at_less_often():
    crops = []
    for visibility in (1.0, 0.5, 0.0):
        scene = Scene([LEFT], slower(8))
        scene.begin([7])
        crops.append(0)
        for i in range(1, 60):
            _, _, new = scene.look(i / 30, [(7, LEFT)], visibility=visibility)
            scene.remember(i / 30, [7] * new)
            crops[-1] += new
    assert crops[0] >= 10 and crops[1] == pytest.approx(crops[0] / 2, abs=2) and 0 < crops[2] < crops[1]


def test_a_crop_that_shows_another_person_is_not_the_expected_one():
    """Two people come close, one passes behind the other: both crops show the one in front."""
    scene = Scene([LEFT, right_of(LEFT, 120.0)])
    scene.begin([1, 2])
    scene.show([LEFT])
    looks, _, crops = scene.look(0.1, [(1, LEFT), (2, right_of(LEFT, 90.0))])
    assert looks.people.ids.tolist() == [1] and looks.missed.tolist() == [2] and crops == 2


def test_people_beside_and_far_beyond_the_image_are_missed():
    scene = Scene([LEFT])
    scene.begin([1])
    looks, *_ = scene.look(0.1, [(1, LEFT), (2, right_of(LEFT, 700.0)), (3, 1e4 * (LEFT - 300.0))])
    assert looks.people.ids.tolist() == [1] and sorted(looks.missed) == [2, 3]


def test_people_far_beyond_a_thin_image_get_a_crop_that_fits_into_memory():
    person = np.full((1, 18, 3), 0.9, np.float32)
    person[0, :, :2] = np.linspace((0, -1e6), (40, 1e6), 18)
    crowd = CrowdImage(np.zeros((6000, 40, 3), np.uint8), person, COCO_18)
    crop, = prepare_crops(crowd, person, MODES['fast'].refinements[0])
    assert np.prod(crop.view.plan.image_size) <= 1.01 * CROP.most_area * 6000 * 40


# --- images that are searched in full ---------------------------------------------------------------------------------

@pytest.mark.parametrize('values', [{}, {'look_closer': 0}, {'mode': 'balanced'}], ids=str)
@pytest.mark.parametrize('interval', [1.0, 2.0], ids=['1 Hz', '0.5 Hz'])
def test_a_slow_stream_shows_all_people_in_each_image(values, interval):
    """They walk on between the images, so that none is where it is expected; on a slow machine too."""
    scene = Scene([], slower(10), **values)
    for i in range(6):
        scene.show([right_of(person, 40.0 * (i % 2)) for person in CROWD])
        looks, searches, _ = scene.look(interval * i, list(enumerate(CROWD, start=1)) if i else [])
        assert searches >= 1 and len(looks.people) == len(CROWD)
        assert all(near(one, right_of(person, 40.0 * (i % 2))) for one, person in zip(in_order(looks.people), CROWD))
        scene.remember(interval * i, looks.people.ids)


@pytest.mark.parametrize('following', ['always', 'never'])
def test_in_full_all_of_the_image_is_searched_before_it_is_decided(following):
    scene = Scene([LEFT], following=following)
    scene.begin([1])
    scene.show([LEFT, RIGHT])
    looks, searches, _ = scene.look(0.05, [(1, LEFT)], in_full=True)
    assert searches >= 1 and sorted(looks.people.ids) == [-1, 1]
    scene.remember(0.05, looks.people.ids)
    parts = list(scene.search(0.05))
    assert len(parts) == 0  # there is nothing left


@pytest.mark.parametrize('values', [{}, {'look_closer': 0}], ids=str)
def test_without_a_stamp_there_is_no_history(values):
    """Each image has the people of a full search, and the stream beside knows nothing of it."""
    scene = Scene([LEFT, RIGHT], **values)
    scene.begin([1, 2])
    for i in range(3):
        scene.show([right_of(LEFT, 10.0 * i), RIGHT])
        looks, searches, _ = scene.look(-BEGIN)
        assert searches == 1 and looks.people.ids.tolist() == [-1, -1]
        assert_same(looks.people, people_in(IMAGE, scene.detector))
        scene.remember(-BEGIN, [5, 6])
        assert list(scene.search(-BEGIN)) == []
    scene.show([LEFT, RIGHT])
    assert sorted(scene.look(0.1, [(1, LEFT), (2, RIGHT)])[0].people.ids) == (
        [-1, -1] if values else [1, 2])


@pytest.mark.parametrize('stamp', [-1.0, 0.9], ids=['back', 'gap'])
def test_stamps_that_jump_begin_anew(stamp):
    scene = Scene([LEFT])
    scene.begin([1])
    scene.show([RIGHT])
    looks, searches, _ = scene.look(stamp)
    assert searches == 1 and looks.people.ids.tolist() == [-1] and near(looks.people.xy[0], RIGHT)


def test_cameras_and_sizes_of_images_do_not_disturb_each_other():
    half = chart(320, 240)
    scene = Scene([LEFT, RIGHT])
    scene.begin([1, 2])
    scene.show([LEFT / 2], (320, 240))
    for camera in ('camera', 'other'):
        looks, searches, _ = scene.look(0.02, image=half, camera=camera)
        assert searches == 1 and len(looks.people) == 1
        scene.remember(0.02, [3], half, camera)
    scene.show([LEFT, RIGHT])
    looks, searches, _ = scene.look(0.1, [(1, LEFT), (2, RIGHT)])
    assert sorted(looks.people.ids) == [1, 2] and searches == 0


@pytest.mark.parametrize('size', [(1, 1), (1, 2000), (2000, 1), (2, 3), (17, 1)])
def test_tiny_images_show_no_person_or_are_refused_as_too_thin(size):
    scene = Scene([], mode='balanced')
    image = np.full((size[1], size[0], 3), 100, np.uint8)
    for i in range(3):
        try:
            assert len(scene.look(0.1 * i, image=image)[0].people) == 0
            assert all(part.seconds >= 0 for part in scene.search(0.1 * i, image))
        except BadInputError as error:
            assert f'{size[0]}x{size[1]}' in str(error) and 'at most' in str(error)


# --- the search after an image ----------------------------------------------------------------------------------------

@pytest.mark.parametrize('stays', [True, False])
def test_who_is_found_by_the_search_is_looked_at_in_the_next_image(stays):
    scene = Scene([LEFT])
    scene.begin([1])
    scene.show([LEFT, RIGHT])
    assert scene.look(0.1, [(1, LEFT)])[0].people.ids.tolist() == [1]
    scene.remember(0.1, [1])
    assert len(list(scene.search(0.1))) >= 1
    scene.show([LEFT] + [right_of(RIGHT, -6.0)] * stays)
    looks, searches, crops = scene.look(0.2, [(1, LEFT)])
    assert (searches, crops) == (not stays, 2) and sorted(looks.people.ids) == [-1] * stays + [1]
    if stays:
        new = looks.people.ids < 0
        assert near(looks.people.xy[new][0], right_of(RIGHT, -6.0))
        scene.remember(0.2, np.where(new, 2, 1))
        tracks = [(1, LEFT), (2, right_of(RIGHT, -6.0))]
        assert sorted(scene.look(0.3, tracks)[0].people.ids) == [1, 2]


def test_a_part_is_announced_before_it_is_searched_and_the_search_stops_where_the_iteration_stops():
    scene = Scene([LEFT], slower(8))
    scene.begin([1])
    scene.look(0.4, [(1, LEFT)])
    search, before = scene.search(0.4), scene.counts[0]
    first = next(search)
    assert first.seconds > 0 and scene.counts[0] == before
    next(search)
    assert scene.counts[0] == before + 1
    search.close()
    assert scene.counts[0] == before + 1
    # the next image goes on with another part
    columns = scene.searching.parts[-1][::2]
    scene.look(0.8, [(1, LEFT)])
    search = scene.search(0.8)
    next(search), next(search)
    assert scene.searching.parts[-1][::2] != columns


@pytest.mark.parametrize('mode, factor', [('balanced', 1), ('balanced', 2), ('balanced', 4), ('fast', 4)])
def test_all_of_the_image_is_searched_once_in_a_second_also_where_a_frame_always_waits(mode, factor):
    """Ten seconds of a camera of 30 Hz, on machines on which a pass of mobilenet_thin takes up to 200 ms.

    By one network; by each one a little later.
    """
    scene, pace, now = Scene([LEFT, RIGHT], slower(factor), mode=mode), slower(factor), 0.0
    scene.begin([1, 2])
    counts = [len(network.inputs) for network in scene.networks]
    columns = (np.arange(40) + 0.5) * SIZE[0] / 40
    last = np.zeros((2, 40))  # times at which each network searched each column [s]
    longest = np.zeros(2)  # of one network, and of each one

    def compute():
        """Let the time pass that the networks took, and note what they searched."""
        nonlocal now, longest
        for row, (network, name) in enumerate(zip(scene.networks, PACE)):
            new = network.inputs[counts[row]:]
            now += pace[name] * sum(image.shape[0] * image.shape[1] for image in new)
            counts[row] += len(new)
            if row < 2:
                for left, _, right, _ in network.parts[len(network.parts) - len(new):]:
                    last[row, (columns > left) & (columns < right)] = now
        waits = now - last[1 - (mode == 'balanced'):]
        longest = np.maximum(longest, (waits.min(axis=0).max(), waits.max()))

    while now < 10.0:
        stamp = now = max(now, (np.floor(now * 30) + 1) / 30)  # of the newest image, which waits
        looks, *_ = scene.look(stamp, [(1, LEFT), (2, RIGHT)])
        compute()
        scene.remember(stamp, looks.people.ids)
        for part in scene.search(stamp):
            compute()
            if not part.owed:
                break
        compute()
    assert longest[0] <= 1.0 and longest[1] <= 1.6


def test_a_stall_of_the_machine_does_not_leave_the_image_unsearched(monkeypatch):
    """All networks take 3 s in one image; a person who comes then is found within a second."""
    scene, now, takes = Scene([]), 0.0, 0.02

    def slowly(infer):
        def timed(images):
            nonlocal now
            now += takes
            return infer(images)
        return timed
    for network in scene.networks:
        monkeypatch.setattr(network, 'infer', slowly(network.infer))
    scene.detection = NetworkDetection(scene.detector, FollowingParams(following='always'), None, lambda: now)
    for i in range(42):
        takes = 3.0 if i == 25 else 0.02
        if i == 27:
            scene.show([LEFT])
        looks, *_ = scene.look(i / 15)
        scene.remember(i / 15, [-1] * len(looks.people))
        for part in scene.search(i / 15):
            if not part.owed:  # the next image waits
                break
    assert len(looks.people) == 1


@pytest.mark.parametrize('rate', [5.0, 15.0, 30.0])
def test_heads_in_the_depth_are_looked_for_also_where_images_wait(monkeypatch, rate):
    scene, stamps, wall = Scene([LEFT]), [], DepthView(np.full((48, 64), 3.0, np.float32), 50.0)
    monkeypatch.setattr(Networks, 'heads', lambda self, people, stamp: stamps.append(stamp) or Look(list(people)))
    for i in range(round(3 * rate)):
        frame = ImageFrame('camera', BEGIN + i / rate, IMAGE, wall)
        looks = scene.detection.look(frame, expected((1, LEFT)) if i else expected(), in_full=False)
        scene.detection.remember(frame, np.ones(len(looks.people), int))
        for part in scene.detection.search(frame):
            if not part.owed:  # the next image waits
                break
    assert np.diff(stamps).max() < 2.5 * SCHEDULE.search_time and len(stamps) <= 3 / SCHEDULE.search_time + 1


def test_what_waited_longer_is_searched_first_so_that_no_part_of_the_image_waits_for_heads(monkeypatch):
    scene, order, wall = Scene([LEFT]), [], DepthView(np.full((48, 64), 3.0, np.float32), 50.0)
    monkeypatch.setattr(Networks, 'heads', lambda self, people, stamp: order.append('heads') or Look(list(people)))
    monkeypatch.setattr(Networks, 'search', lambda self, people, part: order.append('part') or Look(list(people)))
    for i in range(13):
        frame = ImageFrame('camera', BEGIN + i / 10, IMAGE, wall)
        looks = scene.detection.look(frame, expected((1, LEFT)) if i else expected(), in_full=False)
        scene.detection.remember(frame, np.ones(len(looks.people), int))
        order.clear()
        if i in (6, 12):  # before, the next images wait
            list(scene.detection.search(frame))
            assert order[0] == 'part' and order.count('heads') == 1


# --- changes ----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('mode', MODES)
@pytest.mark.parametrize('following, size', [('never', (960, 540)), ('always', (1920, 1080))])
def test_warm_networks_have_seen_inputs_of_every_size(mode, following, size):
    """They are compiled for each size, which takes the time of many images."""
    scene = Scene([], slower(2), following, mode=mode)
    scene.detection.warm_up()
    warm, image = [{part.shape for part in network.inputs} for network in scene.networks], chart(*size)
    scene.show([person_at(320, 100, 300)], size)
    for i in range(20):
        scene.look(0.1 * i, image=image)
        list(scene.search(0.1 * i, image))
    assert all({part.shape for part in network.inputs} == seen for network, seen in zip(scene.networks, warm))


def test_another_mode_holds_from_the_next_image_on_and_people_keep_their_ids():
    scene = Scene([LEFT, RIGHT], slower(4))
    scene.begin([1, 2])
    for i, mode in enumerate(('balanced', 'fast', 'balanced', 'fast'), start=1):
        scene.detector.reconfigure(build(DetectorSettings, {'mode': mode, 'pose_model': 'COCO'}))
        scene.detection.reconfigure()
        looks, searches, _ = scene.look(0.1 * i, [(1, LEFT), (2, RIGHT)])
        assert sorted(looks.people.ids) == [1, 2] and searches >= len(MODES[mode].passes)
        scene.remember(0.1 * i, looks.people.ids)
