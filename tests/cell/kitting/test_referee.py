import json
from typing import Any

import pytest

from cellwright.cell.kitting.effects import (
    AnnouncementReason,
    CompetitionState,
    ConveyorPower,
    Effect,
    EndReason,
    KitSubmitted,
    OrderAnnounced,
    OrderCompleted,
    PopulationRestart,
    StateChanged,
    TrialEnded,
)
from cellwright.cell.kitting.kit_score import RefusalReason
from cellwright.cell.kitting.referee import Referee
from cellwright.cell.kitting.scorer import GameScore
from cellwright.config.trial.trial import Order, Trial
from cellwright.engine.clock import NEVER
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from tests.cell.kitting.builders import TRAY_1, TRAY_2, full_tray, order, tray_object

SECOND = 1_000_000_000
TICK = 2_000_000
INIT, READY, GO, END_GAME, DONE = CompetitionState
FIRST = order(0, ("gear_part", "disk_part"), start_time=0.0)
URGENT = order(1, ("pulley_part", "gear_part"), wanted_parts=1)
UNWANTING = order(2, ("pulley_part",), unwanted_parts=2)


def referee(*orders: Order, limit: float | None = None) -> Referee:
    fresh = Referee(Trial("test", orders=orders, time_limit=limit))
    fresh.tray_changed(TRAY_1, ())
    fresh.tray_changed(TRAY_2, ())
    return fresh


def going(*orders: Order, limit: float | None = None) -> Referee:
    """Return a referee in the state `go` since time 0."""
    fresh = referee(*orders, limit=limit)
    fresh.start(-TICK)
    fresh.update(0)
    return fresh


def short(effects: tuple[Effect, ...]) -> list[Any]:
    """Return effects with the names of their orders and scores."""
    lines: list[Any] = []
    for effect in effects:
        match effect:
            case OrderAnnounced(announced, reason, interrupts):
                lines.append((announced.order_id, reason, interrupts))
            case OrderCompleted(score, resumes):
                lines.append((score.order_id, "complete", resumes))
            case TrialEnded(reason, _, process_time):
                lines.append((reason, process_time))
            case StateChanged(state):
                lines.append(state)
            case _:
                lines.append(effect)
    return lines


def in_state(state: CompetitionState) -> Referee:
    """Return a referee that has reached a state by time 0."""
    fresh = referee(FIRST)
    if state is INIT:
        return fresh
    fresh.start(-3 * TICK)
    if state in (GO, END_GAME, DONE):
        fresh.update(-2 * TICK)
    if state in (END_GAME, DONE):
        fresh.end(-TICK)
    if state is DONE:
        fresh.update(0)
    return fresh


@pytest.mark.parametrize(
    ("before", "after", "effects"),
    [
        (INIT, INIT, []),
        (READY, GO, [GO, ConveyorPower(100.0), PopulationRestart()]),
        (GO, GO, [("order_0", AnnouncementReason.TIME, None)]),
        (END_GAME, DONE, [DONE, (EndReason.COMMAND, TICK)]),
        (DONE, DONE, []),
    ],
)
def test_step_moves_state_and_returns_effects(
    before: CompetitionState, after: CompetitionState, effects: list[Any]
) -> None:
    judge = in_state(before)
    assert judge.state is before
    assert short(judge.update(TICK)) == effects
    assert judge.state is after


@pytest.mark.parametrize("before", [READY, GO, END_GAME, DONE])
def test_start_outside_init_is_refused(before: CompetitionState) -> None:
    judge = in_state(before)
    with pytest.raises(RejectedCommandError, match=before.value):
        judge.start(TICK)
    assert judge.state is before


def test_start_enters_ready_and_runs_clock_from_go() -> None:
    judge = in_state(INIT)
    assert judge.next_deadline == NEVER
    assert judge.start(0) == (StateChanged(READY),)
    assert judge.next_deadline == 1
    assert judge.update(0) == ()
    assert judge.process_time(TICK) == 0
    judge.update(TICK)
    assert judge.process_time(TICK + 5) == 5


