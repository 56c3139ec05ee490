"""Pages show the figures that were measured, and no others."""
import re

import pytest

from development import ROOT
from development.results import FIGURE, PAGE, pages, read_results, results_page, with_figures

# What README.md shows by its name only: a number with a unit of accuracy or speed, and shares such as 0.96. Code, as
# the value of a parameter, does not count.
_UNNAMED = re.compile(r'(?<![\w.])(?:\d[\d.,]*\s?(?:mm|cm|ms|Hz|fps|frames per second|%|deg|degrees)(?!\w)'
                      r'|0?\.\d{2,}(?!\.?\d))')
_CODE = re.compile(r'^```.*?^```|`[^`\n]*`|\]\([^)]*\)', re.MULTILINE | re.DOTALL)

SECTIONS = {'accuracy': {'figures': {
    'near': {'value': 0.9613, 'low': 0.949, 'high': 0.972, 'unit': '', 'digits': 3},
    'error': {'value': 23.04, 'low': 21.1, 'high': 24.9, 'unit': 'mm', 'digits': 1},
    'nothing': {'value': None, 'low': None, 'high': None, 'unit': 'mm', 'digits': 1}}}}


@pytest.mark.parametrize('page', pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_figures_in_pages_are_those_of_the_results(page):
    text, sections = page.read_text(), read_results()
    found = list(FIGURE.finditer(text))
    assert len(found) == text.count('<!-- figure:'), 'the marker of a figure is broken'
    for figure in found:
        section, _, name = figure['name'].partition('.')
        assert name in sections.get(section, {}).get('figures', {}), figure[0]
    assert with_figures(text, sections) == text, 'write it again with: ./run docs'


def test_the_page_of_results_is_that_of_their_files_and_its_pictures_are_there():
    sections = read_results()
    assert PAGE.read_text() == results_page(sections), 'write it again with: ./run docs'
    for picture in (picture for section in sections.values() for picture in section['pictures']):
        assert (ROOT / 'docs/images' / picture['file']).is_file()


def test_the_readme_names_each_figure():
    text = (ROOT / 'README.md').read_text()
    assert not _UNNAMED.findall(_CODE.sub('', FIGURE.sub('', text))), (
        'quote results as CONTRIBUTING says, or put the value of a parameter in backticks')


@pytest.mark.parametrize('name, form, shown', [
    ('error', '', '23.0 mm'), ('error', ' number', '23.0'), ('near', ' percent', '96 %'),
    ('error', ' short', '23 mm'), ('nothing', '', '-')])
def test_a_figure_is_filled_in(name, form, shown):
    written = with_figures(f'before <!-- figure: accuracy.{name}{form} -->old<!-- end --> after', SECTIONS)
    assert written == f'before <!-- figure: accuracy.{name}{form} -->{shown}<!-- end --> after'
    assert with_figures(written, SECTIONS) == written
