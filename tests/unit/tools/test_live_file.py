"""Live data stay in their file, whatever happens."""
import os
import subprocess
import sys

import pytest

from disk_limits import file_size_limit
from openpose_ros_tools.tables.live_file import LiveFile


def test_rows_are_there_at_once_and_after_the_program_is_killed(tmp_path):
    script = ('import os, sys; from pathlib import Path; from openpose_ros_tools.tables.live_file import LiveFile\n'
              'LiveFile(Path(sys.argv[1]), False).write("a,b\\n1,2\\n"); os.kill(os.getpid(), 9)')
    subprocess.run([sys.executable, '-c', script, str(tmp_path / 'a.csv')], check=False,
                   env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert (tmp_path / 'a.csv').read_text() == 'a,b\n1,2\n'
    with pytest.raises(FileExistsError, match=r'a\.csv'):
        LiveFile(tmp_path / 'a.csv', False)
    with LiveFile(tmp_path / 'a.csv', True) as file:
        file.write('c\n')
    assert (tmp_path / 'a.csv').read_text() == 'c\n'


def test_a_full_disk_leaves_the_whole_rows(tmp_path):
    with LiveFile(tmp_path / 'a.csv', False) as file:
        with file_size_limit(1000), pytest.raises(OSError, match=r'too large: .*a\.csv'):
            for number in range(1000):
                file.write(f'{number:06d}\n')
        assert file.lines == 1000 // 7
        file.write('after there is room\n')
    rows = (tmp_path / 'a.csv').read_text().splitlines()
    assert rows == [*(f'{number:06d}' for number in range(1000 // 7)), 'after there is room']