@pytest.mark.parametrize("before", [INIT, READY, GO, DONE])
def test_end_in_any_state_ends_competition(before: CompetitionState) -> None:
    judge = in_state(before)
    assert judge.end(TICK) == (StateChanged(END_GAME),)
    assert judge.update(TICK) == ()
    assert judge.next_deadline == TICK + 1
    effects = judge.update(2 * TICK)
    assert effects[0] == StateChanged(DONE)
    assert [type(effect) for effect in effects[1:]] == ([] if before is DONE else [TrialEnded])
    assert judge.end_reason is EndReason.COMMAND
    assert judge.next_deadline == NEVER


def test_end_in_end_game_changes_nothing() -> None:
    judge = in_state(END_GAME)
    assert judge.end(TICK) == ()
    assert judge.state is END_GAME


@pytest.mark.parametrize("before", [INIT, READY, END_GAME, DONE])
def test_submit_outside_go_is_refused(before: CompetitionState) -> None:
    judge = in_state(before)
    with pytest.raises(RejectedCommandError, match=before.value):
        judge.submit(TRAY_1, "order_0_kit_0", TICK)
    assert judge.score(TICK) == GameScore()


def test_trial_without_orders_ends_at_once() -> None:
    judge = referee()
    judge.start(0)
    log = [short(judge.update(now)) for now in range(TICK, 6 * TICK, TICK)]
    assert log == [
        [GO, ConveyorPower(100.0), PopulationRestart()],
        [END_GAME],
        [DONE, (EndReason.NO_ORDERS, TICK)],
        [],
        [],
    ]


def test_time_limit_ends_trial_only_beyond_it() -> None:
    judge = going(FIRST, limit=10.0)
    judge.update(TICK)
    assert judge.next_deadline == 10 * SECOND + 1
    assert judge.update(10 * SECOND) == ()
    assert judge.submit(TRAY_1, "order_0_kit_9", 10 * SECOND).score.total == 0.0
    assert short(judge.update(10 * SECOND + TICK)) == [END_GAME]
    assert short(judge.update(10 * SECOND + 2 * TICK)) == [DONE, (EndReason.TIME_LIMIT, 10 * SECOND + TICK)]
    score = judge.score(99 * SECOND)
    assert score.orders[0].time_taken == 10 * SECOND
    assert judge.process_time(99 * SECOND) == 10 * SECOND + TICK


def test_order_due_exactly_at_time_limit_is_announced() -> None:
    judge = going(order(0, start_time=10.0), limit=10.0)
    assert judge.next_deadline == 10 * SECOND
    assert short(judge.update(10 * SECOND)) == [("order_0", AnnouncementReason.TIME, None)]
    assert short(judge.update(10 * SECOND + 1)) == [END_GAME]


def test_time_limit_of_zero_ends_trial_before_announcements() -> None:
    judge = going(FIRST, limit=0.0)
    assert short(judge.update(TICK)) == [END_GAME]
    assert judge.score(TICK).orders == ()


def test_trial_without_limit_waits_for_order_without_condition() -> None:
    judge = going(order(0))
    assert judge.next_deadline == NEVER
    assert judge.update(10**6 * SECOND) == ()
    assert judge.state is GO
    assert [each.order_id for each in judge._announcements.waiting] == ["order_0"]


def test_order_is_announced_at_first_step_at_its_time() -> None:
    judge = going(order(0, start_time=3.0))
    assert judge.next_deadline == 3 * SECOND
    assert judge.update(3 * SECOND - 1) == ()
    assert short(judge.update(3 * SECOND)) == [("order_0", AnnouncementReason.TIME, None)]
    assert judge.active_orders == ["order_0"]
    assert not judge._announcements.waiting


