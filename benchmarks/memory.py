#!/usr/bin/python3
"""Measure whether the memory of the 2D detector stays the same over many frames.

Images of 0 to 5 people in changing sizes pass the detector one after the other; the resident memory of the process is
printed after some numbers of frames. Small inputs make it quick; memory that is lost with each frame shows all the
same.

    benchmarks/memory.py
    benchmarks/memory.py --frames 500 --sizes 40        # more sizes than are kept compiled
    benchmarks/memory.py --set mode=balanced --set net_input_height=0
"""
import sys
from typing import List

import cv2
import numpy as np
import psutil

from common import Parser, errors_end_the_program, markdown
from openpose_ros_pkg.detect.detector import DetectorSettings, create_detector
from openpose_ros_pkg.params.parameters import build
from speed_2d import image_of

MOST_PEOPLE = 5
QUICK = {'mode': 'fast', 'net_input_height': 128, 'look_closer': 2}


def images_of(sizes: int) -> List[np.ndarray]:
    """Return images of 0 to MOST_PEOPLE people in as many sizes, (H, W, 3) uint8 BGR."""
    people = [np.zeros_like(image_of(1)), *(image_of(count) for count in range(1, MOST_PEOPLE + 1))]
    return [cv2.resize(image, (480 + 16 * number, 360)) for number in range(sizes) for image in people]


def main() -> int:
    """Run the detector and print the table; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--frames', type=int, default=10000, help='number of frames (default %(default)s)')
    parser.add_argument('--sizes', type=int, default=4, help='number of image sizes (default %(default)s)')
    parser.add_settings('of the detector')
    options = parser.parse_args()
    with errors_end_the_program():
        detector = create_detector(build(DetectorSettings, {**QUICK, **parser.settings(options.set)}))
        images, process = images_of(options.sizes), psutil.Process()
        rows: List[List[object]] = [['frames', 'resident memory [MB]']]
        for frame in range(1, options.frames + 1):
            detector.detect(images[frame % len(images)])
            if frame in (len(images), 100, 1000, 3000) or frame == options.frames:
                rows.append([frame, f'{process.memory_info().rss / 1e6:.0f}'])
                print(*rows[-1], flush=True)
    print(markdown(rows))
    return 0


if __name__ == '__main__':
    sys.exit(main())
