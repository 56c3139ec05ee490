"""The report of a recording: spans of signals of a simulated person, numbers of people, crops, the page."""
import base64
import re
from dataclasses import replace
from html.parser import HTMLParser

import cv2
import numpy as np
import pytest

from animated_skeleton import ADULT, SITTING, STANDING, Limb, frames, held, swinging, then
from known_tables import known_table
from openpose_ros_signals.records import Gesture, Hit, PersonSignals, Pointing, Posture, Ray
from openpose_ros_tools.plots.keypoint_plots import top_view
from openpose_ros_tools.plots.plotting import figure_content
from openpose_ros_tools.plots.signal_plots import signals
from openpose_ros_tools.report.crops import choose_crops, cut
from openpose_ros_tools.report.page import RecordingFacts, ReportFacts, TopicFacts, empty_frames, page
from openpose_ros_tools.tables.keypoint_selection import select
from openpose_ros_tools.tables.signal_timeline import GESTURE, POSTURE, SignalTimeline, timeline_of

RATE = 10
WAVE_IN, WAVE_OUT = Limb((0.4, 0.5, -0.5), (-0.35, 0.2, 1.0)), Limb((0.4, 0.5, -0.5), (0.6, 0.2, 1.0))
AFTER_WAVE = 4.0
MOTION = then((0.0, held((0.0, STANDING))),
              (2.0, swinging(STANDING.with_arm('right', WAVE_IN), STANDING.with_arm('right', WAVE_OUT), 1.5, 2.0)),
              (AFTER_WAVE, held((AFTER_WAVE, STANDING), (6.0, STANDING), (6.5, SITTING), (9.0, SITTING))))
RECORDING = RecordingFacts('walk.bag', 2500000, '10.0 s', 9.0, (TopicFacts('/people', 'some/Type', 90, 10.0),))


def table_of(motion, seconds, number=1, offset=10.0):
    """Return the table of a person with this id that moves like this, from 10 s on."""
    stamps, people = zip(*frames(motion, seconds, RATE))
    return known_table([round(1e9 * (stamp + offset)) for stamp in stamps], np.full(len(stamps), number),
                       np.concatenate([one.xyz for one in people]))


def image_table(joints, people, stamps):
    """Return a table in the image of joints (R, 18, 3)."""
    return known_table(stamps, people, joints[..., :2], confidence=0.9)


def facts_of(table, stamps=None):
    selection = select(table, stamps)
    return ReportFacts(RECORDING, len(selection.frames), empty_frames(selection), selection, timeline_of(table))


def people_of(facts):
    """Return the cells of each person on the page."""
    lines = [line for line in Checker(page(facts)).text.splitlines() if line.strip()]
    first = lines.index('walked [s]') + 1
    return [lines[row:row + 10] for row in range(first, first + 10 * len(facts.selection.persons), 10)]


class Checker(HTMLParser):
    """Holds that elements are closed in order, and collects text and sources of images."""

    def __init__(self, text):
        super().__init__()
        self.open, self.text, self.images, self.names = [], '', [], set()
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.names.add(tag)
        if tag == 'img':
            self.images.append(dict(attributes)['src'])
        elif tag != 'meta':
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data + '\n'


def test_spans_of_a_simulated_person_have_its_times():
    timeline = timeline_of(table_of(MOTION, 9.0))
    postures = [span for span in timeline.of(POSTURE) if span.name != 'unknown']
    assert [span.name for span in postures] == ['standing', 'sitting']
    assert postures[0].end - 10 == pytest.approx(6.3, abs=0.3)
    assert postures[1].end - 10 == pytest.approx(9.0, abs=0.01)
    gesture, = timeline.of(GESTURE)
    assert (gesture.name, gesture.arm, gesture.person) == ('wave', 'right', 1)
    # waving is told by two ways, of 1/3 s each here
    assert gesture.begin - 10 == pytest.approx(2.3, abs=0.35)
    assert gesture.end - 10 == pytest.approx(AFTER_WAVE, abs=0.5)


