"""Bundle adjustment: cameras, clocks, joints, and what depths err by always, by robust least squares over all cameras.

With the joint X_p, its measurement y by camera c (pose R_c, t_c; moving by v there) and u = y / |y|,

    residual in space      (R_c (y + b_j u - d_c v) + t_c - X_p) / sigma
    residual in the image  (project(R_c' (X_p - t_c)) - (y - d_c v)) / sigma

are least (Cauchy) over R_c, t_c, the clock corrections d_c, the depth biases b_j of joints, and X_p. The first camera
stays. b_j is how much deeper joint j lies than the cameras with depth say; it is alike for all of them, so that cameras
on both sides of people tell it, and it has a prior of `BundleConstants.depth_bias`.

Steps are those of Gauss and Newton, the joints eliminated first. SciPy's least_squares with a sparse Jacobian (LSMR)
took ten times as long.
"""
from dataclasses import dataclass
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from openpose_ros_tools.calibration.constants import BundleConstants
from openpose_ros_tools.calibration.edges import CameraPose
from openpose_ros_tools.calibration.gathering import Gathered

# Steps end where no camera changes by more [rad, m, s]; a step that makes it worse is halved so many times at most.
_SETTLED, _HALVINGS = 1e-6, 6
# Parameters of a camera: rotation vector, translation, clock.
_OWN = 7
# Of what a step moves a joint by, if its rays do not tell how far away it is: standard deviation [m].
_JOINT_STEP = 10.0
# Joints nearer to the plane of a camera than this are behind it [m].
_NEAREST = 0.1
# Errors of the distance of the first two cameras where nothing else tells the scale [m], and of given clocks [s].
_GIVEN_LENGTH, _GIVEN_CLOCK = 1e-4, 1e-5


