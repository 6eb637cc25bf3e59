"""Differential inverse kinematics of one arm: the joint step that brings its tip nearer to a pose.

Each step is the solution of a quadratic program on the engine's Jacobians:

    minimise   |W (J dq - step)|^2 + damping |dq - N posture|^2     over dq
    subject to the limits of position and velocity of each joint

`step` goes straight towards the target. `posture` leads home, and N passes only motions that leave the tip in place. So
a redundant arm has a posture of its own for each pose, and still meets its target exactly. The damping grows with the
remaining error. It is almost zero close to a target. Far from it, or at one out of reach, it prevents overshoot where
the arm is stretched out.
"""

import math
from dataclasses import dataclass

import daqp
import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.motion.solver import TURN_WEIGHT
from cellwright.util.pose import Pose

GAIN = 60.0
"""Gain of the error [1/s] within the limits; commands at 100 Hz merge into one motion."""
POSTURE_GAIN, POSTURE_SPEED = 2.0, 0.5
"""Posture motion towards home: gain [1/s], and maximum speed [rad/s; m/s]."""

POSTURE_REST = 0.02
"""Minimum speed of the posture [rad/s; m/s]; a slower one is zero, so that an arm comes to rest."""

_MIN_DAMPING = 1e-6  # keeps the program convex; a stretched arm still meets reachable targets within 1e-6 m
_DAMPING = 0.2  # for a step of 1 m [m]; measured: with 0.05 an arm of 0.7 m trembles at targets out of reach
_ROW_DAMPING = 1e-5  # limit of a singular direction for N
_OPTIMAL = 1
_UNBOUNDED = 1e30  # infinity of the solver

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ArmLimits:
    """Limits of an arm's motion.

    Attributes:
        lower, upper: limits of position of each joint [rad; m].
        velocity: limits of speed of each joint [rad/s; m/s].
        caps: maximum speed of the tip along [m/s] and about [rad/s].
    """

    lower: Array
    upper: Array
    velocity: Array
    caps: tuple[float, float]


