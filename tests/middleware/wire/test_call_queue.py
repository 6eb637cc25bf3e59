"""Queue of calls: each service has its share, and nothing is lost."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.wire.call_queue import CALL_WINDOW, MAX_WAITING_BYTES, MAX_WAITING_CALLS, CallQueue


class Cell:
    """Cell that gets calls, and answers them in the order of their arrival."""

    def __init__(self) -> None:
        self.queue = CallQueue()
        self.unanswered: list[tuple[str, int]] = []
        self.answered: list[tuple[str, int]] = []

    def call(self, name: str, number: int, size: int = 0) -> bool:
        """Call a service; return whether the call was taken."""
        return self.queue.add(name, size, self._sender(name, number))

    def answer(self) -> None:
        """Answer the call that came first."""
        name, number = self.unanswered.pop(0)
        self.answered.append((name, number))
        self.queue.note_answer(name)

    def _sender(self, name: str, number: int) -> Callable[[], None]:
        return lambda: self.unanswered.append((name, number))


def test_call_of_another_service_waits_for_a_window_of_thousands_only() -> None:
    cell = Cell()
    assert all(cell.call("/states", number) for number in range(3000))
    cell.call("/clock", 0)
    for _ in range(CALL_WINDOW + 1):
        cell.answer()
    assert cell.answered[-1] == ("/clock", 0)


def test_calls_beyond_the_bounds_are_refused() -> None:
    cell = Cell()
    assert all(cell.call("/many", number) for number in range(CALL_WINDOW + MAX_WAITING_CALLS))
    assert not cell.call("/many", -1)
    assert all(cell.call("/large", number, MAX_WAITING_BYTES // 2) for number in range(CALL_WINDOW + 2))
    assert not cell.call("/large", -1, 1)
    cell = Cell()
    assert all(cell.call("/large", number, MAX_WAITING_BYTES) for number in range(CALL_WINDOW + 1))
    cell.answer()  # the one that waited has left
    assert cell.call("/large", 9, MAX_WAITING_BYTES)


@given(st.lists(st.sampled_from(["/a", "/b", ""]), max_size=60))
def test_all_calls_are_sent_once_and_in_order_of_their_service(steps: list[str]) -> None:
    cell = Cell()
    calls: list[tuple[str, int]] = []
    for number, name in enumerate(steps):
        if name:
            assert cell.call(name, number)
            calls.append((name, number))
        elif cell.unanswered:
            cell.answer()
        for each in ("/a", "/b"):
            assert sum(sent == each for sent, _ in cell.unanswered) <= CALL_WINDOW
    while cell.unanswered:
        cell.answer()
    for each in ("/a", "/b"):
        assert [call for call in cell.answered if call[0] == each] == [call for call in calls if call[0] == each]
