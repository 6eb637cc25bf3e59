"""Trial in a running cell: the cell carries out the referee's decisions, and the referee judges the results."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import (
    CompetitionState,
    Effect,
    EndReason,
    KitSubmitted,
    OrderAnnounced,
    OrderCompleted,
    StateChanged,
    TrialEnded,
)
from cellwright.cell.kitting.scorer import Scorer
from cellwright.config.trial.trial import KitObject, Options, Part
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.util.errors import RejectedCommandError, UnknownNameError, UsageError
from cellwright.util.pose import Pose
from tests.support.cells import (
    ABOVE_THE_ROD,
    BARE,
    GEARS,
    KITTING,
    ROD_IN_REACH,
    TRAY_1,
    TRAY_2,
    WHOLE,
    Ear,
    call,
    on_tray,
    order,
    publish,
    region,
    run,
    run_to,
    start,
    wait_until,
    way,
)


def effects_of(cell: Cell) -> list[Effect]:
    """Collect the referee's effects from now on."""
    heard: list[Effect] = []
    cell.competition.on_effect.append(heard.append)
    return heard


def kinds(effects: list[Effect], *types: type) -> list[Effect]:
    return [effect for effect in effects if isinstance(effect, types)]


def test_trial_runs_from_start_to_end() -> None:
    cell = Cell(KITTING)
    orders = Ear(cell, "orders")
    run(cell, 1.0)
    assert (cell.competition.state, len(orders)) == ("init", 0)
    assert call(cell, "start_competition").message == "competition started successfully!"
    assert cell.competition.state == "ready"
    assert wait_until(cell, lambda: cell.competition.state == "go", 0.5) == pytest.approx(0.002)
    assert wait_until(cell, lambda: len(orders) > 0, 0.5) < 0.01
    run(cell, 1.0)
    assert call(cell, "agv1", AGVControlRequest("order_0_kit_0")).success
    taken = wait_until(cell, lambda: cell.competition.state == "done", 5.0)
    assert 0.75 <= taken < 0.76  # the AGV's preparation, and two steps of the referee
    assert cell.competition.score().total == 6.0  # two parts, two for all of them, two poses
    assert len(orders) == 1


def test_second_start_is_refused() -> None:
    cell = Cell(KITTING)
    assert call(cell, "start_competition").success
    for _ in range(3):
        again = call(cell, "start_competition")
        assert (again.success, again.message) == (False, "cannot start if not in 'init' state")
        cell.step()
    with pytest.raises(RejectedCommandError, match="got 'go'"):
        cell.competition.start()
    assert cell.bus.refusals.total == 0  # an answer, not a refusal


@pytest.mark.parametrize("state", ["init", "ready", "go", "done"])
def test_end_from_any_state_ends_competition(state: str) -> None:
    cell = Cell(KITTING)
    if state != "init":
        call(cell, "start_competition")
    if state in ("go", "done"):
        cell.step()
    if state == "done":
        call(cell, "end_competition")
        run(cell, 0.1)
    assert cell.competition.state == state
    answer = call(cell, "end_competition")
    assert (answer.success, answer.message) == (True, "competition ended successfully!")
    assert cell.competition.state == "end_game"
    cell.step()
    assert cell.competition.state == "done"
    assert not call(cell, "start_competition").success


def test_trial_without_orders_ends_at_once() -> None:
    cell = Cell(BARE)
    effects = effects_of(cell)
    call(cell, "start_competition")
    run(cell, 0.1)
    assert [each.state for each in effects if isinstance(each, StateChanged)] == ["ready", "go", "end_game", "done"]
    ends = [each for each in effects if isinstance(each, TrialEnded)]
    assert [each.reason for each in ends] == [EndReason.NO_ORDERS]


def test_time_limit_ends_competition() -> None:
    cell = Cell(replace(KITTING, time_limit=2.0))
    run(cell, 0.5)
    start(cell)
    run_to(cell, 2.502)
    assert cell.competition.state == "go"
    assert not cell.competition.is_timed_out
    run(cell, 0.01)
    assert cell.competition.state == "done"
    assert cell.competition.is_timed_out


