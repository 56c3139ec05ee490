"""Against motion capture, in the form of validation studies.

The chain runs on rendered scenes. Their true joints, in the world's frame, take the place of motion capture, and the
figures are those of `evaluate_mocap`, with clocks and camera poses given: nothing is fitted.
"""
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np

import chain_runs
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.alignment.alignment import AlignmentParams, align
from openpose_ros_tools.mocap.evaluation import compare
from openpose_ros_tools.mocap.joints import JointRecording
from openpose_ros_tools.mocap.study import ANGLES, AXES, REGIONS, anatomical_axes, trajectories
from openpose_ros_tools.tables.keypoint_table import PersonRow, table_of
from results import Options, Section, Table
from results.counting import count, people_of
from scoring.counts import Counts, tags_of
from scoring.figures import Ratio, figures
from simulated_mocap import sequence_truth

KINDS = ('visible', 'all')
# Parts of a figure's name; an angle has one axis.
PARTS = [(part, axis) for part in REGIONS for axis in AXES] + [(part, 'angle') for part in ANGLES]
# Figures of a part, by the sums they are made of.
MEANS = {'rmse': ('square', 'samples'), 'centred': ('variance', 'samples'), 'r': ('r', 'correlations'),
         'motion': ('motion', 'paths')}
TITLES = {'rmse': 'RMSE', 'centred': 'without offset', 'r': 'r', 'motion': 'motion'}
TEXT = '''The chain on {scenes} rendered scenes, with clocks and camera poses known; joints that the camera sees, as in
studies of one person in full view, and all joints, hidden ones included. RMSE of time-aligned trajectories [mm] and of
angles [degrees]; without offset: the mean difference of each person's joint is removed; r: Pearson's, the mean over
persons and joints; motion: the mean standard deviation of the true trajectories. Vertical is the world's,
antero-posterior along the camera's view, medio-lateral across it. Angles are between the two segments that meet in the
joint.

In the same form, of real people: Azure Kinect against Qualisys 20-89 mm by axis, region and task (Bertram et al., PLoS
ONE 2023), two Azure Kinects against Vicon in gait knee 11.9 and hip 15.1 degrees (Ma et al., APSIPA 2020). The true
joints of rendered people are those of the body mesh: what differs between a laboratory's definition of a joint and
that of a network is in these figures only as far as it differs from the mesh.'''


@dataclass(frozen=True)
class Root(Ratio):
    """The root of a ratio."""

    def values(self, counts: Sequence[Counts], weights: np.ndarray) -> np.ndarray:
        return np.sqrt(super().values(counts, weights))


def measure(options: Options) -> Section:
    """Run the chain on the scenes and compare it with the truth."""
    found_in = count(options, {'mode': 'balanced'})
    counts = [score_trajectories(folder, people_of(each, sequence_truth(folder).joints.times))
              for folder, each in zip(options.scenes, found_in)]
    found = figures(counts, statistics())
    columns = [*(('visible', figure) for figure in TITLES), ('all', 'rmse')]
    rows = [['region or angle', 'axis', *(f'{TITLES[figure]}, {kind}' for kind, figure in columns)]]
    rows += [[part, axis, *(found[name_of(part, axis, *column)] for column in columns)] for part, axis in PARTS]
    for kind in KINDS:  # over regions and axes
        for figure in ('rmse', 'centred'):
            each = [found[name_of(*part, kind, figure)] for part in PARTS if part[0] in REGIONS]
            each = sorted((one for one in each if one.value is not None), key=lambda one: one.value)
            found.update({f'{kind}_{figure}_least': each[0], f'{kind}_{figure}_greatest': each[-1]} if each else {})
    return Section(TEXT.format(scenes=len(counts)), found, [Table('', rows)])


def score_trajectories(folder: Path, frames: chain_runs.Frames) -> Counts:
    """Return the sums of a scene's trajectories by part, axis and kind of joint."""
    truth, poses = sequence_truth(folder), chain_runs.camera_poses(folder, chain_runs.open_sequence(folder))
    table = table_of(in_world(frames, poses), 3)
    joints = truth.joints.positions @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
    sums: Dict[str, float] = {}
    for kind, shown in zip(KINDS, (truth.visible, np.ones_like(truth.visible))):
        reference = JointRecording(truth.joints.subjects, truth.joints.times,
                                   np.where(shown[..., None], joints, np.nan))
        try:
            known = align(table.measured(), reference, AlignmentParams(-chain_runs.BEGIN, np.eye(4)))
            comparison = compare(table, reference, known)
        except BadInputError:  # no person is found in this scene
            continue
        for row in trajectories(comparison, anatomical_axes(comparison, poses[0, :3, :3])).itertuples():
            scale, known_r = 1.0 if row.axis == 'angle' else 1e3, np.isfinite(row.r)
            for name, value in (('samples', row.samples), ('square', row.samples * scale ** 2 * row.square),
                                ('variance', row.samples * scale ** 2 * row.variance), ('paths', 1),
                                ('motion', scale * row.motion), ('correlations', known_r),
                                ('r', row.r if known_r else 0)):
                key = name_of(row.part, row.axis, kind, name)
                sums[key] = sums.get(key, 0.0) + float(value)
    return Counts(folder.name, tags_of(folder), sums, {})


def in_world(frames: chain_runs.Frames, poses: np.ndarray) -> List[PersonRow]:
    """Return the people of all frames in the world's frame, by the camera's poses (F, 4, 4)."""
    rows = []
    for number, ((seconds, people), pose) in enumerate(zip(frames, poses)):
        stamp = round((chain_runs.BEGIN + seconds) * 1e9)
        places = [MESSAGE_JOINTS.index(joint) for joint in people.skeleton.joints]
        for row in range(len(people)):
            parts = np.full((len(MESSAGE_JOINTS), 6), (np.nan, np.nan, np.nan, 0, 0, np.nan), np.float32)
            parts[places] = np.column_stack([people.xyz[row] @ pose[:3, :3].T + pose[:3, 3], people.confidence[row],
                                             people.status[row], people.sigma[row]])
            rows.append(PersonRow(stamp, number, stamp, 'world', len(people), int(people.ids[row]), parts))
    return rows


def statistics() -> Dict[str, Ratio]:
    """Return the figures by name, pooled over scenes."""
    def of(name: str):
        return lambda counts: counts.sums.get(name, 0.0)

    found: Dict[str, Ratio] = {}
    for part, axis in PARTS:
        for kind in KINDS:
            for figure, (top, bottom) in MEANS.items():
                make, unit, digits = Root if figure in ('rmse', 'centred') else Ratio, 'mm', 1
                if figure == 'r' or axis == 'angle':
                    unit, digits = ('', 2) if figure == 'r' else ('deg', 1)
                found[name_of(part, axis, kind, figure)] = make(
                    f'{TITLES[figure]}, {part} {axis}, {kind} joints', of(name_of(part, axis, kind, top)),
                    of(name_of(part, axis, kind, bottom)), unit, digits)
    return found


def name_of(*parts: str) -> str:
    """Return the name of a figure, or of a sum that it is made of."""
    return '_'.join(parts).replace(' ', '_').replace('-', '_')
