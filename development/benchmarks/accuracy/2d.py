#!/usr/bin/python3
"""Measure the 2D detector on images with COCO keypoint annotations.

Prints average precision (AP, AP50, AR: object keypoint similarity, as pycocotools defines them), precision and recall
of people at a similarity of 0.5, and milliseconds per image. Images without people count: each person found there is
wrong. pycocotools is needed: `pip install pycocotools`.

    ./run bench accuracy 2d --images FOLDER --annotations person_keypoints.json --set mode=fast
"""
import contextlib
import copy
import io
import json
import sys
from pathlib import Path
from typing import Any, Dict, List, Tuple

import cv2
import numpy as np

from common import Parser, elapsed
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.detect.detector import Detector, create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_17

PERSON = 1


def detect_all(detector: Detector, images: List[Dict[str, Any]], folder: Path) -> Tuple[List[dict], List[float]]:
    """Return COCO results, and the milliseconds of each image."""
    results, times = [], []
    for entry in images:
        image = cv2.imread(str(folder / entry['file_name']), cv2.IMREAD_COLOR)
        if image is None:
            raise SystemExit(f"{folder / entry['file_name']} is missing or not an image")
        people_in(image, detector)  # compiles the networks for images of this shape
        milliseconds, people = elapsed(lambda image=image: people_in(image, detector))
        results += coco_results(people, entry['id'])
        times.append(milliseconds)
    return results, times


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
    return {'precision': right / max(right + wrong, 1), 'recall': right / max(there, 1), 'right': right,
            'wrong': wrong, 'people': there}


def main() -> int:
    """Parse the command line, measure, print; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--images', type=Path, required=True, help='folder of the images')
    parser.add_argument('--annotations', type=Path, required=True, help='COCO person_keypoints JSON')
    add_settings(parser, 'of the detector, its backend or its decoder')
    parser.add_argument('--limit', type=int, help='number of images (default: all; fewer are timed, but not scored)')
    args = parser.parse_args()
    images = json.loads(args.annotations.read_text())['images'][:args.limit]
    detector = create_detector(build(DetectorSettings, setting_values(parser, args.settings)))
    results, times = detect_all(detector, images, args.images)
    report = [f'{len(images)} images, {len(results)} people found, {detector.description}',
              f'computed: {detector.recipe.description}',
              f'ms per image: median {np.median(times):.1f}, 90 % below {np.percentile(times, 90):.1f}']
    if results and args.limit is None:
        run = evaluated(args.annotations, results)
        report += [f'{name:9s} {value:.3f}' if isinstance(value, float) else f'{name:9s} {value}'
                   for name, value in figures_of(run, np.arange(len(run.params.imgIds))).items()]
    print('\n'.join(report))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))