def test_belt_and_population_run_from_start_on() -> None:
    cell = Cell(WHOLE)
    clones = {name for name, _ in cell.world.clones}
    run(cell, 0.5)
    assert cell.conveyors["belt"].power == 0.0
    start(cell)
    assert cell.conveyors["belt"].power == 100.0
    run_to(cell, 0.5 + 0.2 + 0.01)
    assert clones & cell.parts.in_play == {"populate_conveyor|gear_part_clone_0"}
    run(cell, 1.0)
    place = cell.parts.pose(cell.parts.part("populate_conveyor|gear_part_clone_0")).position
    assert place[1] == pytest.approx(5.0 - 0.2, abs=0.03)


def test_agv_drives_before_start_without_submission() -> None:
    cell = Cell(KITTING)
    run(cell, 1.1)
    effects = effects_of(cell)
    assert call(cell, "agv1", AGVControlRequest("order_0_kit_0")).success
    run(cell, 2.0)
    assert cell.agvs[1].state == "delivering"
    assert cell.trays[1].world_T_tray.position[0] < 0.2
    assert kinds(effects, KitSubmitted) == []
    assert cell.competition.score().total == 0.0


def test_unordered_kit_drives_off_and_scores_zero() -> None:
    cell = Cell(KITTING)
    start(cell)
    run(cell, 1.1)
    effects = effects_of(cell)
    assert call(cell, "agv1", AGVControlRequest("order_7_kit_0")).success
    run(cell, 1.0)
    submitted = kinds(effects, KitSubmitted)
    assert [(each.kit_type, each.score.total) for each in submitted if isinstance(each, KitSubmitted)] == [
        ("order_7_kit_0", 0.0)
    ]
    assert (cell.competition.state, cell.agvs[1].state) == ("go", "delivering")


@pytest.mark.slow
def test_agv_returns_from_delivery_with_empty_tray() -> None:
    cell = Cell(replace(KITTING, extra_parts=on_tray(*GEARS), time_limit=None))
    start(cell)
    run(cell, 1.1)
    call(cell, "agv1", AGVControlRequest("order_0_kit_0"))
    run(cell, 0.75 + 25 / 3 + 10.0 + 0.02)
    assert cell.trays[1].find_parts() == ()
    assert cell.parts.in_play == set()
    assert cell.trays[1].world_T_tray.position == pytest.approx((0.3, 3.15, 0.75), abs=2e-3)
    # after `done` it is ready, still answers, and still drives
    assert cell.competition.state == "done"
    assert call(cell, "agv1", AGVControlRequest("order_0_kit_0")).success
    run(cell, 1.0)
    states = [agv.state for agv in cell.agvs.values()]
    assert states[0] == "delivering"
    assert cell.competition.score().total == 6.0


def test_trays_are_reported_once_per_second() -> None:
    cell = Cell(replace(KITTING, extra_parts=()))
    assert cell.competition.referee.trays[TRAY_1] == ()
    cell = Cell(KITTING)
    run(cell, 0.9)
    assert cell.competition.tray_objects(cell.trays[1]) == ()
    run(cell, 0.11)
    assert [each.name for each in cell.competition.tray_objects(cell.trays[1])] == [
        "tray1|gear_part_1",
        "tray1|gear_part_2",
    ]


@pytest.mark.parametrize(
    ("parts", "faulty", "expected"),
    [
        (GEARS, (), 6.0),
        (GEARS, ("gear_part_1",), 2.0),  # a faulty part earns nothing, and the kit is not whole
        (GEARS[:1], (), 2.0),
        ((GEARS[0], KitObject("gear_part", Pose((-0.1, 0.16, 0.0)))), (), 5.0),
        ((*GEARS, KitObject("disk_part", Pose((0.0, -0.2, 0.0)))), (), 4.0),  # one too many: no bonus
        ((), (), 0.0),
    ],
    ids=["perfect", "a faulty part", "a part short", "a part out of place", "a part too many", "empty"],
)
def test_competition_score_equals_scorer(
    parts: tuple[KitObject, ...], faulty: tuple[str, ...], expected: float
) -> None:
    trial = replace(KITTING, extra_parts=on_tray(*parts), faulty_parts=frozenset(faulty))
    cell = Cell(trial)
    start(cell)
    run(cell, 1.1)
    reported = cell.competition.referee.trays[TRAY_1]
    cell.agvs[1].send("order_0_kit_0")
    run(cell, 1.0)
    score = cell.competition.score()
    assert score.total == expected
    scorer = Scorer(trial.orders)
    scorer.begin(0)
    scorer.announce("order_0", 0)
    alone = scorer.submit("order_0_kit_0", reported, 1)
    assert alone == score.orders[0].kits[0]


