"""Outputs appear whole, all at once, or not at all."""
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.outputs import PartFiles, delete_parts, output_folder


def everything(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob('*') if path.is_file())


def test_without_outputs_nothing_happens(tmp_path):
    with PartFiles():
        pass
    assert everything(tmp_path) == []


def test_outputs_are_in_their_places_afterwards_and_not_before(tmp_path):
    (tmp_path / 'json').mkdir()
    (tmp_path / 'json/other.json').write_text('of another bag')
    with PartFiles() as parts:
        parts.file(tmp_path / 'new/a.bag').write_text('bag')
        (parts.folder(tmp_path / 'json') / 'a_0.json').write_text('frame')
        assert not (tmp_path / 'new/a.bag').exists()
        assert not (tmp_path / 'json/a_0.json').exists()
    assert everything(tmp_path) == ['json/a_0.json', 'json/other.json', 'new/a.bag']


@pytest.mark.parametrize('error', [ValueError, KeyboardInterrupt])
def test_after_an_error_all_is_as_before(tmp_path, error):
    (tmp_path / 'a.bag').write_text('older')
    with pytest.raises(error), PartFiles() as parts:
        parts.file(tmp_path / 'a.bag').write_text('half')
        (parts.folder(tmp_path / 'json') / 'a_0.json').write_text('frame')
        raise error
    assert everything(tmp_path) == ['a.bag']
    assert (tmp_path / 'a.bag').read_text() == 'older'


def test_what_a_killed_process_left_is_deleted_by_the_next_one(tmp_path):
    (tmp_path / '.a.bag.somewhere-123.part').write_text('half')
    (tmp_path / '.a.bag.somewhere-124.part').mkdir()
    (tmp_path / '.b.bag.somewhere-123.part').write_text('of another one')
    with PartFiles() as parts:
        parts.file(tmp_path / 'a.bag').write_text('whole')
    assert everything(tmp_path) == ['.b.bag.somewhere-123.part', 'a.bag']
    delete_parts(tmp_path / 'b.bag')
    assert everything(tmp_path) == ['a.bag']


def test_whose_part_was_taken_away_moves_nothing(tmp_path):
    with pytest.raises(FileNotFoundError), PartFiles() as parts:
        parts.file(tmp_path / 'a.bag').write_text('of one who was thought to be dead')
        delete_parts(tmp_path / 'a.bag')
    assert everything(tmp_path) == []


def test_of_two_who_make_the_same_at_a_time_the_later_one_does(tmp_path):
    """A worker of a cluster goes on with what nobody waits for, while another thread of it begins anew."""
    with PartFiles() as later:
        with pytest.raises(FileNotFoundError), PartFiles() as earlier:
            earlier.file(tmp_path / 'a.bag').write_text('of before')
            part = later.file(tmp_path / 'a.bag')
            part.write_text('ha')
        assert everything(tmp_path) == [part.name]
        part.write_text('half and half')
    assert (tmp_path / 'a.bag').read_text() == 'half and half'


def test_files_of_an_earlier_run_go_when_the_new_ones_come(tmp_path):
    for name in ('a_0.json', 'a_1.json', 'b_1.json'):
        (tmp_path / name).write_text('older')
    with PartFiles() as parts:
        (parts.folder(tmp_path, lambda name: name.startswith('a_')) / 'a_0.json').write_text('new')
        assert (tmp_path / 'a_1.json').exists()
    assert everything(tmp_path) == ['a_0.json', 'b_1.json']
    assert (tmp_path / 'a_0.json').read_text() == 'new'


# ---- folders: new, in place of an older one, and not at all after an error


def write(path, text='new', overwrite=False):
    with output_folder(path, overwrite, ('own',)) as part:
        (part / 'own').mkdir()
        (part / 'own' / 'file').write_text(text)
        assert not (path / 'own' / 'file').exists() or (path / 'own' / 'file').read_text() != text


def test_a_folder_is_there_at_the_end(tmp_path):
    write(tmp_path / 'deep' / 'out')
    assert (tmp_path / 'deep' / 'out' / 'own' / 'file').read_text() == 'new'
    assert [path.name for path in (tmp_path / 'deep').iterdir()] == ['out']


def test_an_empty_folder_may_be_there(tmp_path):
    (tmp_path / 'out').mkdir()
    write(tmp_path / 'out')
    assert (tmp_path / 'out' / 'own' / 'file').is_file()


def test_an_older_one_is_replaced_only_when_asked_for(tmp_path):
    write(tmp_path / 'out', 'old')
    with pytest.raises(ParameterError, match='is there already'):
        write(tmp_path / 'out')
    assert (tmp_path / 'out' / 'own' / 'file').read_text() == 'old'
    write(tmp_path / 'out', overwrite=True)
    assert (tmp_path / 'out' / 'own' / 'file').read_text() == 'new'
    assert [path.name for path in tmp_path.iterdir()] == ['out']


def test_what_is_foreign_is_never_replaced(tmp_path):
    (tmp_path / 'thesis.tex').write_text('years of work')
    with pytest.raises(ParameterError, match='thesis'):
        write(tmp_path, overwrite=True)
    (tmp_path / 'file').write_text('')
    with pytest.raises(ParameterError, match='is a file'):
        write(tmp_path / 'file', overwrite=True)


@pytest.mark.parametrize('error', [KeyboardInterrupt, ValueError])
def test_nothing_stays_after_an_error(tmp_path, error):
    write(tmp_path / 'old', 'old')
    for name in ('old', 'new'):
        with pytest.raises(error), output_folder(tmp_path / name, True, ('own',)) as part:
            (part / 'half').write_text('')
            raise error
    assert [path.name for path in tmp_path.iterdir()] == ['old']
    assert (tmp_path / 'old' / 'own' / 'file').read_text() == 'old'
