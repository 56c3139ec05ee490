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


def test_a_table_of_parameters():
    lines = table('openpose_ros_pkg.params.nodes.CameraParams')
    assert lines[:2] == ['| name | default | allowed | what it does |', '| --- | --- | --- | --- |']
    assert len(lines) > 4


def test_a_table_of_a_node():
    assert table('openpose_ros_pkg.params.nodes.CameraParams')[2] in table('config:camera_node.yaml')


def test_text_around_a_table_stays():
    page = 'before\n\n<!-- table: config:camera_node.yaml -->\nold\n<!-- end of table -->\n\nafter\n'
    written = with_tables(page)
    assert written.startswith('before\n\n<!-- table: config:camera_node.yaml -->\n| name |')
    assert written.endswith('|\n<!-- end of table -->\n\nafter\n')
    assert with_tables(written) == written


def test_an_unknown_table_is_an_error():
    with pytest.raises(SystemExit, match='there is no config:nothing'):
        table('config:nothing.yaml')
    with pytest.raises(AttributeError, match='Nothing'):
        table('openpose_ros_pkg.params.nodes.Nothing')
