"""Which parameters the nodes of this package read."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class BridgeSettings:
    """Parameters of a bridge that has none of its own."""

    demand: DemandParams


@dataclass(frozen=True)
class VisionParams(Parameters):
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
class VisionSettings:
    """Parameters of vision_msgs_node."""

    vision: VisionParams
    demand: DemandParams


@dataclass(frozen=True)
class HriParams(Parameters):
    """What is published of people, and how they are named."""

    id_prefix: str = parameter(
        'p', 'Bodies are named by this and the number of the person. Letters, digits and underscores, a letter first.')
    cameras: str = parameter(
        '', 'Namespaces of chains whose people are not fused, separated by spaces: a body of left is named left_p5. '
            'Empty: the chain in the namespace of the node.')
    persons: bool = parameter(
        False, 'Publish each body also as an anonymous person below /humans/persons, with its frame at the head. Where '
               'another node manages persons, leave that to it.')
    publish_tf: bool = parameter(
        True, 'Publish the frames body_ID, and those of the links of its robot model, on /tf. The node works then also '
              'while its topics have no subscribers.')
    image_width: int = parameter(0, 'Width of the images, where no camera info says it. 0: camera info does.',
                                 unit='px', minimum=0, maximum=100_000)
    image_height: int = parameter(0, 'Height of the images, where no camera info says it. 0: camera info does.',
                                  unit='px', minimum=0, maximum=100_000)
    signals: bool = parameter(
        True, 'Publish posture and gesture of each body, which people_signals_node tells; false: without them.')
    roi_margin: float = parameter(
        0.1, 'Regions are wider than the keypoints by this share of their longer side, on each side.', minimum=0.0,
        maximum=1.0)
    forget: float = parameter(
        2.0, 'The topics of a body end when it has not been tracked for this long, or when the input ends.', unit='s',
        minimum=0.0, maximum=3600.0)


@dataclass(frozen=True)
class HriSettings:
    """Parameters of hri_node."""

    hri: HriParams
    demand: DemandParams


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {'hri_node.yaml': HriSettings, 'jsk_node.yaml': BridgeSettings,
                                      'people_msgs_node.yaml': BridgeSettings, 'spencer_node.yaml': BridgeSettings,
                                      'vision_msgs_node.yaml': VisionSettings}
