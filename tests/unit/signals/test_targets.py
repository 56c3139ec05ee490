"""Files of what people may point at, and the node's parameters."""
from pathlib import Path

import numpy as np
import pytest

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_signals.node_params import UprightParams
from openpose_ros_signals.targets import read_targets


def test_targets_in_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    path = tmp_path / 'my targets.yaml'
    path.write_text('- {name: lamp, frame_id: room, position: [1, 2, 3]}\n- {name: cup, frame_id: /cup}\n')
    lamp, cup = read_targets(Path('~/my targets.yaml'))
    assert (lamp.name, lamp.frame_id, lamp.position.tolist()) == ('lamp', 'room', [1, 2, 3])
    assert (cup.frame_id, cup.position.tolist()) == ('cup', [0, 0, 0])
    path.write_text('[]')
    assert read_targets(path) == ()


@pytest.mark.parametrize('text', [
    'lamp: [1, 2, 3]', '- {name: lamp}', '- {name: a, frame_id: room, position: [1, 2]}', '- {name: a, frame_id: 3}',
    '- {name: a, frame_id: r, position: [1, 2, .nan]}', '- {name: a, frame_id: r, position: [1, 2, x]}',
    '- {name: a, frame_id: r, colour: red}', '- [a, r]', '', '- {', None])
def test_wrong_files_say_what_is_expected(tmp_path, text):
    path = tmp_path / 'wrong.yaml'
    if text is not None:
        path.write_text(text)
    with pytest.raises(BadInputError, match=f'targets {path}.*' + ('' if text in ('- {', None) else 'expected a list')):
        read_targets(path)


def test_upwards_is_a_unit_vector():
    np.testing.assert_allclose(UprightParams(up='0 -3 4').upwards, [0, -0.6, 0.8])
    for up in ('', '0 0 0', '0 1', '1 2 x', 'nan 0 1'):
        with pytest.raises(ParameterError, match="'up'"):
            UprightParams(up=up)
