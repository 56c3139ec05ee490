"""What `./run docs` writes is what the code says."""
import re

from development.generated import FAULTS, ROS_API, faults_page, find_packages, with_parameters


def test_the_table_of_faults_is_that_of_the_cases():
    find_packages()
    page = faults_page()
    assert FAULTS.read_text() == page, 'write it again with: ./run docs'
    rows = [line for line in page.splitlines() if line.startswith('| ')][2:]
    assert any(row.startswith('| image messages | no data | two/extractor |') for row in rows)
    titles = [tuple(row.split(' | ')[:2]) for row in rows]
    assert len(titles) == len(set(titles)), 'two cases of an area have one title'


def test_the_list_of_parameters_is_that_of_the_nodes():
    find_packages()
    page = ROS_API.read_text()
    assert page == with_parameters(page), 'write it again with: ./run docs'
    assert re.search(r'^\| \[`people_signals_node`\].* \| `fixed_frame=` \| `use_floor=false`, ', page, re.MULTILINE)
