"""Pages show the figures that were measured, and no others."""
import re

import pytest

from development import ROOT
from development.results import FIGURE, FORMS, PAGE, pages, read_results, results_page, with_figures

# What README.md shows by its name only: a number with a unit of accuracy or speed, and shares such as 0.96. Code, as
# the value of a parameter, does not count.
_UNNAMED = re.compile(r'(?<![\w.])(?:\d[\d.,]*\s?(?:mm|cm|ms|Hz|fps|frames per second|%|deg|degrees)(?!\w)'
                      r'|0?\.\d{2,}(?!\.?\d))')
_CODE = re.compile(r'^```.*?^```|`[^`\n]*`|\]\([^)]*\)', re.MULTILINE | re.DOTALL)

SECTIONS = {'accuracy': {'figures': {
    'near': {'value': 0.9613, 'low': 0.949, 'high': 0.972, 'unit': '', 'digits': 3},
    'error': {'value': 23.04, 'low': 21.1, 'high': 24.9, 'unit': 'mm', 'digits': 1},
    'nothing': {'value': None, 'low': None, 'high': None, 'unit': 'mm', 'digits': 1}}}}


def faults_of(text, sections):
    """Return what is wrong with the figures of a page."""
    faults = [f'the marker of a figure is broken: {text[found.start():found.start() + 60]!r}'
              for found in re.finditer('<!-- figure:', text) if not FIGURE.match(text, found.start())]
    for found in FIGURE.finditer(text):
        section, _, name = found['name'].partition('.')
        if name not in sections.get(section, {}).get('figures', {}):
            faults.append(f"{found['name']}: results hold no such figure")
        elif found['form'] not in (None, *FORMS):
            faults.append(f"{found['name']}: form {found['form']!r}, allowed: {', '.join(FORMS)}")
        elif with_figures(found[0], sections) != found[0]:
            shown = FIGURE.match(with_figures(found[0], sections))['shown']
            faults.append(f"{found['name']}: the page has {found['shown']}, results have {shown}")
    return faults


def unnamed_figures(text):
    """Return the figures of accuracy and speed in a page that are no quoted results."""
    return [found[0] for found in _UNNAMED.finditer(_CODE.sub('', FIGURE.sub('', text)))]


@pytest.mark.parametrize('page', pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_figures_in_pages_are_those_of_the_results(page):
    assert not faults_of(page.read_text(), read_results()), 'write them again with: ./run docs'


def test_the_page_of_results_is_that_of_their_files_and_its_pictures_are_there():
    sections = read_results()
    assert PAGE.read_text() == results_page(sections), 'write it again with: ./run docs'
    for picture in (picture for section in sections.values() for picture in section['pictures']):
        assert (ROOT / 'docs/images' / picture['file']).is_file()


def test_the_readme_names_each_figure():
    figures = unnamed_figures((ROOT / 'README.md').read_text())
    assert not figures, 'quote results as CONTRIBUTING says, or put the value of a parameter in backticks'


@pytest.mark.parametrize('name, form, shown', [
    ('error', '', '23.0 mm'), ('error', ' number', '23.0'),
    ('near', ' percent', '96 %'), ('nothing', '', '-')])
def test_a_figure_is_filled_in(name, form, shown):
    page = f'before <!-- figure: accuracy.{name}{form} -->old<!-- end --> after'
    written = with_figures(page, SECTIONS)
    assert written == f'before <!-- figure: accuracy.{name}{form} -->{shown}<!-- end --> after'
    assert with_figures(written, SECTIONS) == written
    assert faults_of(written, SECTIONS) == [] == faults_of('text', {})
    assert faults_of(page, SECTIONS) == [f'accuracy.{name}: the page has old, results have {shown}']


@pytest.mark.parametrize('marker, fault', [
    ('<!-- figure: accuracy.other -->1<!-- end -->', 'accuracy.other: results hold no such figure'),
    ('<!-- figure: speed.near -->1<!-- end -->', 'speed.near: results hold no such figure'),
    ('<!-- figure: accuracy.near round -->1<!-- end -->', "accuracy.near: form 'round', allowed"),
    ('<!-- figure: accuracy.near -->0.961', 'the marker of a figure is broken')])
def test_faults_of_a_page(marker, fault):
    assert with_figures(marker, SECTIONS) == marker or 'round' in marker
    assert any(found.startswith(fault) for found in faults_of(marker, SECTIONS))


@pytest.mark.parametrize('text, figures', [
    ('joints within 23 mm', ['23 mm']), ('a share of 0.96.', ['0.96']), ('at 30 Hz, 12.5ms', ['30 Hz', '12.5ms']),
    ('96 % of people', ['96 %']), ('version 0.10.49, Ubuntu 20.04, 2 cores, 640x480', []),
    ('`target_rate` of `30 Hz`', []),
    ('```sh\nplay 30 Hz\n```\n', []), ('[page](a_0.96.md)', []),
    ('<!-- figure: accuracy.error -->23.0 mm<!-- end -->', [])])
def test_figures_without_a_name(text, figures):
    assert unnamed_figures(text) == figures
