"""Delays of stages from stamps and times of recording: frames, shares, steps, clocks that differ."""
import json

import numpy as np
import pytest

from openpose_ros_tools.delays.delay_plots import delay_distribution, delays_over_time
from openpose_ros_tools.delays.delay_report import CSV_COLUMNS, csv_rows, markdown, summary
from openpose_ros_tools.delays.stage_delays import (
    CAMERA,
    CLOUD,
    DRAWN,
    IMAGE,
    MARKERS,
    PEOPLE_2D,
    PEOPLE_3D,
    TAKEN,
    Spread,
    Stage,
    build_chains,
    cameras_of_none,
    steps,
)
from openpose_ros_tools.plots.plotting import save_figure

MS = 1000000
SPACE = '/openpose_ros/skeleton_3d'
BEGIN = 1700000000 * 1000 * MS
STAMPS = BEGIN + np.arange(10) * 100 * MS


def stage(role, delay_ms, stamps=STAMPS, topic=None, frame_id='camera'):
    """A stage with one message per stamp; delays in ms, one for all or one each."""
    delays = np.broadcast_to(delay_ms, len(stamps))
    return Stage.of_messages(topic or f'/{role}', role, stamps, stamps + (delays * MS).astype(np.int64), frame_id)


def chain_of(results, cameras, **options):
    chain, = build_chains({SPACE: results}, cameras, **options)
    return chain


def column(chain, role):
    return chain.delays[:, [found.role for found in chain.stages].index(role)]


def test_spread_of_nothing_is_not_known():
    spread = Spread.of(np.zeros(0))
    assert spread.count == 0 and np.isnan([spread.median, spread.mean, spread.p95, spread.greatest, spread.least]).all()


def test_chain_without_any_stamp():
    empty = Stage.of_messages('/people', PEOPLE_3D, [0, 0], [BEGIN, BEGIN + 1])
    chain = chain_of([empty], [])
    assert len(chain.frames) == 0 and empty.unstamped == 2
    assert any('2 of 2 messages on /people have no stamp' in note for note in chain.notes)
    assert np.isnan(chain.shares).all()
    assert '-' in markdown(chain) and list(csv_rows(chain)) == []


def test_spread():
    spread = Spread.of(np.array([0.4, 0.1, np.nan, 0.2, 0.3]))
    assert spread.count == 4
    # 95 % of the way through 4 values, linearly interpolated: 0.3 + 0.85 * 0.1
    assert [spread.median, spread.mean, spread.p95, spread.greatest, spread.least] == pytest.approx(
        [0.25, 0.25, 0.385, 0.4, 0.1])


def test_frame_is_complete_with_its_last_message():
    found = Stage.of_messages('/markers', MARKERS, [20, 10, 10, 20], [25, 13, 17, 22])
    assert found.stamps.tolist() == [10, 20] and found.arrivals.tolist() == [17, 25]
    assert found.messages == 4 and found.repeated == 2


def test_delays_shares_rates_and_order():
    every_second = STAMPS[::2]
    chain = chain_of([stage(MARKERS, 130, every_second), stage(PEOPLE_3D, np.arange(5) + 120.0, every_second)],
                     [stage(CLOUD, 20), stage(IMAGE, 5)])
    assert [found.role for found in chain.stages] == [IMAGE, CLOUD, PEOPLE_3D, MARKERS]
    assert chain.shares.tolist() == [1, 1, 0.5, 0.5]
    assert column(chain, IMAGE) == pytest.approx(0.005)
    assert column(chain, PEOPLE_3D)[::2] == pytest.approx([0.120, 0.121, 0.122, 0.123, 0.124])
    assert np.isnan(column(chain, PEOPLE_3D)[1::2]).all()
    assert chain.stages[0].rate == pytest.approx(10.0) and chain.stages[3].rate == pytest.approx(5.0)
    assert chain.is_live and chain.counted_from == 'stamp' and chain.notes == ()


def test_steps_begin_when_all_of_the_camera_is_there():
    chain = chain_of([stage(PEOPLE_2D, 100), stage(PEOPLE_3D, 104), stage(MARKERS, 110), stage(DRAWN, 125)],
                     [stage(IMAGE, 5), stage(CLOUD, 30)])
    found = {(step.before, step.after): step.seconds for step in steps(chain)}
    assert list(found) == [(CAMERA, PEOPLE_2D), (PEOPLE_2D, PEOPLE_3D), (PEOPLE_3D, MARKERS), (PEOPLE_3D, DRAWN)]
    assert [seconds[0] for seconds in found.values()] == pytest.approx([0.070, 0.004, 0.006, 0.021])


