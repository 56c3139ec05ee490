#!/usr/bin/python3
"""Measure the 2D detector on images with COCO keypoint annotations.

Prints average precision (AP, AP50, AR: object keypoint similarity, as pycocotools defines them), precision and recall
of people at a similarity of 0.5, and milliseconds per image. Images without people count: whoever is found there
is wrong. pycocotools is needed: `pip install pycocotools`.

    benchmarks/accuracy_2d.py --images FOLDER --annotations person_keypoints.json
    benchmarks/accuracy_2d.py --images FOLDER --annotations FILE --set net_input_height=256 --set backend=opencv_dnn

All modes, and the recipes below them for `target_rate`, as a table and a plot of accuracy against time, in units of one
pass of mobilenet_thin at 656 x 368:

    benchmarks/accuracy_2d.py --images FOLDER --annotations FILE --plot accuracy_and_time.png
"""
import contextlib
import io
import json
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import cv2
import numpy as np

from common import Parser, elapsed, errors_end_the_program, markdown
from openpose_ros_pkg.detect.detector import Detector, DetectorSettings, Networks, create_detector
from openpose_ros_pkg.detect.recipes import FASTER, MODES, NetworkPass, Recipe
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_17

PERSON = 1
# Width and height of the pass of mobilenet_thin whose time is the unit [px].
UNIT = (656, 368)


def detect_all(detector: Detector, images: List[Dict[str, Any]], folder: Path,
               reference: Optional[Callable[[np.ndarray], Any]] = None) -> Tuple[List[dict], np.ndarray]:
    """Run the detector over images.

    Args:
        reference: what else is timed on each image in turn.

    Returns:
        COCO results; milliseconds, (images, 1 or 2), of the detector and the reference.
    """
    calls = [detector.detect] if reference is None else [detector.detect, reference]
    results, times = [], []
    for entry in images:
        image = cv2.imread(str(folder / entry['file_name']), cv2.IMREAD_COLOR)
        if image is None:
            raise SystemExit(f"{folder / entry['file_name']} is missing or not an image")
        row = []
        for i, call in enumerate(calls):
            call(image)  # compiles the networks for images of this shape
            milliseconds, people = elapsed(lambda call=call, image=image: call(image))
            row.append(milliseconds)
            if i == 0:
                results.extend(coco_results(people, entry['id']))
        times.append(row)
    return results, np.array(times)


class NetworksOf(Networks):
    """Loads the networks of `recipe`, whatever the parameters say."""

    recipe: Recipe

    def load(self, recipe: Recipe) -> Tuple[Recipe, Dict[str, Backend]]:
        """See `Networks.load`."""
        return super().load(self.recipe)


def all_recipes() -> Dict[str, Recipe]:
    """Return the modes, and the recipes below them by what they compute."""
    below = {recipe.description.split(' + 1 crop')[0]: recipe for recipe in FASTER if recipe not in MODES.values()}
    return {**MODES, **below}


def accuracy_and_time(args: Any, images: List[Dict[str, Any]], settings: DetectorSettings) -> List[List[object]]:
    """Measure all recipes; return a table with its header."""
    networks = NetworksOf(settings.backend, settings.detector.model_folder)
    networks.recipe = Recipe((NetworkPass(MOBILENET_THIN, UNIT),))
    unit = networks.load(networks.recipe)[1][MOBILENET_THIN.name]
    blank = np.zeros((1, UNIT[1], UNIT[0], 3), np.uint8)
    rows: List[List[object]] = [['recipe', 'AP', 'AP50', 'AR', 'precision', 'recall', 'time / pass']]
    for name, networks.recipe in all_recipes().items():
        detector = Detector(settings, networks)
        results, times = detect_all(detector, images, args.images, lambda image: unit.infer(blank))
        figures = evaluate(args.annotations, results)
        ratio = float(np.median(times[:, 0] / times[:, 1]))
        rows.append([name, *(f'{figures[key]:.3f}' for key in ('AP', 'AP50', 'AR', 'precision', 'recall')),
                     f'{ratio:.2f}'])
    return rows


