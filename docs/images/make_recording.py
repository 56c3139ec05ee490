"""Writes the pictures of docs/recordings.md beside this file, of what its steps made in walk/. Needs Chromium.

./run shell python3 docs/images/make_recording.py
"""
import sys
from pathlib import Path

import cv2
import numpy as np

import openpose_ros

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'tests/support'))

from browser import Browser

HERE, WALK = Path(__file__).resolve().parent, Path('walk')
# Before one person is hidden, while it is, and after; the frame that the report shows [s].
FRAMES, SECONDS = (14, 19, 26), 1.87


def scaled(image, factor):
    """Return an image of another size."""
    return cv2.resize(image, (round(image.shape[1] * factor), round(len(image) * factor)), interpolation=cv2.INTER_AREA)


def write(name, *images, width=900):
    """Write images side by side, each as high as the lowest one, as JPEG of a width [px]."""
    height = min(len(image) for image in images)
    row = np.hstack([scaled(image, height / len(image)) for image in images])
    row = scaled(row, width / row.shape[1])
    cv2.imwrite(str(HERE / name), row, [cv2.IMWRITE_JPEG_QUALITY, 70])


def coloured(depth):
    """Return a depth image [mm] in colours up to 5 m, black where there is none."""
    colours = cv2.applyColorMap(cv2.convertScaleAbs(depth, alpha=255 / 5000), cv2.COLORMAP_JET)
    return np.where(depth[..., np.newaxis] > 0, colours, 0).astype(np.uint8)


names = [f'{frame:06}' for frame in FRAMES]
images = [cv2.imread(str(WALK / f'images/rgb/{name}.jpg')) for name in names]
depths = [coloured(cv2.imread(str(WALK / f'images/depth/{name}.png'), cv2.IMREAD_UNCHANGED)) for name in names]
write('recording_images.jpg', *(np.vstack(pair) for pair in zip(images, depths)))
drawn = [frame.draw() for frame in openpose_ros.sequence(WALK / 'images')]
write('recording_people.jpg', *(drawn[frame] for frame in FRAMES))
plots = [cv2.imread(str(WALK / f'plots/{name}.png')) for name in ('top_view', 'trajectory_right_ankle')]
write('recording_plots.jpg', *plots, width=1200)
write('recording_angles.jpg', cv2.imread(str(WALK / 'knees.png')), width=560)
with Browser(1280, 960) as browser:
    browser.open((WALK / 'people.html').resolve().as_uri())
    browser.wait('Boolean(window.peopleView?.player)')
    browser.run(f'peopleView.player.seek({SECONDS})')
    browser.wait_for_drawing()
    write('report.jpg', cv2.imdecode(np.frombuffer(browser.screenshot(), np.uint8), cv2.IMREAD_COLOR))
