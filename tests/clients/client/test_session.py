import math
import threading
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.util.errors import UsageError
from tests.support.cells import ARM_ONLY, BARE, KITTING


def session_of(cell: Cell | None = None) -> NodeClient:
    return NodeClient(InProcess(cell or Cell(BARE)))


def test_sleep_advances_simulation_time() -> None:
    session = session_of()
    assert session.time == 0.0
    session.sleep(0.5)
    assert session.time == 0.5
    session.sleep(0.0)
    assert session.time == 0.5
    session.sleep(0.001)
    assert session.time == 0.502


@pytest.mark.parametrize("duration", [-0.001, math.nan, math.inf, -math.inf])
def test_negative_or_infinite_sleep_is_refused(duration: float) -> None:
    session = session_of()
    with pytest.raises(UsageError, match="cannot sleep for"):
        session.sleep(duration)
    assert session.time == 0.0


@pytest.mark.parametrize(
    "act",
    [
        lambda session: session.sleep(0.1),
        lambda session: session.sleep(0.0),
        lambda session: session.wait_until(lambda: False, 0.1),
        lambda session: session.wait_until(lambda: True),
        lambda session: session.rate(10.0).sleep(),
        lambda session: session.latest("/clock").wait(0.1),
    ],
    ids=["sleep", "no sleep at all", "wait_until", "wait_until at once", "rate", "latest"],
)
def test_advance_in_callback_is_refused(act: Callable[[NodeClient], Any]) -> None:
    session = session_of()
    caught: list[str] = []

    def callback(_: object) -> None:
        with pytest.raises(UsageError, match="cannot be called from a callback") as error:
            act(session)
        caught.append(str(error.value))

    leave = session.subscribe("/clock", callback)
    session.sleep(0.002)
    leave()
    assert len(caught) == 1
    session.sleep(0.1)  # and afterwards all is well
    assert session.time == 0.102


def test_sleep_works_after_error_in_callback() -> None:
    session = session_of()

    def fail(_: object) -> None:
        raise LookupError

    leave = session.subscribe("/clock", fail)
    with pytest.raises(LookupError):
        session.sleep(1.0)
    leave()
    session.sleep(1.0)
    assert session.time == 1.002


def test_wait_until_ends_in_tick_of_condition() -> None:
    session = session_of()
    assert session.wait_until(lambda: session.time >= 0.0101)
    assert session.time == 0.012
    assert session.wait_until(lambda: True)
    assert session.time == 0.012


def test_wait_until_times_out() -> None:
    session = session_of()
    assert not session.wait_until(lambda: False, 0.05)
    assert session.time == 0.05
    assert not session.wait_until(lambda: False, 0.0)
    assert not session.wait_until(lambda: False, -1.0)
    assert session.time == 0.05
    assert session.wait_until(lambda: session.time > 0.1, math.inf)
    with pytest.raises(UsageError, match="cannot wait for nan s"):
        session.wait_until(lambda: False, math.nan)


def test_wait_until_accepts_condition_met_in_last_tick() -> None:
    session = session_of()
    assert session.wait_until(lambda: session.time >= 0.1, 0.1)


def test_rate_keeps_its_period() -> None:
    session = session_of()
    rate = session.rate(10.0)
    beats = []
    for _ in range(5):
        session.sleep(0.03)
        rate.sleep()
        beats.append(session.time)
    assert beats == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5])


def test_rate_catches_up_after_missed_beat() -> None:
    session = session_of()
    rate = session.rate(10.0)
    session.sleep(0.15)
    rate.sleep()
    assert session.time == 0.15
    rate.sleep()
    assert session.time == 0.2


def test_rate_restarts_after_long_pause() -> None:
    session = session_of()
    rate = session.rate(10.0)
    session.sleep(0.55)
    rate.sleep()
    assert session.time == 0.55
    rate.sleep()
    assert session.time == pytest.approx(0.65, abs=0.0021)


@pytest.mark.parametrize("frequency", [0.0, -1.0, math.nan, math.inf])
def test_rate_with_invalid_frequency_is_refused(frequency: float) -> None:
    with pytest.raises(UsageError, match="a rate must be above 0 Hz"):
        session_of().rate(frequency)


@pytest.mark.slow
@given(st.floats(1.0, 400.0), st.lists(st.floats(0.0, 0.004), min_size=5, max_size=20))
def test_rate_keeps_period_for_any_work_between(frequency: float, spent: list[float]) -> None:
    session = session_of(SHARED)
    begin = session.time
    rate = session.rate(min(frequency, 100.0))
    for duration in spent:
        session.sleep(duration)
        rate.sleep()
    # no beat is lost and none is added; a tick of 2 ms is what can be missed
    assert session.time - begin == pytest.approx(len(spent) / min(frequency, 100.0), abs=0.0021)


SHARED = Cell(BARE)


def test_latest_holds_newest_message() -> None:
    session = session_of(Cell(KITTING))
    clock = session.latest("/clock")
    assert (clock.message, clock.count, clock.topic) == (None, 0, "/clock")
    assert clock.wait().clock.nanosec == 2_000_000
    assert clock.wait().clock.nanosec == 2_000_000
    assert session.time == 0.002
    assert clock.wait_for_next().clock.nanosec == 4_000_000
    session.sleep(0.1)
    assert (clock.count, clock.message.clock.nanosec) == (52, 104_000_000)
    clock.cancel()
    session.sleep(0.1)
    assert clock.count == 52


def test_latest_wait_times_out() -> None:
    session = session_of(Cell(KITTING))
    orders = session.latest("/ariac/orders")
    assert orders.wait(0.1) is None
    assert orders.wait_for_next(0.1) is None
    assert session.time == 0.2


def test_close_cancels_every_subscription() -> None:
    cell = Cell(KITTING)
    session = session_of(cell)
    session.latest("/clock")
    session.subscribe("/ariac/orders", print)
    session.close()
    assert not any(topic.subscribers for topic in cell.bus.topics() if topic.publishers)


def test_client_refuses_other_threads_until_adopted() -> None:
    session = session_of()
    times: list[object] = []

    def work() -> None:
        for act in (lambda: session.sleep(0.1), lambda: session.wait_until(lambda: True), lambda: session.time):
            with pytest.raises(UsageError, match="works in the thread that created it"):
                act()
        session.adopt()
        session.sleep(0.1)
        times.append(session.time)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert times == [0.1]
    with pytest.raises(UsageError, match="works in the thread that created it"):
        session.sleep(0.1)
    session.adopt()
    assert session.time == 0.1


def test_idle_refused_in_other_thread_leaves_subscriptions_on() -> None:
    client = Client(InProcess(Cell(ARM_ONLY)))

    def work() -> None:
        with pytest.raises(UsageError, match="works in the thread that created it"):
            client.idle(1.0)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    client.sleep(0.1)
    assert client.joint_states.count == 5


def test_latest_can_be_cancelled_and_resumed() -> None:
    session = NodeClient(InProcess(Cell(KITTING)))
    score = session.latest("/ariac/current_score")
    score.listen()  # it does
    session.sleep(0.2)
    assert score.count == 2
    score.cancel()
    score.cancel()
    session.sleep(0.2)
    assert score.count == 2
    assert score.message is not None
    score.listen()
    session.sleep(0.1)
    assert score.count == 3
