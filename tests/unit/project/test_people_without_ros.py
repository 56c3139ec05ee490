"""The example that runs the chain without ROS prints joints where they truly are."""
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from development import ROOT

SEQUENCE = ROOT / 'skeleton_extract_3d/demo/cross'
LINE = re.compile(r'(\S+) s: right wrist of person (\d+) at \[ *(\S+) +(\S+) +(\S+) *\] m, sigma (\S+) mm')


def true_wrists():
    truth = json.loads((SEQUENCE / 'gt.json').read_text())
    wrist = truth['joints'].index('right_wrist')
    return [[person['xyz'][wrist] for person in frame['people']] for frame in truth['frames']]


def test_it_prints_right_wrists_where_they_are():
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, str(ROOT / 'examples/people_without_ros.py'), str(SEQUENCE)],
                          env=environment, stdout=subprocess.PIPE, text=True, check=True, timeout=300)
    lines = map(LINE.fullmatch, done.stdout.splitlines())
    found = np.array([[float(value) for value in line.groups()] for line in lines])
    assert set(found[:, 1]) == {1, 2} and len(found) > 60
    truth = true_wrists()
    times = sorted(set(found[:, 0]))
    errors = [np.linalg.norm(np.subtract(truth[times.index(row[0])], row[2:5]), axis=1).min() for row in found
              if np.isfinite(row[2:5]).all()]
    assert np.median(errors) == pytest.approx(0.04, abs=0.04)
