"""Cameras by name: topics, frames and formats of their drivers, and which camera the published topics are."""
import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, Iterable, List, Literal, Mapping, NamedTuple, Optional, Tuple, Union

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.records import to_record
from openpose_ros_pkg.structured_text import file_values

AUTO = 'auto'
"""Name that stands for the camera that the published topics are."""
IMAGE, COMPRESSED, CLOUD = 'sensor_msgs/Image', 'sensor_msgs/CompressedImage', 'sensor_msgs/PointCloud2'
CAMERA_INFO = 'sensor_msgs/CameraInfo'
# Types of raw topics; topics that each source of points needs.
_KINDS = {'image': IMAGE, 'points': CLOUD, 'depth': IMAGE, 'camera_info': CAMERA_INFO}
_NEEDED = {'': (), 'point_cloud': ('points',), 'depth_image': ('depth', 'camera_info')}


def raw_topic(topic: str) -> str:
    """Return the topic of the raw images that a topic has compressed; the topic of raw images as it is."""
    head, _, last = topic.rpartition('/')
    return head if last in ('compressed', 'compressedDepth', 'theora') else topic


def info_beside(topic: str) -> str:
    """Return the topic of the camera info that drivers publish beside an image."""
    return f'{raw_topic(topic).rpartition("/")[0]}/camera_info'


@dataclass(frozen=True)
class CameraPreset:
    """A camera as its driver publishes it; config/cameras.yaml explains the fields.

    Of its methods, `ns` is a namespace in place of the preset's; `compressed`: JPEG and PNG of image_transport.
    """

    name: str
    image: str
    title: str = ''
    ns: str = ''
    points: str = ''
    depth: str = ''
    camera_info: str = ''
    points_source: Literal['', 'point_cloud', 'depth_image'] = ''
    image_transport: Literal['raw', 'compressed'] = 'raw'
    depth_transport: Literal['raw', 'compressed', 'compressedDepth'] = 'raw'
    rectified: bool = False
    frame: str = ''
    image_encoding: str = ''
    depth_encoding: str = ''
    size: Optional[Tuple[int, int]] = None
    package: str = ''
    launch_file: str = ''
    arguments: str = ''
    ns_argument: str = ''
    source: str = ''
    unconfirmed: str = ''

    @property
    def dimensions(self) -> int:
        """2 for a camera without depth, else 3."""
        return 3 if self.points_source else 2

    def driver_line(self, ns: str = '') -> str:
        """Return the line that starts the driver so that it publishes these topics; empty: not known."""
        try:
            return ' '.join(self.driver_command(ns)) if self.package else ''
        except ParameterError:  # the launch file has no argument for it
            return ''

    def driver_command(self, ns: str = '', words: Iterable[str] = ()) -> List[str]:
        """Return the command that starts the driver.

        Args:
            ns: namespace in place of the preset's; empty: the preset's.
            words: arguments NAME:=VALUE of the launch file, and FILE.launch in place of the preset's.

        Raises:
            ParameterError: a word is neither, or the launch file has no argument for the namespace.
        """
        prefix, launch_file = ['roslaunch'], self.launch_file
        arguments = dict(word.split(':=', 1) for word in self.arguments.split())
        if ns.strip('/') not in ('', self.ns) and not self.ns:
            prefix = ['env', f'ROS_NAMESPACE={ns}', *prefix]
        elif ns.strip('/') not in ('', self.ns):
            if not self.ns_argument:
                raise ParameterError(f"parameter 'camera_ns' = {ns!r} is not allowed: {self.launch_file} of "
                                     f'{self.name} has no argument for it', 'camera_ns')
            arguments[self.ns_argument] = ns.strip('/')
        for word in words:
            name, is_argument, value = word.partition(':=')
            if is_argument:
                arguments[name] = value
            elif word.endswith('.launch'):
                launch_file = word
            else:
                raise ParameterError(f"'{word}' is not allowed for the driver: NAME:=VALUE or FILE.launch",
                                     'driver_args')
        return [*prefix, self.package, launch_file, *(f'{name}:={value}' for name, value in arguments.items())]

    def topic(self, role: str, ns: Optional[str] = None) -> str:
        """Return the absolute topic of a role: image, points, depth or camera_info; empty where there is none."""
        namespace, relative = (self.ns if ns is None else ns).strip('/'), getattr(self, role)
        return '/'.join(('', namespace, relative) if namespace else ('', relative)) if relative else ''

    def inputs(self, dimensions: int = 3, ns: Optional[str] = None) -> Dict[str, str]:
        """Return the topics that are read of the camera, transports included, and their types; the image is first."""
        transports, topics = {'image': self.image_transport, 'depth': self.depth_transport}, {}
        for role in ('image', *(_NEEDED[self.points_source] if dimensions == 3 else ())):
            transport = transports.get(role, 'raw')
            if transport == 'raw':
                topics[self.topic(role, ns)] = _KINDS[role]
            else:
                topics[f'{self.topic(role, ns)}/{transport}'] = COMPRESSED
        return topics

    def recorded(self, ns: Optional[str] = None, dimensions: int = 3, compressed: bool = False) -> List[str]:
        """Return the topics to record for process_bag: the depth image, which is smaller, in place of the cloud."""
        image, depth, info = (self.topic(role, ns) for role in ('image', 'depth', 'camera_info'))
        if compressed or self.image_transport != 'raw':
            image += '/compressed'
        if dimensions == 2 or not self.points_source:
            points = ''
        elif not depth:
            points = self.topic('points', ns)
        else:
            points = f'{depth}/{self.depth_transport}' if self.depth_transport != 'raw' else (
                depth + '/compressedDepth' * compressed)
        return [topic for topic in (image, points, info) if topic]


