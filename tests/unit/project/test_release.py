"""What is written for a release, and the messages for ROS 2."""
import re

import yaml

from development import PACKAGES, ROOT
from development.ros2 import DEPENDENCIES, NAME, RULES, package_of_ros2

BUILTIN = {'bool', 'float32', 'string', 'uint8', 'uint32'}


def test_the_citation_has_the_version_and_date_of_the_newest_release():
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert f'<version>{citation["version"]}</version>' in (PACKAGES[NAME] / 'package.xml').read_text()
    assert f'\n{citation["version"]} ({citation["date-released"]})\n' in (PACKAGES[NAME] / 'CHANGELOG.rst').read_text()


def test_messages_of_ros_2_have_its_names_and_each_field_has_a_rule():
    files = package_of_ros2()
    messages = {name[4:-4]: text for name, text in files.items() if name.endswith('.msg')}
    assert len(messages) == len(list(PACKAGES[NAME].glob('msg/*.msg')))
    rules = {rule['ros2_message_name']: rule for rule in yaml.safe_load(files[RULES])}
    assert rules.keys() == messages.keys()
    for name, text in messages.items():
        assert re.fullmatch('[A-Z][A-Za-z0-9]*', name)
        lines = [line.partition('#')[0].split() for line in text.splitlines() if '=' not in line.partition('#')[0]]
        fields = {words[1]: words[0].partition('[')[0] for words in lines if words}
        assert set(rules[name]['fields_1_to_2'].values()) == set(fields), name
        assert all(re.fullmatch('[a-z][a-z0-9]*(_[a-z0-9]+)*', field) for field in fields), name
        for kind in fields.values():
            assert kind in BUILTIN or kind in messages or kind.partition('/')[0] in DEPENDENCIES, (name, kind)
    assert rules['PersonDetection3d']['fields_1_to_2']['person_ID'] == 'person_id'
