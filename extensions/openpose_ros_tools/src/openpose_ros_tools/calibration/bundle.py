"""Bundle adjustment: cameras, clocks, joints, and what depths err by always, by robust least squares over all cameras.

With the joint X_p, its measurement y by camera c (pose R_c, t_c; moving by v there) and u = y / |y|,

    residual in space      (R_c (y + b_j u - d_c v) + t_c - X_p) / sigma
    residual in the image  (project(R_c' (X_p - t_c)) - (y - d_c v)) / sigma

are least (Cauchy) over R_c, t_c, the clock corrections d_c, the depth biases b_j of joints, and X_p. The first camera
stays. b_j is how much deeper joint j lies than the cameras with depth say; it is alike for all of them, so that cameras
on both sides of people tell it, and it has a prior of 0.02 m.

Steps are those of Gauss and Newton, the joints eliminated first. SciPy's least_squares with a sparse Jacobian (LSMR)
took ten times as long.
"""
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from openpose_ros_tools.calibration.edges import CameraPose
from openpose_ros_tools.calibration.gathering import Gathered

# Steps end where no camera changes by more [rad, m, s]; a step that makes it worse is halved so many times at
# most; steps at most.
_SETTLED, _HALVINGS, _STEPS = 1e-6, 6, 30
# Parameters of a camera: a further turn (rotation vector), translation, clock.
_OWN = 7
# Of what a step moves a joint by, if its rays do not tell how far away it is: standard deviation [m].
_JOINT_STEP = 10.0
# Joints nearer to the plane of a camera than this are behind it [m].
_NEAREST = 0.1
# Standard deviation of the constant error of the depth of a joint, alike in all cameras: skin and clothes are thicker
# or thinner than assumed [m]; measurements that count as one beside it, as keypoints err alike from frame to frame.
_DEPTH_BIAS, _DEPENDENT = 0.02, 10.0
# Residual from which a measurement loses its weight (Cauchy) [standard deviations].
_OUTLIER = 2.0
# Median distance of two coordinates with a standard deviation of 1.
_MEDIAN = 1.18
# Standard deviation of a clock offset beside the one that was found first [s].
_CLOCK_PRIOR = 0.5
# Groups of measurements that are left out in turn, at most, to tell how uncertain the cameras are.
_GROUPS = 30
# Share of the measurements of a camera with which a block tells it alone, so that others tell no spread.
_ALONE = 0.75
# Errors of the distance of the first two cameras where nothing else tells the scale [m], and of given clocks [s].
_GIVEN_LENGTH, _GIVEN_CLOCK = 1e-4, 1e-5


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The result.

    Attributes:
        poses: of all cameras.
        std: (C, 3) standard deviations to the root: angle [degrees], position [m], clock [s]; 0 for the root.
        joints: (P, 3) [m], those of `gathered`.
        gathered: what was adjusted.
        merit: sum of the robust weights of measurements, each divided by the square of its error over sigma.
    """

    poses: List[CameraPose]
    std: np.ndarray
    joints: np.ndarray
    gathered: Gathered
    merit: float


class _State(NamedTuple):
    """What is adjusted, of C cameras: poses, clock corrections, depth biases (J,) [m] and joints (P, 3) [m]."""

    rotations: np.ndarray
    translations: np.ndarray
    clocks: np.ndarray
    bias: np.ndarray
    joints: np.ndarray

    def moved(self, change: np.ndarray) -> '_State':
        """Return the state after a step: parameters of the cameras but the root, biases, joints."""
        cameras, names = len(self.clocks) - 1, len(self.bias)
        own, bias, joints = np.split(change, [_OWN * cameras, _OWN * cameras + names])
        own = np.concatenate([np.zeros((1, _OWN)), own.reshape(-1, _OWN)])
        turns = Rotation.from_rotvec(own[:, :3])
        rotations = np.stack([turns.apply(column) for column in np.moveaxis(self.rotations, 2, 0)], axis=2)
        return _State(rotations, self.translations + own[:, 3:6], self.clocks + own[:, 6], self.bias + bias,
                      self.joints + joints.reshape(-1, 3))


class _Problem:
    """Residuals of a state, and their derivatives by its step.

    scale: of the residuals of each measurement, 1 / sigma with the root of its weight.
    """

    def __init__(self, gathered: Gathered, first: _State, has_depth: np.ndarray, clocks_agree: bool) -> None:
        self.gathered, self.deep = gathered, has_depth[gathered.camera]
        self.directions = gathered.measured / np.linalg.norm(gathered.measured, axis=1, keepdims=True)
        self.cameras, self.names = len(first.clocks) - 1, len(first.bias)
        self.first_joint = _OWN * self.cameras + self.names
        # of a depth bias beside measurements that are taken as independent [m]
        self.bias_sigma = _DEPTH_BIAS / np.sqrt(_DEPENDENT)
        self.clock_sigma = _GIVEN_CLOCK if clocks_agree else _CLOCK_PRIOR
        # the distance of the first two cameras, where nothing else tells the scale
        arm = first.translations[1] - first.translations[0]
        self.length = np.linalg.norm(arm)
        self.by_length = 0 * arm if has_depth.any() else arm / self.length / _GIVEN_LENGTH
        # half of the variance of a keypoint lasts, so that of N that err alike each counts as 2 / (1 + N)
        self.counts = 2 / (1.0 + gathered.alike)
        # networks and images differ: keypoints may err by more than is known of ours
        self.sigma, self.scale = gathered.sigma, 1 / gathered.sigma
        missed = np.linalg.norm(self.residuals(first)[:3 * len(self.deep)].reshape(-1, 3), axis=1)[~self.deep]
        level = max(float(np.median(missed)) / _MEDIAN, 1.0) if len(missed) else 1.0
        self.sigma = np.where(self.deep, 1.0, level) * gathered.sigma

    def residuals(self, state: _State) -> np.ndarray:
        """Return (3 M + ...) residuals, of measurements, biases, clocks, and the scale; a ray has a third one of 0."""
        rotation, arm, local, seen = self._geometry(state)
        in_space = np.einsum('mij,mj->mi', rotation, seen) - arm
        in_image = local / np.maximum(local[:, 2:], _NEAREST) - seen
        in_image[:, 2] = 0
        rows = np.where(self.deep[:, None], in_space, in_image) * self.scale[:, None]
        arm = state.translations[1] - state.translations[0]
        length = self.by_length @ arm - np.linalg.norm(self.by_length) * self.length
        return np.concatenate([rows.ravel(), state.bias / self.bias_sigma, state.clocks[1:] / self.clock_sigma,
                               [length]])

    def reweigh(self, state: _State) -> float:
        """Give measurements with large residuals small weights (Cauchy), and return the robust cost."""
        self.scale = 1 / self.sigma
        residuals = self.residuals(state)
        measured, prior = residuals[:3 * len(self.scale)].reshape(-1, 3), residuals[3 * len(self.scale):]
        squares = (measured ** 2).sum(axis=1) / _OUTLIER ** 2
        self.scale = self.scale * np.sqrt(self.counts / (1 + squares))
        return float(_OUTLIER ** 2 * self.counts @ np.log1p(squares) + (prior ** 2).sum())

    def jacobian(self, state: _State) -> csr_matrix:
        """Return the derivatives of the residuals."""
        data, camera = self.gathered, self.gathered.camera
        rotation, arm, local, seen = self._geometry(state)
        deep, depth = self.deep[:, None, None], np.maximum(local[:, 2], _NEAREST)
        plane = np.zeros((len(arm), 3, 3))
        plane[:, [0, 1], [0, 1]] = 1 / depth[:, None]
        plane[:, :2, 2] = -local[:, :2] / depth[:, None] ** 2
        into = plane @ rotation.transpose(0, 2, 1)
        by_turn = np.where(deep, -_cross(np.einsum('mij,mj->mi', rotation, seen)), into @ _cross(arm))
        by_shift = np.where(deep, np.eye(3), -into)
        by_clock = np.where(deep, -rotation, np.eye(3)) @ data.velocity[..., None]
        by_clock[~self.deep, 2] = 0
        by_bias = np.where(deep, rotation, 0) @ self.directions[..., None]
        own, free = np.concatenate([by_turn, by_shift, by_clock], axis=2), np.flatnonzero(camera > 0)
        rows, scale = np.arange(3 * len(camera)).reshape(-1, 3, 1), self.scale[:, None, None]
        column, point = _OWN * (camera - 1)[:, None, None], data.point[:, None, None]
        first_bias, first_prior = _OWN * self.cameras, 3 * len(camera)
        parts: List[Tuple[Any, Any, Any]] = [
            ((own * scale)[free], rows[free], column[free] + np.arange(_OWN)),
            (by_bias * scale, rows, first_bias + data.name[point]),
            (-by_shift * scale, rows, self.first_joint + 3 * point + np.arange(3)),
            (1 / self.bias_sigma, first_prior + np.arange(self.names), first_bias + np.arange(self.names)),
            (1 / self.clock_sigma, first_prior + self.names + np.arange(self.cameras),
             _OWN - 1 + _OWN * np.arange(self.cameras)),
            (self.by_length, first_prior + self.names + self.cameras, 3 + np.arange(3))]
        entries = zip(*([each.ravel() for each in np.broadcast_arrays(*part)] for part in parts))
        value, row, column = (np.concatenate(each) for each in entries)
        return coo_matrix((value, (row, column)), (int(row.max()) + 1, self.first_joint + state.joints.size)).tocsr()

    def _geometry(self, state: _State) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return of each measurement rotation, joint from its camera in both frames, and corrected point."""
        data, camera = self.gathered, self.gathered.camera
        rotation, arm = state.rotations[camera], state.joints[data.point] - state.translations[camera]
        bias = np.where(self.deep, state.bias[data.name[data.point]], 0)
        seen = data.measured + bias[:, None] * self.directions - state.clocks[camera][:, None] * data.velocity
        return rotation, arm, np.einsum('mji,mj->mi', rotation, arm), seen


