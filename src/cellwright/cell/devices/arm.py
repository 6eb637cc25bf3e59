"""Arm on its rail: joint servos in the engine, driven by a joint trajectory controller."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np

from cellwright.cell.devices.joint_trajectory import JointTrajectory
from cellwright.cell.devices.trajectory_controller import Following, JointTrajectoryController
from cellwright.cell.devices.trajectory_goal import GoalRequest, TrajectoryGoal
from cellwright.config.layout import ARM_JOINTS
from cellwright.config.trial.trial import ArmSettings
from cellwright.engine.simulation import Device, Simulation, State

T = TypeVar("T")

MAX_SETPOINT = 1e6
"""Limit of setpoints [rad, m; per s], far beyond the saturation of every servo.

The engine takes much larger setpoints as a sign of divergence and zeroes all of them.
"""


class JointReadings(NamedTuple):
    """Measured joint positions [rad; m], velocities [rad/s; m/s] and efforts [N m; N], in controller order."""

    positions: list[float]
    velocities: list[float]
    efforts: list[float]


class Arm(Device):
    """Arm with its controller. It holds its initial posture from the first step on.

    The servos get the desired position at the start of a step and the desired velocity at its end. Both at the end
    would cost one step of lag.
    """

    def __init__(self, settings: ArmSettings) -> None:
        super().__init__("arm")
        self.controller = JointTrajectoryController(ARM_JOINTS, settings)
        self.on_goal_ended: list[Callable[[TrajectoryGoal], None]] = []

    def attach(self, simulation: Simulation) -> None:
        """Look up the joints and their servos."""
        super().attach(simulation)
        model = simulation.model
        joints = [model.joint(name).id for name in ARM_JOINTS]
        actuators = [model.actuator(name).id for name in ARM_JOINTS]
        count = len(actuators)
        self._qpos = np.array([model.jnt_qposadr[joint] for joint in joints])
        self._dof = np.array([model.jnt_dofadr[joint] for joint in joints])
        self._actuators = np.array(actuators)
        # each servo has two inputs, and the arm's are adjacent: a slice is written ten times faster than a list
        first = int(model.actuator_ctrladr[actuators[0]])
        assert model.actuator_ctrladr[actuators].tolist() == list(range(first, first + 2 * count, 2))
        self._position_ctrl = slice(first, first + 2 * count, 2)
        self._velocity_ctrl = slice(first + 1, first + 2 * count, 2)
        self._step = simulation.clock.timestep

    def reset(self) -> None:
        """Hold the initial posture of the model."""
        self.controller.start(self.simulation.data.qpos[self._qpos].tolist(), self.simulation.now)
        self.set_stepping(True)  # a run that follows another begins in the same state as the first
        self._drive()

    def command(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory from the command topic; see `JointTrajectoryController.command`."""
        self._with_goal(lambda: self.controller.command(trajectory, self.simulation.now))

    def accept(self, request: GoalRequest) -> TrajectoryGoal:
        """Follow the trajectory of an action goal; see `JointTrajectoryController.accept`."""
        return self._with_goal(lambda: self.controller.accept(request, self.simulation.now))

    def cancel(self) -> bool:
        """End the active goal and bring the arm to rest; return whether there was one."""
        return self._with_goal(lambda: self.controller.cancel(self.simulation.now))

    def read(self) -> JointReadings:
        """Return the present joint readings."""
        data = self.simulation.data
        return JointReadings(
            data.qpos[self._qpos].tolist(), data.qvel[self._dof].tolist(), data.actuator_force[self._actuators].tolist()
        )

    def following(self) -> Following:
        """Return desired and actual state of the joints, and the difference."""
        joints = self.read()
        return self.controller.following(self.simulation.now, joints.positions, joints.velocities)

    def before_step(self) -> None:
        """Drive the servos; stop stepping when nothing changes any more."""
        now = self.simulation.now
        self._drive()
        goal = self.controller.goal
        if (goal is None or not goal.active) and now >= self.controller.end:
            self.set_stepping(False)

    def after_step(self) -> None:
        """Check the active goal."""
        goal = self.controller.goal
        if goal is not None and goal.active:
            joints = self.read()
            self.controller.update(self.simulation.now, joints.positions, joints.velocities)
            if goal.result is not None:
                self._report_ended(goal)

    def get_state(self) -> dict[str, Any]:
        """Return the state of the controller."""
        return self.controller.get_state()

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self.controller.set_state(state)

    def _drive(self) -> None:
        simulation = self.simulation
        now = simulation.now
        ctrl = simulation.data.ctrl
        after = simulation.clock.time_of(simulation.clock.tick + 1)
        ctrl[self._position_ctrl] = _clamped(self.controller.positions(now))
        ctrl[self._velocity_ctrl] = _clamped(self.controller.velocities(after))

    def _with_goal(self, act: Callable[[], T]) -> T:
        """Apply an action to the controller, resume stepping, and report a goal that the action has ended."""
        before = self.controller.goal
        ended_before = before is None or not before.active
        result = act()
        self.set_stepping(True)
        if before is not None and not ended_before and not before.active:
            self._report_ended(before)
        return result

    def _report_ended(self, goal: TrajectoryGoal) -> None:
        for listener in self.on_goal_ended:
            listener(goal)


def _clamped(setpoints: list[float]) -> list[float]:
    """Clamp setpoints to +-MAX_SETPOINT; NaN becomes a number."""
    if sum(map(abs, setpoints)) <= MAX_SETPOINT:  # nearly always true, and cheap to check
        return setpoints
    return [min(MAX_SETPOINT, max(-MAX_SETPOINT, each)) for each in setpoints]
