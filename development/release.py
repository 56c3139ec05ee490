"""./run release VERSION: one version, in the place of this argument, for manifests, changelogs and CITATION.cff."""
import datetime
import re
from pathlib import Path
from typing import Callable, Sequence

from development import PACKAGES, ROOT
from development.terminal import die, say

CITATION = ROOT / 'CITATION.cff'
_FORTHCOMING = 'Forthcoming\n-----------\n'


def release(arguments: Sequence[str]) -> None:
    if len(arguments) != 1 or not re.fullmatch(r'\d+\.\d+\.\d+', arguments[0]):
        die('usage: ./run release VERSION, such as 1.1.0')
    version, today = arguments[0], f'{datetime.date.today():%Y-%m-%d}'
    for folder in PACKAGES.values():
        write(folder / 'package.xml', lambda text: re.sub(r'<version>.*?<', f'<version>{version}<', text))
        write(folder / 'CHANGELOG.rst', lambda text: with_section(text, version, today))
    write(CITATION, lambda text: re.sub(r'(?m)^version: .*$', f'version: {version}', re.sub(
        r'(?m)^date-released: .*$', f'date-released: {today}', text)))
    say(f'Now: git commit --all --message "{version}" && git tag {version} && git push origin main {version}')


def write(path: Path, changed: Callable[[str], str]) -> None:
    path.write_text(changed(path.read_text()))


def with_section(changelog: str, version: str, day: str) -> str:
    """Return a changelog whose forthcoming changes are those of a version; without any it says so."""
    if f'\n{version} (' in changelog:
        die(f'{version} is in a changelog already')
    title = f'{version} ({day})'
    section = f'{title}\n{"-" * len(title)}\n'
    if _FORTHCOMING in changelog:
        return changelog.replace(_FORTHCOMING, section)
    head, _, rest = changelog.partition('\n\n')
    return f'{head}\n\n{section}* No changes\n\n{rest}'
