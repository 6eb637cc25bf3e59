"""Hostile input: refused as a whole and counted, or accepted; the cell goes on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.cell.interface.action import TrajectoryAction
from cellwright.cell.interface.rows import FOLLOW
from cellwright.engine.clock import NANOSECONDS
from cellwright.middleware.bus.refusals import MAX_LINES
from cellwright.middleware.messages import TYPES, Message
from cellwright.middleware.messages.control_msgs import QueryTrajectoryStateRequest
from cellwright.middleware.messages.conversions import joint_trajectory, stamp, trajectory_point
from cellwright.middleware.messages.osrf_gear import (
    AGVControlRequest,
    ConveyorBeltControlRequest,
    ConveyorBeltState,
    GetMaterialLocationsRequest,
    SubmitTrayRequest,
    VacuumGripperControlRequest,
)
from cellwright.middleware.messages.standard import GoalID, JointTrajectory, String, Time
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.util.errors import RejectedCommandError
from tests.cell.interface.goals import ACTION, goal
from tests.middleware.messages.random_messages import messages
from tests.support.cells import ARM_ONLY, INITIAL, JOINTS, TRAY_1, WHOLE, Ear, is_sound, publish, run, wanted, way

AHEAD = tuple(value + 0.1 for value in INITIAL)


@pytest.mark.parametrize("far", [1e6, -1e12, 1e100, -1e306])
def test_trajectory_of_huge_numbers_leaves_cell_sound(far: float) -> None:
    """Numbers that can be computed with are accepted, as in the original; the effort limits protect the arm."""
    cell = Cell(WHOLE)
    gear = cell.parts.pose(cell.parts.part("bin8|gear_part_1"))
    publish(cell, "arm/command", joint_trajectory(JOINTS, [trajectory_point((far,) * 7, time_from_start=NANOSECONDS)]))
    run(cell, 0.5)
    assert is_sound(cell)
    publish(cell, "arm/command", way(INITIAL))
    run(cell, 0.5)
    assert is_sound(cell)
    assert cell.parts.pose(cell.parts.part("bin8|gear_part_1")).position == pytest.approx(gear.position, abs=0.01)


def bad_requests() -> list[tuple[str, Any]]:
    huge = np.zeros((3, 7))
    return [
        ("gripper/control", VacuumGripperControlRequest("yes")),  # type: ignore[arg-type]
        ("gripper/control", VacuumGripperControlRequest(None)),  # type: ignore[arg-type]
        ("gripper/control", TriggerRequest()),
        ("gripper/control", None),
        ("gripper/control", {"enable": True}),
        ("agv1", AGVControlRequest(7)),  # type: ignore[arg-type]
        ("agv1", AGVControlRequest("\ud800")),
        ("conveyor/control", ConveyorBeltControlRequest(None)),  # type: ignore[arg-type]
        ("conveyor/control", ConveyorBeltControlRequest(ConveyorBeltState("100"))),  # type: ignore[arg-type]
        ("conveyor/control", ConveyorBeltControlRequest(ConveyorBeltState(10**400))),
        ("submit_tray", SubmitTrayRequest(TRAY_1, b"order_0_kit_0")),  # type: ignore[arg-type]
        ("arm/query_state", QueryTrajectoryStateRequest(3.5)),  # type: ignore[arg-type]
        ("arm/query_state", QueryTrajectoryStateRequest(huge)),  # type: ignore[arg-type]
        ("material_locations", GetMaterialLocationsRequest(["gear_part"])),  # type: ignore[arg-type]
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("service", "request_"), bad_requests())
def test_malformed_request_is_refused_whole_and_counted(service: str, request_: Any) -> None:
    cell = Cell(WHOLE, competition=False)
    before = cell.state_hash()
    with pytest.raises(RejectedCommandError):
        cell.bus.call(f"/ariac/{service}", request_, node="/team")
    assert cell.bus.refusals.counts[f"/ariac/{service} from /team"] == 1
    assert cell.state_hash() == before


@pytest.mark.parametrize(
    "message",
    [
        String("go"),
        None,
        "trajectory",
        way(AHEAD).points[0],
        JointTrajectory(None, list(JOINTS), []),  # type: ignore[arg-type]
        joint_trajectory((*JOINTS[:6], 7), []),  # type: ignore[arg-type]
        joint_trajectory(JOINTS, ["point"]),  # type: ignore[list-item]
        joint_trajectory(JOINTS, [trajectory_point(np.zeros((7, 7)), time_from_start=1)]),
        joint_trajectory(JOINTS, [trajectory_point(AHEAD, time_from_start=2**40 * NANOSECONDS)]),
    ],
    ids=lambda message: type(message).__name__,
)
def test_malformed_message_is_refused_whole_and_counted(message: Any) -> None:
    cell = Cell(ARM_ONLY)
    log = Ear(cell, "arm/command")
    with pytest.raises(RejectedCommandError):
        publish(cell, "arm/command", message)
    assert cell.bus.refusals.total == 1
    assert len(log) == 0


@pytest.mark.slow
def test_long_trajectory_is_followed() -> None:
    cell = Cell(ARM_ONLY)
    long = joint_trajectory(JOINTS, [trajectory_point(INITIAL, time_from_start=n * 1_000_000) for n in range(1, 5001)])
    publish(cell, "arm/command", long)
    run(cell, 0.1)
    assert wanted(cell) == pytest.approx(INITIAL)


SHARED = Cell(WHOLE, competition=False)
INPUTS = (
    ("arm/command", "trajectory_msgs/msg/JointTrajectory"),
    (f"{ACTION}/goal", "control_msgs/msg/FollowJointTrajectoryActionGoal"),
    (f"{ACTION}/cancel", "actionlib_msgs/msg/GoalID"),
)


@pytest.mark.slow
@given(st.sampled_from(INPUTS).flatmap(lambda pair: st.tuples(st.just(pair[0]), messages(pair[1]))))
@example((f"{ACTION}/goal", replace(goal(way(AHEAD)), goal_id=GoalID(Time(2**31 - 1, 2**32 - 1), "late"))))
@settings(max_examples=150)
def test_cell_survives_any_message(sent: tuple[str, Message]) -> None:
    topic, message = sent
    before = SHARED.simulation.clock.tick
    try:
        publish(SHARED, topic, message)
    except RejectedCommandError:
        assert SHARED.bus.refusals.total > 0
    SHARED.step()
    assert SHARED.simulation.clock.tick == before + 1
    assert is_sound(SHARED)


@given(
    st.lists(st.floats(width=64), min_size=7, max_size=8),
    st.lists(st.floats(width=64), max_size=8),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=150)
def test_cell_survives_any_numbers_in_trajectory(
    positions: list[float], velocities: list[float], seconds: int, nanoseconds: int
) -> None:
    point = trajectory_point(positions, velocities)
    point.time_from_start.sec, point.time_from_start.nanosec = seconds, nanoseconds
    message = joint_trajectory(JOINTS, [point])
    for topic, sent in (("arm/command", message), (f"{ACTION}/goal", goal(message, ""))):
        try:
            publish(SHARED, topic, sent)
        except RejectedCommandError:
            continue
        SHARED.step()
    assert is_sound(SHARED)
    SHARED.state_hash()


@pytest.mark.parametrize("sec", [-(2**31), 2**31 - 1])
@pytest.mark.parametrize("offset", [0, 10 * NANOSECONDS])
def test_goal_whose_stamp_exceeds_seconds_of_32_bits_is_answered(sec: int, offset: int) -> None:
    """Nanoseconds above 10^9 carry into seconds; a clock that was not reset with the state adds to both."""
    cell = Cell(ARM_ONLY)
    sent = goal(way(AHEAD), "late")
    sent.goal_id.stamp.sec, sent.goal_id.stamp.nanosec = sec, 2**32 - 1
    statuses, results = Ear(cell, f"{ACTION}/status"), Ear(cell, f"{ACTION}/result")
    publish(cell, f"{ACTION}/goal", sent)
    (action,) = (each for each in cell.simulation.devices.values() if isinstance(each, TrajectoryAction))
    state = action.get_state()
    cell.simulation.clock.offset = offset
    action.set_state(state)
    publish(cell, f"{ACTION}/cancel", GoalID(stamp(0), ""))
    run(cell, 0.2)
    assert [each.status.goal_id.id for each in results.messages] == ["late"]
    assert statuses.messages
    for message in (*statuses.messages, *results.messages):
        TYPES.to_cdr(message)


def test_cancel_without_goals_changes_only_what_action_remembers() -> None:
    cell = Cell(replace(WHOLE, bin_parts=()))
    before, hash_before = cell.simulation.get_state(), cell.state_hash()
    publish(cell, f"{ACTION}/cancel", GoalID(stamp(0), ""))
    assert cell.state_hash() == hash_before
    publish(cell, f"{ACTION}/cancel", GoalID(stamp(5), "unheard of"))
    after = cell.simulation.get_state()
    assert after["devices"].pop(FOLLOW) != before["devices"].pop(FOLLOW)
    for state in (before, after):  # the status is latched
        state["devices"]["/ariac"]["latched"].pop(f"{FOLLOW}/status", None)
    assert after == before


def test_last_command_of_flood_is_followed() -> None:
    cell = Cell(ARM_ONLY)
    for number in range(2000):
        publish(cell, "arm/command", way(tuple(value + 0.0001 * number for value in INITIAL)))
    run(cell, 1.5)
    assert wanted(cell) == pytest.approx([value + 0.1999 for value in INITIAL])
    assert cell.bus.refusals.total == 0


def test_refusals_of_many_node_names_use_bounded_memory() -> None:
    """Names come from outside: a limited number of sources is counted separately, the others together."""
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    for number in range(1000):
        with pytest.raises(RejectedCommandError):
            publish(cell, "arm/command", String("go"), node=f"/stranger_{number}")
    assert cell.bus.refusals.total == 1000
    assert len(cell.bus.refusals.counts) == 257
    assert len(lines) == MAX_LINES
