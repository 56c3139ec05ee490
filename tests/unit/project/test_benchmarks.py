"""What the benchmarks share: crowds."""
import sys
from pathlib import Path

import numpy as np

from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'development' / 'benchmarks'))

from common import DEMO
from crowd import make_crowd


def test_crowds_have_more_of_the_image(tmp_path):
    shares = []
    scene = np.max([frame.depth for frame in RgbdSequence.read(DEMO)][::3], axis=0).astype(float)
    for people in (1, 2, 4):
        sequence = RgbdSequence.read(make_crowd(tmp_path / str(people), [people]))
        assert len(sequence) == 40
        shares.append(float((scene - sequence.frame(0).depth > 100).mean()))  # [mm]
    assert 0.03 < shares[0] < shares[1] < shares[2] < 0.5
