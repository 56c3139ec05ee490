"""Draw what is computed for an image, stage by stage, as JPEG files; no ROS master is needed.

    rosrun openpose_ros_pkg show_stages IMAGE -o FOLDER
    rosrun openpose_ros_pkg show_stages IMAGE --depth DEPTH.png --camera camera.yaml -o FOLDER

Writes input, opinions and people, and all of them as stages_2d.jpg; of networks with part affinity fields also heat
maps, limb fields and candidates (--set net_input_width=656 chooses such networks). With a depth image, the program of
this name in skeleton_extract_3d goes on: stages_3d.jpg shows the keypoints on the depth image, which joints are
visible, and for each person the samples and candidate depths of all joints.
"""
import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.command_line import DONE, add_settings, run_command, setting_values
from openpose_ros_pkg.command_options import command_parser, plain_path
from openpose_ros_pkg.decode.direct import DirectThresholds
from openpose_ros_pkg.decode.paf import find_peaks, score_limbs
from openpose_ros_pkg.detect.crops import found_by
from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import people_in
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.views import averaged_fields, prepare_views
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.output.draw import DrawParams, draw_people, person_colour
from openpose_ros_pkg.output.files import check_outputs, write_image
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.video_source import read_image

Stages = List[Tuple[str, np.ndarray]]  # titles and images, (H, W, 3) uint8 BGR

# Width of a sheet and height of the title of an image [px].
_WIDTH, _TITLE = 1260, 28
# Quality of the JPEG files.
_QUALITY = 80
# The image is darkened to this share under what is drawn on it.
_DARK = 0.4


def argument_parser(depth_required: bool) -> argparse.ArgumentParser:
    """Return the parser of both programs of this name."""
    parser = command_parser('show_stages', __doc__)
    parser.add_argument('image', type=plain_path, help='image file')
    parser.add_argument('-o', '--output', type=plain_path, required=True, metavar='FOLDER', help='where the images go')
    parser.add_argument('--overwrite', action='store_true', help='replace images that are there')
    parser.add_argument('--depth', type=plain_path, metavar='FILE', required=depth_required, help='16-bit PNG [mm]')
    parser.add_argument('--camera', type=plain_path, metavar='FILE', required=depth_required, help='its camera.yaml')
    add_settings(parser, 'of the detector')
    return parser


def detect_and_draw(settings: DetectorSettings, bgr: np.ndarray, depth: Optional[DepthView] = None
                    ) -> Tuple[People2D, Stages]:
    """Return the people of an image, (H, W, 3) uint8, and images of the stages on the full image."""
    detector = create_detector(settings)
    plain = replace(detector.setup, decode=settings.decode, direct=DirectThresholds())
    stages, opinions = [('input', bgr)], []
    for network_pass in detector.recipe.passes:
        model = network_pass.model
        views = [view.compute(plain.networks[model.name]) for view in prepare_views(bgr, network_pass)]
        opinions += [(network_pass.description, poses.keypoints)
                     for poses in found_by(network_pass, views, bgr, plain)]
        if model.decoder == Decoder.PAF:
            fields, plan = averaged_fields(views, model), views[0].view.plan
            peaks = find_peaks(fields[:len(model.skeleton.joints)], model, settings.decode, plan.scaled_size)
            limbs = score_limbs(fields[model.heatmaps:], peaks, model)
            stages += [('heat maps', _over(bgr, _heat_maps(fields, model), plan, model.stride)),
                       ('limb fields', _over(bgr, _limb_fields(fields, model), plan, model.stride)),
                       ('candidates', _candidates(bgr, peaks, limbs, plan, model))]
    people = people_in(bgr, detector, depth)
    return people, [*stages, ('opinions', _draw_opinions(bgr, opinions, detector.recipe.skeleton)),
                    ('people', draw_people(bgr, people, DrawParams()))]


def write_stages(stages: Stages, folder: Path, sheet: Path, columns: int, overwrite: bool) -> None:
    """Write images of one aspect into a folder, and all of them as one sheet; existing files: ParameterError."""
    paths = [folder / f"{number}_{title.replace(' ', '_')}.jpg" for number, (title, _) in enumerate(stages, start=1)]
    check_outputs([*paths, sheet], overwrite)
    folder.mkdir(parents=True, exist_ok=True)
    cells, width = [], _WIDTH // columns
    for path, (title, image) in zip(paths, stages):
        write_image(path, image, _QUALITY)
        cell = cv2.resize(image, (width, round(width * image.shape[0] / image.shape[1])), interpolation=cv2.INTER_AREA)
        cells.append(cv2.copyMakeBorder(cell, _TITLE, 0, 0, 0, cv2.BORDER_CONSTANT, value=(255, 255, 255)))
        write_text(cells[-1], title, (4, _TITLE - 9), (0, 0, 0))
    cells += [np.full_like(cells[0], 255)] * (-len(cells) % columns)
    rows = [cv2.hconcat(cells[i:i + columns]) for i in range(0, len(cells), columns)]
    write_image(sheet, cv2.vconcat(rows), _QUALITY)


