"""Streams: answers come unasked at their pace, to a client that reads, for as long as it asks for more."""

from __future__ import annotations

import math

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.server.streams import PERIOD
from cellwright.middleware.wire.frames import Frame, FrameKind, data_payload
from cellwright.util.errors import RejectedCommandError
from tests.middleware.server.talk import Hall, Talker, served
from tests.support.cells import KITTING


class Counting:
    """Stream of numbers, from 1 on.

    Args:
        ahead: number of answers until the client asks for more.
        fails_at: number at which it raises `error`.
        error: the error.
    """

    def __init__(self, ahead: int = 100, fails_at: int = 0, error: Exception | None = None) -> None:
        self.ahead = ahead
        self.count = 0
        self.times: list[float] = []
        self._fails_at, self._error = fails_at, error

    def next(self, at: float) -> bytes | None:
        self.count += 1
        self.times.append(at)
        if self.count == self._fails_at and self._error is not None:
            raise self._error
        return data_payload(f'{{"number": {self.count}}}', b"")


def call(client: Talker, number: int = 7) -> None:
    client.say(Frame(FrameKind.CALL, number, "count", payload=b"{}"))


def numbers(client: Talker, number: int = 7) -> list[int]:
    """Return the answers so far."""
    client.listen()
    return [each.data()[0]["number"] for each in client.heard if (each.kind, each.number) == (FrameKind.DATA, number)]


def serve(hall: Hall, times: int = 12) -> None:
    """Serve for longer than some answers need."""
    for _ in range(times):
        hall.server.wait(PERIOD / 4)


def test_stream_answers_one_call_again_and_again_in_order() -> None:
    stream = Counting()
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: stream)
        client = hall.connect()
        call(client)
        client.wait_until(lambda: len(numbers(client)) >= 4)
        assert numbers(client)[:4] == [1, 2, 3, 4]
        gaps = [after - before for before, after in zip(stream.times, stream.times[1:], strict=False)]
        assert min(gaps) > PERIOD / 2


def test_two_streams_get_their_answers_at_the_same_times() -> None:
    streams = [Counting(), Counting()]
    left = iter(streams)
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: next(left))
        for client in (hall.connect("/a"), hall.connect("/b")):
            call(client)
            client.wait_until(lambda client=client: len(numbers(client)) >= 1)  # type: ignore[misc]
        serve(hall)
    assert streams[0].times[-2:] == streams[1].times[-2:]


def test_stream_stops_after_answers_asked_for_and_goes_on_when_asked_for_more() -> None:
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: Counting(ahead=3))
        client = hall.connect()
        call(client)
        client.wait_until(lambda: len(numbers(client)) == 3)
        serve(hall)
        assert numbers(client) == [1, 2, 3]
        call(client)
        client.wait_until(lambda: len(numbers(client)) == 6)
        serve(hall)
        assert numbers(client) == [1, 2, 3, 4, 5, 6], "the same stream goes on"


def test_client_that_does_not_read_gets_few_answers_and_then_the_newest() -> None:
    big = bytes(1 << 20)

    class Large(Counting):
        def next(self, at: float) -> bytes | None:
            super().next(at)
            return data_payload(f'{{"number": {self.count}}}', big)

    stream = Large(ahead=30)
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: stream)
        client = hall.connect()
        call(client)
        client.wait_until(lambda: stream.count >= 1)
        waiting = hall.server._clients
        serve(hall, 160)
        assert stream.count < 30, "no answer is made for a client that has not taken the one before"
        assert all(len(each._out) < 2 * len(big) for each in waiting)


def test_unsubscribed_client_and_client_that_leaves_get_nothing_more() -> None:
    streams: list[Counting] = []

    def begin(_request: object) -> Counting:
        streams.append(Counting())
        return streams[-1]

    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", begin)
        one, other = hall.connect("/one"), hall.connect("/other")
        for client in (one, other):
            call(client)
            client.wait_until(lambda client=client: bool(numbers(client)))  # type: ignore[misc]
        one.say(Frame(FrameKind.UNSUBSCRIBE, 8))  # of nothing
        one.say(Frame(FrameKind.UNSUBSCRIBE, 7))
        other.connection.close()
        serve(hall, 4)
        before = [each.count for each in streams]
        serve(hall)
        assert [each.count for each in streams] == before
        assert hall.server._streams.due == math.inf


def test_next_stream_of_client_replaces_the_one_before() -> None:
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: Counting())
        client = hall.connect()
        call(client, 7)
        client.wait_until(lambda: bool(numbers(client, 7)))
        call(client, 8)
        client.wait_until(lambda: bool(numbers(client, 8)))
        before = numbers(client, 7)
        serve(hall)
        assert numbers(client, 7) == before


@pytest.mark.parametrize(
    ("error", "name", "text"),
    [
        (RejectedCommandError("not any more"), "RejectedCommandError", "not any more"),
        (ZeroDivisionError("oh"), "ServiceFailedError", "the cell failed: ZeroDivisionError: oh"),
    ],
)
def test_failing_stream_is_refused_and_ends_alone(error: Exception, name: str, text: str) -> None:
    left = iter([Counting(fails_at=2, error=error), Counting()])
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: next(left))
        one, other = hall.connect("/one"), hall.connect("/other")
        call(one)
        one.wait_until(lambda: bool(numbers(one)))
        call(other)
        refused = one.wait_for(FrameKind.REFUSED, 7)
        assert (refused.name, refused.text()) == (name, text)
        other.wait_until(lambda: len(numbers(other)) >= 3)
        assert numbers(one) == [1]


def test_long_wait_serves_streams_meanwhile() -> None:
    stream = Counting()
    with served(Cell(KITTING)) as hall:
        hall.server.offer("count", lambda _request: stream)
        client = hall.connect()
        call(client)
        client.wait_until(lambda: stream.count >= 1)
        before = stream.count
        hall.server.wait(6 * PERIOD, until_request=False)
        assert stream.count >= before + 3
