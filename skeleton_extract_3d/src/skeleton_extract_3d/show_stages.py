"""Draw what is computed for an image and its depth image; see the program of this name in openpose_ros_pkg."""
from typing import Optional, Sequence

import cv2
import numpy as np

from openpose_ros_pkg import show_stages
from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.command_line import DONE, run_command, setting_values
from openpose_ros_pkg.detect.occlusion_masks import foregrounds
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_pkg.stream.video_source import read_image
from skeleton_extract_3d.body.body import CHAINS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.lift.robust import lift_robustly
from skeleton_extract_3d.points.camera import CameraModel, calibrated_camera
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.depth_view import depth_view

# Chart of a person: left edge of the depths, width of a candidate and height of a joint's row [px].
_LEFT, _CELL, _ROW = 170, 17, 27
_SAMPLE, _MEASURED, _INFERRED, _BLACK = (150, 150, 150), (60, 160, 0), (0, 110, 255), (0, 0, 0)
# Depth [m] from which on the depth image has the last of its colours.
_FAR = 6.0
# Brightness of pixels that are in front of no person.
_DARK = 0.3


def lift_and_draw(people: People2D, bgr: np.ndarray, depth: np.ndarray, camera: CameraModel,
                  method: MethodConstants = METHOD) -> show_stages.Stages:
    """Return images of the stages between keypoints and joints in space, of people without a track.

    Args:
        bgr: (H, W, 3) uint8; depth: (H', W') uint16 [mm], of the same view.
    """
    points, size = DepthImage(depth, camera), (bgr.shape[1], bgr.shape[0])
    people = People2D(COCO_18, keypoints_in(people.keypoints, people.skeleton, COCO_18), people.scores, people.ids)
    observed = observe(people, size, points, points.camera, method)
    lifted = lift_robustly(observed, points, Expectation.of_strangers(len(observed)), method)
    colours = cv2.applyColorMap((255 * np.clip(1 - 0.001 * depth / _FAR, 0, 1)).astype(np.uint8), cv2.COLORMAP_JET)
    colours[depth == 0] = 0
    for u, v in observed.uv[observed.known].tolist():
        cv2.circle(colours, (round(u), round(v)), 4, (255, 255, 255), 1, cv2.LINE_AA)
    charts = [(f'candidate depths of person {person}',
               cv2.resize(_chart(observed, lifted, person, method.costs.deltas), size))
              for person in range(len(observed))]
    return [('keypoints on the depth image', cv2.resize(colours, size)),
            ('in front of a person', _draw_layers(people, bgr, points)),
            ('visible joints', draw_people(bgr, people, DrawParams(), ~lifted.measured)), *charts]


def _draw_layers(people: People2D, bgr: np.ndarray, points: DepthImage) -> np.ndarray:
    """Draw in colour what is in front of one of the people, and is covered in the crop of that person."""
    size, drawn = (bgr.shape[1], bgr.shape[0]), (bgr * _DARK).astype(np.uint8)
    for foreground in foregrounds(people.keypoints, people.skeleton, depth_view(points), size):
        if foreground is not None:
            covered = cv2.resize(foreground.pixels.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
            drawn[covered] = bgr[covered]
    return drawn


def _chart(observed: ObservedPeople, lifted: Lifted, person: int, deltas: np.ndarray) -> np.ndarray:
    """Draw for each joint the samples, the candidate depths, darker where likelier, and the depth that was chosen."""
    root, rows = lifted.root[person], {int(joint): row for row, joint in enumerate(CHAINS)}
    canvas = np.full((_ROW * (len(COCO_18.joints) + 2), _LEFT + _CELL * len(deltas) + 25, 3), 255, np.uint8)

    def column(depth: float) -> int:
        return round(float(_LEFT + _CELL * ((depth - root - deltas[0]) / (deltas[1] - deltas[0]) + 0.5)))

    for joint, name in enumerate(COCO_18.joints):
        top, bottom = _ROW * joint + 2, _ROW * (joint + 1) - 3
        show_stages.write_text(canvas, name.replace('_', ' '), (8, bottom - 6), _BLACK)
        # joints of the face have the candidates of the middle of the head; the neck lies between the shoulders
        costs = lifted.candidates[person, rows.get(joint, -1)]
        for i, likelihood in enumerate(np.exp(-0.5 * (costs - costs.min())) if name != 'neck' else []):
            corner = (_LEFT + _CELL * i, top)
            colour = (255, round(255 - 130 * float(likelihood)), round(255 - 200 * float(likelihood)))
            cv2.rectangle(canvas, corner, (corner[0] + _CELL - 1, bottom), colour, -1)
        samples = observed.samples[person, joint]
        for depth in samples[np.abs(samples - root) < -deltas[0]]:
            cv2.line(canvas, (column(depth), top), (column(depth), bottom), _SAMPLE, 1)
        if observed.known[person, joint]:
            measured = lifted.measured[person, joint]
            place = (column(lifted.xyz[person, joint, 2]), (top + bottom) // 2)
            cv2.circle(canvas, place, 7, _MEASURED if measured else _INFERRED, -1 if measured else 2, cv2.LINE_AA)
    for depth in root + np.array([-0.8, -0.4, 0.0, 0.4, 0.8]):
        show_stages.write_text(canvas, f'{depth:.2f} m', (column(depth) - 25, canvas.shape[0] - 34), _BLACK)
    for number, (text, colour) in enumerate((('| samples', _SAMPLE), ('blue: candidates', (255, 125, 55)),
                                             ('o measured', _MEASURED), ('o inferred', _INFERRED))):
        show_stages.write_text(canvas, text, (_LEFT + 180 * number, canvas.shape[0] - 10), colour)
    return canvas


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status."""
    parser = show_stages.argument_parser(depth_required=True)
    options = parser.parse_args(arguments)

    def work() -> int:
        bgr, depth = read_image(options.image), read_image(options.depth, cv2.IMREAD_UNCHANGED)
        settings = build(DetectorSettings, setting_values(parser, options.settings))
        camera = calibrated_camera(read_calibration(options.camera))
        people, stages = show_stages.detect_and_draw(settings, bgr, depth_view(DepthImage(depth, camera)))
        folder = options.output
        show_stages.write_stages(stages, folder, folder / 'stages_2d.jpg', 3, options.overwrite)
        show_stages.write_stages(lift_and_draw(people, bgr, depth, camera), folder / '3d', folder / 'stages_3d.jpg', 2,
                                 options.overwrite)
        return DONE

    return run_command(parser.prog, work)
