"""Solver for any chain: steps of differential inverse kinematics from many seeds, on the engine's Jacobians.

From a seed the arm steps towards the pose until it is there or gets stuck. The first seed is the posture near which
solutions are wanted, and it leads to most poses. The others are home and Halton's points: repeatable, and evenly spread
over the range of the joints. What they lead to is not all branches, but many of them.
"""

import math
from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from cellwright.mechanism.inverse_kinematics import ArmLimits, ArmSolver, Array
from cellwright.motion.chain import Chain, ChainArm
from cellwright.motion.solver import MAX_STEP, Vector, largest_step, travel
from cellwright.motion.turns import nearest_turn, principal
from cellwright.util.errors import UsageError
from cellwright.util.halton import halton
from cellwright.util.pose import Pose, normalized

SEEDS = 16
"""Number of Halton's points that are tried beside the posture nearby and home."""

POSITION_TOLERANCE, TURN_TOLERANCE = 1e-6, 1e-6
"""Largest distance [m] and angle [rad] between the tool and its pose."""

MAX_STEPS, MAX_STEPS_NEARBY = 60, 20
"""Largest number of steps from a seed, and to a pose close by."""

_DISTINCT = 0.05  # difference of a joint from which two postures are two [rad; m]
_PERIOD = 0.25  # time of a step [s]: at the core's gain the whole error, but for what its damping holds back
_STEP = 1.6  # maximum motion of a joint in a step [rad; m]
# A seed is given up if its error does not shrink to this share in that number of steps. Measured: a share of 0.5 loses
# a seventh of the branches, and 10 steps take a third more time for 4 % more of them.
_STUCK_AFTER, _STUCK_SHARE = 6, 0.8
_TIP, _BASE = "tool", "world"


class QpSolver(ChainArm):
    """Solver by quadratic programs for any chain of joints.

    Args:
        chain: the arm.
        home: home posture [rad; m].
    """

    def __init__(self, chain: Chain, home: Sequence[float]) -> None:
        super().__init__(chain, home)
        self._model = _model_of(chain)
        self._data = mujoco.MjData(self._model)
        self._low, self._high = np.array(self.lower), np.array(self.upper)
        self._core = ArmSolver(
            self._model,
            joints=self.joints,
            tip=_TIP,
            reference=_BASE,
            home=None,
            limits=ArmLimits(self._low, self._high, np.full(len(self.joints), _STEP / _PERIOD), (math.inf, math.inf)),
        )
        low, high = np.maximum(self._low, -math.pi), np.minimum(self._high, math.pi)
        self._seeds = [np.array(self.home), *(low + (high - low) * halton(SEEDS, len(self.joints)))]

    def branches(self, base_T_tool: Pose, near: Sequence[float]) -> Iterator[Vector]:
        """Yield postures within limits that bring the tool to a pose, lazily.

        The first is the one to which the arm steps from `near`, and nearly always the nearest. Those of the other seeds
        follow, the nearest first; it takes ten times as long to get the second one.

        Raises:
            UsageError: a number is not finite.
        """
        target = self._checked(base_T_tool, near)
        if target is None:
            return
        first = self._solve(target, np.array(near, dtype=float), MAX_STEPS)
        found: list[Vector] = []
        if first is not None:
            found.append(self._turned(first, near))
            yield found[0]
        for seed in self._seeds:
            q = self._solve(target, seed, MAX_STEPS)
            if q is not None and not any(self._is_same(q, other) for other in found):
                found.append(self._turned(q, near))
        yield from sorted(found[first is not None :], key=lambda each: travel(each, near, self.speed))

    def step_to(self, base_T_tool: Pose, near: Sequence[float]) -> Vector | None:
        """Return the posture for a pose close by, with no joint moved by more than `MAX_STEP`; None without one.

        Raises:
            UsageError: a number is not finite.
        """
        target = self._checked(base_T_tool, near)
        if target is None:
            return None
        q = self._solve(target, np.array(near, dtype=float), MAX_STEPS_NEARBY)
        return q if q is not None and largest_step(q, near) <= MAX_STEP else None

    def _checked(self, base_T_tool: Pose, near: Sequence[float]) -> Pose | None:
        """Return the pose with a unit quaternion; None if it is farther away than the arm is long."""
        if not (base_T_tool.is_finite() and all(map(math.isfinite, near))):
            raise UsageError("base_T_tool and near must be finite")
        if math.dist(base_T_tool.position, self.chain.joints[0].point) > self.chain.reach:
            return None
        return Pose(base_T_tool.position, normalized(base_T_tool.quaternion))

    def _solve(self, target: Pose, seed: Array, max_steps: int) -> Vector | None:
        """Return the posture to which the arm steps from a seed; None if it gets stuck on its way."""
        model, data, core = self._model, self._data, self._core
        data.qpos[:] = np.clip(seed, self._low, self._high)
        errors: list[float] = []
        for step in range(max_steps):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            error = core.error(data, target)
            distance, angle = math.hypot(*error[:3]), math.hypot(*error[3:])
            if distance < POSITION_TOLERANCE and angle < TURN_TOLERANCE:
                return tuple(data.qpos.tolist())
            errors.append(distance + angle)
            if step >= _STUCK_AFTER and errors[-1] > _STUCK_SHARE * errors[step - _STUCK_AFTER]:
                return None
            data.qpos[:] = np.clip(data.qpos + core.step(data, target, _PERIOD), self._low, self._high)
        return None

    def _turned(self, q: Vector, near: Sequence[float]) -> Vector:
        """Return the same posture with whole turns added to be nearest to another, within limits."""
        turned: list[float] = []
        for value, other, joint in zip(q, near, self.chain.joints, strict=True):
            best = None if joint.is_prismatic else nearest_turn(value, other, joint.lower, joint.upper)
            turned.append(value if best is None else best)
        return tuple(turned)

    def _is_same(self, a: Vector, b: Vector) -> bool:
        return all(
            abs(p - q if joint.is_prismatic else principal(p - q)) < _DISTINCT
            for p, q, joint in zip(a, b, self.chain.joints, strict=True)
        )


def _model_of(chain: Chain) -> mujoco.MjModel:
    """Return a model with the chain alone: a body a joint, along the axes of the base while all joints are at 0."""
    spec = mujoco.MjSpec()
    parent, origin = spec.worldbody, (0.0, 0.0, 0.0)
    for joint in chain.joints:
        parent = parent.add_body(name=f"{joint.name} body", pos=np.subtract(joint.point, origin))
        # the engine takes no moving body without mass; only kinematics are computed
        parent.explicitinertial, parent.mass, parent.inertia = True, 1.0, (1.0, 1.0, 1.0)
        kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.is_prismatic else mujoco.mjtJoint.mjJNT_HINGE
        parent.add_joint(name=joint.name, type=kind, axis=joint.axis)
        origin = joint.point
    tool = chain.base_T_tool
    parent.add_body(name=_TIP, pos=np.subtract(tool.position, origin), quat=tool.quaternion)
    return spec.compile()
