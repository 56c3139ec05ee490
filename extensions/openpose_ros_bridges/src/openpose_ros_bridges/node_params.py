"""Which parameters the nodes of this package read."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import parameter


@dataclass(frozen=True)
class VisionParams(DemandParams):
    """How people become detections."""

    class_id: int = parameter(
        1, 'Number of the class person, the id of each detection: 1 in COCO, 0 where classes are counted from 0, as in '
           'YOLO.', minimum=0, maximum=1_000_000)
    margin_2d: float = parameter(
        0.1, 'Boxes in images are wider than the keypoints by this share of their longer side, on each side: keypoints '
             'lie inside of the body.', minimum=0.0, maximum=1.0)
    margin_3d: float = parameter(0.12, 'Boxes in space are wider than the joints by this, on each side.', unit='m',
                                 minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class HriParams(DemandParams):
    """What is published of people, and how they are named."""

    retired = ('id_prefix', 'image_width', 'image_height', 'signals', 'roi_margin', 'forget', 'cameras')

    persons: bool = parameter(
        False, 'Publish each body also as an anonymous person below /humans/persons, with its frame at the head. Where '
               'another node manages persons, leave that to it.')
    publish_tf: bool = parameter(
        True, 'Publish the frames body_ID, and those of the links of its robot model, on /tf. The node works then also '
              'while its topics have no subscribers.')


@dataclass(frozen=True)
class SeparationParams(DemandParams):
    """Separation of people from links of the robot."""

    retired = ('rate', 'feet', 'data_timeout', 'tf_timeout', 'guard_margin')

    robot_links: str = parameter(
        '', 'Links of the robot, one at least, separated by spaces: FRAME:RADIUS is a ball round the origin of a frame '
            'of tf, FRAME>FRAME:RADIUS a capsule from one to another, such as elbow_link>wrist_link:0.1.')
    probability: float = parameter(
        0.99, 'The bound is less than the distance with this probability.', minimum=0.5, maximum=0.9999)
    fixed_frame: str = parameter(
        '', 'Frame in which the room stands still, for a camera that moves. Empty: the frame of the people.')
    room_velocities: bool = parameter(
        False, 'Velocities of people are those in the room: the extractor has tracking_frame, or the camera stands '
               'still. false: with fixed_frame, they are not used.')
    lost_timeout: float = parameter(
        3.0, 'A lost track may be anywhere within walking distance for this long.', unit='s', minimum=0.0,
        maximum=60.0)
    link_speed: float = parameter(
        1.0, 'Links move at most this fast: the bound is less by that, times the age of the transform.', unit='m/s',
        minimum=0.0, maximum=20.0)
    guard: bool = parameter(
        False, 'People may come from where the camera does not look: outside of the image, beyond guard_range, and '
               'behind people. Places that furniture or the robot hide count as seen.')
    guard_range: float = parameter(5.0, 'Depth up to which people are found.', unit='m', minimum=0.1, maximum=100.0)


@dataclass(frozen=True)
class MoveitParams(DemandParams):
    """How people become objects of the planning scene."""

    retired = ('tf_timeout', 'prefix', 'robot_padding', 'max_rate')

    planning_frame: str = parameter(
        '', "Publish people in this frame, which MoveIt has to know, such as world; empty: in the people's own, where "
            'that is a link of the robot.')
    sigmas: float = parameter(1.0, 'The radius of a part grows by this multiple of the sigma of its joints.',
                              minimum=0.0, maximum=5.0)
    robot_links: str = parameter(
        '', "The robot's own links, separated by spaces: FRAME:RADIUS is a ball round the origin of a frame of tf, "
            'FRAME>FRAME:RADIUS a capsule from one to another, such as elbow_link>wrist_link:0.1. Parts of people '
            'within them are left out: they are the robot, taken for a person.')


@dataclass(frozen=True)
class ObstacleParams(DemandParams):
    """How people become obstacles on the floor."""

    retired = ('tf_timeout', 'step', 'spacing', 'height', 'footprint_range', 'max_rate', 'footprint')

    planning_frame: str = parameter(
        'odom', 'Frame of the obstacles of teb_local_planner, with z upwards: the global_frame of its costmap, as it '
                'does not turn velocities.')
    robot_frame: str = parameter('base_link', 'Frame of the footprints of costmap_2d, with z upwards and its origin in '
                                              'the middle of the robot.')
    sigmas: float = parameter(1.0, 'Radii grow by this multiple of the sigma of the joints and, of predicted '
                                   'footprints, of the velocity.', minimum=0.0, maximum=5.0)
    horizon: float = parameter(2.0, 'Prediction horizon of people that walk.', unit='s', minimum=0.0, maximum=10.0)
    robot_radius: float = parameter(0.5, 'Points nearer to the origin of robot_frame are left out: people that walk '
                                         'towards the robot would else put an obstacle into it.', unit='m', minimum=0.0,
                                    maximum=10.0)


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {
    **{f'{bridge}_node.yaml': DemandParams for bridge in ('jsk', 'people_msgs', 'spencer')},
    'hri_node.yaml': HriParams, 'moveit_node.yaml': MoveitParams, 'obstacles_node.yaml': ObstacleParams,
    'separation_node.yaml': SeparationParams, 'vision_msgs_node.yaml': VisionParams}
