"""People who hold something before them, on rendered scenes."""
from dataclasses import replace

from common import scenes_of
from results import Options, Section, Table
from results.counting import count
from scoring.figures import figures_of, named, rows_of
from scoring.people import SHORT_TABLE, STATISTICS

MODES = ('fast', 'balanced')
COLUMNS = {**SHORT_TABLE, 'exchanged': 'exchanged'}


def measure(options: Options) -> Section:
    """Measure the chain on --data held=FOLDER, from `./run bench render held`."""
    scenes = scenes_of(options.folder('held'))
    counts = {mode: count(replace(options, scenes=scenes), {'mode': mode}) for mode in MODES}
    modes = figures_of(counts, STATISTICS)
    by_scene = figures_of({each.scene: [each] for each in counts['balanced']}, STATISTICS)
    return Section(f'{len(scenes)} scenes of 50 frames: a shirt, a towel, a box, a tray, a trolley. Exchanged: pairs '
                   'of shoulders or hips with left and right exchanged, of those with a position.', named(modes),
                   [Table('All scenes', rows_of(modes, COLUMNS, 'mode')),
                    Table('By scene, balanced', rows_of(by_scene, COLUMNS, 'scene'))])
