"""Messages with the people of a camera, as sightings."""
from typing import Any, Optional

import numpy as np

from openpose_ros_fusion.observations import Sighting, from_image, from_space
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros import convert as convert_2d
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.ros import convert

# More people of a camera, or people further away [m], are an error of the sender.
_MOST_PEOPLE, _FARTHEST = 200, 1000.0


def sighting_from_message(camera: str, stamp: float, message: Any, pose: Transform, model: Optional[CameraModel]
                          ) -> Sighting:
    """Return the people of a camera in the fixed frame, of a running one or of a recording.

    Args:
        stamp: by the common clock [s].
        message: PersonDetection_3dArray; of a camera without depth PersonDetectionArray, and `model` is given.
        pose: from the frame of the message to the fixed one.

    Raises:
        BadInputError: the message can not be used.
    """
    if len(message.persons) > _MOST_PEOPLE:
        raise BadInputError(f'{camera}: {len(message.persons)} people at a time, expected {_MOST_PEOPLE} at most')
    if model is not None:
        return from_image(camera, stamp, convert_2d.people_from_array(message), model, pose)
    people = convert.people_from_array(message)
    away = float(np.max(np.nan_to_num(np.abs(people.xyz)), initial=0.0))
    if away > _FARTHEST:
        raise BadInputError(f'{camera}: a joint is {away:g} m away, expected {_FARTHEST:g} m at most')
    return from_space(camera, stamp, people, pose)
