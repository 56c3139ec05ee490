"""A recording with known joints, as a camera estimates it and as motion capture measures it, between known clocks."""
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Tuple

import cv2
import numpy as np

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.mocap.joints import JointRecording
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from truth_as_mocap import read_truth, resample

# Label of joints that the camera sees, in gt.json.
VISIBLE = 2
CAMERA_START, MOCAP_START = 1_600_000_000.0, 12.0
# A standing person, z up [m]; the joints of COCO_18 in front, as the camera sees them.
STANDING = {
    'nose': (0.1, 0, 1.6), 'neck': (0, 0, 1.42), 'right_shoulder': (0, -0.17, 1.41), 'right_elbow': (0, -0.2, 1.13),
    'right_wrist': (0.03, -0.22, 0.88), 'left_shoulder': (0, 0.17, 1.41), 'left_elbow': (0, 0.2, 1.13),
    'left_wrist': (0.03, 0.22, 0.88), 'right_hip': (0, -0.1, 0.9), 'right_knee': (0.02, -0.1, 0.48),
    'right_ankle': (0, -0.1, 0.08), 'left_hip': (0, 0.1, 0.9), 'left_knee': (0.02, 0.1, 0.48),
    'left_ankle': (0, 0.1, 0.08), 'right_eye': (0.08, -0.03, 1.64), 'left_eye': (0.08, 0.03, 1.64),
    'right_ear': (0, -0.07, 1.62), 'left_ear': (0, 0.07, 1.62)}


@dataclass(frozen=True)
class Truth:
    """True joints of S people, and which of them the camera sees, (S, T, K) bool."""

    joints: JointRecording
    visible: np.ndarray

    def part(self, start: float, end: float) -> 'Truth':
        """Return what lies between two times [s]."""
        rows = (self.joints.times >= start) & (self.joints.times <= end)
        return Truth(JointRecording(self.joints.subjects, self.joints.times[rows], self.joints.positions[:, rows]),
                     self.visible[:, rows])


@dataclass(frozen=True)
class Simulated:
    """Estimate and reference, and what lies between: x_mocap = rotation x_camera + translation."""

    estimate: KeypointTable
    reference: JointRecording
    clock_offset: float
    rotation: np.ndarray
    translation: np.ndarray


def sequence_truth(folder: Path) -> Truth:
    """Return the truth of a sequence folder, by its gt.json."""
    joints = read_truth(folder)
    values = json.loads((folder / 'gt.json').read_text())
    columns = [MESSAGE_JOINTS.index(joint) for joint in values['joints']]
    visible = np.zeros(joints.positions.shape[:3], bool)
    for number, frame in enumerate(values['frames']):
        for person in frame['people']:
            subject = joints.subjects.index(f"person{person['id']}")
            visible[subject, number, columns] = np.array(person['vis']) == VISIBLE
    return Truth(joints, visible)


def walkers(seconds: float, people: int, seed: int, rate: float = 15.0) -> Truth:
    """Return people that walk about, stop and swing their arms, none like another; all of their joints are seen."""
    random = np.random.RandomState(seed)
    times = np.arange(0, seconds, 1 / rate)
    positions = np.full((people, len(times), len(MESSAGE_JOINTS), 3), np.nan)

    def wander(size: float, slowest: float, fastest: float) -> np.ndarray:
        periods, phases = random.uniform(fastest, slowest, 6), random.uniform(0, 6.3, 6)
        return size * np.sin(2 * np.pi * times[:, None] / periods + phases).mean(axis=1)

    for person in positions:
        heading = wander(4, 15, 5)
        place = np.stack([wander(4, 20, 6), wander(4, 20, 6) + random.uniform(-2, 2), 0 * times], axis=1)
        size = random.uniform(0.9, 1.1)
        for joint, standing in STANDING.items():
            point = np.tile(size * np.array(standing), (len(times), 1))
            if joint.endswith(('wrist', 'elbow', 'ankle', 'knee')):
                point[:, 0] += wander(0.8 if joint.endswith('wrist') else 0.4, 3, 0.8)
            person[:, MESSAGE_JOINTS.index(joint)] = place + np.stack([
                np.cos(heading) * point[:, 0] - np.sin(heading) * point[:, 1],
                np.sin(heading) * point[:, 0] + np.cos(heading) * point[:, 1], point[:, 2]], axis=1)
    joints = JointRecording(tuple(f'person{number + 1}' for number in range(people)), times, positions)
    return Truth(joints, np.isfinite(positions).all(axis=3))


