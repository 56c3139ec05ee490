"""What the demo leaves alone."""
import subprocess
import sys
from pathlib import Path

DEMO = Path(__file__).resolve().parents[2] / 'development' / 'demo' / 'demo.py'
TIMEOUT = 120.0  # [s]


def test_a_folder_with_files_is_left_alone(tmp_path):
    (tmp_path / 'images').mkdir()
    output = tmp_path / 'walks'
    output.mkdir()
    (output / 'output.bag').write_bytes(b'a walk')
    done = subprocess.run([sys.executable, str(DEMO), '--images', str(tmp_path / 'images'), '--output', str(output)],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=TIMEOUT, check=False)
    assert done.returncode == 1
    assert f'{output} is there already, and not an empty folder' in done.stdout
    assert [(path.name, path.read_bytes()) for path in output.iterdir()] == [('output.bag', b'a walk')]
