"""The parameters of each node of this package, and those that only nodes have."""
from dataclasses import dataclass
from typing import Any, Dict, Tuple, Type

from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.recipes import EnsembleParams, LiveDetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.output.draw import DrawParams
from openpose_ros_pkg.output.keypoint_scale import KeypointScaleParams
from openpose_ros_pkg.output.recorder import SaveParams
from openpose_ros_pkg.params.parameters import Parameters, parameter, parameter_fields
from openpose_ros_pkg.stream.image_decoding import ImageLimitParams

# Of the parameters that say which camera a node reads.
CAMERA_DOC = ('Camera whose topics are read unless they are given: a name of cameras.yaml (realsense, kinect2, '
              'azure_kinect, oakd, zed, orbbec, xtion, usb_cam), a YAML file with one camera, or auto: the one that '
              'is published.')
ROTATE_DOC = ('Turn images and points clockwise by this angle, where the camera hangs upside down or lies on its side. '
              'Results are in FRAME_turned, the optical frame of a level camera; an extractor publishes it on /tf.')
CAMERA_NS_DOC = "Namespace of the camera's topics; empty: that of its preset."


@dataclass(frozen=True)
class ImageTransportParams(Parameters):
    """How images reach the node."""

    image_transport: str = parameter(
        'auto', "'compressed' subscribes to <image topic>/compressed, as image_transport publishes it. auto: as the "
                "preset of the node's camera says, raw without one.", choices=('auto', 'raw', 'compressed'))


@dataclass(frozen=True)
class DemandParams(Parameters):
    """When the node works."""

    lazy: bool = parameter(
        True, 'Subscribe to the inputs, and so compute, only while a result has a subscriber. What is saved, '
              'printed (verbose) or published on /tf counts as one. false: always.')


@dataclass(frozen=True)
class StreamParams(Parameters):
    """Images that the service node takes from a camera itself, besides those that clients send."""

    image_topic: str = parameter(
        '', 'Image topic of a camera. The newest image is processed as soon as the networks are free, without a client '
            'node. Empty: that of the camera.')
    camera: str = parameter('', CAMERA_DOC + ' Empty: only images that clients send.')
    camera_ns: str = parameter('', CAMERA_NS_DOC)
    rotate_image: int = parameter(0, ROTATE_DOC, unit='degrees', choices=(0, 90, 180, 270))


@dataclass(frozen=True)
class PublishingParams(Parameters):
    """What the service node does with its results besides answering and saving."""

    publish_results: bool = parameter(
        True, 'Publish keypoints and annotated images; false: only answer the service, whose clients publish.')


@dataclass(frozen=True)
class AnnotatedImageParams(Parameters):
    """How the annotated image is published."""

    jpeg_quality: int = parameter(
        80, 'Quality of the JPEG on detected_poses_image/compressed; 95 is hard to tell from the original, 50 is '
            'about half as large as 80.', minimum=1, maximum=100)


@dataclass(frozen=True)
class ServiceClientParams(Parameters):
    """How the node calls the detection service."""

    service_timeout: float = parameter(
        5.0, 'Drop a frame when the detection service has not answered for this long.', unit='s',
        minimum=0.1, maximum=600.0)


@dataclass(frozen=True)
class StreamingClientParams(Parameters):
    """What the client subscribes to and shows."""

    camera_topic: str = parameter('/usb_cam/image_raw', 'Image topic of the camera.')
    pose_model: str = parameter('auto', 'pose_model of the service; names the joints in the window.')
    display: bool = parameter(False, 'Show the annotated images in a window (needs a display).')


@dataclass(frozen=True)
class CameraParams(Parameters):
    """What the camera node publishes."""

    source: str = parameter('0', "Device number in quotes ('0'), video file, or folder of images.")
    rate: float = parameter(
        0.0, 'Frames per second; 0: that of the video file, 10 for a folder, as fast as it delivers for a webcam.',
        unit='Hz', minimum=0.0, maximum=1000.0)
    loop: bool = parameter(False, 'Begin again at the end of a file or folder.')
    width: int = parameter(0, 'Width to ask a webcam for; 0: its default.', unit='px', minimum=0)
    height: int = parameter(0, 'Height to ask a webcam for; 0: its default.', unit='px', minimum=0)
    frame_id: str = parameter('camera_optical_frame', 'frame_id of the published messages.')
    camera_info_file: str = parameter(
        '', 'Calibration as camera_calibration writes it (YAML); published as camera_info with every image.')
    start_delay: float = parameter(
        0.0, 'Wait this long for a subscriber before the first frame of a file or folder.', unit='s', minimum=0.0)


@dataclass(frozen=True)
class ServiceSettings:
    """All that the service node reads."""

    detector: LiveDetectorSettings
    tracking: TrackingParams
    following: FollowingParams
    landmarks: LandmarkParams
    draw: DrawParams
    keypoint_scale: KeypointScaleParams
    publishing: PublishingParams
    images: AnnotatedImageParams
    stream: StreamParams
    demand: DemandParams
    transport: ImageTransportParams
    limits: ImageLimitParams
    save: SaveParams


@dataclass(frozen=True)
class ClientSettings:
    """All that the streaming client reads."""

    client: StreamingClientParams
    service: ServiceClientParams
    transport: ImageTransportParams
    limits: ImageLimitParams
    draw: DrawParams


# What dynamic_reconfigure may change in the running service node.
LIVE_PARAMETERS: Tuple[str, ...] = ('mode', *(field.name for field in parameter_fields(
    DecodeParams, EnsembleParams, TrackingParams, LandmarkParams, DrawParams,
    AnnotatedImageParams)))

# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {
    'openpose_ros_node.yaml': ServiceSettings,
    'openpose_ros_node_firephinx.yaml': ClientSettings,
    'camera_node.yaml': CameraParams,
}
