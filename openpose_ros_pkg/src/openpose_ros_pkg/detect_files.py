"""Find people in images and videos and save them as OpenPose does; no ROS master is needed.

A folder stands for all images and videos directly in it, in natural order (image2 before image10). People keep their
ids through a video; in single images they have none. Existing files stay, unless --overwrite is given; inputs whose
files all exist are skipped, unless a video is written, which needs every frame.

    rosrun openpose_ros_pkg detect_files images/ --write-json keypoints/ --write-images annotated/
    rosrun openpose_ros_pkg detect_files walk.mp4 --write-video annotated.mp4 --set mode=accurate
    rosrun openpose_ros_pkg detect_files images/ --write-json keypoints/ --set hands=true --set face=true

Exit status: 0 all done; 1 an input could not be read or a file not be written, the others are done; 2 nothing was
done, as the command line, a parameter or the network is wrong; 130 interrupted, the written files are complete.
"""
import argparse
import logging
import sys
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, cast

import cv2
import numpy as np

from openpose_ros_pkg.command_line import DONE, SOME_FAILED, Progress, add_settings, run_command, setting_values
from openpose_ros_pkg.command_options import command_parser, plain_path
from openpose_ros_pkg.detect.detection import Detection, ImageFrame
from openpose_ros_pkg.detect.image_chain import ImageChain
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.errors import BadInputError, ModelError, ParameterError
from openpose_ros_pkg.landmarks.detector import LandmarkDetector, create_landmark_detector
from openpose_ros_pkg.landmarks.records import LandmarkParams, Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams
from openpose_ros_pkg.output.files import check_outputs, natural_key, numbered_name
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams
from openpose_ros_pkg.output.recorder import REPLACE, SKIP, Recorder, SaveParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS, ImageLimitParams
from openpose_ros_pkg.stream.video_source import IMAGE_SUFFIXES, VideoSource, read_image

_log = logging.getLogger(__name__)

VIDEO_SUFFIXES = ('.mp4', '.avi', '.mov', '.mkv', '.webm', '.m4v', '.mpg', '.mpeg', '.wmv')
# Frame rate of tracking in videos that have none [Hz].
_VIDEO_RATE = 25.0


@dataclass(frozen=True)
class FileSettings:
    """All parameters of the command."""

    detector: DetectorSettings
    tracking: TrackingParams
    landmarks: LandmarkParams
    draw: DrawParams
    keypoint_scale: KeypointScaleParams
    save: SaveParams
    limits: ImageLimitParams


@dataclass(frozen=True)
class InputFile:
    """An image or a video."""

    path: Path
    is_video: bool
    frames: int = 1  # 0 for a video of unknown length
    rate: Optional[float] = None  # of a video [Hz]; None: unknown
    most: float = MOST_MEGAPIXELS  # `max_image_megapixels`

    def name(self, number: int) -> str:
        """Return the name of a frame's files."""
        return numbered_name(self.path.stem, number) if self.is_video else self.path.stem

    def read(self) -> Iterator[np.ndarray]:
        """Yield the frames, (H, W, 3) uint8 BGR.

        Raises:
            BadInputError: it can not be read.
        """
        if self.is_video:
            yield from VideoSource(str(self.path.resolve()), most=self.most).frames()
        else:
            yield read_image(self.path, most=self.most)


def find_inputs(paths: Sequence[Path], outputs: Callable[[Path], bool], most: float = MOST_MEGAPIXELS
                ) -> Tuple[List[InputFile], List[Path]]:
    """Return the images and videos of files and folders, without `outputs` of this program; and paths without any."""
    files: List[Path] = []
    bad: List[Path] = []
    for path in paths:
        if path.is_dir():
            held = sorted((p for p in path.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES + VIDEO_SUFFIXES
                           and p.is_file() and not p.name.startswith('.') and not outputs(p)), key=natural_key)
            (files if held else bad).extend(held or [path])
        else:
            (files if path.is_file() else bad).append(path)
    # a file named twice, itself and by its folder, is done once
    return [_input_file(path, most) for path in {path.resolve(): path for path in files}.values()], bad


def check_names(inputs: Sequence[InputFile]) -> None:
    """Raise ParameterError if two inputs would write the same files."""
    first: Dict[Tuple[str, bool], Path] = {}
    for item in inputs:
        other = first.setdefault((item.path.stem, item.is_video), item.path)
        if other != item.path:
            raise ParameterError(f'{other} and {item.path} would write the same files, which are named after the input '
                                 'without its suffix; give them in two commands with folders of their own')


def people_of_frames(item: InputFile, detection: Detection, landmarks: Optional[LandmarkDetector],
                     tracking: TrackingParams) -> Iterator[Tuple[np.ndarray, People2D, Optional[Landmarks2D]]]:
    """Yield each frame of an input, (H, W, 3) uint8 BGR, its people, and their hands and faces if they are wanted."""
    chain = ImageChain(detection, tracking)
    for number, bgr in enumerate(item.read()):
        stamp = (1 + number) / (item.rate or _VIDEO_RATE) if item.is_video else 0.0
        people = chain.update(ImageFrame(item.path, stamp, bgr))
        if not item.is_video:  # negative ids are none; different ones assign hands to people
            people = replace(people, ids=-1 - np.arange(len(people)))
        yield bgr, people, None if landmarks is None else landmarks.detect(bgr, people, None, item.path, stamp)


