"""Servos that bring joints to positions as the io_teleop node's original moved them.

Each drive requests the velocity clip(24/s * error, +- URDF velocity) for each step, with at most the URDF's effort.
(Measured at the original, PyBullet's position control at 240 Hz: its gain of 0.1 is 24/s.) As in the original, such a
drive is a constraint with a limited force: the engine solves for all drives, joint limits and contacts at once. In
MuJoCo it is the dry friction of a joint, which `mechanism.robot_bodies` gives it. Its reference is moved from rest to
the requested velocity; `drive` does so between the two halves of a step, for the robot's own joints alone.

Mostly no joint limit acts, and few drives reach their effort limits. `integrate` makes such steps in half the time.
Inverse dynamics gives the efforts for the requested velocities, and a small linear system the shortfall of the drives
at their limits. This is exact; the engine's constraints are slightly soft.
"""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.config.robot.model import Joint, JointType, RobotModel
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.chain import JOINT_TYPES

GAIN = 24.0
"""Velocity per position error [1/s]."""
DEFAULT_TURN_SPEED, DEFAULT_SLIDE_SPEED = 10.0, 1.0
"""Speed limit [rad/s; m/s] of a joint without one in the URDF."""
MAX_POSITION = 1e4
"""Maximum position [rad; m] of a joint without limits."""
MAX_SPEED = 1000.0
"""Maximum speed [rad/s; m/s] of any joint, whatever the URDF allows: the engine could not follow."""
_MAX_SATURATED, _MAX_PASSES = 40, 8  # drives at their limits and attempts to find them, before the engine solves
_MIN_INERTIA = 1e-15  # [kg m^2; kg]
_LIMIT_TOLERANCE = 1e-9  # [rad; m] beyond a joint limit that rounding explains

Array = NDArray[np.float64]


class Motion(StrEnum):
    """Motion of joints to their targets."""

    SERVO = "servo"
    TELEPORT = "teleport"
    """At once, within a step, as in the original's later scripts."""


class JointArrays(NamedTuple):
    """Readings of joints: positions [rad; m], velocities [rad/s; m/s], efforts [N m; N], in the order of indices."""

    positions: Array
    velocities: Array
    efforts: Array


class MimicJoints:
    """Mimic joints of a robot: they follow their leaders as far as their own limits allow.

    Args:
        joints: all joints with one degree of freedom, in the order of their numbers.
        lower, upper: their limits [rad; m].

    Attributes:
        followers: numbers of the mimic joints.
        leaders: name of the leader, by name of the mimic joint.
    """

    def __init__(self, joints: Sequence[Joint], lower: Array, upper: Array) -> None:
        numbers = {joint.name: number for number, joint in enumerate(joints)}
        mimics = {joint.name: joint.mimic for joint in joints if joint.mimic is not None}
        self.leaders = {name: mimic.joint for name, mimic in mimics.items()}
        self.followers = np.array([numbers[name] for name in mimics], dtype=int)
        self._led_by = np.array([numbers[leader] for leader in self.leaders.values()], dtype=int)
        self._multipliers = np.array([mimic.multiplier for mimic in mimics.values()])
        self._offsets = np.array([mimic.offset for mimic in mimics.values()])
        self._lower, self._upper = lower[self.followers], upper[self.followers]

    def places(self, positions: Array, velocities: Array | None = None, frequency: float = 1.0) -> Array:
        """Return the followers' positions for all joints at positions [rad; m], or with velocities one step later."""
        places = self._multipliers * positions[self._led_by] + self._offsets
        if velocities is not None:
            places += self._multipliers * velocities[self._led_by] / frequency
        found: Array = np.minimum(np.maximum(places, self._lower), self._upper)
        return found


