"""Goals of the arm's action, as messages."""

from __future__ import annotations

from typing import Any

from cellwright.cell.cell import Cell
from cellwright.middleware.messages.control_msgs import (
    FollowJointTrajectoryActionGoal,
    FollowJointTrajectoryGoal,
    JointTolerance,
)
from cellwright.middleware.messages.conversions import duration, stamp
from cellwright.middleware.messages.standard import GoalID, JointTrajectory
from tests.support.cells import publish

ACTION = "arm/follow_joint_trajectory"


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