def main(arguments: Optional[Sequence[str]] = None,
         create: Callable[[DetectorSettings], Detection] = create_detection) -> int:
    """Run the command with arguments, None: those of this process; return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    values = setting_values(parser, options.settings)
    values.update((key, value) for key, value in vars(options).items()
                  if key.startswith('write_') and value is not None)
    return run_command('detect_files', lambda: _run(options, values, create))


def _run(options: argparse.Namespace, values: Dict[str, Any],
         create: Callable[[DetectorSettings], Detection]) -> int:
    settings = build(FileSettings, values)
    save, overwrite = settings.save, options.overwrite
    if not save.active:
        raise ParameterError('nothing to save: give --write-json, --write-images or --write-video')
    inputs, unreadable = find_inputs(options.inputs, lambda path: _is_result(path, save),
                                     settings.limits.max_image_megapixels)
    for path in unreadable:
        _log.warning('%s %s', path, 'holds no images or videos' if path.is_dir() else 'does not exist')
    check_names(inputs)
    video = [Path(save.write_video).expanduser()] if save.write_video else []
    check_outputs(video, overwrite, [item.path for item in inputs])
    rate = next((item.rate for item in inputs if item.rate), None)
    recorder = Recorder(save, settings.draw, settings.keypoint_scale, rate, REPLACE if overwrite else SKIP)
    frames: Dict[InputFile, int] = Counter()
    total, skipped = 0, 0
    try:
        with recorder:
            may_skip = not overwrite and not save.write_video  # a video needs every frame
            todo = [item for item in inputs if not (may_skip and _is_done(item, recorder))]
            skipped = len(inputs) - len(todo)
            detection, landmarks = _networks(settings, create) if todo else (None, None)
            with Progress(total=sum(item.frames for item in todo), unit='frame') as progress:
                for item in todo:
                    try:
                        for bgr, people, found in people_of_frames(item, cast(Detection, detection), landmarks,
                                                                   settings.tracking):
                            recorder.submit(item.name(frames[item]), bgr, people, found)
                            frames[item] += 1
                            total += len(people)
                            progress.update()
                    except BadInputError as error:
                        _log.warning('%s', error)
                        unreadable.append(item.path)
                    else:
                        if overwrite:
                            _delete_from(frames[item], item, recorder)
    finally:
        counters = recorder.counters
        if frames or skipped or unreadable:
            number, files = sum(frames.values()), 'files and video frames' if video else 'files'
            parts = [f'{number} frame{"s" * (number != 1)} with {total} {"person" if total == 1 else "people"}',
                     f'{counters["written"]} {files} written'] + [text for count, text in (
                         (skipped, f'{skipped} inputs skipped, as their files are there (--overwrite does them again)'),
                         (unreadable, f'{len(unreadable)} inputs could not be read'),
                         (counters['failed'], f'{counters["failed"]} {files} could not be written')
                     ) if count]
            sys.stdout.write('; '.join(parts) + '\n')
    return SOME_FAILED if unreadable or counters['failed'] else DONE


def _delete_from(number: int, item: InputFile, recorder: Recorder) -> None:
    """Delete the files of frames from a number on, which a longer video of this name had."""
    while item.is_video and any(path.exists() for path in recorder.files(item.name(number)).values()):
        for path in recorder.files(item.name(number)).values():
            with suppress(FileNotFoundError):
                path.unlink()
        number += 1


def _networks(settings: FileSettings, create: Callable[[DetectorSettings], Detection]
              ) -> Tuple[Detection, Optional[LandmarkDetector]]:
    """Return what finds people, and hands and faces if wanted; raise ModelError if a network is missing."""
    params = settings.detector
    detection = create(params)
    if not (settings.landmarks.hands or settings.landmarks.face):
        return detection, None
    landmarks = create_landmark_detector(settings.landmarks, params.backend, params.detector.model_folder,
                                         recipe_of(params.detector).whole_body)
    if landmarks.missing:
        raise ModelError(landmarks.faults)
    return detection, landmarks


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('detect_files', __doc__)
    parser.add_argument('inputs', nargs='+', type=plain_path, metavar='INPUT', help='images, videos, folders of them')
    parser.add_argument('--write-json', metavar='DIR', help="keypoints in OpenPose's JSON layout, one file per frame")
    parser.add_argument('--write-images', metavar='DIR', help='annotated images, one file per frame')
    parser.add_argument('--write-video', metavar='FILE', help='annotated video of all frames, .mp4 or .avi')
    add_settings(parser, 'of the detector, of drawing, tracking or saving')
    parser.add_argument('--overwrite', action='store_true', help='do inputs again, and replace what is there')
    return parser


def _input_file(path: Path, most: float) -> InputFile:
    if path.suffix.lower() in IMAGE_SUFFIXES:
        return InputFile(path, is_video=False, most=most)
    capture = cv2.VideoCapture(str(path.resolve()))
    frames, rate = capture.get(cv2.CAP_PROP_FRAME_COUNT), capture.get(cv2.CAP_PROP_FPS)
    capture.release()
    return InputFile(path, True, max(int(frames), 0), rate if rate > 0 else None, most)


def _is_result(path: Path, save: SaveParams) -> bool:
    """Return whether a file is an annotated image or the video of this command."""
    if save.write_video and path.resolve() == Path(save.write_video).expanduser().resolve():
        return True
    return (bool(save.write_images) and path.stem.endswith('_rendered')
            and path.parent.resolve() == Path(save.write_images).expanduser().resolve())


def _is_done(item: InputFile, recorder: Recorder) -> bool:
    """Return whether all files of an input exist."""
    return item.frames > 0 and all(path.exists() for number in range(item.frames) for path in
                                   recorder.files(item.name(number)).values())
