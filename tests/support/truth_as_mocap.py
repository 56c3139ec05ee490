"""Write the true joints of a sequence folder as a motion capture system would have recorded them; without a ROS master.

The sequence's gt.json holds the joints in the frame of the camera, image by image. Out of them comes a file of
another rate, clock and frame of reference, with noise if asked for: what evaluate_mocap gets from a laboratory. Each
joint is one marker, called person1:left_knee and so on; between two images it is interpolated (cubic), and nothing
is written while its person is out of the image. The suffix says which format: .csv as OptiTrack Motive exports it,
.trc, or .c3d.

    DEMO=$(rospack find skeleton_extract_3d)/demo/cross
    python3 tests/support/truth_as_mocap.py $DEMO cross_mocap.csv
    python3 tests/support/truth_as_mocap.py $DEMO cross_mocap.trc --rate 100 --noise 2 --clock-offset 12.345 \\
        --rotate-degrees 90 0 30 --move 1 2 0.5

Exit status: 0 done; 2 nothing was done, as the command line or an input is wrong; 130 interrupted.
"""
import argparse
import sys
from pathlib import Path
from typing import Optional, Sequence

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import check_outputs
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_pkg.structured_text import json_value
from openpose_ros_tools.command_options import command_parser
from openpose_ros_tools.mocap.files import SUFFIXES, MarkerRecording, write_mocap
from openpose_ros_tools.mocap.joints import JointRecording

# Samples that are this close to the ends of a person's stay belong to it [s].
_ROUNDING = 1e-6


def read_truth(folder: Path) -> JointRecording:
    """Return the true joints of a sequence folder, in the frame of its camera.

    Raises:
        BadInputError: there is no gt.json, or it is not as expected.
    """
    path = folder / 'gt.json'
    try:
        values = json_value(path.read_text(encoding='utf-8'))
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path} can not be read: {getattr(error, 'strerror', None) or error}") from error
    try:
        joints, frames = list(values['joints']), list(values['frames'])
        columns = [MESSAGE_JOINTS.index(joint) for joint in joints]
        people = sorted({int(person['id']) for frame in frames for person in frame['people']})
        times = np.array([frame['t'] for frame in frames], np.float64)
        positions = np.full((len(people), len(frames), len(MESSAGE_JOINTS), 3), np.nan)
        for number, frame in enumerate(frames):
            for person in frame['people']:
                positions[people.index(int(person['id'])), number, columns] = person['xyz']
        return JointRecording(tuple(f'person{person}' for person in people), times, positions)
    except (KeyError, OverflowError, TypeError, ValueError) as error:
        raise BadInputError(f'{path}: expected joints (nose, neck, ...) and frames of t [s] and people of id and xyz '
                            f'[m]: {error!r}') from error


def resample(joints: JointRecording, rate: float, clock_offset: float = 0.0) -> JointRecording:
    """Return joints at another rate, by a clock that is ahead by an offset; samples are whole multiples of 1 / rate.

    Each run of images that show a joint is interpolated for itself, by cubic splines; a joint that only one
    image shows is missing.

    Args:
        rate: samples per second [Hz].
        clock_offset: time of the new clock when that of the joints is 0 [s].

    Raises:
        BadInputError: no multiple falls into the recording.
    """
    times = joints.times + clock_offset
    first, last = np.ceil((times[0] - _ROUNDING) * rate), np.floor((times[-1] + _ROUNDING) * rate)
    samples = np.arange(first, last + 1) / rate
    if not len(samples):
        raise BadInputError(f'{times[-1] - times[0]:g} s hold no sample at {rate:g} Hz')
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


