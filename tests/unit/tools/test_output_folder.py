"""Folders that appear whole: new, in place of an older one, and not at all after an error."""
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.outputs.output_folder import output_folder


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
