"""Reads the numbers of OpenPose's JSON files."""
import json

import numpy as np


def read_json(path):
    """Return the ids of a file's people, and x, y, score of their joints, (P, K, 3) float32."""
    people = json.loads(path.read_text())['people']
    rows = [np.reshape(person['pose_keypoints_2d'], (-1, 3)) for person in people]
    return [person['person_id'][0] for person in people], np.array(rows, np.float32)
