"""Servos that bring joints to positions as the io_teleop node's original moved them.

Each drive wants the velocity clip(24/s * error, +- URDF velocity) from step to step, and gives at most the URDF's
effort for it. (Measured at the original, PyBullet's position control at 240 Hz: its gain of 0.1 is 24/s.) Such a drive
is a constraint with a bound on its force, as in the original: the engine solves for all drives, joint limits and
contacts at once. In MuJoCo it is the dry friction of a joint, whose reference is moved from rest to the velocity
wanted; `drive` does so between the two halves of a step.
"""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.config.robot.model import Joint, JointType, RobotModel
from cellwright.engine.simulation import Device, Simulation

GAIN = 24.0
"""Velocity for an error of one [1/s]."""
UNLIMITED = 1e9
"""Effort [N m; N] of a joint that the URDF sets no bound for."""
UNSAID_TURN, UNSAID_SLIDE = 10.0, 1.0
"""Greatest speed [rad/s; m/s] of a joint that the URDF sets no bound for."""
FARTHEST = 1e4
"""So far [rad; m] a joint without limits may be sent."""
FASTEST = 1000.0
"""Faster [rad/s; m/s] no joint is driven, whatever the URDF says: the engine could not follow."""
_STIFFNESS = 0.9999  # of the drives, as the engine takes it: what is left of an error in one step is 1e-4 of it

Array = NDArray[np.float64]


class Motion(StrEnum):
    """How targets are reached."""

    SERVO = "servo"
    TELEPORT = "teleport"
    """At once, within a step: the variant of the original's later scripts."""


class JointReadings(NamedTuple):
    """Joints as they are: positions [rad; m], velocities [rad/s; m/s], efforts [N m; N], in the order of indices."""

    positions: Array
    velocities: Array
    efforts: Array


