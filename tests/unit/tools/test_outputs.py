"""Outputs appear whole, all at once, or not at all."""
import os
import subprocess
import sys

import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.outputs import PartFiles, output_file, output_folder


def everything(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob('*') if path.is_file())


def is_of_a(name):
    return name.startswith('a_')


def test_outputs_are_in_their_places_afterwards_and_not_before(tmp_path):
    (tmp_path / 'json').mkdir()
    (tmp_path / 'json/other.json').write_text('of another bag')
    with PartFiles() as parts:
        parts.file(tmp_path / 'new/a.bag').write_text('bag')
        (parts.folder(tmp_path / 'json', is_of_a) / 'a_0.json').write_text('frame')
        assert not (tmp_path / 'new/a.bag').exists()
        assert not (tmp_path / 'json/a_0.json').exists()
    assert everything(tmp_path) == ['json/a_0.json', 'json/other.json', 'new/a.bag']


@pytest.mark.parametrize('error', [ValueError, KeyboardInterrupt])
def test_after_an_error_all_is_as_before(tmp_path, error):
    (tmp_path / 'a.bag').write_text('older')
    with pytest.raises(error), PartFiles() as parts:
        parts.file(tmp_path / 'a.bag').write_text('half')
        (parts.folder(tmp_path / 'json', is_of_a) / 'a_0.json').write_text('frame')
        raise error
    assert everything(tmp_path) == ['a.bag']
    assert (tmp_path / 'a.bag').read_text() == 'older'


def test_what_a_killed_process_left_is_deleted_by_the_next_one(tmp_path):
    script = ('import os, sys; from pathlib import Path; from openpose_ros_tools.outputs import PartFiles\n'
              'parts = PartFiles().__enter__()\n'
              'parts.file(Path(sys.argv[1], "a.bag")).write_text("half")\n'
              '(parts.folder(Path(sys.argv[1], "a.bag"), bool) / "half").write_text("half")\n'
              'os.kill(os.getpid(), 9)')
    subprocess.run([sys.executable, '-c', script, str(tmp_path)], check=False,
                   env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    left = everything(tmp_path)
    assert len(left) == 2 and all(name.startswith('.a.bag.') for name in left)
    with PartFiles() as parts:
        parts.file(tmp_path / 'a').write_text('whole')
    assert everything(tmp_path) == [*left, 'a']
    with PartFiles() as parts:
        parts.file(tmp_path / 'a.bag').write_text('whole')
    assert everything(tmp_path) == ['a', 'a.bag']


@pytest.mark.parametrize('name', ['walk', 'walk.csv'])
def test_unfinished_outputs_of_a_running_program_stay(tmp_path, name):
    with PartFiles() as running:
        table, folder = running.file(tmp_path / 'walk.csv'), running.folder(tmp_path / 'walk.csv.d', bool)
        table.write_text('rows')
        with pytest.raises(ValueError, match='fails'), PartFiles() as other:
            other.file(tmp_path / name).write_text('half')
            other.folder(tmp_path / 'walk.csv.d', bool)
            raise ValueError('fails')
        assert table.read_text() == 'rows' and folder.is_dir()
    assert everything(tmp_path) == ['walk.csv']
    assert (tmp_path / 'walk.csv').read_text() == 'rows'


def test_of_two_that_make_the_same_at_a_time_the_first_that_is_done_has_made_it(tmp_path):
    with pytest.raises(FileExistsError, match='another program'), PartFiles() as later:
        later.file(tmp_path / 'b.bag').write_text('is not moved either')
        later.file(tmp_path / 'a.bag').write_text('later')
        with PartFiles() as earlier:
            earlier.file(tmp_path / 'a.bag').write_text('earlier')
    assert everything(tmp_path) == ['a.bag']
    assert (tmp_path / 'a.bag').read_text() == 'earlier'


def test_a_file_is_replaced_only_when_asked_for_and_an_input_never(tmp_path):
    path = tmp_path / 'a.csv'
    for overwrite, text in ((False, 'first'), (True, 'second')):
        with output_file(path, overwrite) as part:
            part.write_text(text)
    for overwrite, inputs, words in ((False, (), r'is there already; .*--overwrite'), (True, (path,), 'is an input')):
        with pytest.raises(ParameterError, match=words), output_file(path, overwrite, inputs):
            pass
    assert path.read_text() == 'second'


def test_folders_with_other_things_are_never_replaced(tmp_path):
    (tmp_path / 'thesis.tex').write_text('years of work')
    for path, told in ((tmp_path, 'thesis'), (tmp_path / 'thesis.tex', 'is a file')):
        with pytest.raises(ParameterError, match=told), output_folder(path, True, ('own',)):
            pass
