"""Parallel gripper of an arm in a cell: it holds parts, and a drop region makes it drop them."""

from collections.abc import Callable
from typing import Any, Self

from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.build import WorldPart
from cellwright.config.layout.arms import Arm
from cellwright.config.trial.trial import Trial
from cellwright.engine.device import State
from cellwright.mechanism.gripper_goal import GripperGoals
from cellwright.mechanism.parallel_gripper import GOAL_TOLERANCE, ParallelGripper
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose


class FingerGripper(ParallelGripper):
    """Gripper device of an arm, with what programs and the competition use of a suction cup too.

    Args:
        parts: the parts of the cell.
        arm: the arm that carries it.

    Attributes:
        drop_target: each check calls it with name and world_T_part of a held part. It returns the pose to drop the
            part at, or None.
        goals: goals of its actions, part of its state.

    Raises:
        UsageError: the arm has another tool.
    """

    def __init__(self, parts: Parts, arm: Arm) -> None:
        if arm.tool.fingers is None:
            raise UsageError(f"gripper: arm {arm.name!r} has no parallel gripper (got a tool of kind {arm.tool.kind})")
        name = f"gripper_{arm.namespace}" if arm.namespace else "gripper"
        super().__init__(arm.tool.fingers, arm.gripper_names, self._name_of, gripper=arm.namespace, name=name)
        self.parts, self.arm = parts, arm
        self.goals = GripperGoals(self)
        self.drop_target: Callable[[str, Pose], Pose | None] = lambda _name, _pose: None
        parts.on_taken.append(lambda part: self.take_away(part.body))

    @classmethod
    def of(cls, trial: Trial, parts: Parts) -> dict[str, Self]:
        """Return the parallel grippers of a trial's arms, by the names of these."""
        return {arm.name: cls(parts, arm) for arm in trial.arms if arm.tool.kind == "parallel"}

    @property
    def enabled(self) -> bool:
        """True from a command to close until one to open the fingers as far as possible."""
        return self.goal < self.settings.opening - GOAL_TOLERANCE

    @property
    def attached(self) -> bool:
        """True if a part is held."""
        return self.is_holding

    @property
    def width(self) -> float:
        """Present distance between the pads [m]."""
        return self.read().width

    def reset(self) -> None:
        """Begin a run: the fingers stand still, and there is no goal."""
        super().reset()
        self.goals.reset()

    def get_state(self) -> dict[str, Any]:
        """Return the state of the fingers, with the last goal."""
        # absent without a goal, as in recordings of cells that had none
        return {**super().get_state(), **({} if self.goals.goal is None else {"action": self.goals.get_state()})}

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        super().set_state(state)
        self.goals.set_state(state.get("action", {"goal": None}))

    def joints(self) -> tuple[list[float], list[float], list[float]]:
        """Return positions [m], velocities [m/s] and efforts [N] of both fingers, the left one first."""
        data = self.simulation.data
        return (
            data.qpos[self._positions].tolist(),
            data.qvel[self._velocities].tolist(),
            data.actuator_force[self._servos].tolist(),
        )

    def set_enabled(self, enabled: bool) -> None:  # noqa: FBT001
        """Close with the largest force, or open as far as possible, which releases the part."""
        if enabled:
            self.grip()
        else:
            self.open()

    def handle_check(self) -> None:
        """Check the pads; drop the part where a drop region says so."""
        if self.part is not None:
            part: WorldPart = self.parts.part(self.part)
            target = self.drop_target(self.part, self.parts.pose(part))
            if target is not None:
                self.drop("forced drop")
                self.parts.place(part, target)
        super().handle_check()

    def _name_of(self, body: int) -> str | None:
        """Return the name of the part that a body is; None if it is none, or locked to a tray."""
        part = self.parts.by_body.get(body)
        return None if part is None or self.parts.is_locked(part) else part.name
