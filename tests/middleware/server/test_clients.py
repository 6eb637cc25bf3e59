"""Heartbeat of a client: times at which simulation time stands for it, and the longest hold."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.middleware.server import clients
from cellwright.middleware.server.clients import (
    LATE,
    MAX_HELD,
    PING_PERIOD,
    REGAIN_RATE,
    ClientRegistry,
    Heartbeat,
    HoldBudget,
)
from cellwright.middleware.wire.frames import Frame, FrameKind
from tests.middleware.server.talk import Hall, Talker, served
from tests.robot.talk import Talk
from tests.support.waiting import wait_until

LOOK = 0.01
"""Time between two checks [s]."""

Answers = list[float]
"""Delays [s] of a client's answers to its PINGs; afterwards it answers no more."""


def held(visits: list[Answers], until: float) -> list[bool]:
    """Return whether time stood at each check.

    A client comes, gives its answers, stays for `MAX_HELD` without another and goes; then the next one comes.
    """
    standing, found, due = HoldBudget(0.0), [], list(visits)
    beat, answers, leaves, number, answer_at = Heartbeat(0.0), due.pop(0), float("inf"), 0, float("inf")
    for look in range(round(until / LOOK)):
        now = look * LOOK
        if now >= leaves and due:
            beat, answers, leaves, number = Heartbeat(now), due.pop(0), float("inf"), 0
        if number and now >= answer_at:
            beat.pong(number, now)
            number, answer_at = 0, float("inf")
        if sent := beat.ping(now):
            number, answer_at = sent, now + answers.pop(0) if answers else float("inf")
            leaves = now + MAX_HELD if answer_at == float("inf") else leaves
        found.append(standing.hold(now, is_wanted=beat.is_late(now)))
    return found


@given(st.lists(st.floats(0.0, LATE - 2 * LOOK), min_size=1, max_size=30))
def test_hold_budget_with_client_that_keeps_up_never_holds(answers: Answers) -> None:
    assert not any(held([answers], len(answers) * PING_PERIOD))


def test_hold_budget_with_late_answer_holds_until_it_comes() -> None:
    found = held([[0.5, *[0.0] * 100]], 1.0)
    assert found.index(True) * LOOK == pytest.approx(LATE, abs=2 * LOOK)
    assert sum(found) * LOOK == pytest.approx(0.5 - LATE, abs=3 * LOOK)


def test_hold_budget_with_silent_client_holds_once() -> None:
    found = held([[]], 3 * MAX_HELD)
    assert sum(found) * LOOK == pytest.approx(MAX_HELD, abs=3 * LOOK)
    assert found[len(found) // 2 :] == [False] * (len(found) // 2)


@given(st.lists(st.lists(st.floats(0.0, 30.0), max_size=20), min_size=1, max_size=8))
def test_hold_budget_with_random_answers_is_bounded(visits: list[Answers]) -> None:
    seconds = 60.0
    stood = sum(held(visits, seconds)) * LOOK
    assert stood <= MAX_HELD + REGAIN_RATE * (seconds - stood) + 3 * LOOK


def test_hold_budget_is_shared_by_reconnecting_clients() -> None:
    seconds = 120.0
    stood = sum(held([[]] * 12, seconds)) * LOOK
    assert stood == pytest.approx((MAX_HELD + REGAIN_RATE * seconds) / (1.0 + REGAIN_RATE), rel=0.05)


def test_heartbeat_ignores_pong_of_other_ping() -> None:
    beat = Heartbeat(0.0)
    number = beat.ping(0.0)
    beat.pong(number + 1, 0.1)
    assert beat.is_late(0.2)
    beat.pong(number, 0.2)
    assert not beat.is_late(0.3)
    assert beat.ping(0.2 + PING_PERIOD / 2) == 0
    assert beat.ping(0.2 + PING_PERIOD) == number + 1


def test_hold_budget_is_not_charged_for_pause() -> None:
    standing = HoldBudget(0.0)
    assert standing.hold(3 * MAX_HELD, is_wanted=True)  # no check in between: time stood for another reason
    assert standing.hold(3 * MAX_HELD + LOOK, is_wanted=True)


def test_used_budget_is_regained_after_clients_with_pings_have_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(clients, "time", SimpleNamespace(monotonic=lambda: now[0]))
    registry = ClientRegistry(lambda _line: None, lambda _client: None)
    budget = registry._hold_budget
    assert budget.hold(0.5, is_wanted=True)
    assert not budget.is_full
    for now[0] in (1.0, 1.5, 2.0):
        assert not registry.hold_time()
    assert budget.is_full


def test_loop_holds_time_for_client_that_requested_pings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "MAX_HELD", 0.3)
    talk = Talk()
    with served(talk.node) as hall:
        connect_with_pings(hall, "/silent")
        connect_with_pings(hall, "/gone").connection.close()
        loop = SimulationLoop(talk.node.simulation, hall.server, stop=StopCondition(200_000_000))
        loop.run()
        assert loop.pacer.held > 0.2
        assert loop.pacer.factor < 0.9
        assert hall.lines == ["time stands while /silent is more than 0.1 s behind (reported once)"]


@pytest.mark.parametrize(("rate", "can_wait"), [(None, True), (1.0, False)])
def test_loop_without_rate_or_wait_does_not_hold_time(rate: float | None, *, can_wait: bool) -> None:
    talk = Talk()
    with served(talk.node) as hall:
        connect_with_pings(hall, "/silent")
        wait_until(hall.server.hold_time, "client that is behind")
        stop = StopCondition(50_000_000)
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=rate, stop=stop, can_wait=can_wait)
        loop.run()
        assert hall.server.hold_time()
        assert loop.pacer.held == 0.0


def connect_with_pings(hall: Hall, node: str) -> Talker:
    """Return a client that has requested PINGs and answers none."""
    client = hall.connect(node)
    client.say(Frame(FrameKind.PONG, 0))
    client.wait_for(FrameKind.PING, 1)
    return client
