"""The schedule of a policy, in ticks: figures are those of its definition in docs/latency.md, at 20 Hz and 2 ms."""

from collections.abc import Callable, Iterable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.policies.schedule import Mode, Request, Schedule
from cellwright.util.errors import UsageError

PERIOD = 25


def play(
    schedule: Schedule, instants: int, latency: Callable[[int], int] | int, length: int = 8
) -> tuple[list[tuple[int, int] | None], list[Request]]:
    """Return what acts at each instant, and the requests."""
    acted: list[tuple[int, int] | None] = []
    requests = []
    for instant in range(0, instants * schedule.period, schedule.period):
        if schedule.is_due(instant):
            ticks = latency if isinstance(latency, int) else latency(schedule.requests)
            requests.append(schedule.ask(instant, latency=ticks, length=length))
        chosen = schedule.choose(instant)
        acted.append(None if chosen is None else (chosen.request, chosen.place))
    return acted, requests


def indices(acted: Iterable[tuple[int, int] | None]) -> list[int | None]:
    return [None if each is None else each[1] for each in acted]


@pytest.mark.parametrize("mode", Mode)
def test_without_latency_every_mode_plays_each_answer_whole(mode: Mode) -> None:
    acted, requests = play(Schedule(PERIOD, mode=mode, horizon=4), 12, 0, length=4)
    assert acted == [(number // 4, number % 4) for number in range(12)]
    assert [each.observed for each in requests] == [0, 100, 200]


def test_120_ms_act_at_the_next_instant_with_the_fourth_action() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=4), 8, 60)
    assert (requests[0].first, requests[0].index) == (75, 3)
    assert acted[:4] == [None, None, None, (0, 3)]


def test_100_ms_end_on_an_instant_and_act_at_it() -> None:
    _, requests = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=4), 8, 50)
    assert (requests[0].first, requests[0].index) == (50, 2)


def test_one_tick_more_is_one_period_more() -> None:
    _, requests = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=4), 8, 51)
    assert (requests[0].first, requests[0].index) == (75, 3)


def test_latency_of_the_whole_answer_leaves_nothing_and_asks_again() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=4), 30, 4 * PERIOD, length=4)
    assert set(acted) == {None}
    assert [each.observed for each in requests] == [0, 100, 200, 300, 400, 500, 600, 700]
    assert all(each.index == each.length and each.used == 0 for each in requests[:-1])


def test_eight_of_ten_with_a_delay_of_two_acts_on_the_indices_two_to_nine() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=8), 34, 50, length=10)
    assert indices(acted)[2:] == [*range(2, 10)] * 4
    assert sum(each.held for each in requests) == 0


def test_a_delay_beyond_the_rest_of_the_answer_starves_the_robot() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=8), 19, 75, length=10)
    assert indices(acted) == [None, None, None, *range(3, 10), None, *range(3, 10), None]
    assert [each.held for each in requests[:2]] == [PERIOD, PERIOD]


def test_sync_holds_at_once_and_plays_each_answer_from_its_first_action() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.SYNC, horizon=2), 10, 30)
    assert indices(acted) == [None, None, 0, 1, None, None, 0, 1, None, None]
    assert [(each.observed, each.first) for each in requests] == [(0, 50), (100, 150), (200, 250)]


def test_sync_can_leave_out_what_is_past() -> None:
    acted, _ = play(Schedule(PERIOD, mode=Mode.SYNC, horizon=2, drops_stale=True), 8, 30)
    assert indices(acted) == [None, None, 2, 3, None, None, 2, 3]


def test_async_can_play_each_answer_from_its_first_action() -> None:
    acted, _ = play(Schedule(PERIOD, mode=Mode.ASYNC, horizon=4, drops_stale=False), 8, 30)
    assert indices(acted) == [None, None, 0, 1, 2, 3, 0, 1]


def test_the_world_may_stand_for_the_first_request_alone() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.SYNC, horizon=2, thinks_first=True), 6, 30)
    assert indices(acted) == [0, 1, None, None, 0, 1]
    assert [each.latency for each in requests] == [0, 30]


def test_an_answer_shorter_than_the_horizon_is_played_whole() -> None:
    acted, _ = play(Schedule(PERIOD, mode=Mode.FROZEN, horizon=8), 6, 60, length=3)
    assert indices(acted) == [0, 1, 2, 0, 1, 2]


def test_an_answer_of_one_action_acts_for_one_period() -> None:
    acted, requests = play(Schedule(PERIOD, mode=Mode.ASYNC), 4, 0, length=1)
    assert indices(acted) == [0, 0, 0, 0]
    assert len(requests) == 4


def test_without_a_horizon_async_asks_after_half_of_an_answer() -> None:
    _, requests = play(Schedule(PERIOD, mode=Mode.ASYNC), 9, 10, length=8)
    assert [each.observed for each in requests] == [0, 100, 200]


@pytest.mark.parametrize(("period", "horizon"), [(0, 1), (25, 0)])
def test_no_period_and_no_horizon_are_refused(period: int, horizon: int) -> None:
    with pytest.raises(UsageError, match="at least 1"):
        Schedule(period, mode=Mode.ASYNC, horizon=horizon)


def test_a_second_request_under_way_is_refused() -> None:
    schedule = Schedule(PERIOD, mode=Mode.ASYNC)
    schedule.ask(0, latency=30, length=4)
    with pytest.raises(UsageError, match="must be due"):
        schedule.ask(25, latency=30, length=4)


@given(
    mode=st.sampled_from(Mode),
    horizon=st.none() | st.integers(1, 12),
    length=st.integers(1, 12),
    drops=st.none() | st.booleans(),
    latencies=st.lists(st.integers(0, 400), min_size=80, max_size=80),
)
def test_no_answer_acts_early_and_every_instant_is_accounted_for(
    mode: Mode, horizon: int | None, length: int, drops: bool | None, latencies: list[int]
) -> None:
    schedule = Schedule(PERIOD, mode=mode, horizon=horizon, drops_stale=drops)
    acted, requests = play(schedule, 80, lambda number: latencies[number], length)
    for instant, chosen in enumerate(acted):
        if chosen is not None:
            request = requests[chosen[0]]
            assert instant * PERIOD >= request.observed + request.latency
            assert 0 <= chosen[1] < length
    for before, after in pairwise(requests):
        assert after.observed >= before.first  # one request at a time
    held = sum(each.held for each in requests) + schedule.waited
    assert held + PERIOD * sum(each.used for each in requests) == 80 * PERIOD