def test_open_kit_has_points_of_waiting_tray_until_agv_departs() -> None:
    cell = Cell(replace(KITTING, extra_parts=on_tray(*GEARS)))
    start(cell)
    run(cell, 1.1)
    waiting = cell.competition.evidence().orders[0].kits[0].unsent
    assert [(each.tray, each.score.total) for each in waiting or ()] == [("agv1", 6.0)]
    cell.agvs[1].send("order_0_kit_7")  # of no order: it drives off with the parts
    run(cell, 0.5)
    assert cell.competition.evidence().orders[0].kits[0].unsent == waiting
    run(cell, 0.5)
    assert cell.competition.evidence().orders[0].kits[0].unsent == ()


def test_kit_of_agv_that_was_just_sent_is_on_its_way() -> None:
    cell = Cell(replace(KITTING, extra_parts=on_tray(*GEARS)))
    start(cell)
    run(cell, 1.1)
    cell.agvs[1].send("order_0_kit_0")
    run(cell, 0.5)
    found = cell.competition.evidence()
    kit = found.orders[0].kits[0]
    assert [(each.tray, each.is_sent, each.score.total) for each in kit.unsent or ()] == [("agv1", True, 6.0)]
    assert "its AGV was on its way, and had not submitted" in kit.bonus_sentence
    assert found.total == 0.0
    run(cell, 0.5)
    found = cell.competition.evidence()
    assert (found.orders[0].kits[0].unsent, found.total) == (None, 6.0)


def test_wanted_parts_on_one_tray_announce_next_order() -> None:
    """Wanted parts are those of the next order. One tray must hold them; faulty ones do not count."""
    disks = (KitObject("disk_part", Pose((0.1, -0.1, 0.0))), KitObject("disk_part", Pose((-0.1, -0.1, 0.0))))
    orders = (order(0, GEARS), order(1, disks, wanted_parts=2))
    parts = (*on_tray(disks[0]), *on_tray(disks[1], number=2, first=2))
    cell = Cell(replace(KITTING, orders=orders, extra_parts=parts, faulty_parts=frozenset()))
    start(cell)
    run(cell, 2.0)
    assert [each.order_id for each in cell.competition.announced] == ["order_0"]  # one on either tray
    effects = effects_of(cell)
    cell.parts.place(cell.parts.part("tray2|disk_part_2"), cell.trays[1].world_T_tray @ Pose((-0.1, -0.1, 0.006)))
    run(cell, 1.1)
    announced = [each for each in effects if isinstance(each, OrderAnnounced)]
    assert [(each.order.order_id, each.interrupts) for each in announced] == [("order_1", "order_0")]
    cell.agvs[1].send("order_1_kit_0")
    run(cell, 1.0)
    completed = [each for each in effects if isinstance(each, OrderCompleted)]
    assert [each.resumes for each in completed] == ["order_0"]
    assert cell.competition.state is CompetitionState.GO


@pytest.mark.parametrize(("faulty", "announced"), [((), 2), (("gasket_part_1",), 1)])
def test_unwanted_parts_announce_next_order(faulty: tuple[str, ...], announced: int) -> None:
    orders = (order(0, GEARS), order(1, GEARS, unwanted_parts=1))
    parts = on_tray(KitObject("gasket_part", Pose((0.0, -0.2, 0.0))))
    cell = Cell(replace(KITTING, orders=orders, extra_parts=parts, faulty_parts=frozenset(faulty)))
    start(cell)
    run(cell, 1.1)
    assert len(cell.competition.announced) == announced


