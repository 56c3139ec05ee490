"""docs/results.md from what was measured: docs/results/SECTION.json."""
from typing import Any, Dict, List, Sequence

import results
from common import ROOT, markdown

PATH = ROOT / 'docs/results.md'
HEAD = '''# Results

This page is for readers who want to know how accurate and how fast the packages are, and how sure that is. It is
written by `./run bench report`; each section says by which commit, on which processor and when it was measured. Figures
are followed by their 95 % interval, by bootstrap over scenes: `0.961 (0.949 to 0.972)`. **T** is the time of a pass of
the network mobilenet_thin at 656 x 368 in f32 on two threads: divide times by it to compare machines.
'''


def text(sections: Dict[str, Dict[str, Any]], order: Sequence[str]) -> str:
    """Return the page of all sections."""
    names = [*(name for name in order if name in sections), *sorted(set(sections) - {*order})]
    return '\n'.join([HEAD, *(part for name in names for part in _section(name, sections[name]))])


def _section(name: str, section: Dict[str, Any]) -> List[str]:
    made = section['made']
    parts = [f"## {section['title']}\n", f"{section['text']}\n"]
    for table in section['tables']:
        parts += [*([f"**{table['title']}**\n"] if table['title'] else []), markdown(table['rows'])]
    parts += [f"![{picture['text']}](images/{picture['file']})\n\n{picture['text']}\n"
              for picture in section['pictures']]
    return [*parts, f"`./run bench report {name}`: commit {made['commit']}, {made['processor']}, "
                    f"T = {made['T_ms']} ms, {made['date']}\n"]


def write(order: Sequence[str]) -> None:
    """Write docs/results.md."""
    PATH.write_text(text(results.read(), order))
    print(PATH.relative_to(ROOT), flush=True)
