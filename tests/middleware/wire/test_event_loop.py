"""Event loop: timers in order, calls from other threads, sources that come and go, defects that end nothing."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.wire.event_loop import EventLoop
from tests.support.waiting import TIMEOUT, wait_until


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    here, there = socket.socketpair()
    here.setblocking(False)
    yield here, there
    here.close()
    there.close()


@given(st.lists(st.integers(0, 10), max_size=8))
def test_timers_are_called_in_order_of_due_time(delays: list[int]) -> None:
    loop = EventLoop()
    called: list[int] = []
    now = time.monotonic()  # noqa: TID251 - only the start of a clock that then stands still
    with pytest.MonkeyPatch.context() as patch:  # a pause between two of them would change their order
        patch.setattr("cellwright.middleware.wire.event_loop.time", SimpleNamespace(monotonic=lambda: now))
        for delay in delays:
            loop.later(delay / 1000, lambda delay=delay: called.append(delay))  # type: ignore[misc]
        loop.later(0.0111, lambda: loop.stop(3))
    assert loop.run() == 3
    assert called == sorted(delays)
    loop.close()


def test_calls_of_other_threads_keep_their_order() -> None:
    loop = EventLoop()
    called: list[tuple[int, int]] = []

    def ask(who: int) -> None:
        for number in range(2000):
            loop.call(lambda number=number: called.append((who, number)))

    threads = [threading.Thread(target=ask, args=(who,)) for who in range(3)]

    def finish() -> None:
        for thread in threads:
            thread.join()
        loop.call(loop.stop, 0)

    for thread in [*threads, threading.Thread(target=finish)]:
        thread.start()
    loop.later(TIMEOUT, lambda: loop.stop(1))
    assert loop.run() == 0
    for who in range(3):
        assert [number for caller, number in called if caller == who] == list(range(2000))
    loop.close()


def test_call_during_wake_up_does_not_lose_later_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = EventLoop()
    called: list[str] = []
    reader = loop._wake_reader

    class Reader:
        def recv(self, size: int) -> bytes:
            if called == []:
                loop.call(called.append, "as it listens")
            return reader.recv(size)

    with monkeypatch.context() as patch:
        patch.setattr(loop, "_wake_reader", Reader())
        loop.call(called.append, "before")

        def stop() -> None:
            wait_until(lambda: len(called) == 2, "second call")
            loop.call(loop.stop, 0)

        later = threading.Thread(target=stop)
        later.start()
        loop.later(TIMEOUT, lambda: loop.stop(1))
        assert loop.run() == 0
    assert called == ["before", "as it listens"]
    later.join()
    loop.close()


def test_stop_from_other_thread_ends_run_with_first_status() -> None:
    loop = EventLoop()

    def stop() -> None:
        loop.stop(4)
        loop.stop(5)

    timer = threading.Timer(0.05, stop)  # usually the loop waits by then
    timer.start()
    loop.later(TIMEOUT, lambda: loop.stop(1))
    assert loop.run() == 4
    timer.join()
    loop.close()


def test_watch_calls_on_read_and_on_write(pair: tuple[socket.socket, socket.socket]) -> None:
    here, there = pair
    loop = EventLoop()
    heard: list[bytes] = []

    def read() -> None:
        heard.append(here.recv(100))
        loop.watch(here, read, write)

    def write() -> None:
        here.send(b"answer")
        loop.watch(here, read)
        loop.call(loop.call, loop.call, loop.stop, 0)  # two rounds later: it would be written again in each

    loop.watch(here, read)
    there.send(b"question")
    loop.run()
    assert heard == [b"question"]
    assert there.recv(100) == b"answer"
    loop.close()


def test_forget_of_source_may_be_repeated(pair: tuple[socket.socket, socket.socket]) -> None:
    here, there = pair
    loop = EventLoop()
    loop.watch(here, lambda: loop.stop(1))
    loop.forget(here)
    loop.forget(here)
    there.send(b"unheard")
    loop.call(loop.call, loop.stop, 0)
    assert loop.run() == 0
    loop.close()


def test_exception_in_callback_is_reported_in_a_line_and_loop_goes_on(capsys: pytest.CaptureFixture[str]) -> None:
    loop = EventLoop()

    def fail() -> None:
        raise KeyError("x")

    loop.call(fail)
    loop.call(loop.stop, 0)
    assert loop.run() == 0
    assert capsys.readouterr().err == "internal error, please report it: KeyError: 'x'\n"
    loop.close()
