"""Differential inverse kinematics of one arm: the joint step that brings its tip nearer to a pose.

Each step is the solution of a quadratic program on the engine's Jacobians:

    minimise   |W (J dq - step)|^2 + damping |dq - N posture|^2     over dq
    subject to the limits of position and velocity of each joint

`step` goes straight towards the target. `posture` leads home, and N lets through only what leaves the tip where it is:
an arm with more joints than it needs has a posture of its own for each pose, and a target is still met exactly. The
damping grows with the step that is left: far from the target, or at one that is out of reach, it keeps the iteration
from overshooting where the arm is stretched out; close to a target it is next to nothing.
"""

import math

import daqp
import mujoco
import numpy as np

from cellwright.robot.model import body_of
from cellwright.robot.servos import Array
from cellwright.util.pose import Pose

TURN_WEIGHT = 0.2
"""What an error of 1 rad counts beside one of 1 m [m]: as in the original's controller; the size of a hand."""
GAIN = 60.0
"""Share of the error that is made good [1/s], as long as no bound is met; commands at 100 Hz melt into one motion."""
POSTURE_GAIN, POSTURE_SPEED = 2.0, 0.5
"""How the posture goes home: share of the way [1/s], and most that it is moved by [rad/s; m/s]."""

POSTURE_REST = 0.02
"""Slower than this the posture does not creep on, so that an arm comes to rest [rad/s; m/s]."""

_LEAST_DAMPING = 1e-6  # keeps the program convex; an arm that is stretched out still meets what it reaches to 1e-6 m
_DAMPING = 0.2  # for a step of 1 m [m]; measured: with 0.05 an arm of 0.7 m trembles at targets that it cannot reach
_ROW_DAMPING = 1e-5  # what counts as a singular direction for N
_OPTIMAL = 1
_UNBOUNDED = 1e30  # as the solver has it


class ArmSolver:
    """Steps of the joints of one arm, each with one degree of freedom, that bring the link `tip` to a pose.

    Poses are given in the frame of the link `reference`. The arm keeps to the posture `home` where they leave a choice,
    and to its limits of position [rad; m] and velocity [rad/s; m/s]; `caps` are the greatest speeds of the tip along
    [m/s] and about [rad/s].
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        joints: tuple[str, ...],
        tip: str,
        reference: str,
        home: Array,
        lower: Array,
        upper: Array,
        velocity: Array,
        caps: tuple[float, float],
    ) -> None:
        self.lower, self.upper = lower, upper
        self._model, self._home, self._velocity, self._caps = model, home, velocity, caps
        ids = [model.joint(name).id for name in joints]
        self.qpos = model.jnt_qposadr[ids].copy()
        self._dofs = model.jnt_dofadr[ids].copy()
        self._tip, self._reference = model.body(body_of(tip)).id, model.body(body_of(reference)).id
        self._moves_reference = bool(_is_above(model, ids, self._reference))
        self._jacobian = np.zeros((6, model.nv))
        self._other = np.zeros((6, model.nv))
        self._weights = np.repeat((1.0, TURN_WEIGHT), 3)
        self._identity = np.eye(len(joints))
        self._row_damping, self._forces = _ROW_DAMPING * np.eye(6), np.zeros(6)
        self._no_rows = np.zeros((0, len(joints)))
        self._kinds = np.zeros(len(joints), dtype=np.intc)
        self._turned, self._turn = np.zeros(4), np.zeros(3)

    def pose(self, data: mujoco.MjData, link: str | None = None) -> Pose:
        """reference_T_tip, or reference_T_link; positions of bodies in `data` are up to date."""
        body = self._tip if link is None else self._model.body(body_of(link)).id
        return _body_pose(data, self._reference).inverse() @ _body_pose(data, body)

    def error(self, data: mujoco.MjData, target: Pose) -> Array:
        """Way and turn from the tip to `target`, reference_T_tip, along the axes of the world [m, rad]."""
        tip, reference = self._tip, self._reference
        error = np.empty(6)
        error[:3] = self._goal(data, target) - data.xpos[tip]
        mujoco.mju_mulQuat(self._turned, data.xquat[reference], np.array(target.quaternion))
        mujoco.mju_subQuat(self._turn, self._turned, data.xquat[tip])
        error[3:] = data.xmat[tip].reshape(3, 3) @ self._turn
        return error

    def step(self, data: mujoco.MjData, target: Pose, time: float) -> Array:
        """How far each joint is to be moved within `time` [s] to bring the tip nearer to `target` [rad; m].

        Joint positions in `data` are within their limits, bodies and motion axes up to date (`mj_kinematics` and
        `mj_comPos`).
        """
        error = self.error(data, target)
        jacobian = self._weights[:, None] * self._jacobian_of(data, target)
        step = self._weights * (self._share(error, time) * error)
        damping = _LEAST_DAMPING + _DAMPING * math.sqrt(step @ step)

        position = data.qpos[self.qpos]
        posture = self._posture(position, jacobian, time)
        bound = np.minimum(self._velocity * time, _UNBOUNDED)
        found, _, flag, _ = daqp.solve(
            jacobian.T @ jacobian + damping * self._identity,
            -(jacobian.T @ step) - damping * posture,
            self._no_rows,
            np.minimum(self.upper - position, bound),
            np.maximum(self.lower - position, -bound),
            self._kinds,
        )
        moved: Array = np.asarray(found)
        return moved if flag == _OPTIMAL else np.zeros_like(position)  # no step was found: stand still

    def _posture(self, position: Array, jacobian: Array, time: float) -> Array:
        """The way home that leaves the tip where it is [rad; m]: N posture."""
        most = POSTURE_SPEED * time
        posture: Array = np.maximum(np.minimum(POSTURE_GAIN * time * (self._home - position), most), -most)
        gram = jacobian @ jacobian.T + self._row_damping
        mujoco.mju_cholFactor(gram, 0.0)
        mujoco.mju_cholSolve(self._forces, gram, jacobian @ posture)
        posture -= jacobian.T @ self._forces
        if np.abs(posture).max() < POSTURE_REST * time:
            posture[:] = 0.0
        return posture

    def _share(self, error: Array, time: float) -> float:
        """Which part of the error is to be made good in this step: all of it in one straight motion."""
        share = -math.expm1(-GAIN * time)
        for way, speed in zip((math.hypot(*error[:3]), math.hypot(*error[3:])), self._caps, strict=True):
            if share * way > speed * time:
                share = speed * time / way
        return share

    def _goal(self, data: mujoco.MjData, target: Pose) -> Array:
        """Where the target is in the world [m]."""
        goal: Array = data.xpos[self._reference] + data.xmat[self._reference].reshape(3, 3) @ target.position
        return goal

    def _jacobian_of(self, data: mujoco.MjData, target: Pose) -> Array:
        """How the arm's joints move its tip, as seen from the reference."""
        jacobian = self._jacobian
        mujoco.mj_jacBody(self._model, data, jacobian[:3], jacobian[3:], self._tip)
        found: Array = jacobian[:, self._dofs]
        if self._moves_reference:
            mujoco.mj_jac(
                self._model, data, self._other[:3], self._other[3:], self._goal(data, target), self._reference
            )
            found = found - self._other[:, self._dofs]
        return found


def _is_above(model: mujoco.MjModel, joints: list[int], body: int) -> bool:
    """Whether one of the joints moves a body."""
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
