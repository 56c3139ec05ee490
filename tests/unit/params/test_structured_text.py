"""Values in texts: what they hold, and what no text can do."""
import pytest

from openpose_ros_pkg.structured_text import json_value, yaml_value


@pytest.mark.parametrize('text, value', [('', None), ('a: [1, 2.5]', {'a': [1, 2.5]}), ('a: 1\n---\nb: 2\n', {'a': 1}),
                                         ('a: &x [1]\nb: *x', {'a': [1], 'b': [1]})])
def test_yaml(text, value):
    assert yaml_value(text) == value


@pytest.mark.parametrize('text, reason', [
    ('[' * 20000, 'nested too deep'),
    ('2001-99-99', 'month must be in'), ('a: b: c', 'mapping values are not allowed'),
    ('!!python/object/apply:os.system [ls]', 'could not determine a constructor'), ('\0', 'not allowed'),
    ('{[]: 1}', 'unhashable')])
def test_yaml_that_is_refused(text, reason):
    with pytest.raises(ValueError, match=reason):
        yaml_value(text)


def test_json():
    assert json_value(b'{"a": [1, null]}') == {'a': [1, None]}


@pytest.mark.parametrize('text, reason', [('', 'Expecting value'), ('[1', 'Expecting'), (b'\xff', 'decode'),
                                          ('[' * 200000, 'nested too deep')])
def test_json_that_is_refused(text, reason):
    with pytest.raises(ValueError, match=reason):
        json_value(text)