def adjust(gathered: Gathered, poses: Sequence[CameraPose], has_depth: np.ndarray, clocks_agree: bool) -> Adjusted:
    """Return the poses of the cameras, with all measurements.

    Args:
        poses: of all C cameras; the first one, the root, stays.
        has_depth: (C,) bool; where no camera has, the distance of the first two cameras stays.
        clocks_agree: the clock offsets stay.
    """
    state = _State(np.array([one.pose[0] for one in poses]), np.array([one.pose[1] for one in poses]),
                   np.zeros(len(poses)), np.zeros(int(gathered.name.max()) + 1), gathered.joints)
    problem = _Problem(gathered, state, has_depth, clocks_agree)
    cost = problem.reweigh(state)
    for _ in range(_STEPS):
        change = _step(problem, problem.residuals(state), problem.jacobian(state))
        for _ in range(_HALVINGS):
            new_cost = problem.reweigh(state.moved(change))
            if new_cost <= cost:
                break
            change = change / 2
        else:
            break
        state, cost = state.moved(change), new_cost
        if np.abs(change[:problem.first_joint]).max() < _SETTLED:
            break
    problem.reweigh(state)
    adjusted = [CameraPose((rotation, translation), one.clock_offset + clock) for rotation, translation, clock, one in
                zip(state.rotations, state.translations, state.clocks, poses)]
    own = np.concatenate([np.zeros((1, _OWN)), _deviations(problem, state).reshape(-1, _OWN)])
    std = np.stack([np.degrees(np.linalg.norm(own[:, :3], axis=1)), np.linalg.norm(own[:, 3:6], axis=1), own[:, 6]],
                   axis=1)
    return Adjusted(adjusted, std, state.joints, gathered, float((problem.scale ** 2 * gathered.sigma ** 2).sum()))