class ArmSolver:
    """Solver of joint steps for one arm, each joint with one degree of freedom, that bring the body `tip` to a pose.

    Args:
        model: the engine's model.
        joints: names of the arm's joints.
        tip: body that is brought to a pose.
        reference: body in whose frame poses are given.
        home: posture that the arm prefers among all that meet the pose [rad; m]; with None it prefers to stay.
        limits: limits of its motion.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        joints: tuple[str, ...],
        tip: str,
        reference: str,
        home: Array | None,
        limits: ArmLimits,
    ) -> None:
        self.limits = limits
        self._model, self._home = model, home
        ids = [model.joint(name).id for name in joints]
        self.qpos = model.jnt_qposadr[ids].copy()
        self._dofs = model.jnt_dofadr[ids].copy()
        self._tip, self._reference = model.body(tip).id, model.body(reference).id
        self._moves_reference = bool(_is_above(model, ids, self._reference))
        self._jacobian = np.zeros((6, model.nv))
        self._reference_jacobian = np.zeros((6, model.nv))
        self._weights = np.repeat((1.0, TURN_WEIGHT), 3)
        self._identity = np.eye(len(joints))
        self._row_damping, self._forces = _ROW_DAMPING * np.eye(6), np.zeros(6)
        self._no_rows = np.zeros((0, len(joints)))
        self._kinds = np.zeros(len(joints), dtype=np.intc)
        self._turned, self._turn = np.zeros(4), np.zeros(3)

    def pose(self, data: mujoco.MjData, body: str | None = None) -> Pose:
        """Return reference_T_tip, or reference_T_body; positions of bodies in `data` are up to date."""
        number = self._tip if body is None else self._model.body(body).id
        return _body_pose(data, self._reference).inverse() @ _body_pose(data, number)

    def error(self, data: mujoco.MjData, target: Pose) -> Array:
        """Return translation and rotation from tip to `target`, reference_T_tip, along the world's axes [m, rad]."""
        tip, reference = self._tip, self._reference
        error = np.empty(6)
        error[:3] = self._goal(data, target) - data.xpos[tip]
        mujoco.mju_mulQuat(self._turned, data.xquat[reference], np.array(target.quaternion))
        mujoco.mju_subQuat(self._turn, self._turned, data.xquat[tip])
        error[3:] = data.xmat[tip].reshape(3, 3) @ self._turn
        return error

    def step(self, data: mujoco.MjData, target: Pose, time: float) -> Array:
        """Return the motion of each joint within `time` [s] that brings the tip nearer to `target` [rad; m].

        Joint positions in `data` are within their limits, bodies and motion axes up to date (`mj_kinematics` and
        `mj_comPos`).
        """
        error = self.error(data, target)
        jacobian = self._weights[:, None] * self._jacobian_of(data, target)
        step = self._weights * (self._share(error, time) * error)
        damping = _MIN_DAMPING + _DAMPING * math.sqrt(step @ step)

        position = data.qpos[self.qpos]
        pulled = -(jacobian.T @ step)
        if self._home is not None:
            pulled = pulled - damping * self._posture(self._home - position, jacobian, time)
        bound = np.minimum(self.limits.velocity * time, _UNBOUNDED)
        # Half the gradient of the program above at dq is (J^T J + damping) dq - J^T step - damping posture.
        found, _, flag, _ = daqp.solve(
            jacobian.T @ jacobian + damping * self._identity,
            pulled,
            self._no_rows,
            np.minimum(self.limits.upper - position, bound),
            np.maximum(self.limits.lower - position, -bound),
            self._kinds,
        )
        moved: Array = np.asarray(found)
        return moved if flag == _OPTIMAL else np.zeros_like(position)  # no step was found: do not move

    def _posture(self, to_home: Array, jacobian: Array, time: float) -> Array:
        """Return the motion towards home that leaves the tip in place [rad; m]: N posture."""
        limit = POSTURE_SPEED * time
        # N = 1 - J^T (J J^T)^-1 J: J^T times the solution is the part of the posture that would move the tip.
        posture: Array = np.maximum(np.minimum(POSTURE_GAIN * time * to_home, limit), -limit)
        gram = jacobian @ jacobian.T + self._row_damping
        mujoco.mju_cholFactor(gram, 0.0)
        mujoco.mju_cholSolve(self._forces, gram, jacobian @ posture)
        posture -= jacobian.T @ self._forces
        if np.abs(posture).max() < POSTURE_REST * time:
            posture[:] = 0.0
        return posture

    def _share(self, error: Array, time: float) -> float:
        """Return the share of the error for this step; the whole error shrinks in one straight motion."""
        # d(error)/dt = -GAIN error, solved over the time of a step: the motion does not depend on the step's length.
        share = -math.expm1(-GAIN * time)
        for distance, speed in zip((math.hypot(*error[:3]), math.hypot(*error[3:])), self.limits.caps, strict=True):
            if share * distance > speed * time:
                share = speed * time / distance
        return share

    def _goal(self, data: mujoco.MjData, target: Pose) -> Array:
        """Return the target's position in the world [m]."""
        goal: Array = data.xpos[self._reference] + data.xmat[self._reference].reshape(3, 3) @ target.position
        return goal

    def _jacobian_of(self, data: mujoco.MjData, target: Pose) -> Array:
        """Return the Jacobian of the tip relative to the reference."""
        jacobian = self._jacobian
        mujoco.mj_jacBody(self._model, data, jacobian[:3], jacobian[3:], self._tip)
        found: Array = jacobian[:, self._dofs]
        # A joint that moves the reference, such as a waist's, carries the goal along; only the difference counts.
        if self._moves_reference:
            mujoco.mj_jac(
                self._model,
                data,
                self._reference_jacobian[:3],
                self._reference_jacobian[3:],
                self._goal(data, target),
                self._reference,
            )
            found = found - self._reference_jacobian[:, self._dofs]
        return found


def _is_above(model: mujoco.MjModel, joints: list[int], body: int) -> bool:
    """Return whether one of the joints moves a body."""
    bodies = {int(model.jnt_bodyid[joint]) for joint in joints}
    while body:
        if body in bodies:
            return True
        body = int(model.body_parentid[body])
    return False


def _body_pose(data: mujoco.MjData, body: int) -> Pose:
    x, y, z = data.xpos[body].tolist()
    a, b, c, d = data.xquat[body].tolist()
    return Pose((x, y, z), (a, b, c, d))
