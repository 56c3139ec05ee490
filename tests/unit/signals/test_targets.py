"""Files of what people may point at, and the node's parameters."""
from pathlib import Path

import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_signals.node_params import UprightParams
from openpose_ros_signals.targets import read_targets


def test_targets(tmp_path):
    path = tmp_path / 'targets.yaml'
    path.write_text('- {name: lamp, frame_id: room, position: [1, 2, 3]}\n- {name: cup, frame_id: /cup}\n')
    lamp, cup = read_targets(path)
    assert (lamp.name, lamp.frame_id, lamp.position.tolist()) == ('lamp', 'room', [1, 2, 3])
    assert (cup.frame_id, cup.position.tolist()) == ('cup', [0, 0, 0])
    path.write_text('[]')
    assert read_targets(path) == ()


def test_a_file_in_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    (tmp_path / 'my targets.yaml').write_text('[]')
    assert read_targets(Path('~/my targets.yaml')) == ()


@pytest.mark.parametrize('text, says', [
    ('lamp: [1, 2, 3]', 'expected a list'), ('- {name: lamp}', 'is no target'),
    ('- {name: a, frame_id: room, position: [1, 2]}', 'is no target'), ('- {name: a, frame_id: 3}', 'is no target'),
    ('- {name: a, frame_id: r, position: [1, 2, .nan]}', 'is no target'),
    ('- {name: a, frame_id: r, position: [1, 2, x]}', 'targets'), ('- {name: a, frame_id: r, colour: red}', 'is no'),
    ('- {name: a, frame_id: r}\n- {name: a, frame_id: r}', "two targets of the name 'a'"),
    ('- {', 'targets'), (None, 'wrong'),
])
def test_wrong_files_say_what_is_wrong(tmp_path, text, says):
    path = tmp_path / 'wrong.yaml'
    if text is not None:
        path.write_text(text)
    with pytest.raises(BadInputError, match=says) as error:
        read_targets(path)
    assert str(path) in str(error.value)


def test_upwards_is_a_unit_vector():
    np.testing.assert_allclose(UprightParams(up='0 -3 4').upwards, [0, -0.6, 0.8])


@pytest.mark.parametrize('up', ['', '0 0 0', '0 1', '1 2 x', 'nan 0 1'])
def test_up_that_is_no_direction_is_refused(up):
    with pytest.raises(ParameterError, match="'up'"):
        UprightParams(up=up)
