"""Accuracy in images (2D), on annotated photographs."""
import importlib
import json
from typing import Any, Dict, List

import numpy as np

from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.params.parameters import build
from results import NeedsDataError, Options, Section, Table
from scoring.figures import LEVEL, SEED, Figure

ROWS: Dict[str, Dict[str, Any]] = {
    'fast': {'mode': 'fast'}, 'balanced': {'mode': 'balanced'}, 'accurate': {'mode': 'accurate'},
    'mobilenet_thin': {'pose_model': 'mobilenet_thin'}, 'movenet_multipose': {'pose_model': 'movenet_multipose'}}
RESAMPLES = 200
COLUMNS = ('AP', 'AP50', 'AR', 'precision', 'recall')


def measure(options: Options) -> Section:
    """Detect people in photographs: --data images=FOLDER with images/ and COCO's person_keypoints.json."""
    program = importlib.import_module('accuracy.2d')
    folder = options.folder('images')
    try:
        importlib.import_module('pycocotools')
    except ImportError as error:
        raise NeedsDataError('pycocotools: pip install pycocotools') from error
    annotations = folder / 'person_keypoints.json'
    images = json.loads(annotations.read_text())['images'][:4 if options.quick else None]
    named, rows = {}, [['', *COLUMNS]]
    for title, values in ROWS.items():
        detector = create_detector(build(DetectorSettings, values))
        results, _ = program.detect_all(detector, images, folder / 'images')
        found = intervals(program, annotations, results)
        rows.append([title, *(found[name] for name in COLUMNS)])
        named.update({f'{title}_{name.lower()}': found[name] for name in COLUMNS})
        print(rows[-1][0], flush=True)
    return Section(f'{len(images)} photographs annotated as those of COCO; AP, AP50 and AR as pycocotools defines '
                   'them (object keypoint similarity), precision and recall of people at a similarity of 0.5. Images '
                   'without people count. Intervals: bootstrap over images. Sizes, weights and thresholds of the '
                   'modes were chosen on these photographs.', named, [Table('', rows)])


def intervals(program: Any, annotations: Any, results: List[dict]) -> Dict[str, Figure]:
    """Return the figures of results with intervals."""
    run = program.evaluated(annotations, results)
    number = len(run.params.imgIds)
    random = np.random.RandomState(SEED)
    values = [program.figures_of(run, chosen) for chosen in (
        np.arange(number), *random.randint(0, number, (RESAMPLES, number)))]
    ends = {name: np.quantile([each[name] for each in values[1:]], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
            for name in COLUMNS}
    return {name: Figure(float(values[0][name]), *map(float, ends[name]), n=number, scenes=number) for name in COLUMNS}