Presets = Mapping[str, CameraPreset]


def presets_file() -> Path:
    """Return the table of cameras, in the sources or where the package is installed."""
    here = Path(__file__).resolve()
    folders = (here.parents[3], here.parents[5] / 'share' / 'openpose_ros_pkg')
    return next((file for file in (folder / 'config' / 'cameras.yaml' for folder in folders) if file.exists()),
                folders[-1] / 'config' / 'cameras.yaml')


def read_presets(path: Union[Path, str, None] = None) -> Dict[str, CameraPreset]:
    """Return the cameras of a file by name; None: of the table.

    Raises:
        ParameterError: the file can not be read or is not of the table's form.
    """
    path = Path(path or presets_file())
    where = f"parameter 'camera': {path}"

    def refused(text: str) -> ParameterError:
        return ParameterError(text, 'camera')

    values = file_values(path, where, refused)
    if not isinstance(values, dict) or not values:
        raise refused(f'{where} is no table of cameras, as config/cameras.yaml is')
    cameras = {str(name): to_record(entry, CameraPreset, f'{where}: {name}', refused, name=str(name))
               for name, entry in values.items()}
    for name, camera in cameras.items():
        for role in _NEEDED[camera.points_source]:
            if not getattr(camera, role):
                raise refused(f'{where}: {name}: points_source = {camera.points_source!r} needs {role}')
    return cameras


def find_preset(name: str) -> CameraPreset:
    """Return a camera by its name or by a YAML file with one camera.

    Raises:
        ParameterError: there is no such camera, or the file is not of the table's form.
    """
    if name.endswith(('.yaml', '.yml')):
        cameras = read_presets(name)
        if len(cameras) != 1:
            raise ParameterError(f"parameter 'camera': {name} holds {', '.join(cameras)}, expected one camera",
                                 'camera')
        return next(iter(cameras.values()))
    presets = read_presets()
    if name not in presets:
        near = ''.join(f" (did you mean '{other}'?)" for other in difflib.get_close_matches(name, presets, n=1))
        raise ParameterError(f"parameter 'camera' = {name!r} is not allowed{near}: one of {', '.join(presets)}, "
                             f'{AUTO}, or a YAML file with one camera', 'camera')
    return presets[name]


class SeenCamera(NamedTuple):
    """A camera of which the image topic is published; `missing`: topics that are not, or with another type."""

    preset: CameraPreset
    ns: str
    missing: Tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return what it is, and what is missing, in words."""
        image = next(iter(self.preset.inputs(ns=self.ns)))
        text = f'{self.preset.name} ({image})'
        if not self.missing:
            return text
        line = self.preset.driver_line(self.ns)
        return f'{text} without {", ".join(self.missing)}' + (f' ({line})' if line else '')


class CameraChoice(NamedTuple):
    """The camera that was chosen of the published topics, and what else there is.

    Attributes:
        chosen: None where no camera has all of its topics.
        others: cameras, the chosen one left out; with topics missing only in the namespace of their preset, where no
            other camera has their image.
        images: image topics that belong to no camera of the table.
    """

    chosen: Optional[SeenCamera]
    others: Tuple[SeenCamera, ...]
    images: Tuple[str, ...]

    def __str__(self) -> str:
        """Return what was seen besides the chosen camera, in words."""
        parts = [str(other) for other in self.others]
        if self.images:
            parts.append(f'images on {", ".join(self.images)}')
        return '; '.join(parts) or 'no other image'


def choose_camera(published: Mapping[str, str], dimensions: int = 3, presets: Optional[Presets] = None) -> CameraChoice:
    """Return the camera that published topics are.

    A camera with depth is found in any namespace, one without only in its own, as many nodes have an `image_raw`. One
    in the namespace of the table comes first, then the order of the table counts.

    Args:
        published: types of the published topics by name.
        dimensions: 2: the image is enough.
    """
    cameras = read_presets() if presets is None else presets
    seen = [camera for preset in cameras.values() if preset.dimensions >= dimensions
            for camera in _seen(preset, published, dimensions) if not camera.missing or camera.ns == preset.ns]
    seen.sort(key=lambda camera: (len(camera.missing) > 0, camera.ns != camera.preset.ns))  # stable: the table's order
    by_topics: Dict[Tuple[str, ...], SeenCamera] = {}
    taken: List[str] = []
    for camera in seen:
        topics = tuple(camera.preset.inputs(dimensions, camera.ns))
        if not camera.missing or topics[0] not in taken:
            by_topics.setdefault(topics, camera)
        if not camera.missing:
            taken.append(topics[0])
    found = list(by_topics.values())
    chosen = found[0] if found and not found[0].missing else None
    known = {camera.preset.topic(role, camera.ns) for camera in seen for role in ('image', 'depth')}
    images = tuple(sorted(topic for topic, kind in published.items()
                          if kind == IMAGE and topic not in known and '/openpose_ros/' not in topic))
    return CameraChoice(chosen, tuple(found[1:] if chosen else found), images)


def _seen(preset: CameraPreset, published: Mapping[str, str], dimensions: int) -> Iterable[SeenCamera]:
    """Yield a camera in each namespace in which its image is published."""
    ending, kind = next(iter(preset.inputs(ns='').items()))
    for topic in sorted(topic for topic, its_kind in published.items() if its_kind == kind and topic.endswith(ending)):
        ns = topic[:-len(ending)].strip('/')
        if preset.points_source or ns == preset.ns:
            yield SeenCamera(preset, ns, tuple(
                name for name, its_kind in preset.inputs(dimensions, ns).items() if published.get(name) != its_kind))
