"""The demo finds the people of the shipped sequence, and says so."""
import re
import subprocess

from development import PYTHON, ROOT
from session import ENDS_WITH_PARENT

TIMEOUT = 200.0  # [s]


def test_the_demo_finds_its_people(tmp_path):
    done = subprocess.run([*ENDS_WITH_PARENT, PYTHON, str(ROOT / 'development/demo/demo.py'), '--no-rviz', '--seconds',
                           '15', '--output', str(tmp_path)], timeout=TIMEOUT, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False)
    assert done.returncode == 0, done.stdout
    found, visible, gap, no_person = map(float, re.search(
        r'found (\d+) of (\d+) visible people; longest gap (.+) s; (\d+) reported', done.stdout).groups())
    assert found >= 0.9 * visible and gap <= 1.0 and no_person <= 0.05 * visible, done.stdout
    assert 'exchanged: []' in done.stdout, done.stdout
