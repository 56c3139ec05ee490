"""Jobs of process_bag, and reports of them."""
from collections import Counter
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

from openpose_ros_fusion.rig import Rig, rig_text
from openpose_ros_pkg.detect.detection import Detection
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.stream.image_decoding import ImageLimitParams
from openpose_ros_pkg.stream.pairing import PairingParams
from openpose_ros_signals.node_params import UprightParams
from openpose_ros_tools.recording_paths import main_file
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.show.markers import MarkerParams

# Incremented when the same parameters give other results, so that outputs of older versions do not pass for done.
_VERSION = 4
# Parameters that do not change results.
_WITHOUT_EFFECT = ('threads', 'compiled_cache', 'camera', 'camera_ns')


@dataclass(frozen=True)
class BagSettings:
    """The parameters of the nodes that have a meaning for a recording."""

    detector: DetectorSettings
    tracking: TrackingParams
    landmarks: LandmarkParams
    keypoint_scale: KeypointScaleParams
    extractor: ExtractorParams
    estimator: EstimatorSettings
    pairing: PairingParams
    markers: MarkerParams
    upright: UprightParams
    limits: ImageLimitParams


@dataclass(frozen=True)
class CameraTopics:
    """The topics of a camera; empty: to be found, or none."""

    image: str = ''  # raw or compressed
    points: str = ''  # of clouds
    depth: str = ''  # of depth images aligned to the image, raw or compressed, in place of clouds
    camera_info: str = ''  # of the depth images, and of a camera without depth that is fused with others
    image_info: str = ''  # calibration of the images, beside which points are; found, never named

    @property
    def in_space(self) -> bool:
        """Whether there are points."""
        return bool(self.points or self.depth)


@dataclass(frozen=True)
class BagJob:
    """The results to make of a camera in a bag. It can be pickled."""

    source: Path  # the bag
    output: Path  # bag to make
    csv: Optional[Path] = None  # table to make, None: none
    json: Optional[Path] = None  # folder for a file of each frame, None: none
    # parameters that differ from their defaults, of `BagSettings`
    values: Mapping[str, Any] = field(default_factory=dict)
    topics: CameraTopics = field(default_factory=CameraTopics)  # of the camera, where they are named
    preset: str = ''  # name of the camera, or auto, whose topics are read where none is named; empty: found by type
    only_2d: bool = False  # whether points are ignored
    camera: str = ''  # namespace of its results; in a bag of several cameras, of its topics too
    is_alone: bool = True  # whether the bag has no other camera; then its topics may be in any namespace
    copied: Tuple[str, ...] = ()  # topics that are copied, or 'all'
    markers: bool = False  # whether markers are written
    signals: bool = False  # whether postures, gestures and falls are written
    # see `KeypointCsvWriter`. The table has people in space where there are any, else those in the image.
    csv_layout: str = 'extended'
    compression: str = 'none'  # of the bag, one of COMPRESSIONS
    mcap: bool = False  # whether the output is a file for Foxglove and ROS 2
    threads: int = 0  # of the networks where the parameters leave it open; 0: one per core
    create: Callable[[DetectorSettings], Detection] = create_detection  # makes what finds people, of the parameters
    earlier: Tuple[Path, ...] = ()  # parts of the same recording before it, the first one first
    run: str = ''  # identifier of what its unfinished outputs are part of, see `PartFiles`

    @property
    def cameras(self) -> Tuple['BagJob', ...]:
        """The camera, as `RigJob` has several."""
        return (self,)

    @property
    def sources(self) -> List[Path]:
        """Files that are read."""
        return [self.source]

    @property
    def outputs(self) -> List[Path]:
        """Files and folder that are made."""
        return [path for path in (self.output, self.csv, self.json) if path is not None]

    def made_from(self) -> Dict[str, Any]:
        """Return what the results depend on, as JSON has it.

        Raises:
            BadInputError: the bag is not there.
        """
        try:
            state = main_file(self.source).stat()
        except OSError as error:
            raise BadInputError(f'{self.source}: {error.strerror}') from error
        return {'version': _VERSION, 'bag': self.source.name, 'bytes': state.st_size, 'modified_ns': state.st_mtime_ns,
                'earlier': [path.name for path in self.earlier],
                'topics': {part.name: getattr(self.topics, part.name) for part in fields(self.topics)},
                'parameters': {key: value for key, value in self.values.items() if key not in _WITHOUT_EFFECT},
                'camera': self.preset, 'only_2d': self.only_2d, 'copied': list(self.copied), 'markers': self.markers,
                'signals': self.signals, 'csv_layout': self.csv_layout, 'compression': self.compression}


