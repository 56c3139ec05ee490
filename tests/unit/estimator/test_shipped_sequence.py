"""The shipped sequence with the true pixels of its visible joints, played forth and back as the demo does."""
import json
from itertools import islice
from pathlib import Path

import numpy as np

from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence, play_order
from skeleton_extract_3d.settings import EstimatorSettings

FOLDER = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
# Label of joints that are seen, in gt.json.
VISIBLE = 2


def true_people(truth, frame):
    """The people of a frame who show four joints at least, with those joints."""
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    rows = []
    for person in truth['frames'][frame]['people']:
        seen = np.array(person['vis'])[order] == VISIBLE
        row = np.full((len(order), 3), (np.nan, np.nan, 0))
        row[seen] = np.column_stack([np.array(person['uv'])[order], np.ones(len(order))])[seen]
        rows += [row] if seen.sum() >= 4 else []
    return People2D(COCO_18, np.array(rows).reshape(-1, len(order), 3), np.ones(len(rows)), np.full(len(rows), -1))


def test_forth_and_back_there_are_two_people_who_keep_their_ids():
    truth, sequence = json.loads((FOLDER / 'gt.json').read_text()), RgbdSequence.read(FOLDER)
    frames = [sequence.frame(index) for index in range(len(sequence))]
    estimator, ids, most = PeopleEstimator(build(EstimatorSettings, {})), set(), 0
    for number, index in enumerate(islice(play_order(len(frames), 'forth_and_back'), 160)):
        frame = frames[index]
        camera_frame = Frame('', number / 15, frame.bgr, DepthImage(frame.depth, sequence.camera))
        people = estimator.update(true_people(truth, index), camera_frame).people
        ids |= set(people.ids.tolist())
        most = max(most, len(people))
    assert (len(ids), most) == (2, 2)
