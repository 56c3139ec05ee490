"""The sets of random scenes: disjoint, the same for the same seed, and of all kinds."""
import itertools

import numpy as np
import pytest

from development.benchmark_data import jobs
from development.benchmark_data.people.garments import HAIR, OUTFITS, SHOES
from development.benchmark_data.rendering.depth_sensors import SENSORS
from development.benchmark_data.scenarios.plan import KINDS, LIGHTS, plan_scene
from development.benchmark_data.scenarios.random_scenes import ArrangementError

COUNT = 40


@pytest.fixture(scope='module')
def plans():
    special = [('signals', i) for i in range(6)] + [('stage', i) for i in range(2)]
    return {name: [*(plan_scene(name, i) for i in range(COUNT)), *(plan_scene(name, i, kind) for kind, i in special)]
            for name in ('tune', 'report')}


def people_of(plans):
    return [person for plan in plans for person in plan.people]


def test_garments_are_divided():
    for lists in (OUTFITS, HAIR):
        tune, report = ({garment for garments in lists[name].values() for garment in garments}
                        for name in ('tune', 'report'))
        assert tune and report and not tune & report
    assert not set(SHOES['tune']) & set(SHOES['report'])


def test_no_person_garment_skin_or_seed_is_in_both_sets(plans):
    tune, report = plans['tune'], plans['report']
    for attribute in ('outfit', 'shoes', 'hair', 'skin', 'muscle', 'proportions', 'top'):
        both = [{getattr(person, attribute) for person in people_of(of_set)} for of_set in (tune, report)]
        assert both[0] and not both[0] & both[1], attribute
    assert not {plan.seed for plan in tune} & {plan.seed for plan in report}
    assert not {plan.room_seed for plan in tune} & {plan.room_seed for plan in report}
    assert len({plan.seed for plan in tune}) == len(tune)


def test_the_same_seed_gives_the_same_plan():
    assert plan_scene('tune', 7) == plan_scene('tune', 7)
    assert plan_scene('report', 1, 'signals') == plan_scene('report', 1, 'signals')
    assert plan_scene('tune', 7) != plan_scene('tune', 7 + len(KINDS))


def test_a_scene_without_an_arrangement_is_drawn_anew(monkeypatch, capsys):
    """Of the same kind and by the same sensor, with other people; at last it is an error."""
    first, second = plan_scene('tune', 7), plan_scene('tune', 7, again=1)
    failing = []

    def arranged(plan):
        if plan.seed in failing:
            raise ArrangementError(f'{plan.name}: no arrangement')
        return plan

    monkeypatch.setattr(jobs, 'build_scene', arranged)
    assert jobs.drawn(jobs.Job('', None, 'tune', 7)) == first
    failing.append(first.seed)
    assert jobs.drawn(jobs.Job('', None, 'tune', 7)) == second
    assert capsys.readouterr().out == '07_sit: no arrangement; it is drawn anew, from sub-seed 1\n'
    assert (second.name, second.kind, second.view.sensor) == (first.name, first.kind, first.view.sensor)
    assert second.people != first.people and second.room_seed != first.room_seed
    failing.extend(plan_scene('tune', 7, again=again).seed for again in range(jobs.DRAWS))
    with pytest.raises(ArrangementError):
        jobs.drawn(jobs.Job('', None, 'tune', 7))


def test_committed_scenes_are_of_neither_set(plans):
    committed = plan_scene('committed', 10)
    assert committed.seed not in {plan.seed for plan in (*plans['tune'], *plans['report'])}
    assert committed.view.half_resolution


@pytest.mark.parametrize('name', ['tune', 'report'])
def test_each_set_has_all_kinds(plans, name):
    scenes = plans[name][:COUNT]
    assert {(plan.kind, plan.view.sensor) for plan in scenes} >= set(
        itertools.product(('stand', 'sit', 'cross'), SENSORS))
    assert {plan.kind for plan in scenes} == set(KINDS)
    assert {plan.light_name for plan in scenes} == set(LIGHTS)
    counts = [len(plan.people) for plan in scenes]
    assert min(counts) == 1 and max(counts) >= 5 and max(counts) <= 6
    statures = np.array([person.stature for person in people_of(scenes)])
    assert statures.min() < 1.4 and statures.max() > 1.85
    assert statures.min() >= 1.0 and statures.max() <= 2.0
    heights = np.array([plan.view.height for plan in scenes])
    assert heights.min() >= 0.4 and heights.max() <= 2.2 and np.ptp(heights) > 1.4
    assert 0 < sum(plan.view.moving for plan in scenes) < COUNT / 2