def write_text(canvas: np.ndarray, text: str, at: Tuple[int, int], colour: Tuple[int, int, int]) -> None:
    """Write a text into an image; `at` is its lower left corner [px], the colour is BGR."""
    cv2.putText(canvas, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)


def _over(bgr: np.ndarray, colours: np.ndarray, plan: ImageToNet, stride: int) -> np.ndarray:
    """Add colours, (h, w, 3) float32 on the grid of a network's output, to the darkened image."""
    scale = plan.scale / stride
    to_cell = np.array([[scale[0], 0, scale[0] / 2 - 0.5], [0, scale[1], scale[1] / 2 - 0.5]])
    spread = cv2.warpAffine(colours, to_cell, bgr.shape[1::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    return np.clip(_DARK * bgr + spread, 0, 255).astype(np.uint8)


def _heat_maps(fields: np.ndarray, model: Model) -> np.ndarray:
    """Return the confidence map of each joint in its colour, (h, w, 3) float32."""
    colours = np.array([colour[::-1] for colour in model.skeleton.colours], np.float32)
    return (np.clip(fields[:len(colours), :, :, None], 0, 1) * colours[:, None, None]).max(axis=0)


def _limb_fields(fields: np.ndarray, model: Model) -> np.ndarray:
    """Return the strongest field of each cell, its direction as hue, (h, w, 3) float32."""
    x, y = (fields[[model.heatmaps + limb.paf[axis] for limb in model.skeleton.limbs]] for axis in (0, 1))
    strongest = np.hypot(x, y).argmax(axis=0)[None]
    x, y = (np.take_along_axis(component, strongest, axis=0)[0] for component in (x, y))
    hue = np.degrees(np.arctan2(y, x)) % 360 / 2  # in OpenCV's unit of 2 degrees
    hsv = np.stack([hue, np.full_like(hue, 255), 255 * np.minimum(np.hypot(x, y), 1)], axis=2)
    return cv2.cvtColor(hsv.astype(np.uint8), cv2.COLOR_HSV2BGR).astype(np.float32)


def _candidates(bgr: np.ndarray, peaks: np.ndarray, limbs: np.ndarray, plan: ImageToNet, model: Model) -> np.ndarray:
    """Draw the peaks, larger with their score, and lines between the ends of candidate limbs."""
    canvas = (_DARK * bgr).astype(np.uint8)
    places = np.rint(plan.to_image(np.stack([peaks['x'], peaks['y']], axis=1))).astype(int).tolist()
    for limb in limbs:
        cv2.line(canvas, tuple(places[limb['start']]), tuple(places[limb['end']]), (150, 150, 150), 1, cv2.LINE_AA)
    for place, peak in zip(places, peaks):
        colour = model.skeleton.colours[peak['joint']][::-1]
        cv2.circle(canvas, tuple(place), 2 + round(4 * float(peak['score'])), colour, -1, cv2.LINE_AA)
    return canvas


def _draw_opinions(bgr: np.ndarray, opinions: List[Tuple[str, np.ndarray]], skeleton: SkeletonModel) -> np.ndarray:
    """Draw the poses, (P, K, 3), of each source in a colour of its own, with its name."""
    canvas, index = (_DARK * bgr).astype(np.uint8), skeleton.index
    for number, (name, poses) in enumerate(opinions):
        colour = person_colour(number)
        write_text(canvas, name, (8, 20 + 20 * number), colour)
        for ends in (pose[[index[start], index[end]]] for pose in poses for start, end in skeleton.drawn_limbs):
            if (ends[:, 2] > 0).all():
                start, end = np.rint(ends[:, :2]).astype(int).tolist()
                cv2.line(canvas, tuple(start), tuple(end), colour, 2, cv2.LINE_AA)
    return canvas


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    parser = argument_parser(depth_required=False)
    options = parser.parse_args(arguments)
    if options.depth is not None:
        os.execvp('rosrun', ['rosrun', 'skeleton_extract_3d', 'show_stages', *arguments])

    def work() -> int:
        settings = build(DetectorSettings, setting_values(parser, options.settings))
        _, stages = detect_and_draw(settings, read_image(options.image))
        write_stages(stages, options.output, options.output / 'stages_2d.jpg', 3, options.overwrite)
        return DONE

    return run_command(parser.prog, work)