def plot(rows: Sequence[Sequence[object]], path: Path) -> None:
    """Draw AP against time; the modes, which are the first rows, are filled."""
    from openpose_ros_tools.plots.plotting import PALETTE, new_figure, save_figure  # needs Matplotlib
    figure = new_figure(7, 4.5)
    axes = figure.add_subplot()
    for name, accuracy, *_, ratio in rows[1:]:
        is_mode = name in MODES
        axes.plot(float(ratio), float(accuracy), 'o', color=PALETTE[0],
                  markerfacecolor=PALETTE[0] if is_mode else 'white')
        axes.annotate(name, (float(ratio), float(accuracy)), xytext=(6, -3), textcoords='offset points',
                      fontsize=9 if is_mode else 7, fontweight='bold' if is_mode else 'normal')
    axes.set_xscale('log')
    axes.set(xlabel='time per image, in passes of mobilenet_thin at 656 x 368', ylabel='AP', xlim=(0.1, 20))
    axes.set_xticks([0.1, 0.2, 0.5, 1, 2, 5, 10, 20], ['0.1', '0.2', '0.5', '1', '2', '5', '10', '20'])
    axes.grid(True, alpha=0.3)
    save_figure(figure, path)


def coco_results(people: People2D, image_id: int) -> List[dict]:
    """Turn people into COCO's result entries; missing joints are 0, 0, 0 there."""
    keypoints = keypoints_in(people.keypoints, people.skeleton, COCO_17).astype(float)
    keypoints[..., 2] = keypoints[..., 2] > 0
    keypoints = np.nan_to_num(keypoints)
    return [{'image_id': image_id, 'category_id': PERSON, 'keypoints': row.ravel().tolist(), 'score': float(score)}
            for row, score in zip(keypoints, people.scores)]


def evaluate(annotations: Path, results: List[dict]) -> Dict[str, float]:
    """Compare with the annotations; return AP, AP50, AR, and precision and recall of people at similarity 0.5."""
    try:
        from pycocotools.coco import COCO
        from pycocotools.cocoeval import COCOeval
    except ImportError as error:
        raise SystemExit(f'pycocotools is needed to score ({error}): pip install pycocotools') from error
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO(str(annotations))
        run = COCOeval(truth, truth.loadRes(results), 'keypoints')
        run.evaluate()
        run.accumulate()
        run.summarize()
    return {'AP': run.stats[0], 'AP50': run.stats[1], 'AR': run.stats[5], **precision_and_recall(run)}


def precision_and_recall(run: Any) -> Dict[str, float]:
    """Count people at similarity 0.5, over all sizes; whoever matches an unannotated person or crowd is not counted."""
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


def main() -> None:
    """Parse the command line, measure, print."""
    parser = Parser(__doc__)
    parser.add_argument('--images', type=Path, required=True, help='folder of the images')
    parser.add_argument('--annotations', type=Path, required=True, help='COCO person_keypoints JSON')
    parser.add_settings('of the detector, its backend or its decoder')
    parser.add_settings('of another setting, which is timed on each image in turn', '--time-against')
    parser.add_argument('--limit', type=int, help='number of images (default: all; fewer are timed, but not scored)')
    parser.add_argument('--plot', type=Path, metavar='FILE', help='measure all modes and recipes, and plot them')
    args = parser.parse_args()
    values, reference_values = parser.settings(args.set), parser.settings(args.time_against)
    images = json.loads(args.annotations.read_text())['images'][:args.limit]
    if args.plot:
        with errors_end_the_program():
            rows = accuracy_and_time(args, images, build(DetectorSettings, values))
            plot(rows, args.plot)
        sys.stdout.write(markdown(rows))
        return
    with errors_end_the_program():
        detector = create_detector(build(DetectorSettings, values))
        reference = create_detector(build(DetectorSettings, reference_values)) if reference_values else None
        results, times = detect_all(detector, images, args.images, reference and reference.detect)
    report = [f'{len(images)} images, {len(results)} people found, {detector.description}',
              f'computed: {detector.recipe.description}',
              f'ms per image: median {np.median(times[:, 0]):.1f}, 90 % below {np.percentile(times[:, 0], 90):.1f}']
    if reference is not None:
        report.append(f'time against {reference.recipe.description}: median of the ratios '
                      f'{np.median(times[:, 0] / times[:, 1]):.2f}')
    if results and args.limit is None:
        report += [f'{name:9s} {value:.3f}' if isinstance(value, float) else f'{name:9s} {value}'
                   for name, value in evaluate(args.annotations, results).items()]
    sys.stdout.write('\n'.join(report) + '\n')


if __name__ == '__main__':
    main()
