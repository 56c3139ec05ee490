"""Several cameras."""
import importlib
from typing import Dict, List

from results import Options, Section, Table, scenes_with
from scoring.counts import Counts, blocks_of, by_value
from scoring.figures import few_scenes, figures
from scoring.world import STATISTICS, score_world

COLUMNS = {'persons_recall': 'people found', 'persons_precision': 'real', 'visible_median': 'median [mm]',
           'visible_100': 'within 100 mm', 'hidden_100': 'seen by none, within 100 mm', 'switches': 'switches',
           'within_1_sigma': 'within 1 sigma', 'within_2_sigma': 'within 2 sigma'}
# Length of the parts of a stage that intervals are drawn from [s].
BLOCK = 0.5
# Cases of `cameras fusion` by the end of their titles, those of each camera together: titles and names of figures.
CASES = {'all cameras': ('all cameras', 'all'), 'alone': ('one camera alone', 'one'),
         'dead from the middle on': ('one camera dead from the middle on', 'dead'),
         'moved by 100 mm': ('one camera moved by 100 mm', 'moved'),
         'stamps wrong by up to 20 ms': ('stamps wrong by up to 20 ms', 'late'),
         'the others without': ('one camera with depth', 'one_depth'), 'no depth': ('no depth', 'no_depth')}


def measure(options: Options) -> Section:
    """Fuse the people that the chain finds with each camera of stages: rendered ones, or of --data stages=FOLDER."""
    program = importlib.import_module('cameras.fusion')
    folders = scenes_with(options, 'stages', lambda folder: True, 'gt_world.json')
    counts: Dict[str, List[Counts]] = {title: [] for title in CASES}
    blocks: Dict[str, List[Counts]] = {title: [] for title in CASES}
    for folder in folders[:1] if options.quick else folders:
        recorded = program.record(folder)
        for case in program.cases(len(recorded), len(recorded[0].frames)):
            title = next((title for title in CASES if case.title.endswith(title)), None)
            if title:
                fused, _ = program.fuse(recorded, case)
                counts[title].append(score_world(folder, fused))
                blocks[title] += [score_world(folder, fused, part)
                                  for part in blocks_of(folder, BLOCK, 'gt_world.json')]
    found = {title: few_scenes(each, blocks[title], STATISTICS) for title, each in counts.items()}
    named = {f'{CASES[title][1]}_{key}': figure for title, each in found.items() for key, figure in each.items()}
    cameras = by_value(blocks['all cameras'], 'joints', 'cameras', {
        'no camera': [0], 'one camera': [1], 'two cameras': [2], 'three cameras': [3]})
    seen = [['joints seen by', 'median [mm]', 'mean [mm]'], *(
        [title, *(figures(each, STATISTICS)[key] for key in ('visible_median', 'visible_mean'))]
        for title, each in cameras.items() if title != 'no camera')]
    return Section(f'{len(folders)} stages of three cameras each, mode balanced; people fused in the world. A person '
                   'counts where a camera sees one of the joints. Intervals: bootstrap over stages, of less than '
                   'five over halves of a second.', named,
                   [Table('Cases', [['case', *COLUMNS.values()], *(
                        [CASES[title][0], *(each[key] for key in COLUMNS)] for title, each in found.items())]),
                    Table('All cameras', seen)])
