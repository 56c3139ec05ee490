"""Outputs appear whole, all at once, or not at all."""
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


def test_what_a_killed_process_left_is_overwritten(tmp_path):
    (tmp_path / '.a.bag.part').write_text('half of what was made before')
    (tmp_path / '.json.part').mkdir()
    (tmp_path / '.json.part/a_0.json').write_text('half')
    with PartFiles() as parts:
        parts.file(tmp_path / 'a.bag').write_text('whole')
        (parts.folder(tmp_path / 'json', is_of_a) / 'a_1.json').write_text('frame')
    assert everything(tmp_path) == ['a.bag', 'json/a_1.json']
    assert (tmp_path / 'a.bag').read_text() == 'whole'


def test_an_output_that_another_program_is_making_is_refused_and_stays(tmp_path):
    with PartFiles() as running:
        running.file(tmp_path / 'walk.csv').write_text('rows')
        for make in (lambda parts: parts.file(tmp_path / 'walk.csv'),
                     lambda parts: parts.file(tmp_path / 'b') and parts.file(tmp_path / 'walk.csv')):
            with pytest.raises(ParameterError, match=r'another program is making .*walk\.csv'), PartFiles() as other:
                make(other)
    assert everything(tmp_path) == ['walk.csv']
    assert (tmp_path / 'walk.csv').read_text() == 'rows'


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
