import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.kit_score import RefusalReason
from cellwright.cell.kitting.scorer import Scorer
from cellwright.util.errors import UnknownNameError, UsageError
from tests.cell.kitting.builders import full_tray, order, tray_object
from tests.cell.kitting.naive_referee import NaiveScorer

ONE = order(0, ("gear_part", "disk_part"), kits=2)
TWO = order(1, ("gear_part",))
NO_KITS = order(2, kits=0)


@pytest.fixture
def scorer() -> Scorer:
    fresh = Scorer([ONE, TWO, NO_KITS])
    fresh.begin(100)
    return fresh


def test_first_submission_of_kit_counts(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    assert not scorer.is_submitted("order_0_kit_0")
    first = scorer.submit("order_0_kit_0", (tray_object(),), 200)
    assert first.total == 2.0
    assert scorer.is_submitted("order_0_kit_0")
    assert scorer.submit("order_0_kit_0", full_tray(ONE), 300) == first
    assert scorer.game_score(300).total == 2.0
    assert scorer.submit("order_0_kit_1", full_tray(ONE), 300).total == 6.0
    assert scorer.game_score(300).total == 8.0


@pytest.mark.parametrize(
    ("kit_type", "reason", "order_id"),
    [
        ("bogus", RefusalReason.UNKNOWN_KIT_TYPE, None),
        ("", RefusalReason.UNKNOWN_KIT_TYPE, None),
        ("order_1_kit_0", RefusalReason.ORDER_CLOSED, "order_1"),
        ("order_0_kit_0", RefusalReason.NOT_ANNOUNCED, "order_0"),
    ],
)
def test_kit_of_no_order_in_progress_scores_zero_with_reason(
    scorer: Scorer, kit_type: str, reason: RefusalReason, order_id: str | None
) -> None:
    scorer.announce("order_1", 100)
    for kit in TWO.kits:
        scorer.submit(kit.kit_type, (), 105)
    scorer.withdraw("order_1", 110)
    before = scorer.get_state()
    score = scorer.submit(kit_type, full_tray(ONE), 120)
    assert score.total == 0.0
    assert not score.is_submitted
    assert score.refusal is not None
    assert (score.refusal.reason, score.refusal.order_id, score.refusal.accepted) == (reason, order_id, ())
    assert scorer.get_state() == before


def test_refusal_lists_accepted_kits(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    scorer.announce("order_1", 100)
    refusal = scorer.submit("order_0_kit_7", (), 110).refusal
    assert refusal is not None
    assert refusal.accepted == ("order_0_kit_0", "order_0_kit_1", "order_1_kit_0")


def test_order_is_complete_with_last_kit_of_any_score(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    scorer.announce("order_1", 150)
    scorer.submit("order_0_kit_0", (), 200)
    assert not scorer.is_complete("order_0")
    scorer.submit("order_0_kit_1", (), 300)
    assert scorer.is_complete("order_0")
    assert [(each.order_id, each.time_taken, each.is_complete) for each in scorer.game_score(1000).orders] == [
        ("order_0", 200, True),
        ("order_1", 850, False),
    ]


def test_order_without_kits_is_complete_at_once(scorer: Scorer) -> None:
    assert not scorer.is_complete("order_2")
    scorer.announce("order_2", 100)
    assert scorer.is_complete("order_2")
    assert scorer.order_score("order_2", 900).time_taken == 0


def test_withdrawn_order_keeps_points_and_clock(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    scorer.submit("order_0_kit_0", full_tray(ONE), 200)
    assert scorer.withdraw("order_0", 300).total == 6.0
    assert scorer.game_score(400).orders[0].time_taken == 300
    assert scorer.withdraw("order_1", 400).total == 0.0


def test_kit_of_withdrawn_order_is_refused_as_closed(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    scorer.announce("order_1", 100)
    scorer.withdraw("order_0", 200)
    refusal = scorer.submit("order_1_kit_0", full_tray(TWO), 300).refusal
    assert refusal is not None
    assert (refusal.reason, refusal.order_id) == (RefusalReason.ORDER_CLOSED, "order_1")
    assert refusal.accepted == ("order_0_kit_0", "order_0_kit_1")


def test_second_announcement_is_refused(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    scorer.withdraw("order_0", 200)
    with pytest.raises(UsageError, match=r"an order is announced once \(got 'order_0' again\)"):
        scorer.announce("order_0", 300)


OPERATIONS = st.tuples(st.sampled_from(("announce", "withdraw", "withdraw", "submit", "submit")), st.integers(0, 2))


@given(st.lists(OPERATIONS, max_size=20), st.integers(0, 20))
def test_scorer_agrees_with_naive_stack_of_orders(operations: list[tuple[str, int]], snapshot: int) -> None:
    orders = [order(number) for number in range(3)]
    scorer, naive = Scorer(orders), NaiveScorer()
    scorer.begin(0)
    for now, (operation, number) in enumerate(operations):
        name = f"order_{number}"
        if now == snapshot:
            state = scorer.get_state()
            scorer = Scorer(orders)
            scorer.set_state(json.loads(json.dumps(state)))
        if operation == "announce" and name not in naive.times:
            scorer.announce(name, now)
            naive.announce(orders[number])
        elif operation == "withdraw":
            before = naive.points(name)
            assert scorer.withdraw(name, now).total == (3.0 if naive.withdraw(name) and before else 0.0)
        elif operation == "submit":
            kit = f"{name}_kit_0"
            assert scorer.submit(kit, full_tray(orders[number]), now).is_submitted == naive.submit(kit)
        naive.pass_time(1)
        assert {each.order_id: each.time_taken for each in scorer.game_score(now + 1).orders} == naive.times
        assert {each.order_id: each.total for each in scorer.game_score(now).orders} == {
            name: 3.0 * naive.points(name) for name in naive.times
        }


def test_end_stops_all_clocks(scorer: Scorer) -> None:
    scorer.announce("order_0", 100)
    scorer.gripper_changed(110, enabled=True, attached=True)
    scorer.end(200)
    score = scorer.game_score(900)
    assert (score.orders[0].time_taken, score.part_travel_time) == (100, 90)
    scorer.gripper_changed(950, enabled=True, attached=True)
    assert scorer.game_score(999).part_travel_time == 90


def test_part_travel_time_counts_while_gripper_holds_during_game() -> None:
    scorer = Scorer([])
    scorer.gripper_changed(0, enabled=True, attached=True)
    scorer.begin(100)
    scorer.gripper_changed(110, enabled=True, attached=False)
    scorer.gripper_changed(120, enabled=False, attached=True)
    scorer.gripper_changed(130, enabled=True, attached=True)
    scorer.gripper_changed(140, enabled=True, attached=True)
    assert scorer.game_score(145).part_travel_time == 10 + 15
    scorer.gripper_changed(150, enabled=False, attached=False)
    assert scorer.game_score(999).part_travel_time == 10 + 20


def test_duplicate_order_or_kit_is_refused() -> None:
    with pytest.raises(UsageError, match=r"order ids must be unique \(got 'order_0' twice\)"):
        Scorer([ONE, ONE])
    with pytest.raises(UsageError, match="kit types must be unique"):
        Scorer([ONE, type(ONE)("order_9", ONE.kits)])


def test_scorer_state_survives_json_with_evidence(scorer: Scorer) -> None:
    scorer.announce("order_1", 100)
    scorer.announce("order_0", 110)
    scorer.gripper_changed(115, enabled=True, attached=True)
    first = scorer.submit("order_0_kit_0", (tray_object(x=0.02, yaw=0.1), tray_object("disk_part", faulty=True)), 120)
    scorer.withdraw("order_1", 130)  # takes order_0, the newest
    copy = Scorer([ONE, TWO, NO_KITS])
    copy.set_state(json.loads(json.dumps(scorer.get_state())))
    assert copy.get_state() == scorer.get_state()
    for each in (scorer, copy):
        assert each.submit("order_0_kit_0", (), 140).refusal is not None
        assert each.submit("order_1_kit_0", (), 140).refusal is None
        assert each.game_score(150).orders[1].kits[0] == first
        each.end(160)
    assert copy.game_score(999) == scorer.game_score(999)
    assert copy.game_score(999).part_travel_time == 45


@pytest.mark.parametrize(
    "entry",
    [
        {"order": "order_9", "withdrawn": False, "clock": [0, None], "judged": {}},
        {"order": "order_0", "withdrawn": False, "clock": [0, None], "judged": {"order_0_kit_9": []}},
    ],
)
def test_state_of_other_orders_is_refused(scorer: Scorer, entry: dict[str, object]) -> None:
    before = scorer.get_state()
    with pytest.raises(UnknownNameError):
        scorer.set_state({"running": True, "carrying": False, "travel": [0, None], "announced": [entry]})
    assert scorer.get_state() == before
