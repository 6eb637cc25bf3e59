"""The ROS parameters of the kit-building cell: those of the original that a program of the time may read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias, Union

from cellwright.cell.interface.publications import GRIPPER_JOINT
from cellwright.cell.interface.rows import rows
from cellwright.cell.interface.urdf import robot_description
from cellwright.cell.model.arm import gains_of
from cellwright.config.layout import ARM_JOINTS
from cellwright.config.trial.trial import ArmSettings, JointTolerance, Trial
from cellwright.middleware.interface.table import Row

Parameter: TypeAlias = Union[bool, int, float, str, "list[Parameter]", "dict[str, Parameter]"]

_TRAJECTORIES = "effort_controllers/JointTrajectoryController"
_JOINT_STATES = "joint_state_controller/JointStateController"


def parameters(trial: Trial, *, competition: bool) -> dict[str, Parameter]:
    """The parameters of one cell, from the root on: nested dictionaries, as a parameter server holds them.

    Args:
        trial: what was written about the cell.
        competition: competition mode; the simulator's own services are said to be off the network then.
    """
    description = robot_description(trial)
    cell: dict[str, Parameter] = {"robot_description": description}
    if trial.has_arm:
        rates = {row.name: row for row in rows(trial, competition=competition) if row.rate is not None}
        cell["arm"] = _arm(trial.settings.arm, rates)
        cell["joint_state_controller"] = {
            "type": _JOINT_STATES,
            "publish_rate": _rate(rates["/ariac/joint_states"]),
            "extra_joints": [{"name": GRIPPER_JOINT, "position": 0.0, "velocity": 0.0, "effort": 0.0}],
        }
    return {
        "use_sim_time": True,
        "robot_description": description,
        "ariac": cell,
        "gazebo": {"enable_ros_network": not competition},
    }


def _arm(settings: ArmSettings, rates: Mapping[str, Row]) -> dict[str, Parameter]:
    """The parameters of the arm's controller, in the shape of the original's file."""
    constraints: dict[str, Parameter] = {
        "goal_time": settings.goal_time,
        "stopped_velocity_tolerance": settings.stopped_velocity_tolerance,
    }
    for name in ARM_JOINTS:
        tolerance = settings.tolerances.get(name, JointTolerance())
        constraints[name] = {"trajectory": tolerance.trajectory, "goal": tolerance.goal}
    gains: dict[str, Parameter] = {
        name: {"p": float(each.p), "d": float(each.d), "i": float(each.i), "i_clamp": float(each.i_clamp)}
        for name, each in gains_of(settings).items()
    }
    return {
        "type": _TRAJECTORIES,
        "joints": list(ARM_JOINTS),
        "constraints": constraints,
        "gains": gains,
        "stop_trajectory_duration": settings.stop_trajectory_duration,
        "allow_partial_joints_goal": settings.allow_partial_joints_goal,
        "state_publish_rate": _rate(rates["/ariac/arm/state"]),
        "action_monitor_rate": _rate(rates["/ariac/arm/follow_joint_trajectory/feedback"]),
    }


def _rate(row: Row) -> float:
    """How often the topic comes [Hz]."""
    return 0.0 if row.period is None else float(1 / row.period)
