"""Hands and faces."""
from typing import List, Tuple

from scipy.spatial.transform import Rotation

from chain_runs import BEGIN, open_sequence
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.networks.backends import create_backend
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.parameters import build
from results import Options, Section, Table, scenes_with
from scoring.counts import blocks_of
from scoring.figures import few_scenes
from scoring.hands import STATISTICS, Face, Hand, score_hands
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks
from skeleton_extract_3d.points.depth import DepthImage

# Length of the parts of a scene that intervals are drawn from [s].
BLOCK = 0.5


def measure(options: Options) -> Section:
    """Run the chain with hands on scenes with true hand points: rendered ones, or of --data hands=FOLDER."""
    settings = build(ChainSettings, {'mode': 'balanced', **options.settings})
    networks = {kind.model: create_backend(kind.model, weights_path(
        kind.model, settings.detector.detector.model_folder), settings.detector.backend) for kind in (HAND, FACE)}
    counts, blocks = [], []
    for folder in scenes_with(options, 'hands', 'hand_joints'):
        sequence = open_sequence(folder)
        landmarks = LandmarkDetector(LandmarkParams(hands=True, face=True), lambda kind: networks[kind.model])
        chain = PeopleChain(create_detection(settings.detector), settings.estimator, landmarks)
        found = [(frame.time, hands_and_faces(chain.update(Frame('', BEGIN + frame.time, frame.bgr, DepthImage(
            frame.depth, sequence.camera))).landmarks)) for frame in sequence]
        counts.append(score_hands(folder, found))
        blocks += [score_hands(folder, found, block) for block in blocks_of(folder, BLOCK)]
    named = few_scenes(counts, blocks, STATISTICS)
    return Section(f'{len(counts)} scenes, mode balanced. Shares count all points of true hands, those that are not '
                   'given as wrong. Intervals: bootstrap over scenes, of less than five over halves of a second.',
                   named,
                   [Table('', [['', 'figure'], *([figure.text, figure] for figure in named.values())])])


def hands_and_faces(found: Landmarks) -> Tuple[List[Hand], List[Face]]:
    """Return the hands and faces in space of a frame, as they are scored."""
    in_image, lifted = found
    rows = list(zip(in_image.hands.people.tolist(), in_image.hands.left.tolist()))
    names = list(zip(lifted.hands.people.tolist(), lifted.hands.left.tolist()))
    points, faces = lifted.hands.points, lifted.faces
    return ([Hand(name[1], in_image.hands.keypoints[rows.index(name), :, :2], points.xyz[row], points.status[row],
                  points.sigma[row]) for row, name in enumerate(names)],
            [Face(xyz, Rotation.from_quat(turn).apply([1.0, 0.0, 0.0]), sigma) for xyz, turn, sigma in zip(
                faces.points.xyz, faces.orientations, faces.orientation_sigma.tolist())])
