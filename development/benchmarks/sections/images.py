"""Accuracy in images (2D), on annotated photographs."""
import contextlib
import copy
import io
import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Dict, List

import cv2
import numpy as np

from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_17
from results import NeedsDataError, Options, Section, Table
from scoring.figures import LEVEL, SEED, Figure

PERSON = 1
ROWS: Dict[str, Dict[str, Any]] = {
    'fast': {'mode': 'fast'}, 'balanced': {'mode': 'balanced'}, 'accurate': {'mode': 'accurate'},
    'mobilenet_thin': {'pose_model': 'mobilenet_thin'}, 'movenet_multipose': {'pose_model': 'movenet_multipose'}}
RESAMPLES = 200
COLUMNS = ('AP', 'AP50', 'AR', 'precision', 'recall')


def measure(options: Options) -> Section:
    """Detect people in photographs: --data images=FOLDER with images/ and COCO's person_keypoints.json."""
    folder = options.folder('images')
    if find_spec('pycocotools') is None:
        raise NeedsDataError('pycocotools: pip install pycocotools')
    annotations = folder / 'person_keypoints.json'
    images = json.loads(annotations.read_text())['images'][:4 if options.quick else None]
    named, rows = {}, [['', *COLUMNS]]
    for title, values in ROWS.items():
        detector = create_detector(build(DetectorSettings, {**values, **options.settings}))
        results = [entry for image in images for entry in coco_results(people_in(cv2.imread(
            str(folder / 'images' / image['file_name'])), detector), image['id'])]
        found = intervals(annotations, results)
        rows.append([title, *(found[name] for name in COLUMNS)])
        named.update({f'{title}_{name.lower()}': found[name] for name in COLUMNS})
        print(rows[-1][0], flush=True)
    return Section(f'{len(images)} photographs annotated as those of COCO; AP, AP50 and AR as pycocotools defines '
                   'them (object keypoint similarity), precision and recall of people at a similarity of 0.5. Images '
                   'without people count. Intervals: bootstrap over images. Sizes, weights and thresholds of the '
                   'modes were chosen on these photographs.', named, [Table('', rows)])


def intervals(annotations: Path, results: List[dict]) -> Dict[str, Figure]:
    """Return the figures of results with intervals."""
    run = evaluated(annotations, results)
    number = len(run.params.imgIds)
    random = np.random.RandomState(SEED)
    values = [figures_of(run, chosen) for chosen in (
        np.arange(number), *random.randint(0, number, (RESAMPLES, number)))]
    ends = {name: np.quantile([each[name] for each in values[1:]], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
            for name in COLUMNS}
    return {name: Figure(float(values[0][name]), *map(float, ends[name]), n=number, scenes=number) for name in COLUMNS}


def coco_results(people: People2D, image_id: int) -> List[dict]:
    """Turn people into COCO's result entries; missing joints are 0, 0, 0 there."""
    keypoints = keypoints_in(people.keypoints, people.skeleton, COCO_17).astype(float)
    keypoints[..., 2] = keypoints[..., 2] > 0
    keypoints = np.nan_to_num(keypoints)
    return [{'image_id': image_id, 'category_id': PERSON, 'keypoints': row.ravel().tolist(), 'score': float(score)}
            for row, score in zip(keypoints, people.scores)]


def evaluated(annotations: Path, results: List[dict]) -> Any:
    """Compare results with the annotations, image by image; return pycocotools' COCOeval."""
    from pycocotools.coco import COCO  # needs pycocotools
    from pycocotools.cocoeval import COCOeval
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO(str(annotations))
        run = COCOeval(truth, truth.loadRes(results), 'keypoints')
        run.evaluate()
    return run


def figures_of(run: Any, chosen: np.ndarray) -> Dict[str, float]:
    """Return AP, AP50, AR, and precision and recall of people at similarity 0.5.

    Args:
        chosen: numbers of the images, (N,); some may be there several times.
    """
    drawn = copy.copy(run)
    drawn.params = drawn._paramsEval = copy.copy(run._paramsEval)
    drawn.params.imgIds = list(range(len(chosen)))  # accumulate() looks at their number alone
    by_area = np.array(run.evalImgs, object).reshape(-1, len(run._paramsEval.imgIds))  # categories x areas, images
    drawn.evalImgs = by_area[:, chosen].ravel().tolist()
    with contextlib.redirect_stdout(io.StringIO()):
        drawn.accumulate()
        drawn.summarize()
    return {'AP': drawn.stats[0], 'AP50': drawn.stats[1], 'AR': drawn.stats[5], **precision_and_recall(drawn)}


def precision_and_recall(run: Any) -> Dict[str, float]:
    """Count people at similarity 0.5, over all sizes, without matches of an unannotated person or a crowd."""
    entries = [entry for entry in run.evalImgs if entry is not None and entry['aRng'] == run.params.areaRng[0]]
    right = wrong = there = 0
    for entry in entries:
        counted = ~entry['dtIgnore'][0].astype(bool)
        matched = entry['dtMatches'][0] > 0
        right += int((counted & matched).sum())
        wrong += int((counted & ~matched).sum())
        there += int((np.asarray(entry['gtIgnore']) == 0).sum())
    return {'precision': right / max(right + wrong, 1), 'recall': right / max(there, 1)}
