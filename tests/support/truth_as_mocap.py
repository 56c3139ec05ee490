"""Write the true joints of a sequence folder as a motion capture system would have recorded them (.trc).

The sequence's gt.json holds the joints in the frame of the camera, image by image. The file has another rate, clock and
frame of reference, and noise if asked for. Each joint is one marker, called person1:left_knee and so on; between two
images it is interpolated (cubic), and missing while its person is out of the image.

    python3 tests/support/truth_as_mocap.py SEQUENCE mocap.trc --noise 1 --clock-offset 3.7 \\
        --rotate-degrees 90 0 30 --move 1 2 1.5
"""
import argparse
import json
import sys
from pathlib import Path
from typing import Optional, Sequence

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.mocap.files import MarkerRecording
from openpose_ros_tools.mocap.joints import JointRecording
from openpose_ros_tools.motion.trc import trc_text

# Samples that are this close to the ends of a person's stay belong to it [s].
_ROUNDING = 1e-6


def read_truth(folder: Path) -> JointRecording:
    """Return the true joints of a sequence folder, in the frame of its camera."""
    values = json.loads((folder / 'gt.json').read_text(encoding='utf-8'))
    frames, columns = values['frames'], [MESSAGE_JOINTS.index(joint) for joint in values['joints']]
    people = sorted({int(person['id']) for frame in frames for person in frame['people']})
    times = np.array([frame['t'] for frame in frames], np.float64)
    positions = np.full((len(people), len(frames), len(MESSAGE_JOINTS), 3), np.nan)
    for number, frame in enumerate(frames):
        for person in frame['people']:
            positions[people.index(int(person['id'])), number, columns] = person['xyz']
    return JointRecording(tuple(f'person{person}' for person in people), times, positions)


def resample(joints: JointRecording, rate: float, clock_offset: float = 0.0) -> JointRecording:
    """Return joints at another rate [Hz], by a clock that is ahead [s]; samples are whole multiples of 1 / rate.

    Each run of images that show a joint is interpolated for itself, by cubic splines; a single image does not count.
    """
    times = joints.times + clock_offset
    first, last = np.ceil((times[0] - _ROUNDING) * rate), np.floor((times[-1] + _ROUNDING) * rate)
    samples = np.arange(first, last + 1) / rate
    positions = np.full((len(joints.subjects), len(samples), len(MESSAGE_JOINTS), 3), np.nan)
    for subject, of_subject in enumerate(joints.positions):
        for joint in range(len(MESSAGE_JOINTS)):
            shown = np.flatnonzero(np.isfinite(of_subject[:, joint, 0]))
            for part in np.split(shown, np.flatnonzero(np.diff(shown) > 1) + 1):
                if len(part) > 1:
                    inside = (samples >= times[part[0]] - _ROUNDING) & (samples <= times[part[-1]] + _ROUNDING)
                    curve = CubicSpline(times[part], of_subject[part, joint])
                    positions[subject, inside, joint] = curve(samples[inside])
    return JointRecording(joints.subjects, samples, positions)


def as_markers(joints: JointRecording, turn: Rotation, move: Sequence[float], noise: float) -> MarkerRecording:
    """Return joints, but those that are never known, as markers: turned, then moved, with noise per axis [m]."""
    markers = {f'{subject}:{joint}': points for subject, of_subject in zip(joints.subjects, joints.positions)
               for joint, points in zip(MESSAGE_JOINTS, of_subject.transpose(1, 0, 2)) if np.isfinite(points).any()}
    positions = np.array(list(markers.values())).reshape(len(markers), len(joints.times), 3).transpose(1, 0, 2)
    positions = positions @ turn.apply(np.eye(3)) + np.array(move)
    noisy = positions + noise * np.random.default_rng(0).standard_normal(positions.shape)
    return MarkerRecording(tuple(markers), joints.times, noisy)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sequence', type=Path, help='folder with a gt.json')
    parser.add_argument('output', type=Path, help='TRC file to write')
    parser.add_argument('--rate', type=float, default=120.0, help='samples per second [Hz] (default: 120)')
    parser.add_argument('--noise', type=float, default=0.0, help='standard deviation per axis [mm] (default: 0)')
    parser.add_argument('--clock-offset', type=float, default=0.0, metavar='S',
                        help='what the clock of the markers shows at time 0 of gt.json [s] (default: 0)')
    parser.add_argument('--rotate-degrees', type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=('RX', 'RY', 'RZ'),
                        help='turn about the x, then the y, then the z axis [deg] (default: none)')
    parser.add_argument('--move', type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=('X', 'Y', 'Z'),
                        help='then move [m] (default: none)')
    options = parser.parse_args(arguments)
    joints = resample(read_truth(options.sequence), options.rate, options.clock_offset)
    turn = Rotation.from_euler('xyz', options.rotate_degrees, degrees=True)
    markers = as_markers(joints, turn, options.move, options.noise / 1000)
    options.output.write_text(trc_text(markers, options.output.name))
    return 0


if __name__ == '__main__':
    sys.exit(main())
