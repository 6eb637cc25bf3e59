"""Arm: joint servos in the engine, driven by a joint trajectory controller."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Self, TypeVar

from cellwright.config.arm import ARM_JOINTS, ArmSettings
from cellwright.config.layout.arm_models import joints_of
from cellwright.config.trial.trial import Trial
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.mechanism.joint_trajectory import JointTrajectory
from cellwright.mechanism.setpoints import Setpoints
from cellwright.mechanism.trajectory_controller import Following, JointTrajectoryController
from cellwright.mechanism.trajectory_goal import GoalRequest, TrajectoryGoal

T = TypeVar("T")


class JointReadings(NamedTuple):
    """Measured joint positions [rad; m], velocities [rad/s; m/s] and efforts [N m; N], in controller order."""

    positions: list[float]
    velocities: list[float]
    efforts: list[float]


class Arm(Device):
    """Arm with its controller. It holds its initial posture from the first step on.

    Args:
        settings: settings of the controller.
        joints: joints of the controller, base first.
        in_engine: their names in the engine; the same by default.
        name: name of the device.
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        return self.controller.joint_names

    def __init__(
        self,
        settings: ArmSettings,
        joints: Sequence[str] = ARM_JOINTS,
        in_engine: Sequence[str] = (),
        *,
        name: str = "arm",
    ) -> None:
        super().__init__(name)
        self.controller = JointTrajectoryController(joints, settings)
        self._names = [*(in_engine or joints)]
        self.on_goal_ended: list[Callable[[TrajectoryGoal], None]] = []

    @classmethod
    def of(cls, trial: Trial) -> dict[str, Self]:
        """Return the arms of a trial's cell, by their names in the layout."""
        found = {}
        for arm in trial.arms:
            names, settings = [*joints_of(arm, trial.arm_models)], trial.settings.arm
            tolerances = {arm.joint_prefix + name: each for name, each in settings.tolerances.items()}
            found[arm.name] = cls(
                replace(settings, tolerances=tolerances),
                [arm.joint_prefix + name for name in names],
                [arm.prefix + name for name in names],
                name=arm.namespace or "arm",
            )
        return found

    def attach(self, simulation: Simulation) -> None:
        """Look up the joints and their servos."""
        super().attach(simulation)
        self._clock = simulation.clock
        self._setpoints = Setpoints(simulation, self._names)
        self._find_joints()
        simulation.on_model.append(self._find_joints)

    def _find_joints(self) -> None:
        model, data = self.simulation.model, self.simulation.data
        # views: the joints and their servos are adjacent in the engine, and its arrays stay where they are
        self._positions = data.qpos[_slice([model.joint(name).qposadr[0] for name in self._names])]
        self._velocities = data.qvel[_slice([model.joint(name).dofadr[0] for name in self._names])]
        self._efforts = data.actuator_force[_slice([model.actuator(name).id for name in self._names])]

    def reset(self) -> None:
        """Hold the initial posture of the model."""
        self.controller.start(self._positions.tolist(), self.simulation.now)
        # a run that follows another begins in the same state as the first
        self.set_stepping(True)
        self._setpoints.write(self.controller.trajectory)

    def command(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory from the command topic; see `JointTrajectoryController.command`."""
        self._with_goal(lambda: self.controller.command(trajectory, self.simulation.now))

    def steer(self, positions: Sequence[float], duration: int) -> None:
        """Move all joints to positions [rad; m] in `duration` [ns]; see `JointTrajectoryController.steer`."""
        self._with_goal(lambda: self.controller.steer(positions, duration, self.simulation.now))

    def accept(self, request: GoalRequest) -> TrajectoryGoal:
        """Follow the trajectory of an action goal; see `JointTrajectoryController.accept`."""
        return self._with_goal(lambda: self.controller.accept(request, self.simulation.now))

    def cancel(self) -> bool:
        """End the active goal and bring the arm to rest; return whether there was one."""
        return self._with_goal(lambda: self.controller.cancel(self.simulation.now))

    def halt(self, reason: str) -> None:
        """Bring the arm to rest, whatever it does; an active goal ends for this reason."""
        self._with_goal(lambda: self.controller.halt(self.simulation.now, reason))

    def read(self) -> JointReadings:
        """Return the present joint readings."""
        return JointReadings(self._positions.tolist(), self._velocities.tolist(), self._efforts.tolist())

    def following(self) -> Following:
        """Return desired and actual state of the joints, and the difference."""
        joints = self.read()
        return self.controller.following(self.simulation.now, joints.positions, joints.velocities)

    def before_step(self) -> None:
        """Drive the servos; stop stepping when nothing changes any more."""
        controller = self.controller
        trajectory, goal = controller.trajectory, controller.goal
        self._setpoints.write(trajectory)
        if self._clock.now >= trajectory.end and (goal is None or not goal.active):
            self.set_stepping(False)

    def after_step(self) -> None:
        """Check the active goal."""
        goal = self.controller.goal
        if goal is not None and goal.active and goal.is_checked_at(now := self._clock.now):
            self.controller.update(now, self._positions.tolist(), self._velocities.tolist())
            if goal.result is not None:
                self._report_ended(goal)

    def get_state(self) -> dict[str, Any]:
        """Return the state of the controller."""
        return self.controller.get_state()

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self.controller.set_state(state)

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


def _slice(addresses: list[int]) -> slice:
    """Return adjacent addresses as a slice."""
    first, count = int(addresses[0]), len(addresses)
    assert list(map(int, addresses)) == list(range(first, first + count))
    return slice(first, first + count)
