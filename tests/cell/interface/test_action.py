"""The arm's action, as seen by an actionlib client."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cellwright.cell.cell import Cell
from cellwright.config.arm import ArmSettings
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.middleware.messages.control_msgs import JointTolerance
from cellwright.middleware.messages.conversions import duration, header, nanoseconds
from cellwright.util.errors import RejectedCommandError
from tests.cell.interface.goals import (
    ABORTED,
    ACTION,
    ACTIVE,
    FAR,
    NEAR,
    PREEMPTED,
    REJECTED,
    SUCCEEDED,
    Client,
    arm_cell,
    cancel,
    goal,
    hashes_of,
    send,
    velocity,
)
from tests.support.cells import ARM_ONLY, INITIAL, JOINTS, Ear, publish, run, run_to, way


def test_goal_is_accepted_reported_and_succeeds() -> None:
    cell, client = arm_cell()
    run(cell, 0.3)
    send(cell, way(NEAR), "first")
    assert client.statuses() == {"first": ACTIVE}  # immediately
    assert client.status.times[-1] == pytest.approx(0.3)
    run(cell, 1.5)
    assert client.results() == [("first", SUCCEEDED, 0)]
    assert client.result.times[0] == pytest.approx(1.3, abs=0.1)
    assert client.statuses() == {"first": SUCCEEDED}
    assert client.feedback.times == pytest.approx([0.4 + 0.1 * n for n in range(len(client.feedback))])
    assert len(client.feedback) in (9, 10)
    heard = client.feedback.messages[4]
    assert (heard.status.goal_id.id, heard.status.status) == ("first", ACTIVE)
    assert tuple(heard.feedback.joint_names) == JOINTS
    assert heard.feedback.desired.positions == pytest.approx([value + 0.05 for value in INITIAL])
    assert heard.feedback.error.positions == pytest.approx(
        heard.feedback.desired.positions - heard.feedback.actual.positions
    )
    assert nanoseconds(heard.header.stamp) == nanoseconds(heard.feedback.header.stamp) == 800_000_000


def test_status_comes_at_5_hz_until_5_s_after_end_of_goal() -> None:
    cell, client = arm_cell()
    send(cell, way(NEAR), "first")
    run(cell, 6.0)
    ended = client.result.times[0]
    times = [
        time for time, message in zip(client.status.times, client.status.messages, strict=True) if message.status_list
    ]
    assert max(times) == pytest.approx(ended + 5.0, abs=0.21)
    run(cell, 0.5)
    assert client.statuses() == {}
    whole = [time for time in client.status.times if round(time * 1000) % 200 == 0 and time > 0.1]
    assert len(whole) == 32


def test_late_subscriber_gets_latched_status() -> None:
    cell, _ = arm_cell()
    send(cell, way(FAR), "first")
    late = Ear(cell, f"{ACTION}/status")
    assert [each.goal_id.id for each in late.messages[0].status_list] == ["first"]


def test_goal_off_path_is_aborted() -> None:
    cell, client = arm_cell()
    message = goal(way(FAR, each=0.02), "wild")
    publish(cell, f"{ACTION}/goal", message)
    run(cell, 1.0)
    assert client.results() == [("wild", ABORTED, -4)]
    assert "left its path" in client.result.messages[0].result.error_string
    assert client.statuses() == {"wild": ABORTED}
    assert client.result.messages[0].status.text == client.result.messages[0].result.error_string


def test_goal_not_arrived_in_goal_time_is_aborted() -> None:
    cell, client = arm_cell()
    message = goal(way(NEAR), "strict")
    message.goal.goal_tolerance = [JointTolerance(joint, 1e-9) for joint in JOINTS]
    message.goal.goal_time_tolerance = duration(200_000_000)
    publish(cell, f"{ACTION}/goal", message)
    run(cell, 1.5)
    assert client.results() == [("strict", ABORTED, -5)]
    assert client.result.times[0] == pytest.approx(1.2, abs=0.003)


def test_invalid_goal_is_rejected_with_reason() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "good")
    run(cell, 0.2)
    bad = way(NEAR)
    bad.joint_names.append("vacuum_gripper_joint")
    with pytest.raises(RejectedCommandError, match="unknown joint 'vacuum_gripper_joint'"):
        send(cell, bad, "bad")
    with pytest.raises(RejectedCommandError, match="nan"):
        send(cell, way((math.nan, *NEAR[1:])), "worse")
    with pytest.raises(RejectedCommandError, match="tolerances must be finite"):
        send(cell, way(NEAR), "worst", tolerance=math.nan)
    assert client.results() == [("bad", REJECTED, -2), ("worse", REJECTED, -1), ("worst", REJECTED, -1)]
    assert client.statuses() == {"good": ACTIVE, "bad": REJECTED, "worse": REJECTED, "worst": REJECTED}
    assert cell.bus.refusals.total == 3
    run(cell, 1.5)
    assert client.results()[-1] == ("good", SUCCEEDED, 0)


def test_goal_with_id_of_active_goal_is_refused() -> None:
    cell, client = arm_cell()
    send(cell, way(NEAR), "same")
    run(cell, 0.2)
    before = cell.state_hash()
    with pytest.raises(RejectedCommandError, match="goal 'same' is already active"):
        send(cell, way(FAR), "same")
    assert cell.state_hash() == before
    run(cell, 1.2)
    assert client.results() == [("same", SUCCEEDED, 0)]


def test_goal_with_id_of_ended_goal_is_refused_for_5_s_after_newest_copy() -> None:
    cell, client = arm_cell()
    send(cell, way(NEAR), "same")
    run(cell, 1.2)
    assert client.results() == [("same", SUCCEEDED, 0)]
    for _ in range(2):
        run(cell, 4.7)
        with pytest.raises(RejectedCommandError, match="goal 'same' has ended less than 5 s ago; send another id"):
            send(cell, way(FAR), "same")
        assert client.statuses() == {"same": SUCCEEDED}
        assert velocity(cell) == 0.0
    run(cell, 5.1)
    send(cell, way(INITIAL), "same")  # the identifier is free again
    run(cell, 1.2)
    assert client.results() == [("same", SUCCEEDED, 0)] * 2


def test_flood_of_bad_goals_keeps_status_message_bounded() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "good")
    for number in range(300):
        with pytest.raises(RejectedCommandError):
            send(cell, way(FAR[:3]), f"bad {number}")
    statuses = client.statuses()
    assert len(statuses) == 51
    assert statuses["good"] == ACTIVE
    assert "bad 299" in statuses
    cancel(cell, "good")
    assert client.results()[-1] == ("good", PREEMPTED, 0)


def test_goal_without_stamp_gets_time_of_arrival() -> None:
    cell, client = arm_cell()
    run(cell, 0.5)
    send(cell, way(FAR), "mine")
    run(cell, 0.1)
    cancel(cell, until=499_999_999)
    assert client.statuses() == {"mine": ACTIVE}
    cancel(cell, until=500_000_000)
    assert client.statuses() == {"mine": PREEMPTED}


def test_goal_without_id_gets_one() -> None:
    cell, client = arm_cell()
    run(cell, 0.5)
    send(cell, way(FAR), "")
    send(cell, way(NEAR), "")
    names = list(client.statuses())
    assert names == ["/client-1-0.500000000", "/client-2-0.500000000"]
    cancel(cell, names[1])
    assert client.results() == [(name, PREEMPTED, 0) for name in names]


def test_goal_is_preempted_by_other_goal() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "first")
    run(cell, 0.2)
    send(cell, way(NEAR), "second")
    assert client.results() == [("first", PREEMPTED, 0)]
    assert client.result.messages[0].status.text == "another goal took its place"
    assert client.statuses() == {"first": PREEMPTED, "second": ACTIVE}
    run(cell, 1.5)
    assert client.results()[1:] == [("second", SUCCEEDED, 0)]


def test_goal_is_preempted_by_command_on_topic() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "first")
    run(cell, 0.2)
    publish(cell, "arm/command", way(INITIAL))
    assert client.results() == [("first", PREEMPTED, 0)]
    run(cell, 1.5)
    assert cell.arm is not None
    assert cell.arm.read().positions == pytest.approx(INITIAL, abs=0.05)


def test_goal_without_points_stops_arm_and_succeeds() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "first")
    run(cell, 0.5)
    send(cell, way(), "halt")
    run(cell, 1.0)
    assert client.results() == [("first", PREEMPTED, 0), ("halt", SUCCEEDED, 0)]
    assert velocity(cell) == 0.0


def test_partial_goal_succeeds_where_trial_allows_it() -> None:
    settings = replace(ARM_ONLY.settings, arm=ArmSettings(allow_partial_joints_goal=True))
    cell = Cell(replace(ARM_ONLY, settings=settings))
    client = Client(cell)
    send(cell, way((0.2,), names=JOINTS[:1]), "rail")
    run(cell, 1.5)
    assert client.results() == [("rail", SUCCEEDED, 0)]


def test_reset_clears_goals() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "old")
    run(cell, 0.5)
    cell.reset()
    assert len(Ear(cell, f"{ACTION}/status")) == 0
    run(cell, 1.0)
    assert client.statuses() == {}
    assert client.results() == []


def test_restored_run_continues_goal() -> None:
    cell, client = arm_cell()
    send(cell, way(FAR), "", given=NANOSECONDS)
    run(cell, 0.5)
    moment = take_snapshot(cell.simulation)
    other = Cell(ARM_ONLY)
    restore_snapshot(other.simulation, moment)
    heard = Client(other)
    cancel(other, until=NANOSECONDS - 1)
    cancel(cell, until=NANOSECONDS - 1)
    for each in (cell, other):
        run_to(each, 0.7)
        send(each, way(INITIAL), "")
        run_to(each, 0.9)
    assert heard.results() == client.results() == [("/client-1-0.000000000", PREEMPTED, 0)]
    assert nanoseconds(heard.result.messages[0].status.goal_id.stamp) == NANOSECONDS
    assert [each.status.goal_id.id for each in heard.feedback.messages[:2]] == ["/client-1-0.000000000"] * 2
    assert hashes_of((cell, other)) == {cell.state_hash()}


def test_generated_goal_ids_are_same_in_every_run() -> None:
    cell, _ = arm_cell()
    hashes = []
    for _ in range(2):
        send(cell, way(NEAR), "")
        run(cell, 0.3)
        hashes.append(cell.state_hash())
        cell.reset()
    assert hashes[0] == hashes[1]


def test_action_client_changes_no_state_hash() -> None:
    cells = (Cell(ARM_ONLY), Cell(ARM_ONLY))
    Client(cells[0])
    for cell in cells:
        send(cell, way(NEAR), "a", given=1)
        run(cell, 0.4)
        cancel(cell)
        run_to(cell, 5.6)
    assert hashes_of(cells) == {cells[0].state_hash()}


def test_goal_with_wall_time_is_accepted_and_reported() -> None:
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    client = Client(cell)
    trajectory = replace(way(NEAR), header=header("", 1_764_000_000 * NANOSECONDS))
    publish(cell, f"{ACTION}/goal", goal(trajectory, "wall"), node="/team")
    run(cell, 0.3)
    assert client.statuses() == {"wall": ACTIVE}
    assert len(lines) == 1
    assert lines[0].startswith(
        f"/ariac/{ACTION}/goal from /team: the trajectory is stamped with wall time (1764000000 s)"
    )
