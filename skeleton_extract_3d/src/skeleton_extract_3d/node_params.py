"""Which parameters each node of this package reads, and those that only nodes have."""
from dataclasses import dataclass
from typing import Dict, Tuple, Type

from openpose_ros_pkg.node_params import ImageTransportParams, ServiceClientParams
from openpose_ros_pkg.pairing import PairingParams
from openpose_ros_pkg.params import Parameters, parameter
from skeleton_extract_3d.lifting import LiftingParams
from skeleton_extract_3d.markers import MarkerParams


@dataclass(frozen=True)
class ExtractorParams(Parameters):
    """What the extractor reads and in which frame it answers."""

    points_source: str = parameter(
        'point_cloud', 'point_cloud: organized cloud on ~point_cloud; depth_image: aligned depth on ~depth_image with '
                       '~camera_info.', choices=('point_cloud', 'depth_image'))
    rectified: bool = parameter(
        False, 'With depth_image: the images are rectified, so use P of the camera info and no distortion.')
    pose_model: str = parameter('auto', 'pose_model of the detection service; names the joints.')
    target_frame: str = parameter('', 'Frame of the published joints; empty: the frame of the cloud.')
    tf_timeout: float = parameter(
        0.1, 'Wait this long for the transform to target_frame at the stamp of the cloud.', unit='s',
        minimum=0.0, maximum=10.0)
    verbose: bool = parameter(False, "Print the original's report: people, range of the cloud, each joint.")
    verbose_period: float = parameter(1.0, 'Least time between two reports.', unit='s', minimum=0.0)


@dataclass(frozen=True)
class PlayerParams(Parameters):
    """What the RGB-D player publishes."""

    folder: str = parameter('', 'Sequence folder: rgb/ or color/, depth/, camera.yaml; empty: the shipped sequence.')
    rate: float = parameter(0.0, 'Frames per second; 0: as sequence.yaml says, else 15.', unit='Hz',
                            minimum=0.0, maximum=1000.0)
    loop: bool = parameter(True, 'Begin again at the end; stamps go on.')
    frame_id: str = parameter('', 'frame_id of the messages; empty: as sequence.yaml says, else camera_optical_frame.')
    keep_frames: int = parameter(
        40, 'Finished messages of this many frames stay in memory (19 MB each at 960 x 540), so that playing them '
            'again costs the processor no more than sending.', minimum=0, maximum=10000)
    wait_for_subscribers: float = parameter(
        0.0, 'Before the first frame, wait up to this long for subscribers of image and points.', unit='s', minimum=0.0)


EXTRACTOR_PARAMETERS = (ExtractorParams, LiftingParams, PairingParams, ServiceClientParams, ImageTransportParams)
VISUALIZATION_PARAMETERS = (MarkerParams,)
PLAYER_PARAMETERS = (PlayerParams,)

# Parameter classes of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Tuple[Type[Parameters], ...]] = {
    'skeleton_extract_3d_node.yaml': EXTRACTOR_PARAMETERS,
    'skeleton_extract_3d_visualization_node.yaml': VISUALIZATION_PARAMETERS,
    'rgbd_player_node.yaml': PLAYER_PARAMETERS,
}
