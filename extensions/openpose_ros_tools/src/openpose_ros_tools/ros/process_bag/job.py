"""Jobs of process_bag, and reports of them."""
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

from openpose_ros_fusion.rig import Rig
from openpose_ros_pkg.detect.detection import Detection
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.ros.topics import FOUND, CameraTopics
from openpose_ros_pkg.stream.image_decoding import ImageLimitParams
from openpose_ros_pkg.stream.pairing import PairingParams
from openpose_ros_signals.node_params import UprightParams
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.show.markers import MarkerParams


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
class Input:
    """A camera in a bag."""

    bag: Path
    topics: CameraTopics = FOUND  # where they are named
    preset: str = ''  # name of the camera, or auto, whose topics are read where none is named; empty: found by type
    only_2d: bool = False  # whether points are ignored
    camera: str = ''  # namespace of its results; in a bag of several cameras, of its topics too
    is_alone: bool = True  # whether the bag has no other camera; then its topics may be in any namespace
    earlier: Tuple[Path, ...] = ()  # parts of the same recording before it, the first one first


@dataclass(frozen=True)
class Outputs:
    """What is made of a recording."""

    bag: Path  # to write, or a file for Foxglove and ROS 2 (.mcap)
    csv: Optional[Path] = None  # table of people in space, or in the image where there are no points
    json: Optional[Path] = None  # folder for a file of each frame; of several cameras, for a folder of each
    csv_layout: str = 'extended'  # see `KeypointCsvWriter`
    copied: Tuple[str, ...] = ()  # topics that are copied, or 'all'
    markers: bool = False
    signals: bool = False  # postures, gestures and falls
    compression: str = 'none'  # of the bag, one of COMPRESSIONS

    @property
    def paths(self) -> List[Path]:
        """Files and folder that are made."""
        return [path for path in (self.bag, self.csv, self.json) if path is not None]


@dataclass(frozen=True)
class Settings:
    """How people are found; can be pickled."""

    values: Mapping[str, Any] = field(default_factory=dict)  # that differ from the defaults of `BagSettings`
    threads: int = 0  # of the networks where the parameters leave it open; 0: one per core
    create: Callable[[DetectorSettings], Detection] = create_detection  # makes what finds people, of the parameters


@dataclass(frozen=True)
class RigInput:
    """Several cameras that see the same people."""

    cameras: Tuple[Input, ...]
    fixed_frame: str  # of the fused people
    rig: Optional[Rig] = None  # where the cameras stand, and their clocks; None: tf of their bags says so

    @property
    def bags(self) -> List[Path]:
        """The bags of the cameras."""
        return list(dict.fromkeys(camera.bag for camera in self.cameras))

    def clock_offset(self, camera: str) -> int:
        """Return what is added to the stamps of a camera [ns]."""
        return 0 if self.rig is None else round(self.rig.camera(camera).clock_offset * 1e9)

    def time_shift(self, camera: str) -> int:
        """Return what is added to the times of recording of a camera [ns]: one bag has one clock."""
        return self.clock_offset(camera) if len(self.bags) > 1 else 0


class BagJob(NamedTuple):
    """The results to make of a camera, or of several cameras. It can be pickled."""

    input: Union[Input, RigInput]
    outputs: Outputs
    settings: Settings = Settings()

    @property
    def cameras(self) -> Sequence[Input]:
        """The camera, or the cameras."""
        return self.input.cameras if isinstance(self.input, RigInput) else (self.input,)

    @property
    def recording(self) -> Path:
        """Name of the recording: its first bag."""
        return (*self.cameras[0].earlier, self.cameras[0].bag)[0]


@dataclass
class BagReport:
    """Report of a bag."""

    topics: CameraTopics = FOUND  # that the frames are from
    frames: int = 0  # written
    people: int = 0  # in them, in sum
    dropped: Dict[str, int] = field(default_factory=Counter)  # frames without a result, by the reason
    doubts: Dict[str, int] = field(default_factory=Counter)  # frames whose input seems wrong, by the event
    alone: List[int] = field(default_factory=lambda: [0, 0])  # images, and points, without a partner
    unusable: int = 0  # messages without a stamp, or not newer than the one before
    resets: int = 0  # times that the stamps jumped back
    advice: str = ''  # why few messages pair, and how more do

    def text(self) -> str:
        """Return the report in a line."""
        source = ' and '.join(topic for topic in self.topics[:3] if topic)
        parts = [f'{self.frames} frames with {self.people} people, from {source}']
        parts += [f'{number} frames dropped: {reason}' for reason, number in self.dropped.items()]
        parts += [f'{number} frames: {event}' for event, number in self.doubts.items()]
        parts += [f'{number} {what}' for number, what in (
            (self.alone[0], 'images without points'), (self.alone[1], 'points without an image'),
            (self.unusable, 'messages without a stamp or not newer than the one before'),
            (self.resets, 'times the stamps jumped back')) if number]
        return '; '.join(parts + [self.advice] * bool(self.advice))


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