def _step(problem: _Problem, residuals: np.ndarray, jacobian: csr_matrix) -> np.ndarray:
    """Return the step of Gauss and Newton, with the joints, of which each is by itself, eliminated first (Schur)."""
    own, joints, inner, mixed, reduced = _normal(problem, jacobian)
    pull, pull_joints = own.T @ residuals, inner.solve(joints.T @ residuals)
    change = -np.linalg.lstsq(reduced, pull - mixed.T @ pull_joints, rcond=None)[0]
    return np.concatenate([change, -pull_joints - inner.solve(mixed @ change)])


def _normal(problem: _Problem, jacobian: csr_matrix) -> Tuple[csr_matrix, csr_matrix, Any, np.ndarray, np.ndarray]:
    """Return the columns of cameras and joints, the solver of these, and the normal matrix of the cameras alone."""
    own, joints = jacobian[:, :problem.first_joint], jacobian[:, problem.first_joint:]
    inner = splu((joints.T @ joints + identity(joints.shape[1]) / _JOINT_STEP ** 2).tocsc())
    mixed = (joints.T @ own).toarray()
    return own, joints, inner, mixed, (own.T @ own).toarray() - mixed.T @ inner.solve(mixed)


def _deviations(problem: _Problem, state: _State) -> np.ndarray:
    """Return standard deviations of the parameters of the cameras: the greater one of two.

    That by the errors that keypoints are known to have; and, where no block is `_ALONE` in telling a camera, that by
    blocks left out in turn, as the keypoints of a person err alike as long as a camera sees the person from one side,
    and all joints together (delete-a-group jackknife, one step each: Bell and McCaffrey, Survey Methodology 28, 169
    (2002)).
    """
    residuals, jacobian, data = problem.residuals(state), problem.jacobian(state), problem.gathered
    known = np.sqrt(np.maximum(np.diag(np.linalg.pinv(_normal(problem, jacobian)[-1])), 0))[:_OWN * problem.cameras]
    group = data.block % _GROUPS
    steps = []
    for left_out in np.unique(group):
        kept = np.ones(len(residuals))
        kept[:3 * len(group)] = np.repeat(group != left_out, 3)
        steps.append(_step(problem, kept * residuals, diags(kept) @ jacobian)[:_OWN * problem.cameras])
    alone = np.array([(np.bincount(own) > _ALONE * len(own)).any()
                      for own in (group[data.camera == camera] for camera in range(problem.cameras + 1))])
    left_out = np.sqrt((len(steps) - 1) * np.var(steps, axis=0))
    return np.where(np.repeat(alone[1:] | alone[0], _OWN), known, np.maximum(known, left_out))


def _cross(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (N, 3, 3) of the cross products with vectors (N, 3)."""
    return np.cross(np.eye(3), vectors[:, np.newaxis])
