"""Tables of figures."""
from typing import Any, List, Mapping, Sequence

from common import markdown

from .counts import Counts
from .figures import Figure, figures
from .people import STATISTICS, TABLE


def rows_of(groups: Mapping[str, Sequence[Counts]], statistics: Mapping[str, Any], names: Mapping[str, str], first: str
            ) -> List[List[Any]]:
    """Return the rows of a table: one for each group that has figures, one column for each statistic with its title."""
    found = {title: [*figures(counts, {name: statistics[name] for name in names}).values()]
             for title, counts in groups.items()}
    return [[first, 'scenes', *names.values()],
            *([title, max(figure.scenes for figure in each), *each] for title, each in found.items()
              if any(figure.value is not None for figure in each))]


def table_of_scenes(counts: Sequence[Counts]) -> str:
    """Return the table of people in space: a row for each scene, one for all; and all figures of all, as text."""
    scenes = {f'{number}: {each.scene}' if len(counts) > 1 else each.scene: [each]
              for number, each in enumerate(counts, 1)}
    rows = rows_of(scenes, STATISTICS, TABLE, 'scene')
    whole = figures(counts, STATISTICS)
    rows = [[cell for number, cell in enumerate(row) if number != 1] for row in rows]
    rows.append(['all', *(whole[name] for name in TABLE)])
    return '\n'.join([markdown([[str(cell) for cell in row] for row in rows]),
                      'all, with 95 % intervals; of less than five scenes they are hardly more than their range:',
                      *lines_of(whole)])


def lines_of(figures: Mapping[str, Figure]) -> List[str]:
    """Return figures as text, one a line."""
    return [f'{figure.text}: {figure.interval}{f" {figure.unit}" if figure.unit else ""}, n {figure.n}'
            for figure in figures.values()]