class MimicJoints:
    """The joints of a robot that mimic another: they go where that one has them, as far as their own limits let them.

    Args:
        joints: all joints with one degree of freedom, in the order of their numbers.
        lower, upper: their limits [rad; m].

    Attributes:
        followers: the numbers of those that follow another.
        leaders: name of the joint that is followed, by the name of the one that follows.
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
        """Where the followers belong with all joints at positions [rad; m], or one step after that with velocities."""
        places = self._multipliers * positions[self._led_by] + self._offsets
        if velocities is not None:
            places += self._multipliers * velocities[self._led_by] / frequency
        found: Array = np.minimum(np.maximum(places, self._lower), self._upper)
        return found


class JointServos(Device):
    """The servos of all joints of a robot with one degree of freedom, in the order of their indices.

    A joint that mimics another is driven along with it, whatever target it is given, as far as its own limits let it.
    """

    def __init__(self, robot: RobotModel, motion: Motion = Motion.SERVO) -> None:
        super().__init__("joint servos")
        self.motion = motion
        joints = robot.driven
        self.joints = tuple(joint.name for joint in joints)
        self.lower = np.array([max(joint.limits.lower, -FARTHEST) for joint in joints])
        self.upper = np.array([min(joint.limits.upper, FARTHEST) for joint in joints])
        self._velocity = np.array([fastest(joint) for joint in joints])
        effort = np.array([joint.limits.effort for joint in joints])
        self._effort = np.where(np.isfinite(effort), effort, UNLIMITED)
        self._mimics = MimicJoints(joints, self.lower, self.upper)

    def attach(self, simulation: Simulation) -> None:
        """Look up the joints, and let their dry friction be their drives."""
        super().attach(simulation)
        model = simulation.model
        joints = [model.joint(name).id for name in self.joints]
        self._qpos = model.jnt_qposadr[joints].copy()
        self._dof = model.jnt_dofadr[joints].copy()
        self._ctrl = np.array([model.actuator(name).id for name in self.joints], dtype=int)
        model.dof_frictionloss[:] = UNLIMITED  # a joint that nothing drives stays where it is
        model.dof_frictionloss[self._dof] = self._effort
        model.dof_solimp[:] = (_STIFFNESS, _STIFFNESS, 0.001, 0.5, 2.0)
        self._frequency = 1.0 / model.opt.timestep
        self._wanted = np.zeros(model.nv)
        self._fastest, self._back = self._velocity.copy(), -self._velocity
        data = simulation.data  # these arrays stay where they are as long as the simulation lives
        self._positions, self._velocities, self._controls = data.qpos, data.qvel, data.ctrl
        self._guess = data.qacc_warmstart
        self._attainable = model.dof_frictionloss / model.dof_M0
        self._counts = (-1, -1)

    def reset(self) -> None:
        """Hold the posture that the model begins with."""
        data = self.simulation.data
        data.ctrl[self._ctrl] = data.qpos[self._qpos]

    @property
    def targets(self) -> Array:
        """Where the joints are to go [rad; m]; a copy."""
        targets: Array = self.simulation.data.ctrl[self._ctrl]
        return targets

    def command(self, targets: Array) -> None:
        """Have the joints go to `targets` [rad; m], of all joints in their order, cut off at their limits."""
        targets = np.clip(targets, self.lower, self.upper)
        self.simulation.data.ctrl[self._ctrl] = targets
        if self.motion is Motion.TELEPORT:
            self.place(range(len(self.joints)), targets)

    def place(self, joints: Sequence[int], positions: Sequence[float] | Array) -> None:
        """Put some joints, by their number here, at positions [rad; m] at once, at rest, and have them stay there."""
        data, chosen = self.simulation.data, list(joints)
        values = np.clip(positions, self.lower[chosen], self.upper[chosen])
        data.qpos[self._qpos[chosen]] = values
        data.qvel[self._dof[chosen]] = 0.0
        data.ctrl[self._ctrl[chosen]] = values
        if self._mimics.leaders:
            followers, places = self._mimics.followers, self._mimics.places(data.qpos[self._qpos])
            data.qpos[self._qpos[followers]] = data.ctrl[self._ctrl[followers]] = places
        self.simulation.touch()

    def read(self) -> JointReadings:
        """The joints as they are now, with the efforts that the drives gave in the newest step."""
        data, efforts = self.simulation.data, np.zeros(self.simulation.model.nv)
        rows, dofs = self._drives()
        efforts[dofs] = data.efc_force[rows]
        return JointReadings(data.qpos[self._qpos], data.qvel[self._dof], efforts[self._dof])

    def drive(self) -> None:
        """Give each drive the velocity that it is to have at the end of this step."""
        position = self._positions[self._qpos]
        wanted = self._controls[self._ctrl]
        wanted -= position
        wanted *= GAIN
        np.minimum(wanted, self._fastest, out=wanted)
        np.maximum(wanted, self._back, out=wanted)
        if self._mimics.leaders:
            followers = self._mimics.followers
            within, soon = self._mimics.places(position), self._mimics.places(position, wanted, self._frequency)
            wanted[followers] = (soon - within) * self._frequency + GAIN * (within - position[followers])
        wanted -= self._velocities[self._dof]
        wanted *= self._frequency
        self._wanted[self._dof] = wanted
        rows, dofs = self._drives()
        self.simulation.data.efc_aref[rows] = self._wanted[dofs]
        # where the engine's solver begins: a drive that is not at its bound gives what is wanted, and one that is gives
        # about what it gave in the step before; what comes out is the same, with a quarter of the iterations
        np.copyto(self._guess, self._wanted, where=np.abs(self._wanted) < self._attainable)

    def _drives(self) -> tuple[slice, NDArray[np.intp]]:
        """Where the drives stand among the engine's constraints of this step, and whose degree of freedom each is.

        The engine sets up equalities first, then dry friction: of all joints, in the same order in every step.
        """
        data = self.simulation.data
        counts = (data.ne, data.nf)
        if counts != self._counts:
            first, end = data.ne, data.ne + data.nf
            own = data.efc_type[first:end] == int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
            end = first + int(own.sum())  # the friction of tendons comes after that of joints
            self._counts, self._rows = counts, slice(first, end)
            self._dofs_of_rows = data.efc_id[first:end].astype(np.intp)
        return self._rows, self._dofs_of_rows


def fastest(joint: Joint) -> float:
    """Speed that a joint is driven with at most [rad/s; m/s]."""
    unsaid = UNSAID_SLIDE if joint.type is JointType.PRISMATIC else UNSAID_TURN
    return unsaid if math.isinf(joint.limits.velocity) else min(joint.limits.velocity, FASTEST)
