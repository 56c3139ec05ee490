"""Counts of a scene: sums and rows, which add up over scenes and are kept in files."""
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, Mapping, Sequence, Tuple

import numpy as np

# Frames are those of a true time that is so near; true times are rounded [s].
SAME_TIME = 2e-3
# All true frames of a scene.
WHOLE = slice(None)


@dataclass(frozen=True)
class Counts:
    """What was counted in a scene.

    Attributes:
        scene: name.
        tags: what the scene is: 'kind', 'sensor', 'light'.
        sums: numbers that add up, by name.
        rows: tables by name, each a structured array (N,) with one row per joint, hand point, ray ...
    """

    scene: str
    tags: Dict[str, str]
    sums: Dict[str, float]
    rows: Dict[str, np.ndarray]

    def where(self, table: str, wanted: Callable[[np.ndarray], np.ndarray]) -> 'Counts':
        """Return the counts with some rows of a table; `wanted` takes the table and returns a mask (N,)."""
        return replace(self, rows={**self.rows, table: self.rows[table][wanted(self.rows[table])]})

    def save(self, path: Path) -> None:
        """Write the counts as .npz."""
        path.parent.mkdir(parents=True, exist_ok=True)
        head = json.dumps({'scene': self.scene, 'tags': self.tags, 'sums': self.sums})
        partial = path.with_suffix('.partial.npz')
        np.savez_compressed(str(partial), head=np.array(head), **self.rows)
        partial.replace(path)


def load(path: Path) -> Counts:
    """Read counts that were saved."""
    with np.load(str(path)) as file:
        return Counts(**json.loads(str(file['head'])), rows={name: file[name] for name in file.files if name != 'head'})


def tags_of(folder: Path) -> Dict[str, str]:
    """Return kind, sensor and, where it is known, light of a scene by its meta.json; scenario 07_hug is of kind hug."""
    path = folder / 'meta.json'
    meta = json.loads(path.read_text()) if path.is_file() else {}
    tags = {'kind': str(meta.get('scenario', folder.name)).strip('0123456789_'),
            'sensor': str(meta.get('sensor', 'kinect_v2'))}
    return {**tags, 'light': str(meta['light'])} if 'light' in meta else tags


def blocks_of(folder: Path, seconds: float = 1.0, truth: str = 'gt.json') -> List[slice]:
    """Return the frames of a scene in parts of that length, for intervals where there are few scenes."""
    times = [frame['t'] for frame in json.loads((folder / truth).read_text())['frames']]
    edges = np.searchsorted(times, np.arange(times[0], times[-1], seconds) - 1e-6)
    return [slice(int(first), int(last)) for first, last in zip(edges, [*edges[1:], len(times)])]


def at_times(frames: Iterable[Tuple[float, Any]], times: Sequence[float]) -> List[List[Any]]:
    """Return what was found at each true time [s], of pairs of stamp [s] and what was found; the rest is left out."""
    found: List[List[Any]] = [[] for _ in times]
    for seconds, each in frames:
        number = int(np.abs(np.asarray(times) - seconds).argmin())
        found[number] += [each] if abs(times[number] - seconds) < SAME_TIME else []
    return found


def by_tag(counts: Sequence[Counts], tag: str) -> Dict[str, List[Counts]]:
    """Return the scenes by what a tag says of them."""
    return {value: [each for each in counts if each.tags.get(tag) == value]
            for value in sorted({each.tags[tag] for each in counts if tag in each.tags})}


def by_bin(counts: Sequence[Counts], table: str, column: str, edges: Sequence[float]) -> Dict[str, List[Counts]]:
    """Return the scenes with the rows of a table whose column lies in each interval [edge, next edge)."""
    return {f'{low:g}-{high:g}': [each.where(table, lambda rows, low=low, high=high: (
        (rows[column] >= low) & (rows[column] < high))) for each in counts] for low, high in zip(edges, edges[1:])}


def by_value(counts: Sequence[Counts], table: str, column: str, groups: Mapping[str, Sequence[int]]
             ) -> Dict[str, List[Counts]]:
    """Return the scenes with the rows of a table whose column has one of the values of each group."""
    return {name: [each.where(table, lambda rows, values=values: np.isin(rows[column], values)) for each in counts]
            for name, values in groups.items()}
