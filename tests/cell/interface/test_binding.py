"""Every row of the interface on the bus of a real cell: type, latch and rate; and no other topics."""

from __future__ import annotations

from fractions import Fraction
from math import ceil

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.interface.rows import rows
from cellwright.config.trial.trial import Options, Trial
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import Endpoint, EndpointKind, Timing
from cellwright.middleware.messages.osrf_gear import ConveyorBeltControlRequest, ConveyorBeltState, SubmitTrayRequest
from tests.cell.interface.goals import send
from tests.support.cells import ARM_ONLY, BARE, KITTING, TRAY_1, WHOLE, Ear, call, run, start, way, with_timestep

SECONDS = 2
TRIALS = (
    WHOLE,
    BARE,
    KITTING,
    ARM_ONLY,
    Trial("empty", options=Options(insert_agvs=False), belt_parts=WHOLE.belt_parts),
)


def out_rows(trial: Trial, *, competition: bool) -> list[Endpoint]:
    return [row for row in rows(trial, competition=competition) if row.rate is not None]


@pytest.mark.parametrize("competition", [False, True], ids=["development", "competition"])
@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.name)
def test_bus_has_exactly_topics_of_table(trial: Trial, competition: bool) -> None:
    cell = Cell(trial, competition=competition)
    table = rows(trial, competition=competition)
    topics = [row for row in table if row.kind is EndpointKind.TOPIC]
    assert {info.name for info in cell.bus.topics()} == {row.name for row in topics}
    for row in topics:
        info = cell.bus.topic(row.name)
        assert (info.type, info.direction) == (row.type, row.direction)
        assert info.latch == any(each.latch for each in topics if each.name == row.name)
        if row.direction is Direction.OUT:
            assert row.node in info.publishers
            assert len(info.publishers) == sum(each.name == row.name for each in topics)
            assert info.rate == next(each.rate_text for each in topics if each.name == row.name)
        else:
            assert info.subscribers == ("/gazebo",)
    services = {row.name: row.type for row in table if row.kind is EndpointKind.SERVICE}
    assert {info.name: info.type.name for info in cell.bus.services()} == services
    assert cell.topics() == sorted({row.name for row in topics if row.direction is Direction.OUT})


def expected_count(row: Endpoint, timestep: Fraction, ticks: int) -> int | None:
    """Return the number of messages of a periodic topic in `ticks` steps; None for a topic without a period."""
    if row.rate is Timing.EACH_STEP:
        return ticks
    if row.period is None:
        return None
    return int(ticks * timestep / row.period) if row.period >= timestep else ticks


# the lesson's step, a coarse one, two that no rate is a multiple of, and the coarsest that a file may have, with
# one scan a step for a profiler of 100 Hz
@pytest.mark.slow
@pytest.mark.parametrize("timestep", [Fraction(1, 500), Fraction(1, 240), Fraction(3, 1000), Fraction(1, 50)], ids=str)
def test_topics_have_their_rates_in_simulation_time(timestep: Fraction) -> None:
    trial = with_timestep(WHOLE, timestep)
    cell = Cell(trial, competition=False)
    out = out_rows(trial, competition=False)
    logs = {name: Ear(cell, name) for name in sorted({row.name for row in out})}
    send(cell, way(tuple(WHOLE.initial_joint_states.values()), each=10.0))  # so that there is feedback
    ticks = ceil(SECONDS / timestep)
    for _ in range(ticks):
        cell.step()
    cameras = len([sensor for sensor in trial.sensors if sensor.type == "logical_camera"]) + len(cell.quality)
    several = {"/ariac/trays": 2, "/tf": cameras}  # messages at a time: one a tray, one a camera
    expected = {row.name: 0 for row in out}
    for row in out:
        count = expected_count(row, timestep, ticks) or 0
        expected[row.name] += count * (several.get(row.name, 1) if row.node == "/gazebo" else 1)
    expected["/tf_static"] = 1
    expected["/ariac/arm/follow_joint_trajectory/status"] += 1  # immediately, when the goal was accepted
    assert {name: len(ear) for name, ear in logs.items()} == expected


def test_messages_come_at_first_tick_when_due() -> None:
    cell = Cell(with_timestep(WHOLE, Fraction(1, 240)))
    profile, states = Ear(cell, "laser_profiler_1"), Ear(cell, "joint_states")
    run(cell, 0.5)
    assert profile.times == pytest.approx([ceil(n * 2.4) / 240 for n in range(1, 51)], abs=1e-9)
    assert states.times == pytest.approx([ceil(n * 4.8) / 240 for n in range(1, 26)], abs=1e-9)


def test_clock_comes_before_messages_stamped_with_it() -> None:
    cell = Cell(WHOLE)
    log = Ear(cell, "joint_states", "/clock", "gripper/state")
    run(cell, 0.02)
    assert [message.__msgtype__.split("/")[-1] for message in log.messages[-3:]] == [
        "Clock",
        "JointState",
        "VacuumGripperState",
    ]


def test_late_subscriber_changes_no_times() -> None:
    cell = Cell(WHOLE)
    early = Ear(cell, "logical_camera_1", "joint_states")
    run(cell, 0.333)
    late = Ear(cell, "logical_camera_1", "joint_states")
    run(cell, 0.5)
    # the newest picture is latched, and comes immediately
    assert late.times[0] == pytest.approx(0.334, abs=0.002)
    assert late.messages[0] in early.messages
    assert late.times[1:] == [time for time in early.times if time > late.times[0]]


@pytest.mark.parametrize("node", ["/team", "/gazebo", ""])
def test_competition_refuses_cheats_from_any_node_name(node: str) -> None:
    cell = Cell(WHOLE)
    start(cell)
    run(cell, 1.0)
    half_power = ConveyorBeltControlRequest(ConveyorBeltState(50.0))
    assert not call(cell, "conveyor/control", half_power, node=node).success
    assert cell.conveyors["belt"].power == 100.0
    answer = call(cell, "submit_tray", SubmitTrayRequest(TRAY_1, "order_0_kit_0"), node=node)
    assert (answer.success, answer.inspection_result) == (False, 0.0)
    assert cell.competition.score().total == 0.0
    cleared = call(cell, "kit_tray_1/clear_tray", node=node)
    assert (cleared.success, cleared.message) == (False, "not allowed in a competition")
    assert len(cell.trays[1].find_parts()) == 2


def test_competition_silences_trays_without_effect_on_score() -> None:
    """In the original a subscriber to the trays spoilt the score; here watching changes nothing."""
    scores = []
    for is_subscribed in (False, True):
        cell = Cell(KITTING)
        ear = Ear(cell, "trays", node="/team") if is_subscribed else None
        start(cell)
        run(cell, 1.1)
        cell.agvs[1].send("order_0_kit_0")
        run(cell, 1.0)
        assert ear is None or len(ear) == 0
        scores.append((cell.competition.score().total, cell.competition.state, cell.state_hash()))
    assert scores[0] == scores[1]
    assert scores[0][0] == 6.0


def test_development_mode_publishes_trays() -> None:
    cell = Cell(WHOLE, competition=False)
    ear = Ear(cell, "trays")
    run(cell, 1.1)
    assert [message.tray for message in ear.messages] == [TRAY_1, TRAY_1.replace("1", "2")]
    first, second = ear.messages
    assert [(each.type, each.is_faulty) for each in first.objects] == [("gear_part", False), ("gear_part", True)]
    place = first.objects[0].pose.position
    assert (place.x, place.y) == pytest.approx((0.1, 0.1), abs=2e-3)
    assert second.objects == []