def test_one_order_is_announced_per_step() -> None:
    judge = going(*(order(number, start_time=0.0) for number in range(3)))
    for number, interrupts in enumerate((None, "order_0", "order_1")):
        now = (number + 1) * TICK
        assert judge.next_deadline <= now
        assert short(judge.update(now)) == [(f"order_{number}", AnnouncementReason.TIME, interrupts)]
        assert judge.update(now) == ()
    assert judge.active_orders == ["order_0", "order_1", "order_2"]
    assert judge.next_deadline == NEVER


def test_last_kit_ends_trial() -> None:
    judge = going(FIRST)
    judge.update(TICK)
    judge.tray_changed(TRAY_1, full_tray(FIRST))
    assert judge.next_deadline == NEVER
    submitted = judge.submit(TRAY_1, "order_0_kit_0", 5 * SECOND)
    assert (submitted.tray_id, submitted.kit_type, submitted.is_repeated) == (TRAY_1, "order_0_kit_0", False)
    assert submitted.score.total == 6.0
    assert judge.next_deadline <= 5 * SECOND
    assert short(judge.update(5 * SECOND)) == [("order_0", "complete", None), END_GAME]
    (_, ended) = judge.update(5 * SECOND + TICK)
    assert ended == TrialEnded(EndReason.ORDERS_COMPLETE, judge.score(0), 5 * SECOND)
    assert judge.score(0).total == 6.0
    assert judge.score(0).orders[0].time_taken == 5 * SECOND - TICK


def test_wanted_parts_interrupt_order_that_is_resumed_later() -> None:
    judge = going(FIRST, URGENT)
    judge.update(TICK)
    judge.tray_changed(TRAY_2, [tray_object("disk_part"), tray_object("pulley_part", faulty=True)])
    assert judge.next_deadline == NEVER
    judge.tray_changed(TRAY_2, [tray_object("disk_part"), tray_object("pulley_part")])
    assert short(judge.update(2 * TICK)) == [("order_1", AnnouncementReason.WANTED_PARTS, "order_0")]
    judge.submit(TRAY_2, "order_1_kit_0", SECOND)
    assert short(judge.update(SECOND)) == [("order_1", "complete", "order_0")]
    assert judge.active_orders == ["order_0"]
    assert judge.next_deadline == NEVER


def test_unwanted_parts_interrupt_order() -> None:
    judge = going(FIRST, UNWANTING)
    judge.update(TICK)
    judge.tray_changed(TRAY_1, [tray_object("disk_part"), tray_object("pulley_part")])
    assert judge.next_deadline == NEVER
    judge.tray_changed(TRAY_1, [tray_object("disk_part"), tray_object("pulley_part"), tray_object("gear_part")])
    assert short(judge.update(2 * TICK)) == [("order_2", AnnouncementReason.UNWANTED_PARTS, "order_0")]


def test_conditional_order_is_announced_when_idle() -> None:
    judge = going(FIRST, URGENT)
    judge.update(TICK)
    judge.submit(TRAY_1, "order_0_kit_0", SECOND)
    assert short(judge.update(SECOND)) == [("order_0", "complete", None)]
    assert judge.next_deadline == SECOND + 1
    assert short(judge.update(SECOND + TICK)) == [("order_1", AnnouncementReason.IDLE, None)]


def test_complete_interrupted_order_closes_after_interrupting_one() -> None:
    judge = going(FIRST, order(1, start_time=0.0))
    judge.update(TICK)
    judge.update(2 * TICK)
    judge.submit(TRAY_1, "order_0_kit_0", SECOND)
    assert judge.update(SECOND) == ()
    assert judge.submit(TRAY_1, "order_0_kit_0", SECOND).is_repeated
    judge.submit(TRAY_1, "order_1_kit_0", 2 * SECOND)
    assert short(judge.update(2 * SECOND)) == [("order_1", "complete", "order_0")]
    assert short(judge.update(2 * SECOND + TICK)) == [("order_0", "complete", None), END_GAME]
    assert judge.score(9 * SECOND).orders[0].time_taken == SECOND - TICK


