from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.engine.clock import nanoseconds
from cellwright.engine.loop import StopCondition
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.util.errors import RunEndedError, UnknownNameError
from tests.cells import ARM_ONLY, BARE, INITIAL, KITTING, WHOLE, start, way


def never() -> bool:
    return False


def test_time_goes_on_in_whole_ticks_to_the_first_at_or_after() -> None:
    transport = InProcess(Cell(BARE))
    transport.advance(3_000_000, never)
    assert transport.now() == 4_000_000
    transport.advance(4_000_000, never)
    assert transport.now() == 4_000_000
    transport.advance(1, never)
    assert transport.now() == 4_000_000


def test_it_stops_as_soon_as_what_is_waited_for_is_there() -> None:
    cell = Cell(BARE)
    transport = InProcess(cell)
    transport.advance(None, lambda: cell.simulation.clock.tick == 7)
    assert transport.now() == 14_000_000


def test_nothing_is_delivered_but_while_time_passes() -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell)
    got: list[int] = []
    transport.subscribe("/clock", lambda message: got.append(message.clock.nanosec))
    cell.step()
    assert got == []
    transport.advance(6_000_000, never)
    assert got == [2_000_000, 4_000_000, 6_000_000]


def test_what_is_latched_is_delivered_with_the_next_tick() -> None:
    cell = Cell(KITTING)
    start(cell)
    cell.step()
    transport = InProcess(cell)
    got: list[str] = []
    transport.subscribe("/ariac/orders", lambda message: got.append(message.order_id))
    assert got == []
    transport.advance(transport.now() + 1, never)
    assert got == ["order_0"]


def test_messages_come_in_the_order_in_which_they_were_said() -> None:
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


def test_who_has_left_hears_nothing_more_not_even_what_was_on_its_way() -> None:
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


def test_who_keeps_a_client_past_the_end_gets_nothing_more_of_the_cell() -> None:
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
def test_a_callback_that_closes_the_client_ends_its_time(until: int | None) -> None:
    cell = Cell(KITTING)
    transport = InProcess(cell)
    heard: list[str] = []
    transport.subscribe("/clock", lambda _: transport.close())
    transport.subscribe("/ariac/gripper/state", lambda _: heard.append("gripper"))
    with pytest.raises(RunEndedError, match="the client is closed"):
        transport.advance(until)
    assert transport.now() == 2_000_000
    assert heard == []


def test_who_has_left_leaves_nothing_behind() -> None:
    transport = InProcess(Cell(BARE))
    kept: list[object] = []
    stay = transport.subscribe("/clock", kept.append)
    for _ in range(3):
        transport.subscribe("/clock", kept.append)()
    assert list(transport._leave) == [stay]
    transport.advance(2_000_000, never)
    assert len(kept) == 1


def test_a_conversation_cannot_stop_time() -> None:
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


def test_an_error_in_a_callback_comes_out_and_nothing_is_lost() -> None:
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


def test_commands_are_carried_out_where_time_stands() -> None:
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


def test_past_its_deadline_no_time_passes() -> None:
    transport = InProcess(Cell(BARE))
    transport.stop = StopCondition(10_000_000, "enough")
    transport.advance(10_000_000, never)
    for _ in range(2):
        with pytest.raises(RunEndedError, match="enough"):
            transport.advance(12_000_000, never)
    assert transport.now() == 10_000_000
    transport.advance(10_000_000, never)


def test_the_end_of_a_run_is_no_exception_that_programs_catch() -> None:
    assert not issubclass(RunEndedError, Exception)