@dataclass(frozen=True, eq=False)
class Given:
    """What is known of C cameras before the adjustment.

    Attributes:
        poses: of all cameras; the first one, the root, stays.
        has_depth: (C,) bool; where no camera has, the distance of the first two cameras stays.
        clocks_agree: the clock offsets stay.
    """

    poses: Sequence[CameraPose]
    has_depth: np.ndarray
    clocks_agree: bool


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The result.

    Attributes:
        poses: of all cameras.
        std: (C, 3) standard deviations to the root: angle [degrees], position [m], clock [s]; 0 for the root.
        joints: (P, 3) [m], those of `gathered`.
        gathered: what was adjusted.
    """

    poses: List[CameraPose]
    std: np.ndarray
    joints: np.ndarray
    gathered: Gathered


class _Geometry(NamedTuple):
    """Of each measurement: pose of its camera, its joint in the frames of root and camera, corrected point."""

    rotations: np.ndarray
    translations: np.ndarray
    joints: np.ndarray
    local: np.ndarray
    seen: np.ndarray
    turns: np.ndarray


class _Problem:
    """Residuals and their derivatives; parameters are those of the cameras but the root, biases, and joints."""

    def __init__(self, gathered: Gathered, given: Given, constants: BundleConstants) -> None:
        poses, has_depth = given.poses, given.has_depth
        self.gathered, self.first_poses = gathered, poses
        self.outlier = constants.outlier
        # of a depth bias beside measurements that are taken as independent [m]
        self.bias_sigma = constants.depth_bias / np.sqrt(constants.dependent)
        self.deep = has_depth[gathered.camera]
        self.directions = gathered.measured / np.linalg.norm(gathered.measured, axis=1, keepdims=True)
        self.scaled = bool(has_depth.any())
        self.clock_sigma = _GIVEN_CLOCK if given.clocks_agree else constants.clock_prior
        self.cameras = len(poses)
        self.names = int(gathered.name.max()) + 1
        self.first_bias = _OWN * (self.cameras - 1)
        self.first_joint = self.first_bias + self.names
        self.start = np.concatenate([np.zeros(self.first_joint), gathered.joints.ravel()])
        for number, one in enumerate(poses[1:]):
            self.start[_OWN * number + 3:_OWN * number + 6] = one.pose[1]
        arm = poses[1].pose[1] - poses[0].pose[1]  # the scale where nothing else tells it
        self.weights = np.ones(len(gathered.point))
        self.scale = 1 / gathered.sigma  # of residuals, with the roots of the weights
        self.direction, self.length = arm / np.linalg.norm(arm), np.linalg.norm(arm)

    def poses(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return rotations (C, 3, 3), translations (C, 3), clock corrections (C,), derivatives of turns (C, 3, 3)."""
        rotations = np.array([one.pose[0] for one in self.first_poses])
        translations = np.array([one.pose[1] for one in self.first_poses])
        clocks, turns = np.zeros(self.cameras), np.tile(np.eye(3), (self.cameras, 1, 1))
        for camera, own in enumerate(values[:self.first_bias].reshape(-1, _OWN), 1):
            rotations[camera] = Rotation.from_rotvec(own[:3]).apply(rotations[camera].T).T
            translations[camera], clocks[camera], turns[camera] = own[3:6], own[6], _left_jacobian(own[:3])
        return rotations, translations, clocks, turns

    def geometry(self, values: np.ndarray) -> '_Geometry':
        """Return where cameras and joints are, for each measurement."""
        rotations, translations, clocks, turns = self.poses(values)
        data, camera = self.gathered, self.gathered.camera
        joints = values[self.first_joint:].reshape(-1, 3)[data.point]
        bias = np.where(self.deep, values[self.first_bias:self.first_joint][data.name[data.point]], 0)
        seen = data.measured + bias[:, None] * self.directions - clocks[camera][:, None] * data.velocity
        local = np.einsum('mji,mj->mi', rotations[camera], joints - translations[camera])
        return _Geometry(rotations[camera], translations[camera], joints, local, seen, turns[camera])

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Return (3 M + ...) residuals; a ray has a third one, which is 0."""
        at = self.geometry(values)
        in_space = np.einsum('mij,mj->mi', at.rotations, at.seen) + at.translations - at.joints
        in_image = at.local / np.maximum(at.local[:, 2:], _NEAREST) - at.seen
        in_image[:, 2] = 0
        rows = np.where(self.deep[:, None], in_space, in_image) * self.scale[:, None]
        return np.concatenate([rows.ravel(), self._prior(values)])

    def reweigh(self, values: np.ndarray) -> float:
        """Give measurements with large residuals small weights (Cauchy), and return the robust cost."""
        self.scale = 1 / self.gathered.sigma
        residuals = self.residuals(values)
        measured, prior = residuals[:3 * len(self.scale)].reshape(-1, 3), residuals[3 * len(self.scale):]
        squares = (measured ** 2).sum(axis=1) / self.outlier ** 2
        self.weights = 1 / (1 + squares)
        self.scale = np.sqrt(self.weights) * self.scale
        return float(self.outlier ** 2 * np.log1p(squares).sum() + (prior ** 2).sum())

    def jacobian(self, values: np.ndarray) -> csr_matrix:
        """Return the derivatives of the residuals."""
        at, data, camera = self.geometry(values), self.gathered, self.gathered.camera
        rotation, deep = at.rotations, self.deep[:, None, None]
        arm, local = at.joints - at.translations, at.local
        depth = np.maximum(local[:, 2], _NEAREST)
        plane = np.zeros((len(arm), 3, 3))
        plane[:, [0, 1], [0, 1]] = 1 / depth[:, None]
        plane[:, :2, 2] = -local[:, :2] / depth[:, None] ** 2
        into = plane @ rotation.transpose(0, 2, 1)
        eye = np.broadcast_to(np.eye(3), into.shape)
        by_turn = np.where(deep, -_cross(np.einsum('mij,mj->mi', rotation, at.seen)), into @ _cross(arm)) @ at.turns
        by_shift = np.where(deep, eye, -into)
        moved = np.where(deep, rotation, -np.eye(3)) @ data.velocity[..., None]
        by_clock = -moved
        by_clock[~self.deep, 2] = 0
        by_bias = np.where(deep, rotation, 0) @ self.directions[..., None]
        scale = self.scale[:, None, None]
        own = np.concatenate([by_turn, by_shift, by_clock], axis=2) * scale
        free = np.flatnonzero(camera > 0)
        rows = 3 * np.arange(len(camera))[:, None, None] + np.arange(3)[:, None]
        parts = [(own[free], rows[free], _OWN * (camera[free] - 1)[:, None, None] + np.arange(_OWN)),
                 (by_bias * scale, rows, self.first_bias + data.name[data.point][:, None, None]),
                 (-by_shift * scale, rows, self.first_joint + 3 * data.point[:, None, None] + np.arange(3))]
        entries = [tuple(np.broadcast_to(each, part[0].shape).ravel() for each in part) for part in parts]
        entries.append(self._prior_entries(3 * len(camera)))
        value, row, column = (np.concatenate(each) for each in zip(*entries))
        return coo_matrix((value, (row, column)), (int(row.max()) + 1, len(values))).tocsr()

    def _prior(self, values: np.ndarray) -> np.ndarray:
        """Return the residuals of biases, of clocks, and of the scale."""
        clocks = values[_OWN - 1:self.first_bias:_OWN] / self.clock_sigma
        bias = values[self.first_bias:self.first_joint] / self.bias_sigma
        length = (values[3:6] - self.first_poses[0].pose[1]) @ self.direction - self.length
        return np.concatenate([bias, clocks, [0.0 if self.scaled else length / _GIVEN_LENGTH]])

    def _prior_entries(self, first: int) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return derivatives of `_prior`, their rows and columns."""
        cameras = self.cameras - 1
        values = np.concatenate([np.full(self.names, 1 / self.bias_sigma), np.full(cameras, 1 / self.clock_sigma),
                                 0 * self.direction if self.scaled else self.direction / _GIVEN_LENGTH])
        rows = np.concatenate([np.arange(self.names + cameras), np.full(3, self.names + cameras)])
        columns = np.concatenate([self.first_bias + np.arange(self.names), _OWN - 1 + _OWN * np.arange(cameras),
                                  3 + np.arange(3)])
        return values, first + rows, columns


