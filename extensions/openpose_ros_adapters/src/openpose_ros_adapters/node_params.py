"""Which parameters the nodes of this package read."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class AdapterSettings:
    """All that an adapter without parameters of its own reads."""

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
    """All that the adapter to vision_msgs reads."""

    vision: VisionParams
    demand: DemandParams


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {'people_msgs_node.yaml': AdapterSettings, 'spencer_node.yaml': AdapterSettings,
                                      'vision_msgs_node.yaml': VisionSettings}
