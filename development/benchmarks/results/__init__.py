"""Sections of the report: measured by modules of `sections`, kept as JSON, shown in docs/results.md.

A section module has a docstring, whose first line is the title, and `measure(options) -> Section`.
"""
import json
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence

from common import ROOT, markdown
from scoring.figures import Figure

FOLDER, IMAGES = ROOT / 'docs/results', ROOT / 'docs/images'
NAME = re.compile(r'[a-z][a-z0-9_]*')


class NeedsDataError(Exception):
    """A section needs a folder that is not given; the text says which, for --data."""


class Table(NamedTuple):
    """A table; the first row has the names of the columns. Cells may be figures, which are shown with interval."""

    title: str
    rows: Sequence[Sequence[Any]]

    @property
    def cells(self) -> List[List[str]]:
        """The rows as text."""
        return [[cell.interval if isinstance(cell, Figure) else '-' if cell is None else str(cell) for cell in row]
                for row in self.rows]


class Picture(NamedTuple):
    """An image file in docs/images, named results_*, and the text below it."""

    file: str
    text: str


@dataclass(frozen=True)
class Options:
    """What a report is made of.

    Attributes:
        scenes: folders of rendered scenes.
        quick: a few frames of everything, to see that it works.
        data: folders of other data sets by name.
        settings: parameters of the chain, for trials.
    """

    scenes: Sequence[Path] = ()
    quick: bool = False
    data: Dict[str, Path] = field(default_factory=dict)
    settings: Dict[str, Any] = field(default_factory=dict)

    def folder(self, name: str) -> Path:
        """Return the folder of a data set; NeedsDataError: it is not given."""
        if name not in self.data:
            raise NeedsDataError(f'--data {name}=FOLDER')
        return self.data[name]


def scenes_with(options: Options, name: str, key: str, truth: str = 'gt.json') -> List[Path]:
    """Return the scenes whose truth has a key: of --data NAME=FOLDER, else beside those of the report.

    Raises:
        NeedsDataError: there is none.
    """
    folders = [options.data[name]] if name in options.data else sorted({scene.parent for scene in options.scenes})
    scenes = [path.parent for folder in folders for path in sorted([folder / truth, *folder.glob(f'*/{truth}')])
              if path.is_file() and key in json.loads(path.read_text())]
    if not scenes:
        raise NeedsDataError(f'scenes of their own: --data {name}=FOLDER')
    return scenes


@dataclass(frozen=True)
class Section:
    """A part of the results.

    Attributes:
        text: in Markdown, before the tables: what was measured on what, and what it says.
        figures: by name, to be quoted by pages as SECTION.NAME.
    """

    text: str
    figures: Dict[str, Figure] = field(default_factory=dict)
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()

    def __str__(self) -> str:
        return '\n'.join([self.text, *(f'\n{table.title}\n\n{markdown(table.cells)}' for table in self.tables)])


def write(name: str, title: str, section: Section, made: Dict[str, Any]) -> None:
    """Write a section as JSON, its figures with one digit more than is shown.

    Args:
        made: commit, processor, T and date.

    Raises:
        ValueError: a name can not be quoted.
    """
    for each in (name, *section.figures):
        if not NAME.fullmatch(each):
            raise ValueError(f'{each}: a name has small letters, digits and _')
    FOLDER.mkdir(exist_ok=True)
    content = {**asdict(section), 'title': title, 'made': made,
               'figures': {key: {part: round(value, figure.digits + 1) if isinstance(value, float) else value
                                 for part, value in figure._asdict().items()}
                           for key, figure in section.figures.items()},
               'tables': [{'title': table.title, 'rows': table.cells} for table in section.tables],
               'pictures': [picture._asdict() for picture in section.pictures]}
    (FOLDER / f'{name}.json').write_text(json.dumps(content, indent=1, ensure_ascii=False) + '\n')
