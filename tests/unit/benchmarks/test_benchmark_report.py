"""Sections of the report: what is kept, written and shown."""
import json

import numpy as np
import pytest

import report
import results
from common import DEMO
from development.results import ORDER, read_results, results_page
from results import NeedsDataError, Options, Picture, Section, Table, counting
from scoring.figures import Figure
from scoring.people import score_people

MADE = {'commit': 'abc', 'processor': '2 cores', 'T_ms': 50.0, 'date': '2026-01-01'}
SHARE = Figure(0.96128, 0.9491, 0.97249, n=10, digits=3, text='of something', scenes=3)


@pytest.mark.parametrize('name', report.SECTIONS)
def test_each_section_has_a_title_and_a_place_on_the_page(name):
    assert name in ORDER and set(report.TIMED) <= set(report.SECTIONS)
    module = pytest.importorskip(report.SECTIONS[name], reason='needs ROS messages')
    assert module.__doc__.splitlines()[0].rstrip('.')
    assert callable(module.measure)


def test_a_section_is_written_and_shown(tmp_path, monkeypatch):
    monkeypatch.setattr(results, 'FOLDER', tmp_path)
    section = Section('Text.', {'share': SHARE, 'nothing': Figure(None)}, [Table('All', [['', 'share'], ['x', SHARE]])],
                      [Picture('results_x.svg', 'a picture')])
    results.write('trial', 'A trial', section, MADE)
    for name, processor in (('second', '8 cores'), ('third', '2 cores')):
        results.write(name, name, Section('Text.', {}), {**MADE, 'processor': processor})
    assert json.loads((tmp_path / 'trial.json').read_text())['figures']['share']['value'] == 0.9613
    page = results_page(read_results(tmp_path))
    assert '## A trial\n' in page
    assert '| x| 0.961 (0.949-0.972)|' in page
    assert '![results_x.svg](images/results_x.svg)' in page
    assert 'measured on 2 cores.' in page and 'commit abc, T = 50.0 ms, 2026-01-01' in page
    assert page.count('2 cores') == 1 and '`./run bench report second`: commit abc, 8 cores, T = 50.0 ms' in page
    assert '| x | 0.961 [0.949, 0.972] |' in str(section)


def test_names_that_can_not_be_quoted_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(results, 'FOLDER', tmp_path)
    with pytest.raises(ValueError, match='all cameras'):
        results.write('trial', 'A trial', Section('', {'all cameras': SHARE}), MADE)


def test_a_section_without_its_data_says_what_it_needs(tmp_path):
    with pytest.raises(NeedsDataError, match='--data mvor=FOLDER'):
        Options().folder('mvor')
    with pytest.raises(NeedsDataError, match='--data hands=FOLDER'):
        results.scenes_with(Options([DEMO]), 'hands', 'hand_joints')
    assert results.scenes_with(Options(data={'any': DEMO}), 'any', 'joints') == [DEMO]


def test_a_scene_is_counted_once(tmp_path, monkeypatch):
    monkeypatch.setattr(counting, 'KEPT', tmp_path)
    options = Options([DEMO], quick=True)
    counts = counting.count(options, {}, exact=True)
    assert counts[0].sums['frames'] == counting.QUICK_FRAMES
    assert counts[0].sums['paired'] == counts[0].sums['true']
    again = score_people(DEMO, counting.people_of(DEMO, counts[0]), slice(counting.QUICK_FRAMES))
    assert again.sums == counts[0].sums
    np.testing.assert_array_equal(again.rows['joints'], counts[0].rows['joints'])
    monkeypatch.setattr(counting, '_run', lambda job, path: pytest.fail('counted again'))
    assert counting.count(options, {}, exact=True)[0].sums == counts[0].sums
    with pytest.raises(pytest.fail.Exception):
        counting.count(options, {'smoothing': False}, exact=True)