def as_markers(joints: JointRecording, transform: np.ndarray, noise: float = 0.0, seed: int = 0) -> MarkerRecording:
    """Return joints as markers in another frame of reference; joints that are never there are left out.

    Args:
        transform: (4, 4) from the frame of the joints to that of the markers [m].
        noise: standard deviation per axis and sample [m].
        seed: of the noise.
    """
    markers = {f'{subject}:{joint}': points for subject, of_subject in zip(joints.subjects, joints.positions)
               for joint, points in zip(MESSAGE_JOINTS, of_subject.transpose(1, 0, 2)) if np.isfinite(points).any()}
    positions = np.array(list(markers.values())).reshape(len(markers), len(joints.times), 3).transpose(1, 0, 2)
    positions = positions @ transform[:3, :3].T + transform[:3, 3]
    noisy = positions + noise * np.random.default_rng(seed).standard_normal(positions.shape)
    return MarkerRecording(tuple(markers), joints.times, noisy)


def rigid_transform(degrees: Sequence[float], move: Sequence[float]) -> np.ndarray:
    """Return the (4, 4) transform that turns about x, then y, then z of the new frame [deg], then moves [m]."""
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_euler('xyz', degrees, degrees=True).apply(np.eye(3)).T
    transform[:3, 3] = move
    return transform


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status."""
    options = _parser().parse_args(arguments)
    return run_command('truth_as_mocap', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    out = options.output.expanduser()
    if not np.isfinite(options.rate) or options.rate <= 0:
        raise ParameterError(f'--rate {options.rate:g}: expected a number above 0 [Hz]')
    if not np.isfinite(options.noise) or options.noise < 0:
        raise ParameterError(f'--noise {options.noise:g}: expected a number of 0 or more [mm]')
    if not np.isfinite([options.clock_offset, *options.rotate_degrees, *options.move]).all():
        raise ParameterError('--clock-offset, --rotate-degrees, --move: expected finite numbers')
    if out.suffix.lower() not in SUFFIXES:
        raise ParameterError(f"{out}: the suffix says which format to write, expected one of {', '.join(SUFFIXES)}")
    check_outputs([out], options.overwrite)
    truth = read_truth(options.sequence.expanduser())
    transform = rigid_transform(options.rotate_degrees, options.move)
    recording = as_markers(resample(truth, options.rate, options.clock_offset), transform, options.noise / 1000,
                           options.seed)
    if not recording.names:
        raise BadInputError(f'{options.sequence}: gt.json shows nobody in two images in a row')
    write_mocap(out, recording)
    sys.stdout.write(_summary(out, recording, options, transform))
    return DONE


def _summary(out: Path, recording: MarkerRecording, options: argparse.Namespace, transform: np.ndarray) -> str:
    people = sorted({name.partition(':')[0] for name in recording.names})
    rows = '\n'.join('  ' + ' '.join(f'{value:9.5f}' for value in row) for row in np.round(transform, 9) + 0.0)
    return (f"{out}: {len(recording)} samples at {options.rate:g} Hz, {len(recording.names)} markers of "
            f"{', '.join(people)}\n"
            f'clock of the markers = time in gt.json {options.clock_offset:+g} s\n'
            f'position of the markers = transform * position in the camera [m], transform =\n{rows}\n')


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('truth_as_mocap', __doc__)
    parser.add_argument('sequence', type=Path, metavar='SEQUENCE', help='folder with a gt.json')
    parser.add_argument('output', type=Path, metavar='OUTPUT', help=f"file to write: {', '.join(SUFFIXES)}")
    parser.add_argument('--rate', type=float, default=120.0, metavar='HZ', help='samples per second (default: 120)')
    parser.add_argument('--noise', type=float, default=0.0, metavar='MM',
                        help='standard deviation of each coordinate [mm] (default: 0)')
    parser.add_argument('--seed', type=int, default=0, help='of the noise (default: 0)')
    parser.add_argument('--clock-offset', type=float, default=0.0, metavar='S',
                        help='what the clock of the markers shows at time 0 of gt.json [s] (default: 0)')
    parser.add_argument('--rotate-degrees', type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=('RX', 'RY', 'RZ'),
                        help='turn about the x, then the y, then the z axis [deg] (default: none)')
    parser.add_argument('--move', type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=('X', 'Y', 'Z'),
                        help='then move [m] (default: none)')
    parser.add_argument('--overwrite', action='store_true', help='replace the file if it is there')
    return parser


if __name__ == '__main__':
    sys.exit(main())
