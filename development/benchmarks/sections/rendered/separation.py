"""People and a robot: how near they are, and how the bound below that holds."""
from typing import Dict, List

from results import Options, Section, Table
from results.counting import count, people_of
from scoring.counts import Counts
from scoring.figures import figures_of, named, rows_of
from scoring.separation import GAPS, RATE, ROBOTS, STATISTICS, Delivery, score_separation

CASES = {'as_they_come': ('all frames, 100 ms late', Delivery()),
         'dropped': ('every other frame', Delivery(every=2)),
         'gaps': ('half a second in two', Delivery(pause=0.5)),
         'late': ('200 ms late', Delivery(late=0.2)),
         'off': ('camera off from the middle on', Delivery(end=0.5)),
         'guarded': ('with a guard volume', Delivery(guard=True))}
COLUMNS = {'broken': 'bound broken', 'broken_known': 'of bounds above 0, person found', 'slack': 'slack, median [m]',
           'slack_95': 'slack, 95 % [m]', 'zero': 'bound 0', 'until_zero': 'bound above 0 until [s]'}


def measure(options: Options) -> Section:
    """Bound the distances of the people of mode balanced from links of simulated robots."""
    counts: Dict[str, List[Counts]] = {name: [] for name in CASES}
    for folder, each in zip(options.scenes, count(options, {'mode': 'balanced'})):
        found = people_of(folder, each)
        for name, (_, delivery) in CASES.items():
            counts[name].append(score_separation(folder, found, delivery))
    cases = figures_of(counts, STATISTICS)
    table = rows_of({title: cases[name] for name, (title, _) in CASES.items()}, COLUMNS, 'people come')
    return Section(
        f'{len(counts["off"])} scenes, mode balanced; in each {ROBOTS} robots of three links, two that stand and one '
        f'that swings, drawn {GAPS[0]:g} to {GAPS[1]:g} m from people. A bound of probability 0.99 counts at {RATE:g} '
        'Hz, against the distance of the true capsules at that time. Broken: it is greater; the next column leaves out '
        'bounds of 0, and people that the chain had not found before. Feet, which the truth has not, do not count. '
        'Slack: true distance less bound, where the nearest person has a visible joint. Last column: greatest age of '
        'people with a bound above '
        '0.', named(cases), [Table('', table)])
