"""What the checks look at: facts about master, topics, messages, tf and nodes, without ROS."""
from dataclasses import dataclass, field
from typing import Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.calibration import Calibration
from openpose_ros_pkg.stream.silent_topic import PublishedTopic
from skeleton_extract_3d.points.plausibility import Doubt, summarize
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import Transform


@dataclass(frozen=True)
class Master:
    """The ROS master and the time that nodes take."""

    uri: str
    is_online: bool = True
    unreachable: Mapping[str, str] = field(default_factory=dict)  # URIs of nodes that can not be called
    sim_time: bool = False
    ticks: int = 0  # messages on /clock while the doctor listened
    clock: float = 0.0  # newest time on /clock [s]

    @property
    def time_passes(self) -> bool:
        """Whether nodes see time pass."""
        return not self.sim_time or self.ticks > 0


class Arrival(NamedTuple):
    """When a message came: time.monotonic() [s] and ROS time [s]; and its stamp [ns]."""

    received: float
    now: float
    stamp: int


@dataclass(frozen=True)
class Stream:
    """A topic of a camera, and what came on it."""

    role: str  # image, points, depth or camera_info; empty: camera info of the colour image, which the chain ignores
    topic: str
    kind: str  # expected type
    is_connected: bool = True
    arrivals: Tuple[Arrival, ...] = ()
    # of the newest message
    frame_id: str = ''
    size: Tuple[int, int] = (0, 0)  # width, height [px]
    encoding: str = ''
    fault: str = ''  # why it can not be used; empty: it can
    points: Optional[PointGrid] = None
    calibration: Optional[Calibration] = None
    bgr: Optional[np.ndarray] = None  # (H, W, 3) uint8 of a colour image

    @property
    def rate(self) -> float:
        """Messages per second; 0 with less than two."""
        if len(self.arrivals) < 2:
            return 0.0
        return (len(self.arrivals) - 1) / max(self.arrivals[-1].received - self.arrivals[0].received, 1e-6)

    @property
    def doubt(self) -> Optional[Doubt]:
        """Why the newest points are no depth in metres; None: they are, or there are none."""
        return None if self.points is None else summarize(self.points).doubt

    @property
    def age(self) -> float:
        """Median time from the stamp to the arrival of messages, of which there are some [s]."""
        return float(np.median([arrival.now - arrival.stamp * 1e-9 for arrival in self.arrivals]))


@dataclass(frozen=True)
class Camera:
    """Topics of a camera."""

    image: Stream
    points: Optional[Stream] = None  # cloud or depth image; None: people are found in the image alone
    info: Optional[Stream] = None  # camera info of the depth image; None with a cloud
    colour_info: Optional[Stream] = None  # camera info beside the image; None: unknown
    preset: str = ''  # empty: none
    namespace: str = ''  # empty: the preset's
    driver: str = ''  # line that starts the driver with registered depth; empty: unknown
    node: str = ''  # of the chain that reads the topics; empty: none runs
    rectified: bool = False

    @property
    def streams(self) -> Sequence[Stream]:
        """The topics that the chain needs."""
        return [stream for stream in (self.image, self.points, self.info) if stream is not None]


@dataclass(frozen=True)
class ChainNode:
    """A node that finds people: its newest status in /diagnostics, where level 0 is OK, and its parameters."""

    name: str
    level: int = 0
    text: str = ''
    values: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, object] = field(default_factory=dict)
    results: str = ''  # topic of its people

    @property
    def rests(self) -> bool:
        """Whether it computes nothing, as no results are wanted."""
        return self.text.startswith(('idle', 'disabled'))


@dataclass(frozen=True)
class Snapshot:
    """All that is known."""

    master: Master
    seconds: float = 5.0  # that the doctor listened
    published: Mapping[str, PublishedTopic] = field(default_factory=dict)
    subscribed: Mapping[str, Sequence[str]] = field(default_factory=dict)  # names of the subscribers by topic
    cameras: Sequence[Camera] = ()
    fixed_frame: str = ''  # in which the room stands still and z is up; empty: none is named
    parents: Mapping[str, str] = field(default_factory=dict)  # of the frames of tf
    # what tf has between target and source frame at the stamp of the newest points, or why it has nothing
    lookups: Mapping[Tuple[str, str], Union[Transform, str]] = field(default_factory=dict)
    nodes: Sequence[ChainNode] = ()
    unresponsive: Sequence[str] = ()  # nodes that publish results but send no status
    starting: Sequence[str] = ()  # nodes of the chain that publish no results yet
    load: float = 0.0  # programs that want to run, mean of the last minute
    memory: float = 1e6  # available [MB]
    people: Optional[Sequence[int]] = None  # in each result that came; None: not asked for, as the chain rests

    def node_of(self, camera: Camera) -> Optional[ChainNode]:
        """Return the node that reads a camera; None: there is none."""
        return next((node for node in self.nodes if node.name == camera.node), None)
