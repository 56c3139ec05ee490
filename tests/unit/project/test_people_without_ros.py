"""The example that runs the chain without ROS prints the joints of both people."""
import os
import re
import subprocess
import sys

from development import ROOT

LINE = re.compile(r'\S+ s: right wrist of person (\d+) at \[ *\S+ +\S+ +\S+ *\] m, sigma \S+ mm')


def test_it_prints_right_wrists():
    done = subprocess.run(
        [sys.executable, str(ROOT / 'examples/people_without_ros.py'), str(ROOT / 'skeleton_extract_3d/demo/cross')],
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}, stdout=subprocess.PIPE, text=True, check=True,
        timeout=300)
    found = [LINE.fullmatch(line)[1] for line in done.stdout.splitlines()]
    assert set(found) == {'1', '2'} and len(found) > 60