def test_a_gap_begins_a_new_span():
    timeline = SignalTimeline()
    for stamp in (0.0, 0.1, 5.0, 5.1):
        timeline.add(stamp, (PersonSignals(1, np.zeros(3), Posture('standing', 0.0, 1.0)),))
    assert [(span.begin, span.end) for span in timeline.of(POSTURE)] == [(0.0, 0.1), (5.0, 5.1)]


def test_numbers_of_a_person():
    (*numbers, stature, walked), = people_of(facts_of(table_of(MOTION, 9.0)))
    assert numbers == ['1', '0.0', '9.0', '9.1', '91', '18.0', '100 %', '0 %']
    assert float(stature.split()[0]) == pytest.approx(ADULT, abs=0.03)
    assert walked == '0.0'


def test_walking_is_told_in_seconds():
    walking = then((0.0, held((0.0, STANDING), (2.0, STANDING), (6.0, replace(STANDING, place=(4.0, 0.0))))))
    assert float(people_of(facts_of(table_of(walking, 8.0)))[0][-1]) == pytest.approx(4.0, abs=0.6)


def test_the_page_is_whole_and_shows_the_numbers():
    facts = facts_of(table_of(MOTION, 9.0))
    checked = Checker(page(facts))
    for text in ('walk.bag', 'wave', 'right', '/people', 'No falls.', '100 %', '91 frames'):
        assert text in checked.text
    assert re.search(r'standing 6\.\d s, sitting 2\.\d s', checked.text)
    assert 'script' not in checked.names
    assert [base64.b64decode(content.partition('base64,')[2]) for content in checked.images] == [
        figure_content(figure, 'svg') for figure in (signals(facts.selection, facts.timeline),
                                                     top_view(facts.selection))]


def test_nothing_in_a_recording_becomes_html():
    bad = '<script>alert("&")</script>'
    line = Ray(np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.1, None)
    ray = Pointing(line.origin, line.direction, 0.1, Hit(np.ones(3), bad), line, line)
    timeline = SignalTimeline()
    timeline.add(10.0, (PersonSignals(1, np.zeros(3), Posture(bad, 10.0, 1.0), (Gesture(bad, bad, 10.0, 1.0, ray),)),))
    text = page(facts_of(table_of(MOTION, 1.0))._replace(
        timeline=timeline, notes=(bad,), recording=RecordingFacts(bad, 1, bad, 1.0, (TopicFacts(bad, bad, 1, 1.0),))))
    assert '<script' not in text
    assert Checker(text).text.count(bad) == 10


def test_crops_show_people_where_they_are_largest():
    joints = np.full((4, 18, 3), (np.nan, np.nan, 0.0))
    for row, size in enumerate((40, 100, 60, 20)):
        joints[row, :4] = [(200, 100, 0.9), (200, 100 + size, 0.9), (190, 120, 0.9), (210, 120, 0.9)]
    crops = choose_crops(image_table(joints, [7, 7, 7, 7], np.arange(4) * 10 ** 8), [7], 2)
    assert list(crops) == [10 ** 8, 2 * 10 ** 8]
    image = np.zeros((480, 640, 3), np.uint8)
    image[:, :150] = 255
    thumbnail = cut(image, crops[10 ** 8][0])
    pixels = cv2.imdecode(np.frombuffer(thumbnail.jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert (thumbnail.person, pixels.shape[0]) == (7, 220)
    assert pixels.shape[1] == pytest.approx(220 * (20 + 36) / (100 + 36), abs=4)
    assert pixels[:, :10].max() < 100  # what is white is outside


def test_crops_at_the_border_and_of_nothing():
    joints = np.full((1, 18, 3), (np.nan, np.nan, 0.0))
    assert choose_crops(image_table(joints, [1], [0]), [1], 2) == {}
    joints[0, :2] = [(-5, -5, 0.9), (30, 500, 0.9)]
    (crop,), = choose_crops(image_table(joints, [1], [0]), [1], 2).values()
    assert cut(np.zeros((48, 64, 3), np.uint8), crop).jpeg
    far = crop._replace(joints=joints[0] + (500, 500, 0))
    assert cut(np.zeros((48, 64, 3), np.uint8), far).jpeg == b''
