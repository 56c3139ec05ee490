"""The original's console report of a frame, as text."""
from typing import List

from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.lifting import PointGrid
from skeleton_extract_3d.people import People3D


def frame_report(people_2d: People2D, people: People3D, points: PointGrid) -> str:
    """Return the number of people, the range of the cloud, and of each joint its pixel and position.

    Args:
        people_2d: keypoints [px of the image].
        people: the same people in the same order [m].
        points: cloud or depth image they were lifted with; read as a whole.
    """
    low, high = points.valid_range()
    ranges = ', '.join(f'{axis} {lo:.3f} .. {hi:.3f}' for axis, lo, hi in zip('xyz', low, high))
    lines = [f'Detected {len(people)} person{"s" * (len(people) != 1)}', f'Cloud [m]: {ranges}']
    for person in range(len(people)):
        lines += [f'Person {people.ids[person]}', *_joint_lines(people_2d, people, person)]
    return '\n'.join(lines)


def _joint_lines(people_2d: People2D, people: People3D, person: int) -> List[str]:
    lines = []
    for i, joint in enumerate(people.skeleton.joints):
        name = joint.replace('_', ' ').capitalize()
        if people_2d.present[person, i]:
            (u, v), (x, y, z) = people_2d.xy[person, i], people.xyz[person, i]
            lines.append(f'  {name}: pixel ({u:.1f}, {v:.1f}), world ({x:.4f}, {y:.4f}, {z:.4f}) m, '
                         f'confidence {people.confidence[person, i]:.2f}')
        else:
            lines.append(f'  {name}: not detected')
    return lines