def test_step_from_where_the_node_took_the_frame():
    chain = chain_of([stage(TAKEN, 40), stage(PEOPLE_2D, 100)], [stage(IMAGE, 5)])
    assert {(step.before, step.after): round(1000 * step.seconds[0]) for step in steps(chain)} == {
        (CAMERA, TAKEN): 35, (TAKEN, PEOPLE_2D): 60}


def test_image_and_cloud_with_stamps_of_their_own():
    clouds = STAMPS + 12 * MS
    chain = chain_of([stage(PEOPLE_2D, 100), stage(PEOPLE_3D, 110, clouds)], [stage(IMAGE, 5), stage(CLOUD, 9, clouds)])
    assert len(chain.frames) == 10 and chain.shares.tolist() == [1, 1, 1, 1]
    # each from the stamp that it carries, the step from one arrival to the other
    assert column(chain, CLOUD) == pytest.approx(0.009) and column(chain, PEOPLE_3D) == pytest.approx(0.110)
    assert steps(chain)[-1].seconds == pytest.approx(0.022)


def test_frames_that_the_recorder_lost_are_frames():
    chain = chain_of([stage(PEOPLE_3D, 100)], [stage(IMAGE, 5, np.delete(STAMPS, [3, 4]))])
    assert len(chain.frames) == 10 and chain.shares.tolist() == [0.8, 1.0]
    assert any('2 of 10 frames have results, but no message of a camera' in note for note in chain.notes)


def test_results_of_frames_before_the_recording_do_not_count():
    chain = chain_of([stage(PEOPLE_3D, 100)], [stage(IMAGE, 5, STAMPS[2:])])
    assert len(chain.frames) == 8 and chain.shares.tolist() == [1, 1] and chain.notes == ()


def test_without_camera_topics():
    chain = chain_of([stage(PEOPLE_2D, 100), stage(PEOPLE_3D, 110)], [], counted_from='arrival')
    assert column(chain, PEOPLE_3D) == pytest.approx(0.110) and chain.counted_from == 'stamp'
    assert any('No camera topic' in note for note in chain.notes)


@pytest.mark.parametrize('results, cameras', [
    ([stage(PEOPLE_3D, 0)], []),
    ([stage(PEOPLE_3D, 0)], [stage(IMAGE, 0)]),
    ([stage(PEOPLE_3D, 8)], [stage(IMAGE, 8)]),
    ([stage(PEOPLE_3D, 0), stage(PEOPLE_2D, 8)], [stage(IMAGE, 8)]),
    ([stage(PEOPLE_3D, 8), stage(PEOPLE_2D, 8)], [])],
    ids=['at the stamp', 'all at the stamp', "at the camera's message", 'either', 'all results at one time'])
def test_what_a_program_wrote_has_no_delays(results, cameras):
    chain = chain_of(results, cameras)
    assert not chain.is_live and np.isnan(chain.delays).all() and steps(chain) == ()
    assert 'No live recording' in chain.notes[0] and 'process_bag' in markdown(chain)
    assert summary(chain)['stages'][0]['delay_ms']['median'] is None


def test_played_without_its_clock_counts_from_arrival():
    days = 3 * 24 * 3600 * 1000.0
    chain = chain_of([stage(PEOPLE_3D, days + 120)], [stage(IMAGE, days + 5), stage(CLOUD, days + 15)])
    assert chain.counted_from == 'arrival'
    assert column(chain, CLOUD) == pytest.approx(0.010) and column(chain, PEOPLE_3D) == pytest.approx(0.115)
    assert any('3.0 days before' in note for note in chain.notes)
    from_stamp = chain_of([stage(PEOPLE_3D, days + 120)], [stage(IMAGE, days + 5)], counted_from='stamp')
    assert column(from_stamp, PEOPLE_3D) == pytest.approx(days / 1000 + 0.120)


def test_clock_that_is_ahead():
    chain = chain_of([stage(PEOPLE_3D, 80)], [stage(IMAGE, -40)])
    assert chain.counted_from == 'arrival' and column(chain, PEOPLE_3D) == pytest.approx(0.120)
    assert any('up to 40 ms (/image)' in note and 'ahead' in note for note in chain.notes)


def test_few_negative_delays_are_told_but_counted():
    chain = chain_of([stage(PEOPLE_3D, 80)], [stage(IMAGE, [-3, *[5] * 9])])
    assert chain.counted_from == 'stamp' and any('up to 3 ms' in note for note in chain.notes)


