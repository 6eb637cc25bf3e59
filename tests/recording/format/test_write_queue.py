"""Write queue: one thread takes what another adds, complete and in order."""

from __future__ import annotations

from threading import Thread

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.recording.format.chunks import MESSAGE_OVERHEAD, Messages, WriteQueue
from cellwright.recording.format.format import Entry


def hand_in(waiting: WriteQueue[str], entry: Entry) -> None:
    waiting.entries += entry
    waiting.added += MESSAGE_OVERHEAD + len(entry[2])


def handed_in(entries: list[Entry]) -> Messages:
    """Return at least one message, as it is taken."""
    waiting: WriteQueue[str] = WriteQueue()
    for entry in entries:
        hand_in(waiting, entry)
    (messages,) = waiting.take()
    assert isinstance(messages, Messages)
    return messages


def entries(messages: Messages) -> list[Entry]:
    return list(zip(messages.channels, messages.times, messages.contents, strict=True))


def take(waiting: WriteQueue[str]) -> list[Entry | str]:
    found: list[Entry | str] = []
    for what in waiting.take():
        if isinstance(what, Messages):
            found += entries(what)
            waiting.written = int(what.ends[-1])
        else:
            found.append(what)
    return found


an_entry = st.tuples(st.integers(1, 9), st.integers(0, 99), st.binary(max_size=9))


@pytest.mark.slow
@given(st.lists(st.lists(an_entry | st.sampled_from(["schema", "channel"]), max_size=20), max_size=5))
def test_queue_yields_entries_in_order(given: list[list[Entry | str]]) -> None:
    waiting: WriteQueue[str] = WriteQueue()
    for items in given:
        for item in items:
            if isinstance(item, str):
                waiting.add_record(item)
            else:
                hand_in(waiting, item)
        assert take(waiting) == items
        assert waiting.written == waiting.added
    assert take(waiting) == []


@given(st.lists(an_entry, min_size=1, max_size=30), st.integers(1, 400))
def test_part_ends_as_soon_as_it_reaches_size(given: list[Entry], size: int) -> None:
    parts = list(handed_in(given).parts(size))
    assert [entry for part in parts for entry in entries(part)] == given
    sizes = [[MESSAGE_OVERHEAD + len(data) for data in part.contents] for part in parts]
    assert all(sum(each) >= size for each in sizes[:-1])
    assert all(sum(each[:-1]) < size for each in sizes)
    assert [int(part.ends[-1]) - part.begin for part in parts] == [sum(each) for each in sizes]


def test_entry_added_during_take_stays_for_next_take() -> None:
    waiting: WriteQueue[str] = WriteQueue()
    hand_in(waiting, (1, 0, b"early"))
    taking = waiting.take()
    first = next(taking)
    assert isinstance(first, Messages)
    hand_in(waiting, (1, 1, b"late"))
    waiting.add_record("later")
    assert list(taking) == []
    waiting.written = int(first.ends[-1])
    assert take(waiting) == [(1, 1, b"late"), "later"]


@pytest.mark.slow
def test_two_threads_lose_no_entry() -> None:
    waiting: WriteQueue[str] = WriteQueue()
    count = 30_000

    def work() -> None:
        for number in range(count):
            hand_in(waiting, (number % 7 + 1, number, b"%d" % number))
            if number % 100 == 0:
                waiting.add_record(f"after {number}")

    thread = Thread(target=work)
    thread.start()
    found: list[Entry | str] = []
    while thread.is_alive():
        found += take(waiting)
    thread.join()
    found += take(waiting)
    expected: list[Entry | str] = []
    for number in range(count):
        expected.append((number % 7 + 1, number, b"%d" % number))
        if number % 100 == 0:
            expected.append(f"after {number}")
    assert found == expected


def test_cleared_queue_yields_no_entry() -> None:
    waiting: WriteQueue[str] = WriteQueue()
    hand_in(waiting, (1, 0, b"x"))
    waiting.add_record("y")
    waiting.clear()
    assert take(waiting) == []
    with pytest.raises(StopIteration):
        next(waiting.take())