@dataclass(frozen=True)
class RigJob:
    """The results to make of several cameras that see the same people."""

    # the job of each camera: its `output` is not used, its `json` is a folder in that of all
    cameras: Tuple[BagJob, ...]
    output: Path  # bag to make, with the people of each camera and the fused ones
    csv: Optional[Path]  # table of the fused people, None: none
    json: Optional[Path]  # folder with one for each camera, None: none
    fixed_frame: str  # of the fused people
    rig: Optional[Rig]  # where the cameras stand; None: tf of their bags says so
    clock_offsets: Mapping[str, float]  # are added to the stamps of each camera [s]
    rectified: bool = False  # the images of cameras without depth are rectified
    only_fuse: bool = False  # the bags hold the people of the cameras

    @property
    def sources(self) -> List[Path]:
        """Files that are read."""
        return list(dict.fromkeys(camera.source for camera in self.cameras))

    @property
    def outputs(self) -> List[Path]:
        """Files and folder that are made."""
        return [path for path in (self.output, self.csv, self.json) if path is not None]

    def clock_offset(self, camera: str) -> int:
        """Return what is added to the stamps of a camera [ns]."""
        return round(self.clock_offsets.get(camera, 0.0) * 1e9)

    def time_shift(self, camera: str) -> int:
        """Return what is added to the times of recording of a camera [ns]: one bag has one clock."""
        return self.clock_offset(camera) if len(self.sources) > 1 else 0

    def made_from(self) -> Dict[str, Any]:
        """Return what the results depend on, as JSON has it; see `BagJob.made_from`."""
        return {'cameras': [[camera.camera, camera.made_from()] for camera in self.cameras],
                'fixed_frame': self.fixed_frame, 'rig': self.rig and rig_text(self.rig),
                'clock_offsets': dict(self.clock_offsets), 'rectified': self.rectified, 'only_fuse': self.only_fuse}


@dataclass
class Counts:
    """Messages of a recording that became no frame."""

    images: int = 0  # all images that were read
    pairs: int = 0  # of image and points
    alone: List[int] = field(default_factory=lambda: [0, 0])  # images, and points, without a partner
    unusable: int = 0  # messages without a stamp, or not newer than the one before
    resets: int = 0  # times that the stamps jumped back
    advice: str = ''  # why few messages pair, and how more do

    @property
    def few_pairs(self) -> bool:
        """Whether half of the images that could have a partner, or more, have none."""
        return 0 < min(self.alone) >= self.pairs


@dataclass
class BagReport:
    """Report of a bag."""

    frames: int = 0  # written
    people: int = 0  # in them, in sum
    dropped: Dict[str, int] = field(default_factory=Counter)  # frames without a result, by the reason
    doubts: Dict[str, int] = field(default_factory=Counter)  # frames whose input seems wrong, by the event
    counts: Counts = field(default_factory=Counts)  # of what became no frame
    topics: CameraTopics = field(default_factory=CameraTopics)  # that the frames are from

    def text(self) -> str:
        """Return the report in a line."""
        source = ' and '.join(topic for topic in (self.topics.image, self.topics.points, self.topics.depth) if topic)
        parts = [f'{self.frames} frames with {self.people} people, from {source}']
        parts += [f'{number} frames dropped: {reason}' for reason, number in self.dropped.items()]
        parts += [f'{number} frames: {event}' for event, number in self.doubts.items()]
        counts = self.counts
        for number, what in ((counts.alone[0], 'images without points'), (counts.alone[1], 'points without an image'),
                             (counts.unusable, 'messages without a stamp or not newer than the one before'),
                             (counts.resets, 'times the stamps jumped back')):
            if number:
                parts.append(f'{number} {what}')
        parts += [counts.advice] if counts.advice else []
        return '; '.join(parts)


def build_settings(values: Mapping[str, Any]) -> BagSettings:
    """Return the settings of a flat mapping.

    Raises:
        ParameterError: a key is unknown, or a value is not allowed, here or at all.
    """
    settings = build(BagSettings, values)
    rate = settings.detector.detector.target_rate
    if rate > 0:
        raise ParameterError(f"parameter 'target_rate' = {rate:g} is not allowed here: results would depend on the "
                             'machine; 0, and mode=fast where time is short')
    return settings
