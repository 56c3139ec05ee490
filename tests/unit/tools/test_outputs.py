"""Outputs appear whole, all at once, or not at all."""
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.outputs import PartFiles, delete_parts, new_run, output_file, output_folder


def everything(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob('*') if path.is_file())


def is_of_a(name):
    return name.startswith('a_')


def test_outputs_are_in_their_places_afterwards_and_not_before(tmp_path):
    (tmp_path / 'json').mkdir()
    for name in ('other.json', 'a_1.json'):
        (tmp_path / 'json' / name).write_text('of another bag, of a former run')
    with PartFiles() as parts:
        parts.file(tmp_path / 'new/a.bag').write_text('bag')
        (parts.scratch_folder(tmp_path / 'new/a.bag') / 'half').write_text('of the work')
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


def test_what_a_killed_worker_of_a_run_left_is_deleted(tmp_path):
    run = new_run()
    for path in ('a.bag', 'a'):
        PartFiles(run).file(tmp_path / path).write_text('half')
    other = PartFiles().file(tmp_path / 'a.bag')
    delete_parts(tmp_path / 'a.bag', run)
    assert everything(tmp_path) == sorted([f'.a.{run}-0.part', other.name])
    with PartFiles(run) as parts:  # the worker that takes its place
        parts.file(tmp_path / 'a').write_text('whole')
    assert everything(tmp_path) == sorted(['a', other.name])


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
    for path, words in ((tmp_path, 'thesis'), (tmp_path / 'thesis.tex', 'is a file')):
        with pytest.raises(ParameterError, match=words), output_folder(path, True, ('own',)):
            pass
    for text in ('first', 'second'):
        with output_folder(tmp_path / 'new', text == 'second', ('own',)) as part:
            (part / 'own').write_text(text)
    assert everything(tmp_path / 'new') == ['own'] and (tmp_path / 'new/own').read_text() == 'second'
