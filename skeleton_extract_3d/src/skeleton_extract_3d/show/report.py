"""The original's console report of a frame, as text."""
from typing import List

from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.point_grid import PointGrid

_STATUS = {MISSING: 'missing', MEASURED: 'measured', INFERRED: 'inferred'}


def frame_report(people_2d: People2D, people: People3D, points: PointGrid) -> str:
    """Return the number of people, the range of the cloud, and of each joint its pixel, position and status.

    Args:
        people_2d: the first of `people` in the image [px]; the others are hidden.
    """
    low, high = points.valid_range()
    ranges = ', '.join(f'{axis} {lo:.3f} .. {hi:.3f}' for axis, lo, hi in zip('xyz', low, high))
    seen, hidden = len(people_2d), len(people) - len(people_2d)
    lines = [f'Detected {seen} person{"s" * (seen != 1)}' + f', {hidden} hidden' * (hidden > 0),
             f'Cloud [m]: {ranges}']
    for person in range(len(people)):
        lines.append(f'Person {people.ids[person]}' + ', hidden' * (person >= seen))
        lines += _joint_lines(people_2d, people, person)
    return '\n'.join(lines)


def _joint_lines(people_2d: People2D, people: People3D, person: int) -> List[str]:
    lines = []
    for i, joint in enumerate(people.skeleton.joints):
        name = joint.replace('_', ' ').capitalize()
        x, y, z = people.xyz[person, i]
        world, status = f'world ({x:.4f}, {y:.4f}, {z:.4f}) m', people.status[person, i]
        if person < len(people_2d) and people_2d.present[person, i]:
            u, v = people_2d.xy[person, i]
            lines.append(f'  {name}: pixel ({u:.1f}, {v:.1f}), {world}, '
                         f'confidence {people.confidence[person, i]:.2f}, {_STATUS[status]}')
        elif status == MISSING:
            lines.append(f'  {name}: not detected')
        else:
            lines.append(f'  {name}: not detected, {world}, {_STATUS[status]}')
    return lines