@pytest.mark.parametrize('simulated', [True, False])
def test_simulated_time(simulated):
    # a clock in steps of 10 ms: what happens within a step is recorded at one time
    chain = chain_of([stage(PEOPLE_2D, 110), stage(PEOPLE_3D, 110), stage(MARKERS, 120)], [stage(IMAGE, 10)],
                     simulated=simulated)
    assert any('simulated time' in note and 'steps of 10 ms' in note for note in chain.notes)
    assert column(chain, PEOPLE_3D) == pytest.approx(0.110)


def test_looped_stamps_are_told():
    arrivals = np.concatenate([STAMPS + 5 * MS, STAMPS + 2000 * MS])
    twice = Stage.of_messages('/image', IMAGE, np.tile(STAMPS, 2), arrivals, 'camera')
    chain = chain_of([stage(PEOPLE_3D, 2100)], [twice])
    assert any('come again' in note and '10 messages' in note for note in chain.notes)


def test_cameras_find_their_results_by_stamp_and_frame():
    other = STAMPS + 33 * MS
    results = {'/one/openpose_ros': [stage(PEOPLE_2D, 100)], '/two/openpose_ros': [stage(PEOPLE_2D, 50, other)]}
    cameras = [stage(IMAGE, 5, topic='/a/image'), stage(IMAGE, 7, other, '/b/image'),
               stage(IMAGE, 3, STAMPS + 50 * MS, '/c/image')]
    one, two = build_chains(results, cameras)
    assert [found.topic for found in one.stages] == ['/a/image', '/people_2d']
    assert [found.topic for found in two.stages] == ['/b/image', '/people_2d']
    assert [found.topic for found in cameras_of_none(results, cameras)] == ['/c/image']


def test_cameras_that_are_triggered_together_are_told_apart_by_frame():
    results = {name: [stage(PEOPLE_2D, 100, frame_id=name)] for name in ('left', 'right')}
    cameras = [stage(IMAGE, 5, topic=f'/{name}/image', frame_id=name) for name in ('left', 'right')]
    assert [[found.topic for found in chain.stages] for chain in build_chains(results, cameras)] == [
        ['/left/image', '/people_2d'], ['/right/image', '/people_2d']]


def test_one_camera_of_two_namespaces():
    results = {name: [stage(PEOPLE_2D, 100)] for name in ('/openpose_ros', '/openpose_ros/skeleton_3d')}
    chains = build_chains(results, [stage(IMAGE, 5)])
    assert [chain.stages[0].role for chain in chains] == [IMAGE, IMAGE]


def test_texts_agree():
    chain = chain_of([stage(PEOPLE_3D, np.linspace(100, 190, 10))], [stage(IMAGE, 5)])
    row = next(line for line in markdown(chain).splitlines() if line.startswith('| people in 3D'))
    assert [cell.strip() for cell in row.strip('|').split('|')] == [
        'people in 3D', '/people_3d', '10', '10', '100.0 %', '9.1', '145.0', '145.0', '185.5', '190.0', '100.0']
    values = json.loads(json.dumps(summary(chain)))
    assert values['stages'][1]['delay_ms'] == {
        'count': 10, 'median': 145.0, 'mean': 145.0, 'p95': 185.5, 'max': 190.0, 'min': 100.0}
    rows = list(csv_rows(chain))
    assert len(rows) == 20 and all(len(row) == len(CSV_COLUMNS) for row in rows)
    assert rows[10] == (SPACE, PEOPLE_3D, '/people_3d', str(STAMPS[0]), str(STAMPS[0] + 100 * MS), '100.000000')


@pytest.mark.parametrize('frames', [1, 2])
def test_plots_of_any_length(tmp_path, frames):
    stamps = STAMPS[:frames]
    chain = chain_of([stage(PEOPLE_3D, 100, stamps)], [stage(IMAGE, 5, stamps)])
    for draw in (delays_over_time, delay_distribution):
        first, again = (save_figure(draw(chain), tmp_path / name).read_bytes() for name in ('a.png', 'b.png'))
        assert first == again and first.startswith(b'\x89PNG')


def test_lines_of_the_plot_are_the_delays():
    chain = chain_of([stage(PEOPLE_3D, np.linspace(100, 190, 10))], [stage(IMAGE, 5)])
    above = delays_over_time(chain).axes[0]
    lines = {line.get_label(): line.get_ydata() for line in above.get_lines()}
    assert lines['people in 3D'] == pytest.approx(np.linspace(100, 190, 10))
    assert lines['colour image'] == pytest.approx(5)
