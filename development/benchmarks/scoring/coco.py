"""Average precision in images annotated as those of COCO, by object keypoint similarity; needs pycocotools."""
import contextlib
import copy
import io
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.people import keypoints_in
from openpose_ros_pkg.skeletons import COCO_17
from results import NeedsDataError

from .figures import LEVEL, SEED, Figure

RESAMPLES = 200


def average_precision(folder: Path, detector: Detector, most: int) -> Figure:
    """Return AP in the first images of a folder with images/ and person_keypoints.json, with its interval over images.

    Raises:
        NeedsDataError: pycocotools is not there.
        OSError: an image is missing.
    """
    try:
        from pycocotools import coco, cocoeval
    except ImportError as error:
        raise NeedsDataError('pycocotools: pip install pycocotools') from error
    annotations, results = folder / 'person_keypoints.json', []
    entries = json.loads(annotations.read_text())['images'][:most]
    for entry in entries:
        image = cv2.imread(str(folder / 'images' / entry['file_name']), cv2.IMREAD_COLOR)
        if image is None:
            raise OSError(f"{folder / 'images' / entry['file_name']} is missing or not an image")
        people = people_in(image, detector)
        keypoints = np.nan_to_num(keypoints_in(people.keypoints, people.skeleton, COCO_17).astype(float))
        keypoints[..., 2] = keypoints[..., 2] > 0  # missing joints are 0, 0, 0
        results += [{'image_id': entry['id'], 'category_id': 1, 'keypoints': row.ravel().tolist(),
                     'score': float(score)} for row, score in zip(keypoints, people.scores)]
    with contextlib.redirect_stdout(io.StringIO()):
        truth = coco.COCO(str(annotations))
        run = cocoeval.COCOeval(truth, truth.loadRes(results), 'keypoints')
        run.evaluate()
    number = len(run.params.imgIds)
    drawn = np.random.RandomState(SEED).randint(0, number, (RESAMPLES, number))
    ends = np.quantile([_precision(run, chosen) for chosen in drawn], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    return Figure(_precision(run, np.arange(number)), *map(float, ends), n=number, scenes=number)


def _precision(run: Any, chosen: np.ndarray) -> float:
    """Return AP; chosen: numbers of the images, (N,); some may be there several times."""
    drawn = copy.copy(run)
    drawn.params = drawn._paramsEval = copy.copy(run._paramsEval)
    drawn.params.imgIds = list(range(len(chosen)))  # accumulate() looks at their number alone
    by_area = np.array(run.evalImgs, object).reshape(-1, len(run._paramsEval.imgIds))  # categories x areas, images
    drawn.evalImgs = by_area[:, chosen].ravel().tolist()
    with contextlib.redirect_stdout(io.StringIO()):
        drawn.accumulate()
        drawn.summarize()
    return float(drawn.stats[0])