def adjust(gathered: Gathered, given: Given, constants: BundleConstants) -> Adjusted:
    """Return the poses of the cameras, with all measurements."""
    problem = _Problem(gathered, given, constants)
    values, cost = problem.start, problem.reweigh(problem.start)
    for _ in range(constants.steps):
        change = _step(problem, problem.residuals(values), problem.jacobian(values))
        for _ in range(_HALVINGS):
            new_cost = problem.reweigh(values + change)
            if new_cost <= cost:
                break
            change = change / 2
        else:
            break
        values, cost = values + change, new_cost
        if np.abs(change[:problem.first_joint]).max() < _SETTLED:
            break
    problem.reweigh(values)
    rotations, translations, clocks, _ = problem.poses(values)
    adjusted = [CameraPose((rotation, translation), one.clock_offset + clock) for rotation, translation, clock, one in
                zip(rotations, translations, clocks, given.poses)]
    own = np.concatenate([np.zeros((1, _OWN)), _deviations(problem, values, constants.groups).reshape(-1, _OWN)])
    std = np.stack([np.degrees(np.linalg.norm(own[:, :3], axis=1)), np.linalg.norm(own[:, 3:6], axis=1), own[:, 6]],
                   axis=1)
    return Adjusted(adjusted, std, values[problem.first_joint:].reshape(-1, 3), gathered)


def _step(problem: _Problem, residuals: np.ndarray, jacobian: csr_matrix) -> np.ndarray:
    """Return the step of Gauss and Newton, with the joints, of which each is by itself, eliminated first (Schur)."""
    own, joints = jacobian[:, :problem.first_joint], jacobian[:, problem.first_joint:]
    inner = splu((joints.T @ joints + identity(joints.shape[1]) / _JOINT_STEP ** 2).tocsc())
    mixed = (joints.T @ own).toarray()
    pull, pull_joints = own.T @ residuals, inner.solve(joints.T @ residuals)
    reduced = (own.T @ own).toarray() - mixed.T @ inner.solve(mixed)
    change = -np.linalg.lstsq(reduced, pull - mixed.T @ pull_joints, rcond=None)[0]
    return np.concatenate([change, -pull_joints - inner.solve(mixed @ change)])


def _deviations(problem: _Problem, values: np.ndarray, most: int) -> np.ndarray:
    """Return standard deviations of the parameters of the cameras; infinite where one block alone tells a camera.

    All others stand relative to the first camera: where one block alone tells that one, none is known.

    The keypoints of a person err alike as long as a camera sees the person from one side, and all joints together.
    Such blocks of measurements are left out in turn (delete-a-group jackknife, one step each: Bell and McCaffrey,
    Survey Methodology 28, 169 (2002)).

    Args:
        most: groups; where there are more blocks, some are left out together.
    """
    residuals, jacobian, data = problem.residuals(values), problem.jacobian(values), problem.gathered
    group = data.block % most
    steps = []
    for left_out in np.unique(group):
        kept = np.ones(len(residuals))
        kept[:3 * len(group)] = np.repeat(group != left_out, 3)
        steps.append(_step(problem, kept * residuals, diags(kept) @ jacobian)[:problem.first_bias])
    deviations = np.sqrt((len(steps) - 1) * np.var(steps, axis=0))
    alone = np.array([len(np.unique(group[data.camera == camera])) < 2 for camera in range(problem.cameras)])
    return np.where(np.repeat(alone[1:] | alone[0], _OWN), np.inf, deviations)


def _cross(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (N, 3, 3) of the cross products with vectors (N, 3)."""
    x, y, z = vectors.T
    nothing = np.zeros_like(x)
    return np.stack([nothing, -z, y, z, nothing, -x, -y, x, nothing], axis=1).reshape(-1, 3, 3)


def _left_jacobian(turn: np.ndarray) -> np.ndarray:
    """Return by what a rotation vector (3,) must be changed for a small further turn, the inverse: (3, 3)."""
    angle = float(np.linalg.norm(turn))
    cross = _cross(turn[np.newaxis])[0]
    if angle < 1e-4:
        return np.asarray(np.eye(3) + cross / 2)
    return np.asarray(np.eye(3) + (1 - np.cos(angle)) / angle ** 2 * cross
                      + (angle - np.sin(angle)) / angle ** 3 * cross @ cross)
