"""What the checks look at: facts about master, topics, messages, tf and nodes, without ROS."""
from dataclasses import dataclass, field
from typing import Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.calibration import Calibration
from openpose_ros_pkg.stream.silent_topic import PublishedTopic
from skeleton_extract_3d.points.point_grid import PointGrid


class Clock(NamedTuple):
    """Messages on /clock while the doctor looked, and the newest time [s]."""

    ticks: int = 0
    newest: float = 0.0


@dataclass(frozen=True)
class Master:
    """The ROS master and this machine in its network.

    Attributes:
        uri: ROS_MASTER_URI.
        is_online: whether it answers.
        name: by which other nodes call this machine: ROS_HOSTNAME, ROS_IP or the host name.
        address: of this machine as the master's machine would call it; empty: unknown.
        fault: why other nodes can not call this machine by its name; empty: they can.
        unreachable: nodes that can not be called, with their URIs.
        sim_time: whether use_sim_time is true.
        clock: what came on /clock.
    """

    uri: str
    is_online: bool = True
    name: str = 'localhost'
    address: str = ''
    fault: str = ''
    unreachable: Mapping[str, str] = field(default_factory=dict)
    sim_time: bool = False
    clock: Clock = field(default_factory=Clock)


class Arrival(NamedTuple):
    """When a message came: time.monotonic() [s] and ROS time [s]; and its stamp [ns]."""

    received: float
    now: float
    stamp: int


@dataclass(frozen=True)
class Stream:
    """A topic of a camera, and what came on it.

    Attributes:
        role: argument of the launch files that names it: image, points, depth or camera_info; empty: the camera info
            of the colour image where the chain reads none.
        topic, kind: name and expected type.
        is_connected: whether there was a connection to its publisher.
        arrivals: of its messages.
        frame_id, size, encoding: of the newest one; size (width, height) [px]; encoding of images.
        fault: why the newest one can not be used; empty: it can.
        points: of the newest cloud or depth image.
        calibration: of the newest camera info.
    """

    role: str
    topic: str
    kind: str
    is_connected: bool = True
    arrivals: Tuple[Arrival, ...] = ()
    frame_id: str = ''
    size: Tuple[int, int] = (0, 0)
    encoding: str = ''
    fault: str = ''
    points: Optional[PointGrid] = None
    calibration: Optional[Calibration] = None

    @property
    def rate(self) -> float:
        """Messages per second; 0 with less than two."""
        if len(self.arrivals) < 2:
            return 0.0
        return (len(self.arrivals) - 1) / max(self.arrivals[-1].received - self.arrivals[0].received, 1e-6)

    @property
    def age(self) -> float:
        """Median time from the stamp to the arrival of messages, of which there are some [s]."""
        return float(np.median([arrival.now - arrival.stamp * 1e-9 for arrival in self.arrivals]))


@dataclass(frozen=True)
class Camera:
    """Topics of a camera.

    Attributes:
        image: colour image.
        points: cloud or depth image; None: people are found in the image alone.
        info: camera info of the depth image, which the chain needs; None with a cloud.
        colour_info: camera info beside the image; None: unknown.
        preset: name of the camera preset; empty: none.
        namespace: of the camera; empty: none.
        driver: line that starts its driver with registered depth; empty: unknown.
        node: node of the chain that reads the topics; empty: none runs.
    """

    image: Stream
    points: Optional[Stream] = None
    info: Optional[Stream] = None
    colour_info: Optional[Stream] = None
    preset: str = ''
    namespace: str = ''
    driver: str = ''
    node: str = ''

    @property
    def streams(self) -> Sequence[Stream]:
        """The topics that the chain needs."""
        return [stream for stream in (self.image, self.points, self.info) if stream is not None]


class Lookup(NamedTuple):
    """Rotation (3, 3) and translation (3,) [m] that tf has between two frames, or why it has none."""

    rotation: Optional[np.ndarray] = None
    translation: Optional[np.ndarray] = None
    error: str = ''


@dataclass(frozen=True)
class Tf:
    """Frames that tf knows.

    Attributes:
        fixed_frame: in which the room stands still and z is up; empty: none is named.
        parents: of frames.
        lookups: by target and source frame, at the stamp of the newest points.
    """

    fixed_frame: str = ''
    parents: Mapping[str, str] = field(default_factory=dict)
    lookups: Mapping[Tuple[str, str], Lookup] = field(default_factory=dict)


@dataclass(frozen=True)
class ChainNode:
    """A node that finds people, by its status in /diagnostics.

    Attributes:
        name: of the node.
        level, text, values: of its newest status; level 0 is OK.
        skipped: images that it skipped per second, between the first and the newest status [Hz].
        parameters: its private parameters.
        results: topic of its people.
    """

    name: str
    level: int = 0
    text: str = ''
    values: Mapping[str, str] = field(default_factory=dict)
    skipped: float = 0.0
    parameters: Mapping[str, object] = field(default_factory=dict)
    results: str = ''

    @property
    def rests(self) -> bool:
        """Whether it computes nothing, as no results are wanted."""
        return self.text.startswith(('idle', 'disabled'))


class Machine(NamedTuple):
    """This machine: load average of the last minute, number of cores, available memory [MB]."""

    load: float
    cores: int
    memory: float


class People(NamedTuple):
    """Results that came: frames, the greatest number of people in one, and their median ages by topic [s]."""

    frames: int = 0
    most: int = 0
    ages: Mapping[str, float] = {}


@dataclass(frozen=True)
class Snapshot:
    """All that is known.

    Attributes:
        seconds: that the doctor looked.
        published, subscribed: topics with their publishers, and with the names of their subscribers.
        unresponsive: nodes that publish results but send no status.
        starting: nodes of the chain that publish no results yet.
        people: results that came; None: not asked for, as the chain rests.
        recorders: level, text and folder of the status of each.
    """

    master: Master
    seconds: float = 5.0
    published: Mapping[str, PublishedTopic] = field(default_factory=dict)
    subscribed: Mapping[str, Sequence[str]] = field(default_factory=dict)
    cameras: Sequence[Camera] = ()
    tf: Tf = field(default_factory=Tf)
    nodes: Sequence[ChainNode] = ()
    unresponsive: Sequence[str] = ()
    starting: Sequence[str] = ()
    machine: Machine = field(default_factory=lambda: Machine(0.0, 1, 1e6))
    people: Optional[People] = None
    recorders: Sequence[Tuple[int, str, str]] = ()

    def node_of(self, camera: Camera) -> Optional[ChainNode]:
        """Return the node that reads a camera; None: there is none."""
        return next((node for node in self.nodes if node.name == camera.node), None)
