from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.engine.clock import nanoseconds
from cellwright.engine.loop import StopCondition
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.util.errors import RunEndedError, UnknownNameError
from tests.support.cells import ARM_ONLY, BARE, INITIAL, KITTING, WHOLE, start, way


def never() -> bool:
    return False


def test_advance_stops_at_first_tick_at_or_after_target() -> None:
    transport = InProcess(Cell(BARE))
    transport.advance(3_000_000, never)
    assert transport.now() == 4_000_000
    transport.advance(4_000_000, never)
    assert transport.now() == 4_000_000
    transport.advance(1, never)
    assert transport.now() == 4_000_000


def test_advance_stops_when_condition_is_met() -> None:
    cell = Cell(BARE)
    transport = InProcess(cell)
    transport.advance(None, lambda: cell.simulation.clock.tick == 7)
    assert transport.now() == 14_000_000


def test_messages_are_delivered_only_during_advance() -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell)
    got: list[int] = []
    transport.subscribe("/clock", lambda message: got.append(message.clock.nanosec))
    cell.step()
    assert got == []
    transport.advance(6_000_000, never)
    assert got == [2_000_000, 4_000_000, 6_000_000]


def test_latched_message_is_delivered_with_next_tick() -> None:
    cell = Cell(KITTING)
    start(cell)
    cell.step()
    transport = InProcess(cell)
    got: list[str] = []
    transport.subscribe("/ariac/orders", lambda message: got.append(message.order_id))
    assert got == []
    transport.advance(transport.now() + 1, never)
    assert got == ["order_0"]


def test_messages_arrive_in_publishing_order() -> None:
    cell = Cell(WHOLE)
    transport = InProcess(cell)
    got: list[tuple[str, int]] = []
    for topic in ("/clock", "/ariac/joint_states", "/ariac/gripper/state"):
        transport.subscribe(topic, lambda _, topic=topic: got.append((topic, transport.now())))  # type: ignore[misc]
    transport.advance(nanoseconds(0.1), never)
    assert [time for _, time in got] == sorted(time for _, time in got)
    assert [topic for topic, time in got if time == 20_000_000] == [
        "/clock",
        "/ariac/joint_states",
        "/ariac/gripper/state",
    ]


def test_left_subscription_drops_queued_messages() -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell)
    got: list[str] = []
    leave = [transport.subscribe("/clock", lambda _, name=name: got.append(name)) for name in "ab"]  # type: ignore[misc]
    cell.step()
    leave[0]()
    leave[0]()
    transport.advance(4_000_000, never)
    assert got == ["b", "b"]
    transport.close()
    transport.close()
    cell.step()
    assert got == ["b", "b"]
    assert cell.bus.topic("/clock").subscribers == ()


def test_closed_client_refuses_every_action() -> None:
    cell = Cell(KITTING)
    client = Client(InProcess(cell))
    client.close()
    before = cell.state_hash()
    acts: list[Callable[[], object]] = [
        lambda: client.sleep(1.0),
        lambda: client.wait_until(lambda: False, 1.0),
        lambda: client.start_competition(),
        lambda: client.publish("/ariac/arm/command", None),
        lambda: client.latest("/clock"),
    ]
    for act in acts:
        with pytest.raises(RunEndedError, match="the client is closed"):
            act()
    assert cell.state_hash() == before


@pytest.mark.parametrize("until", [None, 10_000_000])
def test_callback_that_closes_client_ends_advance(until: int | None) -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell)
    received: list[str] = []
    transport.subscribe("/clock", lambda _: transport.close())
    transport.subscribe("/ariac/gripper/state", lambda _: received.append("gripper"))
    with pytest.raises(RunEndedError, match="the client is closed"):
        transport.advance(until)
    assert transport.now() == 2_000_000
    assert received == []


def test_left_subscription_is_not_kept() -> None:
    transport = InProcess(Cell(BARE))
    kept: list[object] = []
    stay = transport.subscribe("/clock", kept.append)
    for _ in range(3):
        transport.subscribe("/clock", kept.append)()
    assert list(transport._subscriptions) == [stay]
    transport.advance(2_000_000, never)
    assert len(kept) == 1


def test_reply_in_callback_is_delivered_with_next_tick() -> None:
    """Replies to a callback come with the next tick."""
    cell = Cell(ARM_ONLY)
    transport = InProcess(cell)
    got: list[int] = []

    def answer(_: object) -> None:
        got.append(transport.now())
        transport.publish("/ariac/arm/command", way(INITIAL))

    transport.subscribe("/ariac/arm/command", answer)
    transport.publish("/ariac/arm/command", way(INITIAL))
    transport.advance(10_000_000, never)
    assert got == [2_000_000, 4_000_000, 6_000_000, 8_000_000, 10_000_000]


def test_error_in_callback_is_raised_without_message_loss() -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell)
    got: list[int] = []

    def fail(_: object) -> None:
        raise ValueError("no")

    leave = transport.subscribe("/clock", fail)
    transport.subscribe("/clock", lambda message: got.append(message.clock.nanosec))
    with pytest.raises(ValueError, match="no"):
        transport.advance(10_000_000, never)
    assert transport.now() == 2_000_000
    leave()
    transport.advance(6_000_000, never)
    assert got == [2_000_000, 4_000_000, 6_000_000]


def test_service_call_takes_effect_without_advance() -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell, node="/mine")
    before: list[str] = []
    cell.simulation.inbox.put(lambda: before.append(cell.agvs[1].state))
    assert transport.call("/ariac/agv1", AGVControlRequest("")).success
    assert before == ["ready_to_deliver"]  # earlier requests of others came first
    assert cell.agvs[1].state == "preparing_to_deliver"
    assert transport.now() == 0
    with pytest.raises(UnknownNameError):
        transport.call("/ariac/agv7", AGVControlRequest(""))
    assert dict(cell.bus.refusals.counts) == {"/ariac/agv7 from /mine": 1}


def test_advance_past_deadline_ends_run() -> None:
    transport = InProcess(Cell(BARE))
    transport.stop = StopCondition(10_000_000, "enough")
    transport.advance(10_000_000, never)
    for _ in range(2):
        with pytest.raises(RunEndedError, match="enough"):
            transport.advance(12_000_000, never)
    assert transport.now() == 10_000_000
    transport.advance(10_000_000, never)


def test_run_ended_error_is_not_exception_subclass() -> None:
    assert not issubclass(RunEndedError, Exception)