def simulate(truth: Truth, seed: int, seen: Tuple[float, float] = (0, np.inf), noise: float = 0.015,
             rate: float = 120.0, outliers: float = 0.03, dropped: float = 0.05) -> Simulated:
    """Return both recordings with random clocks, years apart, and random frames of reference.

    The camera records the part `seen` [s] with noise per axis [m], drops a share of the frames and 2 % of the joints,
    and is off by 0.3 m per axis in a share of outliers. The motion capture has a rate [Hz] and noise of 1 mm. The first
    person gets another track id in the middle; hidden joints are inferred, 60 mm off per axis.
    """
    random = np.random.RandomState(seed)
    rotation = cv2.Rodrigues(random.normal(size=3) * 2)[0]
    translation = random.uniform(-3, 3, 3)
    offset = MOCAP_START - CAMERA_START + random.uniform(-5, 5)
    measured = resample(truth.joints, rate)
    positions = measured.positions @ rotation.T + translation + 0.001 * random.normal(size=measured.positions.shape)
    reference = JointRecording(measured.subjects, CAMERA_START + measured.times + offset, positions)
    estimate = _estimate(truth.part(*seen), random, noise, outliers, dropped)
    return Simulated(estimate, reference, offset, rotation, translation)


def _estimate(truth: Truth, random: np.random.RandomState, noise: float, outliers: float, dropped: float
              ) -> KeypointTable:
    people, frames = truth.visible.shape[:2]
    kept = random.uniform(size=frames) >= dropped
    rows = [(frame, person) for frame in np.flatnonzero(kept) for person in random.permutation(people)]
    frame, person = np.array(rows).T
    visible = truth.visible[person, frame]
    spread = np.where(visible, noise, 0.06)
    spread = np.where(visible & (random.uniform(size=visible.shape) < outliers), 0.3, spread)
    positions = truth.joints.positions[person, frame]
    positions = positions + spread[..., None] * random.normal(size=positions.shape)
    missing = np.isnan(positions).any(axis=2) | (random.uniform(size=visible.shape) < 0.02)
    positions[missing] = np.nan
    positions = positions.astype(np.float32)
    status = np.where(missing, MISSING, np.where(visible, MEASURED, INFERRED))
    return KeypointTable(
        stamps=np.rint((CAMERA_START + truth.joints.times[frame]) * 1e9).astype(np.int64),
        frame_ids=np.full(len(rows), 'camera'),
        ids=7 + person + np.where((person == 0) & (frame > frames / 2), 100, 0), positions=positions,
        confidence=np.where(status == MEASURED, 0.9, 0.0), status=status,
        sigma=np.where(missing, np.nan, np.where(visible, noise, 0.06) * np.sqrt(3)))


def errors(scene: Simulated, found: Alignment) -> Tuple[float, float, float, float]:
    """Return the errors of offset [ms], rotation [degrees], translation [mm] at the people and at the camera."""
    angle = np.linalg.norm(cv2.Rodrigues(found.rotation @ scene.rotation.T)[0])
    seen = scene.estimate.positions[scene.estimate.status == MEASURED]
    there = (found.rotation - scene.rotation) @ np.median(seen, axis=0) + found.translation - scene.translation
    return (1e3 * abs(found.clock_offset - scene.clock_offset), float(np.degrees(angle)),
            1e3 * float(np.linalg.norm(there)), 1e3 * float(np.linalg.norm(found.translation - scene.translation)))
