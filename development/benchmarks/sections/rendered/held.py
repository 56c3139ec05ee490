"""People who hold something before them, on rendered scenes."""
from dataclasses import replace

from common import scenes_of
from results import Options, Section, Table
from results.counting import count
from scoring.figures import figures, rows_of
from scoring.people import SHORT_TABLE, STATISTICS

MODES = ('fast', 'balanced')
COLUMNS = {**SHORT_TABLE, 'exchanged': 'exchanged'}


def measure(options: Options) -> Section:
    """Measure the chain on --data held=FOLDER, from `./run bench render held`."""
    scenes = scenes_of(options.folder('held'))
    counts = {mode: count(replace(options, scenes=scenes), {'mode': mode}) for mode in MODES}
    found = {f'{mode}_{name}': figure for mode, each in counts.items()
             for name, figure in figures(each, STATISTICS).items()}
    by_scene = {each.scene: [each] for each in counts['balanced']}
    return Section(f'{len(scenes)} scenes of 50 frames: a shirt, a towel, a box, a tray, a trolley. Exchanged: pairs '
                   'of shoulders or hips with left and right exchanged, of those with a position.', found,
                   [Table('All scenes', rows_of(counts, STATISTICS, COLUMNS, 'mode')),
                    Table('By scene, balanced', rows_of(by_scene, STATISTICS, COLUMNS, 'scene'))])
