"""Which parameters each node of this package reads, and those that only nodes have."""
from dataclasses import dataclass
from typing import Any, Dict, Tuple, Type

from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.output.draw import DrawParams
from openpose_ros_pkg.params.nodes import (
    CAMERA_DOC,
    CAMERA_NS_DOC,
    ROTATE_DOC,
    AnnotatedImageParams,
    DemandParams,
    ImageTransportParams,
    ServiceClientParams,
    ServiceSettings,
)
from openpose_ros_pkg.params.parameters import Parameters, parameter, parameter_fields
from openpose_ros_pkg.stream.image_decoding import ImageLimitParams
from openpose_ros_pkg.stream.pairing import PairingParams
from skeleton_extract_3d.points.rgbd_sequence import PLAYBACKS
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.show.markers import MarkerParams


@dataclass(frozen=True)
class ExtractorParams(Parameters):
    """Input and frames of the extractor."""

    retired = ('tf_timeout',)

    camera: str = parameter('kinect2', CAMERA_DOC + ' Empty: ~image, ~point_cloud, ~depth_image and ~camera_info.')
    camera_ns: str = parameter('', CAMERA_NS_DOC)
    rotate_image: int = parameter(0, ROTATE_DOC, unit='degrees', choices=(0, 90, 180, 270))
    points_source: str = parameter(
        'auto', 'point_cloud: organized cloud on ~point_cloud; depth_image: aligned depth on ~depth_image with '
                '~camera_info; none: a camera without depth, people are placed by the image and ~camera_info alone; '
                'auto: as the camera says, point_cloud without one.',
        choices=('auto', 'point_cloud', 'depth_image', 'none'))
    depth_transport: str = parameter(
        'auto', "With depth_image: 'compressedDepth' or 'compressed' subscribes to <depth topic>/compressedDepth or "
                'compressed, as image_transport publishes them as PNG; auto: as the camera says, raw without one.',
        choices=('auto', 'raw', 'compressed', 'compressedDepth'))
    rectified: str = parameter(
        'auto', 'With depth_image and none: true: the images are rectified, so use P of the camera info and no '
                'distortion; auto: as the camera says, false without one.', choices=('auto', 'true', 'false'))
    pose_model: str = parameter(
        'auto', 'pose_model of the detection service; names the joints. COCO: without toes and heels.')
    target_frame: str = parameter('', 'Frame of the published joints; empty: the frame of the cloud.')
    tracking_frame: str = parameter(
        '', 'Frame in which the room stands still (odom, map) while the camera moves: people are followed there; '
            'empty: the camera stands still. What is published, and where, does not depend on it.')
    use_floor: bool = parameter(
        False, 'Subscribe to the plane of the floor on ~floor (pcl_msgs/ModelCoefficients in the frame of the cloud, '
               'as the node floor publishes it): hidden feet of standing people are on it, and no inferred foot '
               'lies below it. Without a plane of the last 2 s, as if false. With points_source none and a '
               'tracking_frame its z = 0 is the floor; feet on it tell how large and how far people are.')
    publish_tf: bool = parameter(
        False, 'Publish each joint that is measured or inferred as a frame person_<person_ID>/<joint> on /tf: parent '
               'is the frame of the published joints, x points along the limb to the next joint, the stamp is that of '
               'the cloud. For one extractor in a system, as another one uses the same ids.')
    publish_2d: bool = parameter(
        False, 'Publish also the people in the image, with the ids that the same people have in space: '
               'detected_poses, detected_poses_keypoints (always in pixels of the image) and detected_poses_image, '
               'with hollow circles and thin, dashed limbs where a joint is hidden. Set publish_results of the '
               "detection service to false where that one has the same topics.")
    verbose: bool = parameter(
        False, "Print the original's report, at most once a second: people, range of the cloud, each joint.")


@dataclass(frozen=True)
class PlayerParams(Parameters):
    """Output of the RGB-D player."""

    folder: str = parameter('', 'RGB-D folder, as images_to_bag --help describes it; empty: the shipped sequence.')
    rate: float = parameter(0.0, 'Frames per second; 0: as sequence.yaml says, else 15.', unit='Hz',
                            minimum=0.0, maximum=1000.0)
    playback: str = parameter(
        'loop', "What comes after the last frame. 'loop': the first frame, so that people jump; 'pause': 1.5 s of "
                "black images without depth, as of a covered camera, then the first frame; 'forth_and_back': the "
                "sequence backwards, so that they move without a jump; 'once': the node ends. Stamps always increase.",
        choices=PLAYBACKS)
    frame_id: str = parameter('', 'frame_id of the messages; empty: as sequence.yaml says, else camera_optical_frame.')
    wait_for_subscribers: float = parameter(
        0.0, 'Before the first frame, wait up to this long for subscribers of image and points.', unit='s', minimum=0.0)


@dataclass(frozen=True)
class ExtractorSettings:
    """All that the extractor reads."""

    extractor: ExtractorParams
    estimator: EstimatorSettings
    landmarks: LandmarkParams
    pairing: PairingParams
    demand: DemandParams
    service: ServiceClientParams
    transport: ImageTransportParams
    limits: ImageLimitParams
    draw: DrawParams
    images: AnnotatedImageParams

    @property
    def is_lazy(self) -> bool:
        """Whether it rests without subscribers to its results."""
        return self.demand.lazy and not (self.extractor.publish_tf or self.extractor.verbose)


@dataclass(frozen=True)
class CameraParams(Parameters):
    """Cameras of one process."""

    cameras: str = parameter(
        '', 'Namespaces of the cameras, separated by spaces: the topics of each are in its namespace, as those of a '
            'node there would be. Empty: one camera.')

    @property
    def names(self) -> Tuple[str, ...]:
        """The namespaces; an empty one where there is one camera."""
        return tuple(self.cameras.split()) or ('',)


@dataclass(frozen=True)
class PeopleSettings:
    """All that detection service and extractors read in one process; what both read has one value."""

    cameras: CameraParams
    detection: ServiceSettings
    extraction: ExtractorSettings


@dataclass(frozen=True)
class VisualizationSettings:
    """All that the visualization reads."""

    markers: MarkerParams
    demand: DemandParams


# What dynamic_reconfigure may change in the running extractor.
LIVE_PARAMETERS: Tuple[str, ...] = tuple(field.name for field in parameter_fields(
    EstimatorSettings, LandmarkParams, DrawParams, AnnotatedImageParams))

# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {
    'skeleton_extract_3d_node.yaml': ExtractorSettings,
    'skeleton_extract_3d_visualization_node.yaml': VisualizationSettings,
    'rgbd_player_node.yaml': PlayerParams,
}
