"""Commands and services of a real cell, including hostile ones."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.kit_sender import PREPARATION
from cellwright.engine.clock import NANOSECONDS
from cellwright.middleware.messages.control_msgs import QueryTrajectoryStateRequest
from cellwright.middleware.messages.conversions import joint_trajectory, stamp, trajectory_point
from cellwright.middleware.messages.osrf_gear import (
    AGVControlRequest,
    ConveyorBeltControlRequest,
    ConveyorBeltState,
    GetMaterialLocationsRequest,
    PopulationControlRequest,
    SubmitTrayRequest,
    VacuumGripperControlRequest,
)
from cellwright.middleware.messages.standard import JointTrajectory, String
from cellwright.util.errors import RejectedCommandError, ServiceFailedError, UnknownNameError
from tests.support.cells import (
    ARM_ONLY,
    INITIAL,
    JOINTS,
    KITTING,
    TRAY_1,
    WHOLE,
    call,
    publish,
    run,
    run_to,
    start,
    wanted,
    way,
)

AHEAD = tuple(value + 0.1 for value in INITIAL)


def test_joint_names_in_any_order_are_followed() -> None:
    cell = Cell(ARM_ONLY)
    publish(cell, "arm/command", way(AHEAD[::-1], names=JOINTS[::-1]))
    run(cell, 1.5)
    assert wanted(cell) == pytest.approx(AHEAD)


def test_positions_beyond_names_are_ignored() -> None:
    cell = Cell(ARM_ONLY)
    publish(cell, "arm/command", way((*AHEAD, 9.9)))
    run(cell, 1.5)
    assert wanted(cell) == pytest.approx(AHEAD)
    assert cell.bus.refusals.total == 0


def test_positions_are_joined_by_lines_from_desired_state() -> None:
    cell = Cell(ARM_ONLY)
    publish(cell, "arm/command", way(AHEAD))
    run(cell, 0.5)
    publish(cell, "arm/command", way(INITIAL))
    run(cell, 0.5)
    assert wanted(cell) == pytest.approx([value + 0.025 for value in INITIAL])


def test_trajectory_starts_at_its_stamp() -> None:
    cell = Cell(ARM_ONLY)
    message = way(AHEAD)
    message.header.stamp = stamp(NANOSECONDS)
    publish(cell, "arm/command", message)
    run_to(cell, 1.0)
    assert wanted(cell) == pytest.approx(INITIAL)
    run_to(cell, 2.0)
    assert wanted(cell) == pytest.approx(AHEAD)


def test_command_without_points_stops_arm() -> None:
    cell = Cell(ARM_ONLY)
    publish(cell, "arm/command", way(tuple(value + 1.0 for value in INITIAL)))
    run(cell, 0.5)
    publish(cell, "arm/command", way())
    run(cell, 0.5)
    at_rest = wanted(cell)
    run(cell, 0.5)
    assert wanted(cell) == at_rest
    # half a second at 1 rad/s, then the original's stop: half-way through a spline of 1 s that reverses the speed
    assert at_rest == pytest.approx([value + 0.5 + 5 / 16 for value in INITIAL])


Edit = Callable[[JointTrajectory], object]


def edited_command(edit: Edit) -> JointTrajectory:
    message = way(AHEAD, INITIAL)
    return edit(message) or message  # type: ignore[return-value]


def points(*values: tuple[float, ...]) -> JointTrajectory:
    return joint_trajectory(JOINTS, [trajectory_point(each, time_from_start=NANOSECONDS) for each in values])


REFUSED: dict[str, tuple[Edit, str]] = {
    "a name too many": (lambda m: m.joint_names.append("vacuum_gripper_joint"), "unknown joint 'vacuum_gripper_joint'"),
    "a name too few": (lambda m: m.joint_names.remove("wrist_3_joint"), "joints are missing: wrist_3_joint"),
    "a wrong name": (lambda m: m.joint_names.__setitem__(2, "shoulder_lft_joint"), "did you mean shoulder_lift_joint"),
    "a name twice": (lambda m: m.joint_names.__setitem__(2, "elbow_joint"), "'elbow_joint' is named more than once"),
    "too few positions": (lambda _: points(AHEAD[:6]), "point 0 has 6 positions for 7 joints"),
    "no positions": (lambda _: points(()), "point 0 has 0 positions"),
    "times that stand still": (lambda _: points(AHEAD, INITIAL), "times must increase strictly"),
    "times that run backwards": (lambda m: m.points.reverse(), "times must increase strictly"),
    "a past that is over": (
        lambda _: joint_trajectory(JOINTS, [trajectory_point(AHEAD, time_from_start=1)], time=1),
        "all 1 points lie in the past",
    ),
    "not a number": (
        lambda _: points((math.nan, *AHEAD[1:])),
        r"point 0: position of linear_arm_actuator_joint must be finite \(got nan\)",
    ),
    "infinity": (
        lambda _: points((*AHEAD[:6], math.inf)),
        r"point 0: position of wrist_3_joint must be finite \(got inf\)",
    ),
    "a velocity that is no number": (
        lambda _: joint_trajectory(JOINTS, [trajectory_point(AHEAD, (math.nan,) * 7, time_from_start=NANOSECONDS)]),
        r"point 0: velocity of linear_arm_actuator_joint must be finite \(got nan\)",
    ),
    "numbers beyond computing": (
        lambda _: joint_trajectory(JOINTS, [trajectory_point((1e308,) * 7, (-1e308,) * 7, time_from_start=1)]),
        "too large or too close to interpolate",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", REFUSED)
def test_invalid_command_is_refused_whole_and_counted(case: str) -> None:
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    run(cell, 0.1)
    publish(cell, "arm/command", way(AHEAD))
    run(cell, 0.2)
    before = cell.state_hash()
    edit, reason = REFUSED[case]
    with pytest.raises(RejectedCommandError, match=reason):
        publish(cell, "arm/command", edited_command(edit), node="/team")
    assert cell.state_hash() == before
    assert dict(cell.bus.refusals.counts) == {"/ariac/arm/command from /team": 1}
    assert len(lines) == 1
    assert lines[0].startswith("refused /ariac/arm/command from /team: ")
    run_to(cell, 1.2)
    assert wanted(cell) == pytest.approx(AHEAD)


def test_flood_of_bad_commands_is_reported_once_per_second() -> None:
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    bad = points((math.nan,) * 7)
    for _ in range(30):
        for _ in range(20):
            with pytest.raises(RejectedCommandError):
                publish(cell, "arm/command", bad)
        run(cell, 0.1)
    assert cell.bus.refusals.total == 600
    assert len(lines) == 3
    assert lines[1].endswith("(and 199 more since the last report)")
    assert cell.simulation.time == pytest.approx(3.0)


def test_query_state_returns_desired_state_at_time() -> None:
    cell = Cell(ARM_ONLY)
    publish(cell, "arm/command", way(AHEAD))
    answer = call(cell, "arm/query_state", QueryTrajectoryStateRequest(stamp(NANOSECONDS // 2)))
    assert tuple(answer.name) == JOINTS
    assert answer.position == pytest.approx([value + 0.05 for value in INITIAL])
    assert answer.velocity == pytest.approx([0.1] * 7)
    assert answer.acceleration == pytest.approx([0.0] * 7)
    run(cell, 1.5)
    publish(cell, "arm/command", way(INITIAL))
    run(cell, 0.2)
    publish(cell, "arm/command", way(AHEAD))
    with pytest.raises(ServiceFailedError, match="must not be before the stored motion"):
        call(cell, "arm/query_state", QueryTrajectoryStateRequest(stamp(NANOSECONDS // 10)))
    far = call(cell, "arm/query_state", QueryTrajectoryStateRequest(stamp(2**31 * NANOSECONDS - 1)))
    assert far.position == pytest.approx(AHEAD)


def test_material_locations_lists_units_of_type() -> None:
    cell = Cell(WHOLE)

    def units(material: str) -> list[str]:
        answer = call(cell, "material_locations", GetMaterialLocationsRequest(material))
        return [unit.unit_id for unit in answer.storage_units]

    assert units("gear_part") == ["belt", "bin8"]
    assert units("tray") == ["agv1_load_point", "agv2_load_point"]
    assert units("unheard_of") == units("") == []


def test_gripper_control_always_succeeds() -> None:
    cell = Cell(ARM_ONLY)
    for enable in (True, True, False, False):
        assert call(cell, "gripper/control", VacuumGripperControlRequest(enable)).success
        assert cell.gripper is not None
        assert cell.gripper.enabled is enable


@pytest.mark.parametrize("power", [-1.0, 100.5, math.nan, math.inf, -math.inf])
def test_belt_power_outside_range_changes_nothing_and_succeeds(power: float) -> None:
    cell = Cell(WHOLE, competition=False)
    assert call(cell, "conveyor/control", ConveyorBeltControlRequest(ConveyorBeltState(40.0))).success
    assert call(cell, "conveyor/control", ConveyorBeltControlRequest(ConveyorBeltState(power))).success
    assert cell.conveyors["belt"].power == 40.0


def test_population_control_pauses_and_resumes_parts() -> None:
    cell = Cell(WHOLE, competition=False)
    clones = {name for name, _ in cell.world.clones}
    start(cell)
    for word in ("pause", "resume", "restart", "pause"):
        assert call(cell, "population/control", PopulationControlRequest(word)).success
    run(cell, 1.0)
    assert not clones & cell.parts.in_play
    with pytest.raises(ServiceFailedError, match=r"unknown action 'stop' \(known: pause, resume, restart\)"):
        call(cell, "population/control", PopulationControlRequest("stop"))
    call(cell, "population/control", PopulationControlRequest("resume"))
    run(cell, 0.3)
    assert len(clones & cell.parts.in_play) == 1


def test_competition_has_no_population_control() -> None:
    with pytest.raises(UnknownNameError, match="unknown service '/ariac/population/control'"):
        call(Cell(WHOLE), "population/control", PopulationControlRequest("pause"))


def test_submit_tray_scores_tray_in_state_go_only() -> None:
    cell = Cell(KITTING, competition=False)
    with pytest.raises(ServiceFailedError, match="kits are judged in state 'go' only"):
        call(cell, "submit_tray", SubmitTrayRequest(TRAY_1, "order_0_kit_0"))
    start(cell)
    run(cell, 1.1)
    assert not call(cell, "submit_tray", SubmitTrayRequest("no_tray", "order_0_kit_0")).success
    unknown = call(cell, "submit_tray", SubmitTrayRequest(TRAY_1, "no_kit"))
    assert (unknown.success, unknown.inspection_result) == (True, 0.0)
    answer = call(cell, "submit_tray", SubmitTrayRequest(TRAY_1, "order_0_kit_0"))
    assert (answer.success, answer.inspection_result) == (True, 6.0)


def test_clear_tray_removes_parts_of_its_tray_only() -> None:
    cell = Cell(KITTING, competition=False)
    run(cell, 0.3)
    assert len(cell.trays[1].find_parts()) == 2
    assert call(cell, "kit_tray_2/clear_tray").success
    assert len(cell.trays[1].find_parts()) == 2
    assert call(cell, "kit_tray_1/clear_tray").success
    assert cell.trays[1].find_parts() == ()
    assert cell.parts.in_play == set()


def test_agv_control_succeeds_at_once_for_any_kit() -> None:
    cell = Cell(KITTING)
    assert call(cell, "agv1", AGVControlRequest("an unknown kit")).success
    assert not call(cell, "agv1", AGVControlRequest("order_0_kit_0")).success  # it is on its way already
    assert call(cell, "agv2", AGVControlRequest("")).success
    run(cell, PREPARATION + 0.01)
    assert {agv.state for agv in cell.agvs.values()} == {"delivering"}


def test_topics_of_missing_devices_are_unknown() -> None:
    cell = Cell(ARM_ONLY)
    with pytest.raises(UnknownNameError, match="unknown service '/ariac/agv1'"):
        call(cell, "agv1", AGVControlRequest("order_0_kit_0"))
    with pytest.raises(UnknownNameError, match="did you mean /ariac/arm/command"):
        publish(cell, "arm/comand", way(AHEAD))
    with pytest.raises(UnknownNameError, match="unknown topic to publish on '/ariac/orders'"):
        publish(cell, "orders", String("mine"))


def test_trajectory_with_wall_time_is_followed_late_and_reported_once_a_second() -> None:
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    command = joint_trajectory(
        JOINTS, [trajectory_point(AHEAD, time_from_start=NANOSECONDS)], time=1_764_000_000 * NANOSECONDS
    )
    for _ in range(5):
        publish(cell, "arm/command", command, node="/team")
        run(cell, 0.1)
    expected = (
        "/ariac/arm/command from /team: the trajectory is stamped with wall time (1764000000 s), so the arm waits for "
        "decades of simulation time; set use_sim_time to true, or leave the stamp at 0 to start at once"
    )
    assert lines == [expected]
    assert cell.bus.refusals.total == 0
    run(cell, 0.6)
    publish(cell, "arm/command", command, node="/team")
    assert len(lines) == 2
    publish(cell, "arm/command", joint_trajectory(JOINTS, command.points, time=3_000 * NANOSECONDS), node="/late")
    assert len(lines) == 2  # an hour ahead may be meant