def test_submit_accepts_both_trays_and_refuses_unknown_one() -> None:
    cell = Cell(replace(KITTING, extra_parts=on_tray(*GEARS, number=2)))
    with pytest.raises(RejectedCommandError):
        cell.competition.submit(TRAY_2, "order_0_kit_0")
    start(cell)
    run(cell, 1.1)
    with pytest.raises(UnknownNameError, match="unknown tray 'tray_3'"):
        cell.competition.submit("tray_3", "order_0_kit_0")
    assert cell.competition.submit(TRAY_2, "order_0_kit_0").score.total == 6.0


def test_demo_tray_is_filled_at_start_and_earns_kit() -> None:
    trial = replace(KITTING, extra_parts=(), options=Options(fill_demo_tray=True))
    cell = Cell(trial)
    run(cell, 1.1)
    assert cell.parts.in_play == set()
    start(cell)
    run(cell, 0.1)
    assert cell.parts.in_play == {"populate_kit_tray_1|gear_part_clone_0", "populate_kit_tray_1|gear_part_clone_1"}
    run(cell, 2.0)
    cell.agvs[1].send("order_0_kit_0")
    run(cell, 1.0)
    assert cell.competition.score().total == 6.0


def grip(cell: Cell) -> None:
    assert cell.gripper is not None
    cell.gripper.set_enabled(True)
    wait_until(cell, lambda: cell.gripper is not None and cell.gripper.attached, 0.5)


def test_time_with_part_in_gripper_is_travel_time() -> None:
    cell = Cell(WHOLE)
    start(cell)
    grip(cell)
    begin = cell.simulation.now
    run(cell, 0.5)
    assert cell.competition.score().part_travel_time == cell.simulation.now - begin
    assert cell.gripper is not None
    cell.gripper.set_enabled(False)
    held = cell.simulation.now - begin
    run(cell, 0.5)
    assert cell.competition.score().part_travel_time == held


def test_part_is_dropped_once_at_destination_of_region() -> None:
    above = (-1.0, -1.0, 0.8), (1.0, 1.0, 2.0)
    destination = Pose.from_rpy((-0.3, 0.23, 0.75), (0.0, 0.0, 0.5))
    other = Part("bin7|piston_rod_part_6", "piston_rod_part", Pose((-0.5, 0.4, 0.725)))
    trial = replace(WHOLE, drop_regions=(region(*above, destination),), bin_parts=(ROD_IN_REACH, other))
    cell = Cell(trial)
    run(cell, 0.2)
    grip(cell)
    publish(cell, "arm/command", way(ABOVE_THE_ROD))
    assert cell.gripper is not None
    taken = wait_until(cell, lambda: cell.gripper is not None and not cell.gripper.attached, 1.5)
    assert taken > 0.2
    assert cell.gripper.enabled
    assert cell.gripper.lost_reason == "forced drop"
    rod = cell.parts.pose(cell.parts.part(ROD_IN_REACH.name))
    assert rod.position == pytest.approx(destination.position)
    run(cell, 0.5)
    rod = cell.parts.pose(cell.parts.part(ROD_IN_REACH.name))
    assert rod.position == pytest.approx((-0.3, 0.23, 0.725), abs=0.01)
    assert cell.competition.drops.get_state() == {"spent": ["piston_rod_part"]}


def test_part_outside_drop_region_is_kept() -> None:
    far = (5.0, 5.0, 0.8), (6.0, 6.0, 2.0)
    cell = Cell(replace(WHOLE, drop_regions=(region(*far, Pose()),)))
    run(cell, 0.2)
    grip(cell)
    publish(cell, "arm/command", way(ABOVE_THE_ROD))
    run(cell, 1.5)
    assert cell.gripper is not None
    assert cell.gripper.part == ROD_IN_REACH.name
    assert cell.parts.pose(cell.parts.part(ROD_IN_REACH.name)).position[2] > 0.9


def test_unknown_event_is_refused() -> None:
    cell = Cell(BARE)
    with pytest.raises(UsageError, match="device 'competition' does not know the event 'dance'"):
        cell.competition.handle("dance", ())
