"""Figures of the live benchmarks: scores of answers, stages and their sum, what is played."""
import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'development' / 'benchmarks'))

from common import DEMO
from live.crowd import make_crowd
from live.figures import SCORE_COLUMNS, Answers, by_stage, median_and_95, misordered, score, score_row, wanted_rate
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

SCORES = {'person_recall': 0.5, 'person_precision': None, 'visible': {'pck100': 0.25},
          'occluded': {'pck150': 0.125, 'lies': 0.0}, 'id_switches': 3}
# A stand-in for the script that scores: it tells what it was given.
EVALUATE = '''import json, sys
*pairs, t0, t0_value, report, path = sys.argv[1:]
assert (t0, report) == ('--t0', '--json')
json.dump({'one': {'pairs': pairs, 't0': t0_value}, 'ALL': {}}, open(path, 'w'))
'''


def test_nothing_came():
    assert misordered([]) == 0
    assert median_and_95([]) == median_and_95([math.nan]) == '-'
    assert score_row('wave', 'live', SCORES, Answers(40, []))[-2:] == ['0 of 40', '-']


def test_answers_out_of_order():
    assert misordered([1, 2, 3]) == 0
    assert misordered([1, 4, 2, 3, 5]) == 2


def test_answers_add():
    both = Answers(40, [0.1], 1).plus(Answers(20, [0.2, 0.3], 2))
    assert both == Answers(60, [0.1, 0.2, 0.3], 3)


def test_row_of_scores():
    row = score_row('wave', 'live', SCORES, Answers(4, [0.01, 0.02, 0.03]))
    assert row == ['wave', 'live', '0.500 / -', '0.250', '0.125', '0.000', '3', '3 of 4', '20 / 29']
    assert len(row) == len(SCORE_COLUMNS)


def test_the_script_gets_pairs_and_the_first_stamp(tmp_path):
    script = tmp_path / 'evaluate.py'
    script.write_text(EVALUATE)
    records = score(script, [(Path('a'), Path('a.csv')), (Path('b'), Path('b.csv'))], '7', tmp_path / 'report.json')
    assert records == [{'pairs': ['a', 'a.csv', 'b', 'b.csv'], 't0': '7'}, {}]


def test_the_sum_is_that_of_the_stages_which_a_result_passes():
    stages = {'transport': 1.0, 'wait': math.nan, 'detection': 20.5, 'network': 18.0, 'age': 25.0}
    assert by_stage(stages, ('transport', 'wait', 'prepare', 'detection')) == ('transport 1.0, detection 20.5', 21.5)


@pytest.mark.parametrize('camera, unit, rate', [(30, 49, 29), (30, 100, 1000 / 60), (15, 49, 14.5)])
def test_wanted_rate(camera, unit, rate):
    assert wanted_rate(camera, unit) == pytest.approx(rate)


def test_crowds_have_more_of_the_image(tmp_path):
    shares = []
    scene = np.max([frame.depth for frame in RgbdSequence.read(DEMO)][::3], axis=0).astype(float)
    for people in (1, 2, 4):
        sequence = RgbdSequence.read(make_crowd(people, tmp_path / str(people)))
        assert len(sequence) == 40
        shares.append(float((scene - sequence.frame(0).depth > 100).mean()))  # [mm]
    assert 0.03 < shares[0] < shares[1] < shares[2] < 0.5
