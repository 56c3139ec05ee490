"""The tables in docs/*.md are those of the code."""
from pathlib import Path

import pytest

from development.generated import table, with_tables

ROOT = Path(__file__).parents[3]
PAGES = sorted((ROOT / 'docs').glob('*.md'))


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_tables_are_those_of_the_code(page):
    text = page.read_text()
    assert text.count('<!-- table: ') == text.count('<!-- end of table -->')
    assert text == with_tables(text), 'write them again with: ./run docs'


def test_text_around_a_table_stays():
    page = 'before\n\n<!-- table: config:camera_node.yaml -->\nold\n<!-- end of table -->\n\nafter\n'
    written = with_tables(page)
    assert written.startswith('before\n\n<!-- table: config:camera_node.yaml -->\n| name |')
    assert written.endswith('|\n<!-- end of table -->\n\nafter\n')
    assert with_tables(written) == written


def test_the_table_of_faults_has_a_row_of_each_case():
    rows = table('faults')[2:]
    assert len(rows) == len({tuple(row.split(' | ')[:2]) for row in rows}), 'two cases of an area have one title'
    assert any('| image messages | no data | two/extractor |' in row for row in rows)


def test_an_unknown_table_is_an_error():
    with pytest.raises(SystemExit, match='there is no config:nothing'):
        table('config:nothing.yaml')
    with pytest.raises(AttributeError, match='Nothing'):
        table('openpose_ros_pkg.params.nodes.Nothing')


def test_a_table_of_constants():
    lines = table('skeleton_extract_3d.track.constants.BirthConstants')
    assert lines[2] == '| `joint_sigma` | 0.3 [m] | Standard deviation per axis of the joints of a new track. |'
