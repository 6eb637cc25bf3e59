"""Goals of the arm's action, as messages, and the client that sends them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.middleware.messages.control_msgs import (
    FollowJointTrajectoryActionGoal,
    FollowJointTrajectoryGoal,
    JointTolerance,
)
from cellwright.middleware.messages.conversions import duration, stamp
from cellwright.middleware.messages.standard import GoalID, JointTrajectory
from tests.support.cells import ARM_ONLY, INITIAL, Ear, publish

ACTION = "arm/follow_joint_trajectory"
PENDING, ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED, PREEMPTING, RECALLING, RECALLED = range(9)
NEAR = tuple(value + 0.1 for value in INITIAL)
FAR = tuple(value + 0.4 for value in INITIAL)


class Client:
    """Subscriber to the topics of an actionlib client."""

    def __init__(self, cell: Cell) -> None:
        self.status = Ear(cell, f"{ACTION}/status")
        self.feedback = Ear(cell, f"{ACTION}/feedback")
        self.result = Ear(cell, f"{ACTION}/result")

    def statuses(self) -> dict[str, int]:
        """Return the latest status of each goal."""
        return {each.goal_id.id: each.status for each in self.status.messages[-1].status_list}

    def results(self) -> list[tuple[str, int, int]]:
        """Return goal, status and error code of each result."""
        return [(each.status.goal_id.id, each.status.status, each.result.error_code) for each in self.result.messages]


def arm_cell() -> tuple[Cell, Client]:
    cell = Cell(ARM_ONLY)
    return cell, Client(cell)


def velocity(cell: Cell) -> float:
    assert cell.arm is not None
    return max(map(abs, cell.arm.controller.velocities(cell.simulation.now)))


def hashes_of(cells: Iterable[Cell]) -> set[str]:
    return {cell.state_hash() for cell in cells}


def goal(
    trajectory: JointTrajectory, name: str = "goal", given: int = 0, tolerance: float = 0.0, timeout: float = 0.0
) -> FollowJointTrajectoryActionGoal:
    """Return a goal; `given` is the stamp of its identifier [ns], a tolerance of 0 keeps the controller's own."""
    tolerances = [JointTolerance(joint, tolerance) for joint in trajectory.joint_names] if tolerance else []
    content = FollowJointTrajectoryGoal(trajectory, tolerances, tolerances, duration(round(timeout * 1e9)))
    return FollowJointTrajectoryActionGoal(goal_id=GoalID(stamp(given), name), goal=content)


def send(cell: Cell, trajectory: JointTrajectory, name: str = "goal", **more: Any) -> None:
    """Send a goal."""
    publish(cell, f"{ACTION}/goal", goal(trajectory, name, **more))


def cancel(cell: Cell, name: str = "", until: int = 0) -> None:
    """Cancel by name, by time [ns], or everything."""
    publish(cell, f"{ACTION}/cancel", GoalID(stamp(until), name))
