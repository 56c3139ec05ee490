"""Several cameras."""
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

import numpy as np

from chain_runs import Finder, Frames, camera_poses, open_sequence
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import from_image, from_space
from openpose_ros_pkg.params.parameters import build
from results import Options, Section, Table, scenes_with
from scoring.counts import Counts, blocks_of, by_value
from scoring.figures import few_scenes, figures_of, named
from scoring.people import WORLD_STATISTICS as STATISTICS
from scoring.people import score_world
from sections.real_cameras import Camera
from skeleton_extract_3d.chain_settings import ChainSettings

COLUMNS = {'persons_recall': 'people found', 'persons_precision': 'real', 'visible_median': 'median [mm]',
           'visible_100': 'within 100 mm', 'hidden_100': 'seen by none, within 100 mm', 'switches': 'switches',
           'within_1_sigma': 'within 1 sigma', 'within_2_sigma': 'within 2 sigma'}
# Length of the parts of a stage that intervals are drawn from [s].
BLOCK = 0.5
# Titles of the cases, those of each camera together, by the name of their figures.
TITLES = {'all': 'all cameras', 'one': 'one camera alone', 'dead': 'one camera dead from the middle on',
          'moved': 'one camera moved by 100 mm', 'late': 'stamps wrong by up to 20 ms',
          'one_depth': 'one camera with depth', 'no_depth': 'no depth'}


class Case(NamedTuple):
    """How the recorded cameras are given to the fusion.

    Attributes:
        name: of the figures.
        sent: (cameras, frames) whether a camera sends a frame.
        rgb: numbers of the cameras whose depth is withheld.
        moved: number of the camera that is believed to stand 100 mm aside.
        late: (cameras, frames) error of the stamps [s]; 0: none.
    """

    name: str
    sent: np.ndarray
    rgb: Sequence[int] = ()
    moved: Optional[int] = None
    late: Any = 0.0


def measure(options: Options) -> Section:
    """Fuse the people that the chain finds with each camera of stages: rendered ones, or of --data stages=FOLDER."""
    folders = scenes_with(options, 'stages', 'cameras', 'gt_world.json')
    counts: Dict[str, List[Counts]] = {name: [] for name in TITLES}
    blocks: Dict[str, List[Counts]] = {name: [] for name in TITLES}
    for folder in folders[:1] if options.quick else folders:
        recorded = record(folder)
        for case in cases(len(recorded), len(recorded[0].people)):
            fused = fuse(recorded, case)
            counts[case.name].append(score_world(folder, fused))
            blocks[case.name] += [score_world(folder, fused, part)
                                  for part in blocks_of(folder, BLOCK, 'gt_world.json')]
    found = {name: few_scenes(each, blocks[name], STATISTICS) for name, each in counts.items()}
    cameras = figures_of(by_value(blocks['all'], 'joints', 'cameras', {
        'one camera': [1], 'two cameras': [2], 'three cameras': [3]}), STATISTICS)
    seen = [['joints seen by', 'median [mm]', 'mean [mm]'], *(
        [title, each['visible_median'], each['visible_mean']] for title, each in cameras.items())]
    return Section(f'{len(folders)} stages of three cameras each, mode balanced; people fused in the world. A person '
                   'counts where a camera sees one of the joints. Intervals: bootstrap over stages, of less than '
                   'five over halves of a second.', named(found),
                   [Table('Cases', [['case', *COLUMNS.values()], *(
                        [TITLES[name], *(each[key] for key in COLUMNS)] for name, each in found.items())]),
                    Table('All cameras', seen)])


def record(stage: Path) -> List[Camera]:
    """Run the chain on each camera of a stage; people: stamp [s], and people in space and in the image."""
    finder, recorded = Finder(build(ChainSettings, {'mode': 'balanced'})), []
    for folder in sorted(stage.glob('cam*')):
        sequence, run = open_sequence(folder), finder.run(folder)
        pose = camera_poses(folder)[0]
        frames = [(stamp, people, image) for (stamp, people), image in zip(run.frames, run.people)]
        recorded.append(Camera(folder.name, sequence.camera, (pose[:3, :3], pose[:3, 3]), people=frames))
    return recorded


def cases(number: int, frames: int) -> List[Case]:
    """Return the cases for a number of cameras and frames."""
    everyone, jitter = tuple(range(number)), np.random.RandomState(0).uniform(-0.02, 0.02, (number, frames))
    every, camera, frame = np.ones((number, frames), bool), np.arange(number)[:, np.newaxis], np.arange(frames)
    return [Case('all', every), *(Case('one', every & (camera == one)) for one in everyone),
            *(Case('dead', (camera != one) | (frame < frames // 2)) for one in everyone),
            *(Case('moved', every, moved=one) for one in everyone), Case('late', every, late=jitter),
            Case('one_depth', every, everyone[1:]), Case('no_depth', every, everyone)]


def fuse(recorded: Sequence[Camera], case: Case) -> Frames:
    """Return the fused people of each frame."""
    fusion, fused, late = PeopleFusion(), [], np.broadcast_to(case.late, case.sent.shape)
    for frame in range(min(len(camera.people) for camera in recorded)):
        sightings = []
        for number, camera in enumerate(recorded):
            stamp, people, image = camera.people[frame]
            pose = (camera.pose[0], camera.pose[1] + np.array([0.1 if case.moved == number else 0.0, 0.0, 0.0]))
            if case.sent[number, frame]:
                sightings.append(
                    from_image(camera.name, stamp + late[number, frame], image, camera.model, pose)
                    if number in case.rgb else from_space(camera.name, stamp + late[number, frame], people, pose))
        stamp = recorded[0].people[frame][0]
        fused.append((stamp, fusion.update(sightings, stamp)))
    return fused
