"""What was measured, docs/results/SECTION.json: the page docs/results.md, and figures that pages quote by name."""
import json
import re
from pathlib import Path
from typing import Any, Dict, List, Sequence

from development import PACKAGES, ROOT
from development.terminal import say

FOLDER, PAGE = ROOT / 'docs/results', ROOT / 'docs/results.md'
HEAD = '''# Results

This page is for readers who want to know how accurate and how fast the packages are, and how sure that is. It is
written by `./run bench report`; each section says by which commit, on which processor and when it was measured. Figures
are followed by their 95 % interval, by bootstrap over scenes: 0.961 (0.949-0.972). **T** is the time of a pass of the
network mobilenet_thin at 656 x 368 in f32 on two threads: divide times by it to compare machines. Sections that name no
processor were measured on {processor}.
'''
# Sections in the order of the page; others follow.
ORDER = ('accuracy', 'errors', 'sigma', 'held', 'speed', 'modes', 'latency', 'live', 'signals', 'separation',
         'hands', 'cameras', 'monocular', 'mvor', 'real_cameras', 'real', 'sensors')
# A figure in a page: <!-- figure: SECTION.NAME FORM -->0.96<!-- end -->, FORM one of FORMS or nothing.
FIGURE = re.compile(r'<!-- figure: (?P<name>[a-z0-9_]+\.[a-z0-9_]+)(?: (?P<form>[a-z]+))? -->'
                    r'(?P<shown>[^<]*)<!-- end -->')
FORMS = ('number', 'percent', 'short')
_INTERVAL = re.compile(r'\[(-?[\d.]+), (-?[\d.]+)\]')

Sections = Dict[str, Dict[str, Any]]


def read_results(folder: Path = FOLDER) -> Sections:
    """Return what was measured, by section."""
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob('*.json'))}


def results_page(sections: Sections) -> str:
    """Return docs/results.md."""
    names = [*(name for name in ORDER if name in sections), *sorted(set(sections) - {*ORDER})]
    processors = [sections[name]['made']['processor'] for name in names]
    usual = max(processors, key=processors.count, default='')
    return '\n'.join([HEAD.format(processor=usual),
                      *(part for name in names for part in _section(name, sections[name], usual))])


def _section(name: str, section: Dict[str, Any], usual: str) -> List[str]:
    made = section['made']
    processor = '' if made['processor'] == usual else f"{made['processor']}, "
    parts = [f"## {section['title']}\n", f"{section['text']}\n"]
    for table in section['tables']:
        parts += [*([f"**{table['title']}**\n"] if table['title'] else []), _markdown(table['rows'])]
    parts += [f"![{picture['file']}](images/{picture['file']})\n\n{picture['text']}\n"
              for picture in section['pictures']]
    return [*parts, f"`./run bench report {name}`: commit {made['commit']}, {processor}"
                    f"T = {made['T_ms']} ms, {made['date']}\n"]


def _markdown(rows: Sequence[Sequence[str]]) -> str:
    lines = [_INTERVAL.sub(r'(\1-\2)', f"| {'| '.join(row)}|") for row in rows]
    lines.insert(1, '|---|' + '---:|' * (len(rows[0]) - 1))
    return '\n'.join(lines) + '\n'


def pages() -> List[Path]:
    """Return the pages that quote figures: README.md, docs/*.md, and README.md of packages."""
    found = [ROOT / 'README.md', *sorted((ROOT / 'docs').glob('*.md')),
             *(folder / 'README.md' for folder in PACKAGES.values())]
    return [path for path in found if path.is_file() and path != PAGE]


def with_figures(text: str, sections: Sections) -> str:
    """Return a page with its figures as they were measured; unknown ones stay."""
    return FIGURE.sub(lambda found: found[0][:found.start('shown') - found.start()]
                      + _shown(found, sections) + '<!-- end -->', text)


def _shown(found: 're.Match[str]', sections: Sections) -> str:
    """Return the text of a figure: with its unit, in one of FORMS; short: in two digits."""
    section, _, name = found['name'].partition('.')
    figure = sections.get(section, {}).get('figures', {}).get(name)
    if figure is None:
        return found['shown']
    if figure['value'] is None:
        return '-'
    if found['form'] == 'percent':
        return f"{100 * figure['value']:.0f} %"
    short = found['form'] == 'short'
    value = f"{figure['value']:.2g}" if short else f"{figure['value']:.{figure['digits']}f}"
    return f"{value} {figure['unit']}" if figure['unit'] and found['form'] != 'number' else value


def write_results() -> None:
    """Write docs/results.md, and the figures in other pages."""
    sections = read_results()
    if sections:
        PAGE.write_text(results_page(sections))
        say(str(PAGE))
    for path in pages():
        text = path.read_text()
        written = with_figures(text, sections)
        if written != text:
            path.write_text(written)
            say(str(path))