def test_order_without_kits_is_announced_and_closed_in_one_step() -> None:
    judge = going(order(0, kits=0, start_time=0.0))
    assert short(judge.update(TICK)) == [
        ("order_0", AnnouncementReason.TIME, None),
        ("order_0", "complete", None),
        END_GAME,
    ]


def test_repeated_submission_returns_first_score() -> None:
    judge = going(order(0, ("gear_part",), kits=2, start_time=0.0))
    judge.update(TICK)
    judge.tray_changed(TRAY_1, [tray_object()])
    first = judge.submit(TRAY_1, "order_0_kit_0", SECOND)
    again = judge.submit(TRAY_2, "order_0_kit_0", SECOND)
    assert first.score.total == 3.0
    assert again == KitSubmitted(TRAY_2, "order_0_kit_0", first.score, is_repeated=True)


@pytest.mark.parametrize(
    ("kit_type", "reason"),
    [
        ("order_0_kit_0", RefusalReason.ORDER_CLOSED),
        ("order_2_kit_0", RefusalReason.NOT_ANNOUNCED),
        ("gear_kit", RefusalReason.UNKNOWN_KIT_TYPE),
    ],
)
def test_unrequested_kit_scores_zero_with_reason(kit_type: str, reason: RefusalReason) -> None:
    judge = going(FIRST, URGENT, UNWANTING)
    judge.update(TICK)
    judge.submit(TRAY_1, "order_0_kit_0", SECOND)
    judge.update(SECOND)
    judge.update(SECOND + TICK)
    submitted = judge.submit(TRAY_1, kit_type, 2 * SECOND)
    assert submitted.score.total == 0.0
    assert submitted.score.refusal is not None
    assert submitted.score.refusal.reason is reason
    assert submitted.score.refusal.accepted == ("order_1_kit_0",)
    assert not submitted.is_repeated


def test_unknown_tray_is_refused_with_suggestion() -> None:
    judge = going(FIRST)
    judge.update(TICK)
    with pytest.raises(UnknownNameError, match="did you mean"):
        judge.submit("agv1::kit_tray_1::tray", "order_0_kit_0", SECOND)
    assert not judge.scorer.is_submitted("order_0_kit_0")


def test_part_travel_time_counts_only_during_game() -> None:
    judge = referee(FIRST)
    judge.scorer.gripper_changed(0, enabled=True, attached=True)
    judge.start(SECOND)
    judge.update(2 * SECOND)
    judge.scorer.gripper_changed(5 * SECOND, enabled=True, attached=False)
    judge.scorer.gripper_changed(6 * SECOND, enabled=True, attached=True)
    judge.end(7 * SECOND)
    assert judge.score(9 * SECOND).part_travel_time == 4 * SECOND


def test_reset_referee_equals_new_one() -> None:
    judge = going(FIRST)
    judge.update(TICK)
    judge.submit(TRAY_1, "order_0_kit_0", SECOND)
    judge.update(SECOND)
    judge.reset()
    assert judge.get_state() == Referee(Trial("test", orders=(FIRST,))).get_state()
    assert judge.next_deadline == NEVER
    assert judge.start(0) == (StateChanged(READY),)


def test_referee_state_survives_json() -> None:
    judge, copy = going(FIRST, URGENT, limit=60.0), referee(FIRST, URGENT, limit=60.0)
    judge.update(TICK)
    judge.tray_changed(TRAY_1, [tray_object("pulley_part", x=0.01)])
    judge.update(2 * TICK)
    copy.set_state(json.loads(json.dumps(judge.get_state(), sort_keys=True)))
    assert copy.get_state() == judge.get_state()
    assert copy.next_deadline == judge.next_deadline
    for each in (judge, copy):
        assert each.submit(TRAY_1, "order_1_kit_0", SECOND).score.total == 2.0
        assert short(each.update(SECOND)) == [("order_1", "complete", "order_0")]
        each.end(2 * SECOND)
    assert copy.update(3 * SECOND) == judge.update(3 * SECOND)
