"""What the page of a recording shows: spans of signals of a simulated person, messages of frames, plots."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import SITTING, STANDING, Limb, frames, held, swinging, then
from known_tables import known_table
from long_recording import UP, long_recording
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.records import PersonSignals, Posture
from openpose_ros_tools.report.recording import Recording, facts_of, frames_of, z_up
from openpose_ros_tools.tables.keypoint_selection import select
from openpose_ros_tools.tables.signal_timeline import (
    GESTURE,
    POSTURE,
    SignalFrame,
    computed_signals,
    timeline_of,
    upwards_of,
)
from openpose_ros_web.protocol import encode

RATE = 10
WAVE_IN, WAVE_OUT = Limb((0.4, 0.5, -0.5), (-0.35, 0.2, 1.0)), Limb((0.4, 0.5, -0.5), (0.6, 0.2, 1.0))
AFTER_WAVE = 4.0
MOTION = then((0.0, held((0.0, STANDING))),
              (2.0, swinging(STANDING.with_arm('right', WAVE_IN), STANDING.with_arm('right', WAVE_OUT), 1.5, 2.0)),
              (AFTER_WAVE, held((AFTER_WAVE, STANDING), (6.0, STANDING), (6.5, SITTING), (9.0, SITTING))))


def table_of(motion, seconds, number=1, offset=10.0):
    """Return the table of a person with this id that moves like this, from 10 s on."""
    stamps, people = zip(*frames(motion, seconds, RATE))
    return known_table([round(1e9 * (stamp + offset)) for stamp in stamps], np.full(len(stamps), number),
                       np.concatenate([one.xyz for one in people]))


def recording_of(table, stamps=None):
    return Recording('walk.bag', '10 s', select(table, stamps), list(computed_signals(table)), upwards_of(table))


def test_spans_of_a_simulated_person_have_its_times():
    spans, _ = timeline_of(computed_signals(table_of(MOTION, 9.0)))
    postures = [span for span in spans if span.kind == POSTURE and span.name != 'unknown']
    assert [span.name for span in postures] == ['standing', 'sitting']
    assert postures[0].end - 10 == pytest.approx(6.3, abs=0.3)
    assert postures[1].end - 10 == pytest.approx(9.0, abs=0.01)
    gesture, = (span for span in spans if span.kind == GESTURE)
    assert (gesture.name, gesture.arm, gesture.person) == ('wave', 'right', 1)
    # waving is told by two ways, of 1/3 s each here
    assert gesture.begin - 10 == pytest.approx(2.3, abs=0.35)
    assert gesture.end - 10 == pytest.approx(AFTER_WAVE, abs=0.5)


def test_a_gap_begins_a_new_span():
    person = PersonSignals(1, np.zeros(3), Posture('standing', 0.0, 1.0))
    spans, _ = timeline_of(SignalFrame(stamp, (person,)) for stamp in (0.0, 0.1, 5.0, 5.1))
    assert [(span.begin, span.end) for span in spans] == [(0.0, 0.1), (5.0, 5.1)]


def test_frames_have_people_in_millimetres_and_what_they_do():
    table = table_of(MOTION, 9.0)
    recording = recording_of(table, np.append(table.stamps, table.stamps[-1] + 10 ** 8))
    facts, frames = facts_of(recording), list(frames_of(recording))
    assert facts['stamps'] == pytest.approx(np.arange(92) / RATE)
    assert len(frames) == 92
    signals, people = frames[30]
    person, = people['people']
    assert (people['stamp'], people['skeleton'], person['id']) == (13.0, 'COCO_18', 1)
    expected = 1000 * table.positions[30, [table.joints.index(joint) for joint in COCO_18.joints]]
    assert np.abs(np.reshape(person['xyz'], (18, 3)) - expected).max() <= 0.5
    assert [gesture['name'] for gesture in signals['people'][0]['gestures']] == ['wave']
    assert [message['people'] for message in frames[91]] == [[], []]
    encode({'facts': facts, 'frames': frames})


def test_signals_belong_to_their_frame_whatever_the_rounding_of_its_stamp():
    recording = long_recording(20, rate=16)  # each second stamp lies between two milliseconds
    later = replace(recording, signals=[SignalFrame(np.nextafter(each.stamp, np.inf), each.persons)
                                        for each in recording.signals])
    for each in (recording, later):
        assert all(len(signals['people']) == 3 for signals, *_ in frames_of(each))


def test_spans_and_plots_of_the_page():
    facts = facts_of(long_recording(40.0))
    spans = [span for span in facts['spans'] if (span['person'], span['kind']) == (2, 'gesture')]
    assert [(span['begin'], span['end']) for span in spans] == [(12.0, 16.0), (32.0, 36.0)]
    assert [plot['title'][:12] for plot in facts['plots']] == ['Distance and', *['Joint angles'] * 3]
    assert 'knee' in facts['plots'][1]['svg']
    # 18 joints have no feet
    assert 'dorsiflexion' not in facts['plots'][1]['svg']


def test_a_camera_looks_along_x_of_the_page():
    rotation, _ = z_up(np.array([0.0, -1.0, 0.0]))
    assert np.allclose(rotation @ (0, 0, 1), (1, 0, 0)) and np.allclose(rotation @ (1, 0, 0), (0, -1, 0))
    assert np.allclose(z_up(3 * UP)[0], np.eye(3))
    for up in ((1.0, 2.0, 3.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)):
        rotation, _ = z_up(np.array(up))
        assert np.allclose(rotation @ up, (0, 0, np.linalg.norm(up)))
        assert np.linalg.det(rotation) == pytest.approx(1)
