"""Tables of figures."""
from typing import Any, List, Mapping, Sequence

from .counts import Counts
from .figures import figures


def rows_of(groups: Mapping[str, Sequence[Counts]], statistics: Mapping[str, Any], names: Mapping[str, str], first: str
            ) -> List[List[Any]]:
    """Return the rows of a table: one for each group that has figures, one column for each statistic with its title."""
    found = {title: [*figures(counts, {name: statistics[name] for name in names}).values()]
             for title, counts in groups.items()}
    return [[first, 'scenes', *names.values()],
            *([title, max(figure.scenes for figure in each), *each] for title, each in found.items()
              if any(figure.value is not None for figure in each))]
