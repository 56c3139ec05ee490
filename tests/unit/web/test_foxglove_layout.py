"""The layout for Foxglove names panels, topics and fields that there are."""
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
LAYOUT = json.loads((ROOT / 'extensions/openpose_ros_web/foxglove/people.json').read_text())
PANELS = LAYOUT['configById']
NAMESPACE = '/openpose_ros/skeleton_3d/'
# foxglove/studio 1.87, packages/studio-base/src/panels/index.ts: those that this layout may use.
KINDS = {'3D', 'Image', 'Plot', 'StateTransitions', 'DiagnosticSummary', 'RawMessages'}


def strings(value):
    """Yield all texts of a value, keys as well."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield key
            yield from strings(each)
    elif isinstance(value, list):
        for each in value:
            yield from strings(each)
    elif isinstance(value, str):
        yield value


def panels_of(part):
    """Return the panels of a part of the layout."""
    return [part] if isinstance(part, str) else panels_of(part['first']) + panels_of(part['second'])


def test_each_panel_has_a_place_and_a_known_kind():
    assert sorted(panels_of(LAYOUT['layout'])) == sorted(PANELS)
    assert {panel.partition('!')[0] for panel in PANELS} == KINDS


@pytest.mark.parametrize('text', sorted({text for text in strings(PANELS) if text.startswith('/')}))
def test_topics_and_fields_are_those_of_the_nodes(text):
    topic, _, path = text.partition('.')
    if topic == '/diagnostics':
        return
    assert topic.startswith(NAMESPACE)
    name = topic[len(NAMESPACE):].replace('/compressed', '')
    pages = (ROOT / 'docs/ros_api.md').read_text() + (ROOT / 'docs/signals.md').read_text()
    assert re.search(rf'`(NS/|openpose_ros/skeleton_3d/)?{name}`', pages), f'{topic} is in no table of topics'
    kind = 'PersonSignalsArray'
    for field in re.sub(r'\[:\]|\{[^}]*\}', '', path).split('.') if path else ():
        text = (ROOT / f'openpose_ros_msgs/msg/{kind}.msg').read_text()
        kinds = {name: each for each, name in re.findall(r'^(\w+)(?:\[\d*\])? +(\w+)', text, re.MULTILINE)}
        assert field in kinds, f'{kind} has no field {field}'
        kind = kinds[field]
    for condition in re.findall(r'\{(\w+)==', path):
        assert condition == 'person_ID'