class JointServos(Device):
    """Servos of all joints of a robot with one degree of freedom, in the order of their indices.

    A mimic joint follows its leader as far as its own limits allow, whatever its own target is.

    Args:
        robot: the robot.
        motion: settings of the motion to targets.
        prefix: prefix of the robot's joints in the engine, which may have others beside them.
    """

    def __init__(self, robot: RobotModel, motion: Motion = Motion.SERVO, prefix: str = "") -> None:
        super().__init__(f"{prefix}joint servos")
        self.motion, self._prefix = motion, prefix
        joints = robot.driven
        self.joints = tuple(joint.name for joint in joints)
        self.lower = np.array([max(joint.limits.lower, -MAX_POSITION) for joint in joints])
        self.upper = np.array([min(joint.limits.upper, MAX_POSITION) for joint in joints])
        self._velocity = np.array([fastest(joint) for joint in joints])
        self._movable = [joint.name for joint in robot.movable if joint.type in JOINT_TYPES]
        self._described = joints
        self._mimics = MimicJoints(joints, self.lower, self.upper)

    def attach(self, simulation: Simulation) -> None:
        """Look up the joints."""
        super().attach(simulation)
        model = simulation.model
        joints = [model.joint(f"{self._prefix}{name}").id for name in self.joints]
        self._qpos = model.jnt_qposadr[joints].copy()
        self._dof = model.jnt_dofadr[joints].copy()
        inputs = [model.actuator_ctrladr[model.actuator(f"{self._prefix}{name}").id] for name in self.joints]
        self._inputs = np.array(inputs, dtype=np.intp)
        self._ctrl = as_slice(self._inputs)
        self._frequency = 1.0 / model.opt.timestep
        # The drives work in the engine's order of degrees of freedom, where arrays of most robots need no look-up.
        self._order = order = np.argsort(self._dof)
        self._inputs, self._places, self._dofs = (
            self._inputs[order],
            as_slice(self._qpos[order]),
            as_slice(self._dof[order]),
        )
        self._fastest, self._back = self._velocity[order], -self._velocity[order]
        self._led = MimicJoints([self._described[number] for number in order], self.lower[order], self.upper[order])
        simulation.on_model.append(self._look_up_arrays)
        self._look_up_arrays()

    def _look_up_arrays(self) -> None:
        """Look up the arrays of the engine, which stay the same objects until it gets another model."""
        model, data = self.simulation.model, self.simulation.data
        self._data = data
        self._positions, self._velocities, self._controls = data.qpos, data.qvel, data.ctrl
        self._guess, self._accelerations = data.qacc_warmstart, data.qacc
        self._forces, self._constraint_efforts = (data.qfrc_applied, data.xfrc_applied), data.qfrc_constraint
        self._requested = np.zeros(model.nv)
        movable = [model.joint(f"{self._prefix}{name}").id for name in self._movable]
        self._is_own: NDArray[np.bool_] = np.isin(model.dof_jntid, movable)
        self._attainable = np.where(self._is_own, model.dof_frictionloss / model.dof_M0, 0.0)
        self._counts = (-1, -1)
        has_contacts = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
        # Without these only drives and joint limits act.
        self._is_free = self._is_own.all() and not (has_contacts or model.neq or model.ntendon)
        if self._is_free:
            self._prepare_to_integrate(model, data)

    def _prepare_to_integrate(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        lower, upper = self.lower[self._order], self.upper[self._order]
        # Efforts of all degrees of freedom and positions of joints, with the middles and half widths of their ranges.
        self._checked = np.zeros(model.nv + len(lower))
        self._efforts, self._checked_places = self._checked[: model.nv], self._checked[model.nv :]
        self._inertias = np.zeros(len(data.M) + 1)  # of the engine's sparse matrix, and a 0
        self._inertia_places = _inertia_places(model)
        self._shortfall, self._reaction = np.zeros(model.nv), np.zeros(model.nv)
        self._bounds = model.dof_frictionloss * (1 + 1e-9)
        self._middles = np.concatenate([np.zeros(model.nv), (lower + upper) / 2])
        self._halves = np.concatenate([model.dof_frictionloss, (upper - lower) / 2 + _LIMIT_TOLERANCE])

    def reset(self) -> None:
        """Hold the posture that the model begins with."""
        data = self.simulation.data
        data.ctrl[self._ctrl] = data.qpos[self._qpos]

    @property
    def targets(self) -> Array:
        """Targets of the joints [rad; m]; a copy."""
        targets: Array = self._controls[self._ctrl].copy()
        return targets

    def command(self, targets: Array) -> None:
        """Set the targets [rad; m] of all joints in their order, clipped to their limits."""
        targets = targets.clip(self.lower, self.upper)
        self._controls[self._ctrl] = targets
        if self.motion is Motion.TELEPORT:
            self.place(range(len(self.joints)), targets)

    def place(self, joints: Sequence[int], positions: Sequence[float] | Array) -> None:
        """Place some joints, by number, at positions [rad; m] at once, at rest, and hold them there."""
        data, chosen = self.simulation.data, list(joints)
        values = np.clip(positions, self.lower[chosen], self.upper[chosen])
        data.qpos[self._qpos[chosen]] = values
        data.qvel[self._dof[chosen]] = 0.0
        controls = self.targets
        controls[chosen] = values
        if self._mimics.leaders:
            followers, places = self._mimics.followers, self._mimics.places(data.qpos[self._qpos])
            data.qpos[self._qpos[followers]] = controls[followers] = places
        self._controls[self._ctrl] = controls
        self.simulation.touch()

    def read(self) -> JointArrays:
        """Return the current readings, with the efforts of the drives in the newest step."""
        # `take` is twice as fast as an index.
        data, numbers = self._data, self._dof
        if data.nf:
            efforts = np.zeros(len(self._requested))
            rows, dofs = self._drives()
            efforts[dofs] = data.efc_force[rows]
        else:
            efforts = self._constraint_efforts
        return JointArrays(self._positions.take(self._qpos), self._velocities.take(numbers), efforts.take(numbers))

    def integrate(self) -> bool:
        """Make this step without the engine's solver, if nothing but drives acts on the joints."""
        if not self._is_free or np.count_nonzero(self._forces[0]) or np.count_nonzero(self._forces[1]):
            return False
        model, data = self.simulation.model, self._data
        self._request()
        np.copyto(self._accelerations, self._requested)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 1, self._efforts)
        self._checked_places[:] = self._positions[self._places]
        is_within = np.abs(self._checked - self._middles) <= self._halves
        if not is_within.all() and not self._saturate(np.flatnonzero(~is_within)):
            return False
        np.copyto(self._constraint_efforts, self._efforts)
        # No constraints: the efforts are in `qfrc_constraint`.
        data.nf = data.nefc = 0
        mujoco.mj_Euler(model, data)
        return True

    def _saturate(self, beyond: NDArray[np.intp]) -> bool:
        """Bring efforts within their limits, with less acceleration; return False if the engine must solve this step.

        A drive at its limit falls short of its requested acceleration, and that changes the efforts of other drives. So
        drives join those at their limits or leave them, until no effort is beyond its limit and no drive helps on.
        """
        model, data, count = self.simulation.model, self._data, len(self._efforts)
        if beyond[-1] >= count:  # a joint limit acts
            return False
        mujoco.mj_crb(model, data)
        self._inertias[:-1] = data.M
        needed, limits = self._efforts, self._halves[:count]
        for _ in range(_MAX_PASSES):
            if not 0 < len(beyond) <= _MAX_SATURATED:
                return False
            own = needed.take(beyond)
            shortfall = np.copysign(limits.take(beyond), own) - own
            inertias = self._inertias.take(self._inertia_places.take(beyond, axis=0).take(beyond, axis=1))
            if mujoco.mju_cholFactor(inertias, _MIN_INERTIA) < len(beyond):
                return False
            mujoco.mju_cholSolve(shortfall, inertias, shortfall)
            self._shortfall[:] = 0.0
            self._shortfall[beyond] = shortfall
            mujoco.mj_mulM(model, data, self._reaction, self._shortfall)
            efforts = needed + self._reaction
            is_beyond = np.abs(efforts) > self._bounds
            is_beyond[beyond] = shortfall * own <= 0.0
            found = np.flatnonzero(is_beyond)
            if np.array_equal(found, beyond):
                self._accelerations += self._shortfall
                self._efforts[:] = efforts
                return True
            beyond = found
        return False

    def drive(self) -> None:
        """Set the velocity of each drive at the end of this step."""
        self._request()
        rows, dofs = self._drives()
        self._data.efc_aref[rows] = self._requested[dofs]
        # Start of the engine's solver: a drive within its limit gives the requested effort, and one at its limit about
        # that of the step before. The result is the same, with a quarter of the iterations.
        np.copyto(self._guess, self._requested, where=np.abs(self._requested) < self._attainable)

    def _request(self) -> None:
        """Compute the acceleration with which each joint has its requested velocity at the end of this step."""
        position = self._positions[self._places]
        requested: Array = self._controls.take(self._inputs)
        requested -= position
        requested *= GAIN
        np.minimum(requested, self._fastest, out=requested)
        np.maximum(requested, self._back, out=requested)
        if self._led.leaders:
            followers = self._led.followers
            within, soon = self._led.places(position), self._led.places(position, requested, self._frequency)
            requested[followers] = (soon - within) * self._frequency + GAIN * (within - position[followers])
        requested -= self._velocities[self._dofs]
        requested *= self._frequency
        self._requested[self._dofs] = requested

    def _drives(self) -> tuple[slice | NDArray[np.intp], NDArray[np.intp] | slice]:
        """Return the place of the drives among the engine's constraints of this step, and their degrees of freedom.

        The engine sets up equalities first, then dry friction: of all joints that are awake, in the same order in every
        step. Joints with drives never sleep, so the numbers of both tell whether their places have changed.
        """
        data = self._data
        counts = (data.ne, data.nf)
        if counts != self._counts:
            first, end = data.ne, data.ne + data.nf
            # The friction of tendons, whose numbers are others, follows that of joints.
            is_joint = data.efc_type[first:end] == int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
            dofs = data.efc_id[first : first + int(is_joint.sum())].astype(np.intp)
            is_own = self._is_own[dofs]
            self._counts, self._rows = counts, as_slice(first + np.flatnonzero(is_own))
            self._dofs_of_rows = as_slice(dofs[is_own])
        return self._rows, self._dofs_of_rows


def _inertia_places(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return the place (nv, nv) of each element of the inertia matrix in the engine's sparse one; -1 for 0."""
    places = np.full((model.nv, model.nv), -1, dtype=np.intp)
    rows, entries = np.repeat(np.arange(model.nv), model.M_rownnz), np.arange(len(model.M_colind))
    places[rows, model.M_colind] = places[model.M_colind, rows] = entries
    return places


def as_slice(numbers: NDArray[np.intp]) -> NDArray[np.intp] | slice:
    """Return indices as a slice, which is faster, if each is one above the one before; otherwise themselves."""
    first, count = int(numbers[0]) if len(numbers) else 0, len(numbers)
    return slice(first, first + count) if np.array_equal(numbers, np.arange(first, first + count)) else numbers


def fastest(joint: Joint) -> float:
    """Return the maximum speed of a joint [rad/s; m/s]."""
    unsaid = DEFAULT_SLIDE_SPEED if joint.type is JointType.PRISMATIC else DEFAULT_TURN_SPEED
    return unsaid if math.isinf(joint.limits.velocity) else min(joint.limits.velocity, MAX_SPEED)
