"""RViz markers of hands and faces: lines for fingers and contours, and an arrow for the direction of each head."""
from typing import List, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.skeletons import FACE_70, HAND_21, SkeletonModel
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.show.markers import Markers, MarkerSpec, limb_lines, marker_colour

# Length of the dashes of fingers and contours [m], which are shorter than limbs.
_DASH = 0.006
# The width of the arrow's shaft as a share of its length.
_ARROW_WIDTH = 0.06


class LandmarkMarkers(Markers):
    """Makes the markers of hands, or of faces."""

    def hands(self, hands: Hands3D, stamp: float) -> List[MarkerSpec]:
        """Return what to publish for the hands of a frame with this stamp [s]; id is 2 x the person's + 1 if left."""
        owners = zip(hands.people.tolist(), hands.left.astype(int).tolist())
        return self._replaced([marker for row, owner in enumerate(owners)
                               for marker in self._lines('hand', HAND_21, hands.points, row, owner)], stamp)

    def faces(self, faces: Faces3D, stamp: float) -> List[MarkerSpec]:
        """Return what to publish for the faces of a frame with this stamp [s]; id is that of the person."""
        return self._replaced([marker for row, person in enumerate(faces.people.tolist())
                               for marker in [*self._lines('face', FACE_70, faces.points, row, (person, -1)),
                                              self._arrow(faces, row)]], stamp)

    def _lines(self, ns: str, skeleton: SkeletonModel, points: Points3D, row: int, owner: Tuple[int, int]
               ) -> List[MarkerSpec]:
        """Return solid and dashed lines; `owner`: id of the person; 1: left hand, 0: right hand, -1: face."""
        person, left = owner
        measured, inferred = limb_lines(skeleton, points.xyz[row], points.status[row],
                                        min(self._params.dash_length, _DASH))
        return [MarkerSpec(f'{ns}{kind}', person if left < 0 else 2 * person + left, 'add', 'line_list', places,
                           self._params.hand_scale, marker_colour(self._params, f'skeleton{kind}_colour', person))
                for kind, places in (('', measured), ('_inferred', inferred))]

    def _arrow(self, faces: Faces3D, row: int) -> MarkerSpec:
        """Return the direction of a head, from the middle of the face; without points where it is not known."""
        person, known = int(faces.people[row]), faces.points.status[row] != MISSING
        length, turn = self._params.head_arrow, faces.orientations[row]
        place = np.zeros((0, 3), np.float32)
        # in messages of other nodes an unset orientation is zero
        if length > 0 and known.any() and np.isfinite(turn).all() and turn.any():
            start = faces.points.xyz[row][known].mean(axis=0)
            place = np.stack([start, start + length * Rotation.from_quat(turn).apply((1, 0, 0))]).astype(np.float32)
        return MarkerSpec('head_direction', person, 'add', 'arrow', place, _ARROW_WIDTH * length,
                          marker_colour(self._params, 'skeleton_colour', person))
